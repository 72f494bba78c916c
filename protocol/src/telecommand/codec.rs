//! Requests to bytes and back, and their fields by name.

use heapless::Vec;

use crate::{
    Field, FieldValue, Guidance, PayloadError, Resolution, ScheduleUpload, ScriptUpload, Telecommand,
    TorqueProfile, UP_PAYLOAD_MAX,
    telecommand::{ChunkRanges, DownlinkSchedule, up_type},
    wire::{Reader, Walk, Wire, Writer},
};

/// Flags of CaptureImage.
const GREY: u8 = 1;
const STRONG_COMPRESSION: u8 = 2;

impl Telecommand {
    /// Writes the payload to the beginning of `out` and returns its length; bytes after it are not touched.
    pub fn encode_payload(&self, out: &mut [u8; UP_PAYLOAD_MAX]) -> usize {
        let mut w = Writer::new(out);
        match self {
            Self::Ping
            | Self::GetImageInfo
            | Self::Reset
            | Self::GetAdcsInfo
            | Self::SetAdcsOmegaKill
            | Self::SetAdcsAuto
            | Self::GetModeReport => {}
            Self::GetImageChunk { first, count } => {
                w.write(first);
                w.write(count);
            }
            Self::ExecuteTorqueProfile(profile) => write_list(&mut w, &profile.steps),
            Self::CaptureImage { resolution, grey, strong_compression } => {
                w.write(&resolution.code());
                w.write(&capture_flags(*grey, *strong_compression));
            }
            Self::SetDownlinkSchedule(schedule) => write_list(&mut w, &schedule.slots),
            Self::SetAdcsAttitude { attitude_mrp } => w.write(attitude_mrp),
            Self::SetAdcsTarget { latitude_deg, longitude_deg } => {
                w.write(latitude_deg);
                w.write(longitude_deg);
            }
            Self::SetTimestamp { utc_ms } => w.write(utc_ms),
            Self::SetTle(lines) => w.write(lines),
            Self::GetImageRanges(ranges) => write_list(&mut w, &ranges.ranges),
            Self::SetTransmitter { on } => w.write(on),
            Self::SetMode { mode, substate } => w.put(&[*mode, *substate]),
            Self::UploadSchedule(upload) => {
                w.put(&[upload.schedule, upload.part, upload.parts, upload.entries.len() as u8]);
                w.write(&upload.entries_crc32);
                upload.entries.iter().for_each(|entry| w.write(entry));
            }
            Self::SetParameter { parameter, value } => {
                w.write(parameter);
                w.write(value);
            }
            Self::UploadScript(upload) => {
                w.put(&[upload.script, upload.part, upload.parts]);
                write_list(&mut w, &upload.steps);
            }
            Self::GetEvents { first } => w.write(first),
            Self::UploadGuidance(guidance) => {
                w.put(&[guidance.id, guidance.actuator, guidance.degree()]);
                w.write(&guidance.start_ms);
                guidance.coefficients.iter().for_each(|coefficient| w.write(coefficient));
            }
        }
        w.offset()
    }

