//! The structures inside requests: their lists are bounded by what the ICD allows, so that encoding is total.

use core::fmt;

use heapless::Vec;

use crate::{
    FieldValue, PayloadError,
    wire::{Reader, Walk, Wire, Writer, packet},
};

/// Size of a picture.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Resolution {
    /// 408 × 304 pixels (0).
    Cif,
    /// 818 × 610 pixels (1).
    Svga,
}

impl Resolution {
    /// Code on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Cif => 0,
            Self::Svga => 1,
        }
    }

    /// The resolution of a code, `None` if the ICD has no such code.
    #[must_use]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Cif),
            1 => Some(Self::Svga),
            _ => None,
        }
    }

    /// Width and height, pixels.
    #[must_use]
    pub const fn size_px(self) -> (u16, u16) {
        match self {
            Self::Cif => (408, 304),
            Self::Svga => (818, 610),
        }
    }
}

impl fmt::Display for Resolution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cif => "CIF",
            Self::Svga => "SVGA",
        })
    }
}

packet! {
    /// One step of a torque profile.
    pub struct TorqueStep (16 bytes) {
        /// Torque, body axes, N·m.
        torque_n_m: [f32; 3] = ["step.torque.x", "step.torque.y", "step.torque.z"], "N·m";
        /// How long, ms.
        duration_ms: u32 = ["step.duration"], "ms";
    }
}

/// At most 12 steps, at most 600 s in total.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct TorqueProfile {
    /// Steps in the order they run.
    pub steps: Vec<TorqueStep, 12>,
}

impl TorqueProfile {
    /// Longest profile the ICD allows, ms.
    pub const DURATION_MAX_MS: u64 = 600_000;

    /// Sum of all steps, ms: what the time-out of the answer is longer by.
    #[must_use]
    pub fn duration_ms(&self) -> u64 {
        self.steps.iter().map(|step| u64::from(step.duration_ms)).sum()
    }
}

/// One scheduled transmission of image chunks.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DownlinkSlot {
    /// When it begins, ms since 1970 UTC.
    pub time_ms: u64,
    /// First chunk.
    pub first: u16,
    /// Number of chunks.
    pub count: u16,
    /// Attitude to take, modified Rodrigues parameters; `None` (three NaN on the wire) to leave it.
    pub attitude_mrp: Option<[f32; 3]>,
}

impl Wire for DownlinkSlot {
    const LEN: usize = 24;

    fn read(reader: &mut Reader<'_>) -> Result<Self, PayloadError> {
        let (time_ms, first, count) = (reader.read()?, reader.read()?, reader.read()?);
        let attitude: [f32; 3] = reader.read()?;
        let attitude_mrp = if attitude.iter().all(|x| x.is_nan()) { None } else { Some(attitude) };
        Ok(Self { time_ms, first, count, attitude_mrp })
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.write(&self.time_ms);
        writer.write(&self.first);
        writer.write(&self.count);
        writer.write(&self.attitude_mrp.unwrap_or([NO_ATTITUDE; 3]));
    }

    fn walk(&self, walk: &mut Walk<'_>, _: &[&'static str], _: &'static str) {
        walk.value(&self.time_ms, &["slot.time"], "ms");
        walk.value(&self.first, &["slot.first"], "");
        walk.value(&self.count, &["slot.count"], "");
        let attitude = self.attitude_mrp.unwrap_or([NO_ATTITUDE; 3]);
        walk.value(&attitude, &["slot.attitude.x", "slot.attitude.y", "slot.attitude.z"], "MRP");
    }
}

/// The quiet NaN we write for *no attitude* (0x7FC00000); any NaN is read as such.
const NO_ATTITUDE: f32 = f32::from_bits(0x7FC0_0000);

/// At most 8 scheduled transmissions, times ascending; it replaces the satellite's list, an empty one clears it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct DownlinkSchedule {
    /// The transmissions.
    pub slots: Vec<DownlinkSlot, 8>,
}

