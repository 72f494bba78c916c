//! The module by hand, against the twin's.

use super::twin::Twin;
use super::{json, run};

#[test]
fn a_module_is_probed_configured_and_watched() {
    let twin = Twin::start(&["--speed", "4", "--heartbeat-s", "5"]);
    let port = twin.port();
    let wiring = [port.as_str(), "--mode-pins", "software", "--aux", "absent"];
    let radio = |verb: &str, more: &[&str]| run([&["radio", verb][..], &wiring, more].concat());

    let (code, out, error) = radio("probe", &["--json"]);
    assert_eq!(code, 0, "{error}");
    let found = json(&out);
    assert_eq!((found["answered"].clone(), found["frequency_hz"].clone()), (true.into(), 435_000_000.into()));
    assert_eq!(found["differences"], json("[]"));

    let (code, out, _) = radio("configure", &["--power-dbm", "24", "--json"]);
    let dry = json(&out);
    assert_eq!((code, dry["power_dbm"].clone()), (0, 21.into()));
    assert_eq!(dry["differences"][0]["setting"], "power");
    assert_eq!(dry["differences"].as_array().unwrap().len(), 1, "{dry}");
    assert_eq!(json(&radio("probe", &["--json"]).1)["power_dbm"], 21, "nothing was written");

    let (code, out, error) = radio("configure", &["--power-dbm", "24", "--write", "--json"]);
    let written = json(&out);
    assert_eq!((code, written["configuration_verified"].clone()), (0, true.into()), "{error}");
    let (_, out, _) = radio("probe", &["--power-dbm", "24", "--json"]);
    assert_eq!((json(&out)["power_dbm"].clone(), json(&out)["differences"].clone()), (24.into(), json("[]")));

    let log = twin.file("raw.log");
    let (code, out, error) = radio("monitor", &["--count", "1", "--json", "--raw-log", &log]);
    assert_eq!(code, 0, "{error}");
    let lines: Vec<_> = out.lines().map(json).collect();
    assert_eq!(lines[0]["name"], "Heartbeat");
    assert!(lines[0]["rssi_dbm"].as_i64().unwrap() < -50, "{out}");
    assert_eq!(lines.last().unwrap()["kind"], "summary");
    assert!(std::fs::read_to_string(&log).unwrap().contains(" < - 504958454c534154"), "the head of a frame");
}

#[test]
fn what_cannot_be_asked_is_said() {
    let twin = Twin::start(&[]);
    let port = twin.port();
    let (code, _, error) = run(["radio", "probe", &port, "--mode-pins", "strapped", "--aux", "absent"]);
    assert_eq!(code, 2, "{error}");
    let (code, _, error) = run(["radio", "probe", &port, "--aux", "absent"]);
    assert_eq!(code, 1);
    assert!(error.contains("a pseudo-terminal has none"), "{error}");
    let (code, _, error) = run(["radio", "probe", "/dev/ttyNOSUCH"]);
    assert_eq!(code, 1);
    assert!(error.contains("is not there"), "{error}");
}
