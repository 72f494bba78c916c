//! JSON to telecommands.

use protocol::{
    ChunkRange, ChunkRanges, DownlinkSchedule, DownlinkSlot, Guidance, PayloadError, RANGE_MAX, Resolution,
    ScheduleEntry, ScheduleUpload, ScriptStep, ScriptUpload, Telecommand, TorqueProfile, TorqueStep,
    TwoLines,
};
use serde_json::{Map, Value};

use super::{ArgumentError, NAMES};
use crate::Time;

pub(super) fn parse(name: &str, arguments: &Map<String, Value>) -> Result<Telecommand, Vec<ArgumentError>> {
    let mut errors = Vec::new();
    let command = command(name, Object::new("arguments", arguments, &mut errors));
    match command {
        Some(command) if errors.is_empty() => match command.validate() {
            Ok(()) => Ok(command),
            Err(error) => Err(vec![broken_rule(&error)]),
        },
        _ => {
            if errors.is_empty() {
                errors.push(unknown_command(name));
            }
            Err(errors)
        }
    }
}

fn command(name: &str, mut args: Object<'_, '_>) -> Option<Telecommand> {
    let command = match name {
        "Ping" => Some(Telecommand::Ping),
        "GetImageInfo" => Some(Telecommand::GetImageInfo),
        "GetImageChunk" => {
            let (first, count) = (args.number("first"), args.number_in("count", 1, u64::from(RANGE_MAX)));
            first.zip(count).map(|(first, count)| Telecommand::GetImageChunk { first, count })
        }
        "Reset" => Some(Telecommand::Reset),
        "ExecuteTorqueProfile" => args
            .list("steps", torque_step)
            .map(|steps| Telecommand::ExecuteTorqueProfile(TorqueProfile { steps })),
        "GetAdcsInfo" => Some(Telecommand::GetAdcsInfo),
        "CaptureImage" => {
            let resolution = args.resolution("resolution");
            let (grey, strong_compression) = (args.flag("grey"), args.flag("strong_compression"));
            resolution.map(|resolution| Telecommand::CaptureImage { resolution, grey, strong_compression })
        }
        "SetDownlinkSchedule" => args
            .list("slots", downlink_slot)
            .map(|slots| Telecommand::SetDownlinkSchedule(DownlinkSchedule { slots })),
        "SetAdcsOmegaKill" => Some(Telecommand::SetAdcsOmegaKill),
        "SetAdcsAttitude" => {
            args.vector("attitude_mrp").map(|attitude_mrp| Telecommand::SetAdcsAttitude { attitude_mrp })
        }
        "SetAdcsTarget" => {
            let latitude = args.float_in("latitude_deg", -90.0, 90.0);
            let longitude = args.float_in("longitude_deg", -180.0, 180.0);
            latitude.zip(longitude).map(|(latitude_deg, longitude_deg)| Telecommand::SetAdcsTarget {
                latitude_deg,
                longitude_deg,
            })
        }
        "SetAdcsAuto" => Some(Telecommand::SetAdcsAuto),
        "SetTimestamp" => args.time_ms("utc").map(|utc_ms| Telecommand::SetTimestamp { utc_ms }),
        "SetTle" => two_lines(&mut args).map(Telecommand::SetTle),
        "GetImageRanges" => image_ranges(&mut args).map(Telecommand::GetImageRanges),
        "SetTransmitter" => args.boolean("on").map(|on| Telecommand::SetTransmitter { on }),
        "SetMode" => {
            let (mode, substate) = (args.number("mode"), args.number_or("substate", 255));
            mode.zip(substate).map(|(mode, substate)| Telecommand::SetMode { mode, substate })
        }
        "UploadSchedule" => schedule_upload(&mut args).map(Telecommand::UploadSchedule),
        "GetModeReport" => Some(Telecommand::GetModeReport),
        "SetParameter" => {
            let (parameter, value) = (args.number("parameter"), args.float("value"));
            parameter.zip(value).map(|(parameter, value)| Telecommand::SetParameter { parameter, value })
        }
        "UploadScript" => script_upload(&mut args).map(Telecommand::UploadScript),
        "GetEvents" => args.number("first").map(|first| Telecommand::GetEvents { first }),
        "UploadGuidance" => guidance(&mut args).map(Telecommand::UploadGuidance),
        _ => return None,
    };
    args.finish();
    command
}

