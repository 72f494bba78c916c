//! What each telecommand is and takes, as a table: what a form, a palette or a help page is made of.
//!
//! The table says what [`super::parse`] accepts; a test holds the two against each other, argument by argument.

use protocol::RANGE_MAX;

/// One telecommand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Definition {
    /// Its name, as the ICD has it.
    pub name: &'static str,
    /// What it does and what answers it, in one sentence.
    pub doc: &'static str,
    /// Whether it must be armed and then fired.
    pub critical: Critical,
    /// What it takes, in the order of the ICD.
    pub arguments: &'static [Argument],
}

/// Whether a telecommand must be armed and then fired.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Critical {
    /// Never.
    No,
    /// Always.
    Yes,
    /// When this flag is true.
    WhenTrue(&'static str),
}

/// One argument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Argument {
    /// Its name in JSON.
    pub name: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// What may stand there.
    pub kind: Kind,
    /// In what it is measured; empty: in nothing.
    pub unit: &'static str,
    /// It may be left out, and means this then.
    pub default: Option<Default>,
}

/// What may stand in an argument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A whole number in this range.
    Whole {
        /// The least.
        min: u64,
        /// The greatest.
        max: u64,
    },
    /// A number that fits binary32, in this range where there is one.
    Number {
        /// The least and the greatest.
        range: Option<(f32, f32)>,
    },
    /// Three numbers: x, y, z.
    Vector,
    /// True or false.
    Flag,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A UTC time.
    Time,
    /// Printable ASCII of exactly so many characters.
    Line {
        /// How many.
        length: usize,
    },
    /// A list of objects with these arguments.
    List {
        /// The fewest.
        min: usize,
        /// The most.
        max: usize,
        /// What each has.
        entry: &'static [Argument],
    },
    /// A list of vectors.
    Vectors {
        /// The fewest.
        min: usize,
        /// The most.
        max: usize,
    },
}

/// What an argument means when it is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Default {
    /// This number.
    Whole(u64),
    /// This flag.
    Flag(bool),
    /// Nothing at all.
    Absent,
}

impl Definition {
    /// The telecommand of this name; upper and lower case do not matter.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        DEFINITIONS.iter().find(|definition| definition.name.eq_ignore_ascii_case(name))
    }
}

const U8: u64 = u8::MAX as u64;
const U16: u64 = u16::MAX as u64;
const U32: u64 = u32::MAX as u64;

const fn argument(name: &'static str, kind: Kind, doc: &'static str) -> Argument {
    Argument { name, doc, kind, unit: "", default: None }
}

const fn whole(name: &'static str, max: u64, doc: &'static str) -> Argument {
    argument(name, Kind::Whole { min: 0, max }, doc)
}

const fn flag(name: &'static str, doc: &'static str) -> Argument {
    argument(name, Kind::Flag, doc).or(Default::Flag(false))
}

impl Argument {
    const fn in_unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    const fn or(self, default: Default) -> Self {
        Self { default: Some(default), ..self }
    }
}

const COUNT: Argument =
    argument("count", Kind::Whole { min: 1, max: RANGE_MAX as u64 }, "How many chunks").in_unit("chunks");
const FIRST_CHUNK: Argument = whole("first", U16, "The first chunk, from 0");
const VECTOR: Argument = argument("argument", Kind::Vector, "What it is given");
const PART: [Argument; 2] = [
    whole("part", U8, "Which part this is, from 0; below the number of parts"),
    whole("parts", U8, "How many parts there are"),
];

const TORQUE_STEP: &[Argument] = &[
    argument("torque_n_m", Kind::Vector, "Torque about the body's axes").in_unit("N·m"),
    whole("duration_ms", U32, "For how long; 600,000 ms at most in all steps together").in_unit("ms"),
];
const DOWNLINK_SLOT: &[Argument] = &[
    argument("time", Kind::Time, "When it sends; later than the slot before"),
    FIRST_CHUNK,
    whole("count", U16, "How many chunks").in_unit("chunks"),
    argument("attitude_mrp", Kind::Vector, "Attitude to take, modified Rodrigues parameters")
        .or(Default::Absent),
];
const SCHEDULE_ENTRY: &[Argument] =
    &[argument("time", Kind::Time, "When it begins"), whole("script", U8, "Which script it runs"), VECTOR];
