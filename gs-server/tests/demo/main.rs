//! `gs-server demo` as scripts run it: the image comes home over a real pseudo-terminal, byte for byte.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Command, Stdio};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

fn demo(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gs-server"));
    command.arg("demo").args(arguments).stdin(Stdio::null());
    command
}

/// Exit code, the one object, standard error.
fn until_image(arguments: &[&str]) -> (i32, Value, String) {
    let output = demo(&[&["--until", "image", "--json"][..], arguments].concat()).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1, "exactly one object: {text}{error}");
    (output.status.code().unwrap(), serde_json::from_str(&text).unwrap(), error)
}

#[test]
fn the_image_comes_home_under_two_skies() {
    for (seed, loss, flips) in [("3", "0", "0"), ("4", "0.3", "0.0002")] {
        let (code, summary, error) = until_image(&["--seed", seed, "--loss", loss, "--flips", flips]);
        assert_eq!((code, summary["equal"].clone()), (0, true.into()), "{summary} {error}");
        assert_eq!(summary["sha256"]["ground"], summary["sha256"]["twin"]);
        assert_eq!(summary["seed"].to_string(), seed);
        assert_eq!(summary["chunks"]["held"], summary["chunks"]["total"]);
        let number = |pointer: &str| summary.pointer(pointer).and_then(Value::as_f64).expect(pointer);
        assert!(number("/airtime/used_s") >= number("/airtime/bound_s") * 0.7, "{summary}");
        assert!(number("/commands/answered") >= 3.0, "{summary}");
        assert!(number("/frames/heard") >= number("/chunks/total"), "{summary}");
        if loss != "0" {
            assert!(number("/frames/lost") > 0.0 && number("/requests") > 1.0, "{summary}");
        }
    }
}

#[test]
fn an_image_that_cannot_come_home_is_a_failure_with_its_reason() {
    let (code, summary, error) = until_image(&["--loss", "1", "--limit-h", "1", "--seed", "5"]);
    assert_eq!((code, summary["equal"].clone()), (1, false.into()));
    assert!(error.contains("the simulated time is up"), "{error}");
    assert!(summary["simulated_s"].as_f64().unwrap() >= 3600.0);
}

#[test]
fn the_same_satellite_flies_on_in_the_same_folder() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data").display().to_string();
    let (code, first, error) = until_image(&["--data", &data, "--seed", "6"]);
    assert_eq!(code, 0, "{error}");
    let (code, second, error) = until_image(&["--data", &data, "--seed", "6"]);
    assert_eq!(code, 0, "{error}");
    assert_eq!(first["sha256"], second["sha256"]);
    assert_eq!(second["chunks"]["sent"], 0, "what is held is not asked for again");
}

#[test]
fn somebody_who_watches_gets_a_page_and_ends_it_with_a_signal() {
    let mut child = demo(&["--speed", "200"]).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut out = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    out.read_line(&mut line).unwrap();
    let url = line.trim().strip_prefix("Page:").unwrap().trim();
    let (address, token) = url.strip_prefix("http://").unwrap().split_once("/#token=").unwrap();
    assert!(token.len() >= 32);
    let mut stream = std::net::TcpStream::connect(address).unwrap();
    write!(stream, "GET /api/v1/station HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200") && answer.contains("pixelsat-1"), "{answer}");
    kill_process(Pid::from_raw(child.id().try_into().unwrap()).unwrap(), Signal::INT).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
}