fn torque_step(step: &mut Object<'_, '_>) -> Option<TorqueStep> {
    let (torque, duration) = (step.vector("torque_n_m"), step.number("duration_ms"));
    Some(TorqueStep { torque_n_m: torque?, duration_ms: duration? })
}

fn downlink_slot(slot: &mut Object<'_, '_>) -> Option<DownlinkSlot> {
    let (time, first, count) = (slot.time_ms("time"), slot.number("first"), slot.number("count"));
    let attitude =
        if slot.is_given("attitude_mrp") { slot.vector("attitude_mrp").map(Some) } else { Some(None) };
    Some(DownlinkSlot { time_ms: time?, first: first?, count: count?, attitude_mrp: attitude? })
}

fn two_lines(args: &mut Object<'_, '_>) -> Option<TwoLines> {
    let (line_1, line_2) = (args.text("line_1"), args.text("line_2"));
    let (line_1, line_2) = (line_1?, line_2?);
    match TwoLines::new(line_1, line_2) {
        Ok(lines) => Some(lines),
        Err(error) => {
            let field =
                if matches!(error, protocol::TextError::TleLine { line: 2 }) { "line_2" } else { "line_1" };
            args.wrong(field, "give the 69 printable ASCII characters of the line, without its line end");
            None
        }
    }
}

fn image_ranges(args: &mut Object<'_, '_>) -> Option<ChunkRanges> {
    let ranges: protocol::heapless::Vec<ChunkRange, 48> = args.list("ranges", |range| {
        let (first, count) = (range.number("first"), range.number_in("count", 1, u64::from(RANGE_MAX)));
        Some(ChunkRange { first: first?, count: count? })
    })?;
    let total: u32 = ranges.iter().map(|range| u32::from(range.count)).sum();
    if ranges.is_empty() || total > u32::from(RANGE_MAX) {
        args.wrong("ranges", &format!("1 to {RANGE_MAX} chunks in all ranges together, these are {total}"));
        return None;
    }
    Some(ChunkRanges { ranges })
}

fn schedule_upload(args: &mut Object<'_, '_>) -> Option<ScheduleUpload> {
    let (schedule, part, parts) = (args.number("schedule"), args.number("part"), args.number("parts"));
    let crc = args.number("entries_crc32");
    let entries = args.list("entries", |entry| {
        let (time, script) = (entry.time_ms("time"), entry.number("script"));
        let argument = entry.vector("argument");
        Some(ScheduleEntry { time_ms: time?, script: script?, argument: argument? })
    });
    Some(ScheduleUpload {
        schedule: schedule?,
        part: part?,
        parts: parts?,
        entries_crc32: crc?,
        entries: entries?,
    })
}

fn script_upload(args: &mut Object<'_, '_>) -> Option<ScriptUpload> {
    let (script, part, parts) = (args.number("script"), args.number("part"), args.number("parts"));
    let steps = args.list("steps", |step| {
        let (offset, command) = (step.number("offset_ms"), step.number("command"));
        let (argument, expect) = (step.vector("argument"), step.number("expect"));
        let (timeout, on_fail) = (step.number("timeout_ms"), step.number("on_fail"));
        Some(ScriptStep {
            offset_ms: offset?,
            command: command?,
            argument: argument?,
            expect: expect?,
            timeout_ms: timeout?,
            on_fail: on_fail?,
        })
    });
    Some(ScriptUpload { script: script?, part: part?, parts: parts?, steps: steps? })
}

fn guidance(args: &mut Object<'_, '_>) -> Option<Guidance> {
    let (id, actuator, start) = (args.number("id"), args.number("actuator"), args.time_ms("start"));
    let values = args.array("coefficients", 1, 6)?;
    let mut coefficients = protocol::heapless::Vec::new();
    for (index, value) in values.iter().enumerate() {
        let coefficient = args.vector_of(&format!("coefficients[{index}]"), value)?;
        coefficients.push(coefficient).ok()?;
    }
    Some(Guidance { id: id?, actuator: actuator?, start_ms: start?, coefficients })
}

fn unknown_command(name: &str) -> ArgumentError {
    let near = NAMES.iter().find(|known| known.eq_ignore_ascii_case(name));
    let shown: String = name.chars().take(40).collect();
    let message = match near {
        Some(near) => format!("'{shown}' is no telecommand; did you mean '{near}'?"),
        None => format!("'{shown}' is no telecommand; there are {}", NAMES.join(", ")),
    };
    ArgumentError { field: "command".to_owned(), message }
}