const SCRIPT_STEP: &[Argument] = &[
    whole("offset_ms", U32, "How long after the beginning of the script").in_unit("ms"),
    whole("command", U8, "Which command of the satellite's machine"),
    VECTOR,
    whole("expect", U8, "What has to come of it"),
    whole("timeout_ms", U32, "Until when that has to come").in_unit("ms"),
    whole("on_fail", U8, "What follows when it does not"),
];

const fn plain(name: &'static str, doc: &'static str) -> Definition {
    Definition { name, doc, critical: Critical::No, arguments: &[] }
}

const fn with(name: &'static str, doc: &'static str, arguments: &'static [Argument]) -> Definition {
    Definition { name, doc, critical: Critical::No, arguments }
}

const fn critical(name: &'static str, doc: &'static str, arguments: &'static [Argument]) -> Definition {
    Definition { name, doc, critical: Critical::Yes, arguments }
}

/// All telecommands, in the order of [`super::NAMES`].
pub const DEFINITIONS: [Definition; 23] = [
    plain("Ping", "Asks for a sign of life; answered by Pong."),
    plain("GetImageInfo", "Asks which image is stored; answered by ImageInfo."),
    with(
        "GetImageChunk",
        "Asks for chunks of the stored image; answered by these chunks, ascending.",
        &[FIRST_CHUNK, COUNT],
    ),
    critical("Reset", "Restarts the satellite; not answered, the next heartbeat shows a small uptime.", &[]),
    critical(
        "ExecuteTorqueProfile",
        "Turns the satellite by these torques, one after the other; answered by AdcsInfo afterwards.",
        &[argument("steps", Kind::List { min: 0, max: 12, entry: TORQUE_STEP }, "Torques, in this order")],
    ),
    plain("GetAdcsInfo", "Asks how attitude control is; answered by AdcsInfo."),
    with(
        "CaptureImage",
        "Takes a picture, which takes the place of the stored one; answered by ImageInfo afterwards.",
        &[
            argument("resolution", Kind::Choice(&["CIF", "SVGA"]), "CIF is 408 x 304, SVGA 818 x 610")
                .in_unit("px"),
            flag("grey", "Without colour"),
            flag("strong_compression", "A smaller file, a worse picture"),
        ],
    ),
    with(
        "SetDownlinkSchedule",
        "Has chunks sent by themselves at these times, in place of the schedule before; answered by ScheduleInfo.",
        &[argument(
            "slots",
            Kind::List { min: 0, max: 8, entry: DOWNLINK_SLOT },
            "Times, ascending; none clears the schedule",
        )],
    ),
    plain("SetAdcsOmegaKill", "Has attitude control stop the rotation; answered by AdcsInfo."),
    with(
        "SetAdcsAttitude",
        "Has attitude control hold this attitude; answered by AdcsInfo.",
        &[argument("attitude_mrp", Kind::Vector, "Attitude to hold, modified Rodrigues parameters")],
    ),
    with(
        "SetAdcsTarget",
        "Has attitude control point at this place on the ground; answered by AdcsInfo.",
        &[
            argument("latitude_deg", Kind::Number { range: Some((-90.0, 90.0)) }, "Latitude, north positive")
                .in_unit("deg"),
            argument(
                "longitude_deg",
                Kind::Number { range: Some((-180.0, 180.0)) },
                "Longitude, east positive",
            )
            .in_unit("deg"),
        ],
    ),
    plain("SetAdcsAuto", "Lets attitude control decide by itself; answered by AdcsInfo."),
    critical(
        "SetTimestamp",
        "Sets the satellite's clock; answered by a heartbeat.",
        &[argument("utc", Kind::Time, "What time it is")],
    ),
    critical(
        "SetTle",
        "Gives the satellite its own elements; answered by a heartbeat.",
        &[
            argument("line_1", Kind::Line { length: 69 }, "Line 1 of the elements").in_unit("characters"),
            argument("line_2", Kind::Line { length: 69 }, "Line 2 of the elements").in_unit("characters"),
        ],
    ),
    with(
        "GetImageRanges",
        "Asks for several stretches of chunks at once; answered by these chunks, in this order.",
        &[argument(
            "ranges",
            Kind::List { min: 1, max: 48, entry: &[FIRST_CHUNK, COUNT] },
            "Stretches; 64 chunks at most in all together",
        )],
    ),
    Definition {
        name: "SetTransmitter",
        doc: "Switches the satellite's transmitter; answered by a heartbeat when on, by nothing when off.",
        critical: Critical::WhenTrue("on"),
        arguments: &[argument("on", Kind::Flag, "Whether the satellite may transmit")],
    },
    critical(
        "SetMode",
        "Puts the satellite's mode machine into this mode; answered by ModeReport.",
        &[
            whole("mode", U8, "Mode, by its number"),
            whole("substate", U8, "Sub-state, by its number; 255: none").or(Default::Whole(255)),
        ],
    ),
    critical(
        "UploadSchedule",
        "Stores one part of a schedule of scripts; answered by ModeReport.",
        &[
            whole("schedule", U8, "Number of the schedule"),
            PART[0],
            PART[1],
            whole("entries_crc32", U32, "CRC-32 of all entries of all parts"),
            argument("entries", Kind::List { min: 0, max: 8, entry: SCHEDULE_ENTRY }, "Entries of this part"),
        ],
    ),
    plain("GetModeReport", "Asks in which mode the satellite is; answered by ModeReport."),
    with(
        "SetParameter",
        "Sets a parameter of the mode machine; answered by ModeReport.",
        &[
            whole("parameter", U8, "Parameter, by its number"),
            argument("value", Kind::Number { range: None }, "Its value, in the parameter's own unit"),
        ],
    ),
    with(
        "UploadScript",
        "Stores one part of a script; answered by ModeReport.",
        &[
            whole("script", U8, "Number of the script"),
            PART[0],
            PART[1],
            argument("steps", Kind::List { min: 0, max: 8, entry: SCRIPT_STEP }, "Steps of this part"),
        ],
    ),
    with(
        "GetEvents",
        "Asks for recorded events; answered by EventReport.",
        &[whole("first", U32, "The first event, by its sequence number")],
    ),
    with(
        "UploadGuidance",
        "Stores a guidance polynomial; answered by ModeReport.",
        &[
            whole("id", U8, "Number of the polynomial"),
            whole("actuator", U8, "Which actuator it drives, by its number"),
            argument("start", Kind::Time, "When it begins"),
            argument(
                "coefficients",
                Kind::Vectors { min: 1, max: 6 },
                "Coefficients, by rising power of time",
            ),
        ],
    ),
];

