//! `gs-server decode` over the vectors of the wire, which an independent program made.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot be set up has failed"
)]

use std::io::Write as _;
use std::process::{Command, Stdio};

use base64::Engine as _;
use serde_json::Value;

/// Exit code and lines of JSON.
fn decode(input: &[u8], arguments: &[&str]) -> (i32, Vec<Value>) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_gs-server"))
        .arg("decode")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    let feeding = std::thread::spawn(move || stdin.write_all(&input));
    let output = child.wait_with_output().unwrap();
    feeding.join().unwrap().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    (output.status.code().unwrap(), lines)
}

/// The vectors of one direction: the lines of each, by their key.
fn vectors(direction: &str) -> Vec<Vec<(String, String)>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../protocol/vectors");
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if !path.file_name().unwrap().to_str().unwrap().starts_with(direction) {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        for block in text.split("\n\n").filter(|block| block.contains("frame: ")) {
            let lines = block.lines().filter(|line| !line.starts_with('#'));
            let pairs = lines.filter_map(|line| line.split_once(": "));
            all.push(pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).collect());
        }
    }
    assert!(all.len() > 10, "there are vectors");
    all
}

fn of<'a>(vector: &'a [(String, String)], key: &str) -> &'a str {
    &vector.iter().find(|(found, _)| found == key).unwrap_or_else(|| panic!("no {key} in {vector:?}")).1
}

#[test]
fn every_downlink_vector_comes_out_with_its_fields() {
    let vectors = vectors("down_");
    let stream: String = vectors.iter().map(|vector| format!("{}\n", of(vector, "frame"))).collect();
    let (code, lines) = decode(stream.as_bytes(), &[]);
    assert_eq!(code, 0);
    let frames: Vec<_> =
        lines.iter().filter(|line| line["kind"] == "frame" && line["nested"] == false).collect();
    assert_eq!(frames.len(), vectors.len());
    assert!(!lines.iter().any(|line| line["kind"] == "skipped"), "{lines:?}");
    for (vector, frame) in vectors.iter().zip(frames) {
        let name = of(vector, "name");
        assert_eq!(frame["type"].to_string(), of(vector, "type"), "{name}");
        assert_eq!(frame["tag"].as_u64().unwrap_or(0).to_string(), of(vector, "tag"), "{name}");
        assert_eq!(frame["form"], of(vector, "form"), "{name}");
        for (_, field) in vector.iter().filter(|(key, _)| key == "field") {
            check_field(name, &frame["fields"], field);
        }
    }
}

/// `gyro.x @9+4 f32:3f735d97 rad/s # 0.95`
fn check_field(vector: &str, fields: &Value, line: &str) {
    let mut words = line.split(' ');
    let (name, _place, value) = (words.next().unwrap(), words.next().unwrap(), words.next().unwrap());
    // Entries of lists are written `[0]event.time` there.
    let name = match name.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((index, name)) => format!("{name}[{index}]"),
        None => name.to_owned(),
    };
    let name = name.as_str();
    let unit = words.next().filter(|word| *word != "#");
    let found = fields.get(name).unwrap_or_else(|| panic!("{vector}: no {name} in {fields}"));
    if let Some(unit) = unit {
        assert_eq!(found["unit"], unit, "{vector} {name}");
    }
    let (kind, value) = value.split_once(':').unwrap();
    match kind {
        "f32" => {
            let wanted = f32::from_bits(u32::from_str_radix(value, 16).unwrap());
            if wanted.is_finite() {
                assert_eq!(found["value"].as_f64().unwrap() as f32, wanted, "{vector} {name}");
            } else {
                assert_eq!(
                    (&found["value"], &found["invalid"]),
                    (&Value::Null, &true.into()),
                    "{vector} {name}"
                );
            }
        }
        "u" => assert_eq!(found["value"].to_string(), value, "{vector} {name}"),
        "bool" => assert_eq!(found["value"], value == "1", "{vector} {name}"),
        _ => assert_eq!(found["value"], value, "{vector} {name}"),
    }
}

#[test]
fn a_telecommand_is_seen_from_outside() {
    for vector in vectors("up_") {
        let frame = hex::decode(of(&vector, "frame")).unwrap();
        let (code, lines) = decode(&frame, &[]);
        assert_eq!(code, 0);
        assert_eq!(lines[0]["kind"], "sealed-uplink");
        assert_eq!(lines[0]["counter"].to_string(), of(&vector, "counter"));
        assert_eq!(lines[0]["nonce"], of(&vector, "nonce"));
        let text = lines[0].to_string();
        assert!(!text.contains(of(&vector, "key")), "no key in it");
    }
}

#[test]
fn the_example_of_the_readme_decodes_from_all_formats() {
    let hex = "504958454c534154f7dba90c0207000d010000003d0000348d01980130";
    let bytes = hex::decode(hex).unwrap();
    let base64 = base64::engine::general_purpose::STANDARD.encode(&bytes);
    for (input, format) in [(hex.as_bytes(), "hex"), (&bytes, "raw"), (base64.as_bytes(), "base64")] {
        for format in ["auto", format] {
            let (code, lines) = decode(input, &["-", "--format", format]);
            assert_eq!((code, lines.len()), (0, 2));
            assert_eq!(lines[0]["name"], "ImageInfo");
            assert_eq!(lines[0]["fields"]["chunks"]["value"], 61);
        }
    }
    let (code, lines) = decode(b"no frame in here", &[]);
    assert_eq!((code, lines.last().unwrap()["frames"].clone()), (1, 0.into()));
}

#[test]
fn a_long_capture_with_damage_is_read_to_its_end() {
    let frame = hex::decode("504958454c534154f7dba90c0207000d010000003d0000348d01980130").unwrap();
    let mut capture = Vec::new();
    for round in 0_u32..20_000 {
        capture.extend(&frame);
        capture.extend(round.to_be_bytes());
        if round % 100 == 0 {
            capture.extend(&frame[..20]);
        }
    }
    let (code, lines) = decode(&capture, &["--frames-only"]);
    let summary = lines.last().unwrap();
    assert_eq!((code, summary["frames"].clone()), (0, 20_000.into()));
    assert_eq!(summary["bytes"], capture.len());
    assert_eq!(summary["skipped_bytes"], 20_000 * 4 + 200 * 20);
}