    /// The request of this type in exactly these bytes; what it accepts also passes [`Telecommand::validate`].
    ///
    /// # Errors
    /// When the type is unknown, the length does not match the type exactly, or a rule of the ICD is broken: NaN or
    /// infinity, a code or flag without meaning, a list too long, times not ascending.
    pub fn decode(packet_type: u8, payload: &[u8]) -> Result<Self, PayloadError> {
        let door = Door { packet_type, payload };
        let command = match packet_type {
            up_type::PING => door.empty(Self::Ping)?,
            up_type::GET_IMAGE_INFO => door.empty(Self::GetImageInfo)?,
            up_type::GET_IMAGE_CHUNK => {
                let mut r = door.exactly(4)?;
                Self::GetImageChunk { first: r.read()?, count: r.read()? }
            }
            up_type::RESET => door.empty(Self::Reset)?,
            up_type::EXECUTE_TORQUE_PROFILE => {
                Self::ExecuteTorqueProfile(TorqueProfile { steps: door.list(0, 1)? })
            }
            up_type::GET_ADCS_INFO => door.empty(Self::GetAdcsInfo)?,
            up_type::CAPTURE_IMAGE => {
                let [resolution, flags] = door.exactly(2)?.take();
                let resolution =
                    Resolution::from_code(resolution).ok_or(PayloadError::Range { field: "resolution" })?;
                if flags & !(GREY | STRONG_COMPRESSION) != 0 {
                    return Err(PayloadError::Range { field: "flags" });
                }
                let (grey, strong_compression) = (flags & GREY != 0, flags & STRONG_COMPRESSION != 0);
                Self::CaptureImage { resolution, grey, strong_compression }
            }
            up_type::SET_DOWNLINK_SCHEDULE => {
                Self::SetDownlinkSchedule(DownlinkSchedule { slots: door.list(0, 1)? })
            }
            up_type::SET_ADCS_OMEGA_KILL => door.empty(Self::SetAdcsOmegaKill)?,
            up_type::SET_ADCS_ATTITUDE => Self::SetAdcsAttitude { attitude_mrp: door.exactly(12)?.read()? },
            up_type::SET_ADCS_TARGET => {
                let mut r = door.exactly(8)?;
                Self::SetAdcsTarget { latitude_deg: r.read()?, longitude_deg: r.read()? }
            }
            up_type::SET_ADCS_AUTO => door.empty(Self::SetAdcsAuto)?,
            up_type::SET_TIMESTAMP => Self::SetTimestamp { utc_ms: door.exactly(8)?.read()? },
            up_type::SET_TLE => Self::SetTle(door.exactly(138)?.read()?),
            up_type::GET_IMAGE_RANGES => Self::GetImageRanges(ChunkRanges { ranges: door.list(0, 1)? }),
            up_type::SET_TRANSMITTER => Self::SetTransmitter { on: door.exactly(1)?.read()? },
            up_type::SET_MODE => {
                let [mode, substate] = door.exactly(2)?.take();
                Self::SetMode { mode, substate }
            }
            up_type::UPLOAD_SCHEDULE => {
                let entries = door.list(3, 8)?;
                let mut r = Reader::new(payload);
                let [schedule, part, parts, _n] = r.take();
                let entries_crc32 = r.read()?;
                Self::UploadSchedule(ScheduleUpload { schedule, part, parts, entries_crc32, entries })
            }
            up_type::GET_MODE_REPORT => door.empty(Self::GetModeReport)?,
            up_type::SET_PARAMETER => {
                let mut r = door.exactly(5)?;
                Self::SetParameter { parameter: r.read()?, value: r.read()? }
            }
            up_type::UPLOAD_SCRIPT => {
                let steps = door.list(3, 4)?;
                let [script, part, parts] = Reader::new(payload).take();
                Self::UploadScript(ScriptUpload { script, part, parts, steps })
            }
            up_type::GET_EVENTS => Self::GetEvents { first: door.exactly(4)?.read()? },
            up_type::UPLOAD_GUIDANCE => Self::UploadGuidance(door.guidance()?),
            _ => return Err(PayloadError::UnknownTelecommand { packet_type }),
        };
        command.validate()?;
        Ok(command)
    }