#[cfg(test)]
mod tests {
    use serde_json::{Map, Value, json};

    use super::super::{NAMES, parse};
    use super::*;

    /// The least and the greatest that an argument takes.
    fn ends(argument: &Argument) -> [Value; 2] {
        let list = |min: usize, max: usize, entry: &dyn Fn(usize) -> Value| {
            [(0..min).map(entry).collect(), (0..max).map(entry).collect()]
        };
        match argument.kind {
            Kind::Whole { min, max } => [json!(min), json!(max)],
            Kind::Number { range } => {
                range.map_or([json!(-1e30), json!(1e30)], |(min, max)| [json!(min), json!(max)])
            }
            Kind::Vector => [json!([0, 0, 0]), json!([1.5, -2, 1e9])],
            Kind::Flag => [json!(false), json!(true)],
            Kind::Choice(words) => [json!(words[0]), json!(words[words.len() - 1])],
            Kind::Time => [json!("1970-01-01T00:00:00Z"), json!("2026-11-22T05:19:25.123Z")],
            Kind::Line { length } => [json!("1".repeat(length)), json!("~".repeat(length))],
            // Entries of their least; times rise from slot to slot
            Kind::List { min, max, entry } => list(min, max, &|index| {
                let mut map = object(entry, 0);
                if map.contains_key("time") {
                    map["time"] = json!(format!("2026-11-22T05:00:{index:02}Z"));
                }
                Value::Object(map)
            }),
            Kind::Vectors { min, max } => list(min, max, &|_| json!([0, 1, 2])),
        }
    }

    fn object(arguments: &[Argument], end: usize) -> Map<String, Value> {
        let mut map: Map<_, _> =
            arguments.iter().map(|one| (one.name.to_owned(), ends(one)[end].clone())).collect();
        if map.contains_key("parts") {
            map["part"] = json!([0, 254][end]);
            map["parts"] = json!([1, 255][end]);
        }
        map
    }

