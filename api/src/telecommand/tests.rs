use proptest::prelude::*;
use serde_json::json;

use super::*;

fn read(name: &str, value: &Value) -> Result<Telecommand, Vec<ArgumentError>> {
    parse(name, value.as_object().unwrap())
}

fn fields(name: &str, value: &Value) -> Vec<String> {
    read(name, value).unwrap_err().into_iter().map(|error| error.field).collect()
}

/// One good request of every telecommand.
fn examples() -> Vec<(&'static str, Value)> {
    let line = "1 25544U 98067A   26326.50000000  .00016717  00000-0  10270-3 0  9005";
    vec![
        ("Ping", json!({})),
        ("GetImageInfo", json!({})),
        ("GetImageChunk", json!({"first": 0, "count": 8})),
        ("Reset", json!({})),
        ("ExecuteTorqueProfile", json!({"steps": [{"torque_n_m": [0.001, 0.0, -0.5], "duration_ms": 1500}]})),
        ("GetAdcsInfo", json!({})),
        ("CaptureImage", json!({"resolution": "SVGA", "grey": true, "strong_compression": false})),
        (
            "SetDownlinkSchedule",
            json!({"slots": [
                {"time": "2026-11-22T05:00:00.000Z", "first": 0, "count": 9, "attitude_mrp": null},
                {"time": "2026-11-22T06:00:00.000Z", "first": 9, "count": 9, "attitude_mrp": [0.1, 0.2, 0.3]},
            ]}),
        ),
        ("SetAdcsOmegaKill", json!({})),
        ("SetAdcsAttitude", json!({"attitude_mrp": [0.1, -0.2, 0.3]})),
        ("SetAdcsTarget", json!({"latitude_deg": 46.52, "longitude_deg": 6.57})),
        ("SetAdcsAuto", json!({})),
        ("SetTimestamp", json!({"utc": "2026-11-22T05:19:25.123Z"})),
        ("SetTle", json!({"line_1": line, "line_2": line})),
        ("GetImageRanges", json!({"ranges": [{"first": 3, "count": 1}, {"first": 7, "count": 2}]})),
        ("SetTransmitter", json!({"on": false})),
        ("SetMode", json!({"mode": 5, "substate": 2})),
        (
            "UploadSchedule",
            json!({"schedule": 1, "part": 0, "parts": 1, "entries_crc32": 4_000_000_000u32, "entries": [
                {"time": "2026-11-22T05:00:00.000Z", "script": 3, "argument": [1.0, 2.0, 3.0]},
            ]}),
        ),
        ("GetModeReport", json!({})),
        ("SetParameter", json!({"parameter": 4, "value": 0.1})),
        (
            "UploadScript",
            json!({"script": 1, "part": 0, "parts": 1, "steps": [
                {"offset_ms": 10, "command": 2, "argument": [0.0, 0.0, 1.5], "expect": 1, "timeout_ms": 500, "on_fail": 0},
            ]}),
        ),
        ("GetEvents", json!({"first": 77})),
        (
            "UploadGuidance",
            json!({"id": 1, "actuator": 0, "start": "2026-11-22T05:00:00.000Z", "coefficients": [[0.1, 0.2, 0.3]]}),
        ),
    ]
}

#[test]
fn every_telecommand_is_read_and_written_back_as_it_was() {
    let examples = examples();
    assert_eq!(examples.iter().map(|(name, _)| *name).collect::<Vec<_>>(), NAMES);
    for (name, value) in examples {
        let command = read(name, &value).unwrap_or_else(|errors| panic!("{name}: {errors:?}"));
        assert_eq!(command.name(), name);
        assert_eq!(Value::Object(arguments(&command)), value, "{name}");
    }
}

#[test]
fn every_telecommand_refuses_an_argument_nobody_knows() {
    for (name, mut value) in examples() {
        value["nonsense"] = json!(1);
        assert_eq!(fields(name, &value), ["arguments.nonsense"], "{name}");
    }
}