/// Rules over several fields, which the codec checks.
fn broken_rule(error: &PayloadError) -> ArgumentError {
    let field = match error {
        PayloadError::Order { entry } => format!("arguments.slots[{entry}].time"),
        PayloadError::Duration { .. } => "arguments.steps".to_owned(),
        PayloadError::Range { field: "part" } => "arguments.part".to_owned(),
        _ => "arguments".to_owned(),
    };
    let message = match error {
        PayloadError::Range { field: "part" } => "must be below 'parts'; parts are counted from 0".to_owned(),
        other => other.to_string(),
    };
    ArgumentError { field, message }
}

/// An object being read; it notes what was asked for, so that the rest can be refused by name.
struct Object<'a, 'e> {
    path: String,
    map: &'a Map<String, Value>,
    asked: Vec<&'static str>,
    errors: &'e mut Vec<ArgumentError>,
}

impl<'a, 'e> Object<'a, 'e> {
    fn new(path: impl Into<String>, map: &'a Map<String, Value>, errors: &'e mut Vec<ArgumentError>) -> Self {
        Self { path: path.into(), map, asked: Vec::new(), errors }
    }

    fn wrong(&mut self, field: &str, message: &str) {
        let field = format!("{}.{field}", self.path);
        self.errors.push(ArgumentError { field, message: message.to_owned() });
    }

    fn is_given(&mut self, field: &'static str) -> bool {
        self.asked.push(field);
        self.map.get(field).is_some_and(|value| !value.is_null())
    }