    /// Calls `visit` for every field, in wire order.
    pub fn visit_fields(&self, visit: &mut dyn FnMut(Field<'_>)) {
        let mut w = Walk::new(visit);
        match self {
            Self::Ping
            | Self::GetImageInfo
            | Self::Reset
            | Self::GetAdcsInfo
            | Self::SetAdcsOmegaKill
            | Self::SetAdcsAuto
            | Self::GetModeReport => {}
            Self::GetImageChunk { first, count } => {
                w.value(first, &["first"], "");
                w.value(count, &["count"], "");
            }
            Self::ExecuteTorqueProfile(profile) => walk_list(&mut w, &profile.steps),
            Self::CaptureImage { resolution, grey, strong_compression } => {
                w.value(&resolution.code(), &["resolution"], "");
                w.value(&capture_flags(*grey, *strong_compression), &["flags"], "");
            }
            Self::SetDownlinkSchedule(schedule) => walk_list(&mut w, &schedule.slots),
            Self::SetAdcsAttitude { attitude_mrp } => {
                w.value(attitude_mrp, &["attitude.x", "attitude.y", "attitude.z"], "MRP");
            }
            Self::SetAdcsTarget { latitude_deg, longitude_deg } => {
                w.value(latitude_deg, &["latitude"], "deg");
                w.value(longitude_deg, &["longitude"], "deg");
            }
            Self::SetTimestamp { utc_ms } => w.value(utc_ms, &["utc"], "ms"),
            Self::SetTle(lines) => w.value(lines, &[], ""),
            Self::GetImageRanges(ranges) => walk_list(&mut w, &ranges.ranges),
            Self::SetTransmitter { on } => w.value(on, &["on"], ""),
            Self::SetMode { mode, substate } => {
                w.value(mode, &["mode"], "");
                w.value(substate, &["substate"], "");
            }
            Self::UploadSchedule(upload) => {
                w.value(&upload.schedule, &["schedule"], "");
                w.value(&upload.part, &["part"], "");
                w.value(&upload.parts, &["parts"], "");
                w.field("n", "", FieldValue::U(upload.entries.len() as u64), 1);
                w.value(&upload.entries_crc32, &["entries_crc32"], "");
                walk_entries(&mut w, &upload.entries);
            }
            Self::SetParameter { parameter, value } => {
                w.value(parameter, &["parameter"], "");
                w.value(value, &["value"], "");
            }
            Self::UploadScript(upload) => {
                w.value(&upload.script, &["script"], "");
                w.value(&upload.part, &["part"], "");
                w.value(&upload.parts, &["parts"], "");
                walk_list(&mut w, &upload.steps);
            }
            Self::GetEvents { first } => w.value(first, &["first"], ""),
            Self::UploadGuidance(guidance) => guidance.walk(&mut w),
        }
    }
}

fn capture_flags(grey: bool, strong_compression: bool) -> u8 {
    (u8::from(grey) * GREY) | (u8::from(strong_compression) * STRONG_COMPRESSION)
}

fn write_list<T: Wire>(writer: &mut Writer<'_>, entries: &[T]) {
    writer.write(&(entries.len() as u8));
    entries.iter().for_each(|entry| writer.write(entry));
}

fn walk_list<T: Wire>(walk: &mut Walk<'_>, entries: &[T]) {
    walk.field("n", "", FieldValue::U(entries.len() as u64), 1);
    walk_entries(walk, entries);
}

fn walk_entries<T: Wire>(walk: &mut Walk<'_>, entries: &[T]) {
    for (index, entry) in (0..).zip(entries) {
        walk.index = Some(index);
        walk.value(entry, &[], "");
    }
    walk.index = None;
}

/// Where the length of a payload is checked, once.
struct Door<'a> {
    packet_type: u8,
    payload: &'a [u8],
}

impl<'a> Door<'a> {
    fn exactly(&self, expected: usize) -> Result<Reader<'a>, PayloadError> {
        let (packet_type, found) = (self.packet_type, self.payload.len());
        if found != expected {
            return Err(PayloadError::Length { packet_type, found, expected });
        }
        Ok(Reader::new(self.payload))
    }

    fn empty(&self, command: Telecommand) -> Result<Telecommand, PayloadError> {
        self.exactly(0).map(|_| command)
    }

    /// A list whose number of entries stands at `count_at` and which begins at `entries_at`.
    fn list<T: Wire, const N: usize>(
        &self,
        count_at: usize,
        entries_at: usize,
    ) -> Result<Vec<T, N>, PayloadError> {
        let (packet_type, found) = (self.packet_type, self.payload.len());
        let Some(&count) = self.payload.get(count_at) else {
            return Err(PayloadError::Length { packet_type, found, expected: entries_at });
        };
        if usize::from(count) > N {
            return Err(PayloadError::Count { found: count, max: N as u8 });
        }
        self.exactly(entries_at + usize::from(count) * T::LEN)?;
        let mut reader = Reader::at(self.payload, entries_at);
        (0..count).map(|_| reader.read()).collect()
    }

    fn guidance(&self) -> Result<Guidance, PayloadError> {
        const COEFFICIENTS_AT: usize = 11;
        let (packet_type, found) = (self.packet_type, self.payload.len());
        let Some(&degree) = self.payload.get(2) else {
            return Err(PayloadError::Length { packet_type, found, expected: COEFFICIENTS_AT });
        };
        if degree > 5 {
            return Err(PayloadError::Range { field: "degree" });
        }
        let mut r = self.exactly(COEFFICIENTS_AT + (usize::from(degree) + 1) * <[f32; 3]>::LEN)?;
        let [id, actuator, _degree] = r.take();
        let start_ms = r.read()?;
        let coefficients = (0..=degree).map(|_| r.read()).collect::<Result<_, _>>()?;
        Ok(Guidance { id, actuator, start_ms, coefficients })
    }
}