packet! {
    /// A range of chunks.
    pub struct ChunkRange (4 bytes) {
        /// First chunk.
        first: u16 = ["range.first"], "";
        /// Number of chunks.
        count: u16 = ["range.count"], "";
    }
}

/// At most 48 ranges, sent in this order, duplicates resent.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ChunkRanges {
    /// The ranges.
    pub ranges: Vec<ChunkRange, 48>,
}

packet! {
    /// When to run which script.
    pub struct ScheduleEntry (21 bytes) {
        /// When, ms since 1970 UTC.
        time_ms: u64 = ["entry.time"], "ms";
        /// Script to run.
        script: u8 = ["entry.script"], "";
        /// Its argument.
        argument: [f32; 3] = ["entry.argument.0", "entry.argument.1", "entry.argument.2"], "";
    }
}

impl ScheduleEntry {
    /// The entry as it goes on the wire; the schedule's CRC runs over all entries of all parts.
    #[must_use]
    pub fn to_wire_bytes(&self) -> [u8; Self::LEN] {
        let mut out = [0; Self::LEN];
        self.write(&mut Writer::new(&mut out));
        out
    }
}

/// One part of a schedule, at most 8 entries.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ScheduleUpload {
    /// Which schedule.
    pub schedule: u8,
    /// This part, from 0.
    pub part: u8,
    /// Number of parts.
    pub parts: u8,
    /// CRC-32 of all entries of all parts, see [`ScheduleEntry::to_wire_bytes`].
    pub entries_crc32: u32,
    /// Entries of this part.
    pub entries: Vec<ScheduleEntry, 8>,
}

packet! {
    /// One step of a script.
    pub struct ScriptStep (23 bytes) {
        /// When, ms after the script began.
        offset_ms: u32 = ["step.offset"], "ms";
        /// Command to run.
        command: u8 = ["step.command"], "";
        /// Its argument.
        argument: [f32; 3] = ["step.argument.0", "step.argument.1", "step.argument.2"], "";
        /// What must be seen.
        expect: u8 = ["step.expect"], "";
        /// By when, ms.
        timeout_ms: u32 = ["step.timeout"], "ms";
        /// What to do when it is not.
        on_fail: u8 = ["step.on_fail"], "";
    }
}

/// One part of a script, at most 8 steps.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ScriptUpload {
    /// Which script.
    pub script: u8,
    /// This part, from 0.
    pub part: u8,
    /// Number of parts.
    pub parts: u8,
    /// Steps of this part.
    pub steps: Vec<ScriptStep, 8>,
}

/// A polynomial of attitude (MRP) against seconds since `start_ms`.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Guidance {
    /// Name of it; a manoeuvre script's first argument.
    pub id: u8,
    /// Which actuator follows it.
    pub actuator: u8,
    /// When it begins, ms since 1970 UTC.
    pub start_ms: u64,
    /// Coefficients of rising degree, 1 to 6 of them: degree 0 to 5.
    pub coefficients: Vec<[f32; 3], 6>,
}

impl Guidance {
    /// Degree of the polynomial; 0 when there are no coefficients, which no receiver accepts.
    #[must_use]
    pub fn degree(&self) -> u8 {
        self.coefficients.len().saturating_sub(1) as u8
    }

    pub(super) fn walk(&self, walk: &mut Walk<'_>) {
        walk.value(&self.id, &["id"], "");
        walk.value(&self.actuator, &["actuator"], "");
        walk.field("degree", "", FieldValue::U(self.degree().into()), 1);
        walk.value(&self.start_ms, &["start"], "ms");
        for (index, coefficient) in (0..).zip(&self.coefficients) {
            walk.index = Some(index);
            walk.value(coefficient, &["coefficient.x", "coefficient.y", "coefficient.z"], "");
        }
        walk.index = None;
    }
}