    fn required(&mut self, field: &'static str, what: &str) -> Option<&'a Value> {
        self.asked.push(field);
        let value = self.map.get(field);
        if value.is_none() {
            self.wrong(field, &format!("is missing: give {what}"));
        }
        value
    }

    fn number<T: TryFrom<u64> + Bounded>(&mut self, field: &'static str) -> Option<T> {
        self.number_in(field, 0, T::MAX_U64)
    }

    fn number_in<T: TryFrom<u64>>(&mut self, field: &'static str, min: u64, max: u64) -> Option<T> {
        let what = format!("a whole number from {min} to {max}");
        let value = self.required(field, &what)?;
        let number = value.as_u64().filter(|n| (min..=max).contains(n)).and_then(|n| T::try_from(n).ok());
        if number.is_none() {
            self.wrong(field, &format!("must be {what}, found {}", shown(value)));
        }
        number
    }

    fn number_or(&mut self, field: &'static str, default: u8) -> Option<u8> {
        if self.is_given(field) { self.number(field) } else { Some(default) }
    }

    fn float(&mut self, field: &'static str) -> Option<f32> {
        let value = self.required(field, "a number")?;
        self.float_of(field, value)
    }

    fn float_in(&mut self, field: &'static str, min: f32, max: f32) -> Option<f32> {
        let found = self.float(field)?;
        if (min..=max).contains(&found) {
            return Some(found);
        }
        self.wrong(field, &format!("must lie from {min} to {max}, found {found}"));
        None
    }

    fn float_of(&mut self, field: &str, value: &Value) -> Option<f32> {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the wire has binary32; what overflows is refused below"
        )]
        let number = value.as_f64().map(|v| v as f32).filter(|v| v.is_finite());
        if number.is_none() {
            self.wrong(field, &format!("must be a number that fits binary32, found {}", shown(value)));
        }
        number
    }

    fn vector(&mut self, field: &'static str) -> Option<[f32; 3]> {
        let value = self.required(field, "three numbers, e.g. [0, 0, 0.1]")?;
        self.vector_of(field, value)
    }

    fn vector_of(&mut self, field: &str, value: &Value) -> Option<[f32; 3]> {
        let Some([x, y, z]) = value.as_array().map(Vec::as_slice) else {
            self.wrong(field, &format!("must be three numbers, e.g. [0, 0, 0.1], found {}", shown(value)));
            return None;
        };
        let [x, y, z] = [(0, x), (1, y), (2, z)].map(|(i, v)| self.float_of(&format!("{field}[{i}]"), v));
        Some([x?, y?, z?])
    }

    fn boolean(&mut self, field: &'static str) -> Option<bool> {
        let value = self.required(field, "true or false")?;
        if value.as_bool().is_none() {
            self.wrong(field, &format!("must be true or false, found {}", shown(value)));
        }
        value.as_bool()
    }

    /// A boolean that is false when left out; the error is noted.
    fn flag(&mut self, field: &'static str) -> bool {
        self.is_given(field) && self.boolean(field) == Some(true)
    }

    fn text(&mut self, field: &'static str) -> Option<&'a str> {
        let value = self.required(field, "text")?;
        if value.as_str().is_none() {
            self.wrong(field, &format!("must be text, found {}", shown(value)));
        }
        value.as_str()
    }

    fn resolution(&mut self, field: &'static str) -> Option<Resolution> {
        let value = self.required(field, "\"CIF\" (408 x 304) or \"SVGA\" (818 x 610)")?;
        match value.as_str() {
            Some("CIF") => Some(Resolution::Cif),
            Some("SVGA") => Some(Resolution::Svga),
            _ => {
                self.wrong(field, &format!("must be \"CIF\" or \"SVGA\", found {}", shown(value)));
                None
            }
        }
    }

    fn time_ms(&mut self, field: &'static str) -> Option<u64> {
        const EXAMPLE: &str = "a UTC time like \"2026-11-22T05:19:25.123Z\", not before 1970";
        let value = self.required(field, EXAMPLE)?;
        let time = value.as_str().and_then(|text| text.parse::<Time>().ok());
        let ms = time.and_then(|time| u64::try_from(time.unix_us()).ok()).map(|us| us / 1000);
        if ms.is_none() {
            self.wrong(field, &format!("must be {EXAMPLE}, found {}", shown(value)));
        }
        ms
    }

    fn array(&mut self, field: &'static str, min: usize, max: usize) -> Option<&'a [Value]> {
        let what = format!("a list of {min} to {max} entries");
        let value = self.required(field, &what)?;
        match value.as_array() {
            Some(list) if (min..=max).contains(&list.len()) => Some(list),
            Some(list) => {
                self.wrong(field, &format!("must be {what}, found {}", list.len()));
                None
            }
            None => {
                self.wrong(field, &format!("must be {what}, found {}", shown(value)));
                None
            }
        }
    }

    fn list<T, const N: usize>(
        &mut self,
        field: &'static str,
        mut read: impl FnMut(&mut Object<'_, '_>) -> Option<T>,
    ) -> Option<protocol::heapless::Vec<T, N>> {
        let entries = self.array(field, 0, N)?;
        let mut list = Some(protocol::heapless::Vec::new());
        for (index, entry) in entries.iter().enumerate() {
            let Some(map) = entry.as_object() else {
                self.wrong(
                    &format!("{field}[{index}]"),
                    &format!("must be an object, found {}", shown(entry)),
                );
                list = None;
                continue;
            };
            let mut object = Object::new(format!("{}.{field}[{index}]", self.path), map, self.errors);
            let value = read(&mut object);
            object.finish();
            // An entry that is wrong does not end the walk: all that is wrong is told at once.
            list = list.zip(value).and_then(|(mut list, value)| list.push(value).ok().map(|()| list));
        }
        list
    }

    fn finish(mut self) {
        for field in self.map.keys() {
            if !self.asked.contains(&field.as_str()) {
                let known = if self.asked.is_empty() {
                    "this telecommand takes no arguments".to_owned()
                } else {
                    format!("known are {}", self.asked.join(", "))
                };
                let name: String = field.chars().take(40).collect();
                self.errors.push(ArgumentError {
                    field: format!("{}.{name}", self.path),
                    message: format!("is no argument here: {known}"),
                });
            }
        }
        self.asked.clear();
    }
}

trait Bounded {
    const MAX_U64: u64;
}
impl Bounded for u8 {
    const MAX_U64: u64 = u8::MAX as u64;
}
impl Bounded for u16 {
    const MAX_U64: u64 = u16::MAX as u64;
}
impl Bounded for u32 {
    const MAX_U64: u64 = u32::MAX as u64;
}

/// What was found, short enough to be told.
fn shown(value: &Value) -> String {
    let text = value.to_string();
    if text.chars().count() <= 40 {
        text
    } else {
        format!("{}…", text.chars().take(40).collect::<String>())
    }
}