    /// Something just outside of an argument, and whether there is an outside.
    fn beyond(kind: Kind) -> Option<Value> {
        let (list, entry) = match kind {
            Kind::Whole { max, .. } => return Some(json!(max + 1)),
            Kind::Number { range: Some((_, max)) } => return Some(json!(max + 1.0)),
            Kind::Number { range: None } => return Some(json!(1e300)),
            Kind::Choice(_) => return Some(json!("neither")),
            Kind::Line { length } => return Some(json!("1".repeat(length + 1))),
            Kind::Vector => return Some(json!([1, 2])),
            Kind::List { max, entry, .. } => (max, Value::Object(object(entry, 0))),
            Kind::Vectors { max, .. } => (max, json!([0, 0, 0])),
            Kind::Flag | Kind::Time => return Some(json!("sometimes")),
        };
        Some(Value::Array(vec![entry; list + 1]))
    }

    #[test]
    fn the_table_has_every_telecommand_in_its_place() {
        assert_eq!(DEFINITIONS.map(|definition| definition.name), NAMES);
        assert_eq!(Definition::find("getimagechunk").unwrap().name, "GetImageChunk");
        for definition in &DEFINITIONS {
            assert!(definition.doc.ends_with('.'), "{}", definition.name);
            assert!(definition.arguments.iter().all(|argument| !argument.doc.is_empty()));
        }
    }

    #[test]
    fn the_reader_takes_what_the_table_says_at_both_ends_and_knows_it_critical() {
        for definition in &DEFINITIONS {
            for end in [0, 1] {
                let mut map = object(definition.arguments, end);
                if definition.name == "GetImageRanges" && end == 1 {
                    map["ranges"].as_array_mut().unwrap().truncate(48);
                }
                let read =
                    parse(definition.name, &map).unwrap_or_else(|errors| panic!("{map:?}: {errors:?}"));
                let critical = match definition.critical {
                    Critical::No => false,
                    Critical::Yes => true,
                    Critical::WhenTrue(flag) => map[flag] == json!(true),
                };
                assert_eq!(read.is_critical(), critical, "{} {map:?}", definition.name);
            }
        }
    }

    #[test]
    fn the_reader_refuses_what_is_just_outside_and_names_it() {
        for definition in &DEFINITIONS {
            walk(definition.name, definition.arguments, &|inner| inner, "");
        }
    }

    /// Each argument beyond its end, and left out; `wrap` puts it into the whole.
    fn walk(
        name: &str,
        arguments: &[Argument],
        wrap: &dyn Fn(Map<String, Value>) -> Map<String, Value>,
        at: &str,
    ) {
        for argument in arguments {
            let good = object(arguments, 0);
            let path = format!("arguments.{at}{}", argument.name);
            let mut wrong = good.clone();
            if let Some(value) = beyond(argument.kind) {
                wrong[argument.name] = value;
                let errors = parse(name, &wrap(wrong)).expect_err(&path);
                assert!(
                    errors.iter().all(|error| error.field.starts_with(&path)),
                    "{name} {path}: {errors:?}"
                );
            }
            if let Kind::Whole { min, .. } = argument.kind
                && min > 0
            {
                let mut wrong = good.clone();
                wrong[argument.name] = json!(min - 1);
                assert_eq!(parse(name, &wrap(wrong)).unwrap_err()[0].field, path);
            }
            let mut without = good.clone();
            without.remove(argument.name);
            let read = parse(name, &wrap(without));
            assert_eq!(read.is_ok(), argument.default.is_some(), "{name} {path}: {read:?}");
            if let Kind::List { entry, .. } = argument.kind {
                let inside = |inner: Map<String, Value>| {
                    let mut whole = good.clone();
                    whole[argument.name] = Value::Array(vec![Value::Object(inner)]);
                    wrap(whole)
                };
                walk(name, entry, &inside, &format!("{at}{}[0].", argument.name));
            }
        }
    }

    #[test]
    fn what_is_left_out_means_what_the_table_says() {
        let read =
            parse("SetMode", &object(&[argument("mode", Kind::Whole { min: 0, max: 5 }, "")], 1)).unwrap();
        let substate = Definition::find("SetMode").unwrap().arguments[1];
        let Some(Default::Whole(default)) = substate.default else { panic!("{substate:?}") };
        assert_eq!(
            read,
            protocol::Telecommand::SetMode { mode: 5, substate: u8::try_from(default).unwrap() }
        );
    }
}