#[test]
fn every_argument_is_required_or_has_a_stated_default() {
    let optional = ["grey", "strong_compression", "substate"];
    for (name, value) in examples() {
        for key in value.as_object().unwrap().keys().filter(|key| !optional.contains(&key.as_str())) {
            let mut cut = value.clone();
            cut.as_object_mut().unwrap().remove(key);
            assert_eq!(fields(name, &cut), [format!("arguments.{key}")], "{name}");
        }
    }
}

#[test]
fn every_argument_of_the_wrong_type_is_named() {
    for (name, value) in examples() {
        for key in value.as_object().unwrap().keys() {
            let mut wrong = value.clone();
            wrong[key] = json!({"of": "another type"});
            let found = fields(name, &wrong);
            assert!(
                found.iter().all(|field| field.starts_with(&format!("arguments.{key}"))),
                "{name}: {found:?}"
            );
        }
    }
}

#[test]
fn all_that_is_wrong_is_told_at_once_with_its_path() {
    assert_eq!(
        fields("GetImageChunk", &json!({"first": -1, "count": 65})),
        ["arguments.first", "arguments.count"]
    );
    let slots = json!({"slots": [{"time": "soon", "first": 0, "count": 1}, {"time": "2026-11-22T05:00:00Z", "first": 70000, "count": 1}]});
    assert_eq!(
        fields("SetDownlinkSchedule", &slots),
        ["arguments.slots[0].time", "arguments.slots[1].first"]
    );
    let error = &read("GetImageChunk", &json!({"first": 0, "count": 0})).unwrap_err()[0];
    assert_eq!(error.to_string(), "arguments.count: must be a whole number from 1 to 64, found 0");
}

#[test]
fn rules_over_several_fields_name_the_field() {
    let long = json!({"steps": [{"torque_n_m": [0, 0, 0], "duration_ms": 600_001}]});
    assert_eq!(fields("ExecuteTorqueProfile", &long), ["arguments.steps"]);
    let slot = json!({"time": "2026-11-22T05:00:00Z", "first": 0, "count": 1});
    assert_eq!(fields("SetDownlinkSchedule", &json!({"slots": [slot, slot]})), ["arguments.slots[1].time"]);
    let script = json!({"script": 1, "part": 1, "parts": 1, "steps": []});
    assert_eq!(fields("UploadScript", &script), ["arguments.part"]);
    let many = json!({"ranges": [{"first": 0, "count": 40}, {"first": 80, "count": 40}]});
    assert_eq!(fields("GetImageRanges", &many), ["arguments.ranges"]);
    assert_eq!(
        fields("SetAdcsTarget", &json!({"latitude_deg": 91, "longitude_deg": 0})),
        ["arguments.latitude_deg"]
    );
    assert_eq!(fields("SetParameter", &json!({"parameter": 1, "value": 1e300})), ["arguments.value"]);
}

#[test]
fn an_unknown_name_is_answered_with_the_known_ones() {
    let error = &read("ping", &json!({})).unwrap_err()[0];
    assert_eq!(error.to_string(), "command: 'ping' is no telecommand; did you mean 'Ping'?");
    let error = &read("Explode", &json!({"x": 1})).unwrap_err()[0];
    assert!(error.to_string().contains("GetImageChunk"));
}

proptest! {
    #[test]
    fn what_the_codec_decodes_is_written_and_read_back(packet_type in 0u8..=0x46, mut payload in proptest::collection::vec(any::<u8>(), 0..=196), cut in 0usize..=196) {
        payload.truncate(cut);
        if let Ok(command) = Telecommand::decode(packet_type, &payload) {
            // Times beyond the calendar and chunk counts that ground never asks for have no JSON of their own.
            let map = arguments(&command);
            if let Ok(again) = parse(command.name(), &map) {
                prop_assert_eq!(arguments(&again), map);
            }
        }
    }

    #[test]
    fn reading_never_panics(name in proptest::sample::select(&NAMES[..]), key in "[a-z_]{1,12}", number in any::<f64>(), text in ".{0,60}") {
        let _ = parse(name, json!({key.clone(): number}).as_object().unwrap());
        let _ = parse(name, json!({key.clone(): text, "first": number}).as_object().unwrap());
        let _ = parse(name, json!({key: [[number], {"time": text}], "steps": [{"torque_n_m": [number, text, null]}]}).as_object().unwrap());
    }
}
