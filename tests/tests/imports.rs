//! Reports of others through the real doors: `gs-server import`, `gs-server export` and `POST /receptions`, with a server
//! and without one, broken off and begun again, and wrong in every way.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use end_to_end::process::{gs_server, run};
use end_to_end::reports::{heartbeat, hex, log, rx};
use end_to_end::wait::{pause, until};
use end_to_end::{Folder, Process, Server};
use rustix::process::Signal;
use serde_json::{Value, json};

fn import(folder: &Folder, arguments: &[&str]) -> Command {
    let mut command = gs_server(["import", "--config"]);
    command.arg(folder.write_config()).args(arguments);
    command
}

/// The import's one line of JSON.
fn imported(folder: &Folder, file: &Path) -> Value {
    let (code, out, error) = run(import(folder, &["--json", &file.display().to_string()]));
    assert_eq!(code, 0, "{out}{error}");
    assert_eq!(out.lines().count(), 1, "{out}");
    serde_json::from_str(&out).expect("JSON")
}

fn counts(done: &Value) -> [u64; 5] {
    ["frames", "merged", "without_frame", "repeated", "refused"]
        .map(|name| done[name].as_u64().expect("a count"))
}

/// What the archive says of all receptions, but for when they came in: lines in order.
fn archive(folder: &Folder) -> Vec<String> {
    let mut command = gs_server(["export", "--receptions", "--config"]);
    command.arg(folder.write_config());
    let (code, out, error) = run(command);
    assert!(code == 0 || out.is_empty(), "{error}");
    let mut lines: Vec<String> = out.lines().map(str::to_owned).collect();
    lines.sort_unstable();
    lines
}

fn written(folder: &Folder, name: &str, text: impl AsRef<[u8]>) -> std::path::PathBuf {
    let path = folder.file(name);
    std::fs::write(&path, text).expect("a file");
    path
}

#[test]
fn without_a_server_and_with_one_the_same_is_stored_and_nothing_twice() {
    let (alone, beside) = (Folder::new(), Folder::new());
    let text = format!("{}{{\"data\":1}}\nhello\n", log(0, 60));
    let done = imported(&alone, &written(&alone, "a.log", &text));
    assert_eq!(counts(&done), [60, 240, 0, 0, 2], "{done}");
    assert_eq!(done["files"][0]["format"], "json");
    assert_eq!(done["stopped"], false);
    let reasons = done["reasons"].as_object().expect("reasons");
    assert_eq!(reasons.values().map(|count| count.as_u64().unwrap_or(0)).sum::<u64>(), 2, "{reasons:?}");
    assert_eq!(counts(&imported(&alone, &alone.file("a.log"))), [0, 0, 0, 300, 2]);

    let server = Server::start(&beside);
    let file = written(&beside, "a.log", &text);
    assert_eq!(counts(&imported(&beside, &file))[..4], [60, 240, 0, 0]);
    assert_eq!(counts(&imported(&beside, &file))[..4], [0, 0, 0, 300]);
    let ears: Value = server.client.read("/api/v1/ears");
    let of_file = ears["items"].as_array().and_then(|ears| ears.iter().find(|ear| ear["source"] == "file"));
    let of_file = of_file.expect("what was imported");
    assert_eq!(of_file["taken"]["frames"], 60, "{ears}");
    assert_eq!(of_file["refused"], json!({"no-bytes": 2}), "what is no object never left: {ears}");
    // The export reads beside the server.
    assert_eq!(archive(&beside), archive(&alone));
    assert_eq!(archive(&alone).len(), 300);
    server.stop();
    assert_eq!(archive(&beside), archive(&alone));
}

#[test]
fn what_is_exported_can_be_imported_and_exported_again() {
    let named = || {
        let mut folder = Folder::new();
        folder.satellite = "aliases = [\"PixelSat-I\"]\n".to_owned();
        folder
    };
    let (first, second, third) = (named(), named(), named());
    let mut damaged = heartbeat(77);
    damaged[50] ^= 8;
    let text = format!(
        "{}{}{}",
        log(0, 40),
        rx("roof", &damaged, 1_781_000_000_000_000),
        rx("roof", b"Error_CRC", 1_781_000_001_000_000)
    );
    imported(&first, &written(&first, "a.log", text));
    let exported = archive(&first);
    assert_eq!(exported.len(), 202);
    let done = imported(&second, &written(&second, "b.ndjson", exported.join("\n")));
    assert_eq!(counts(&done), [40, 160, 2, 0, 0], "{done}");
    imported(&third, &written(&third, "c.ndjson", archive(&second).join("\n")));
    assert_eq!(archive(&third), archive(&second), "byte for byte");
    // Also how the time is known, and how far off it may be: an estimate does not become a statement by being carried.
    assert_eq!(archive(&second), exported);
    let bases = |lines: &[String]| -> std::collections::BTreeSet<(String, String)> {
        let parsed = lines.iter().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        parsed.map(|line| (line["time_basis"].to_string(), line["time_error_s"].to_string())).collect()
    };
    let board_alone = ("\"board-alone\"".to_owned(), "null".to_owned());
    assert_eq!(
        bases(&exported).into_iter().collect::<Vec<_>>(),
        [board_alone],
        "no clock stands beside a file's"
    );
    // And the first takes its own export for what it is.
    let file = first.file("own.ndjson");
    let mut command = gs_server(["export", "--receptions", "--config"]);
    command.arg(first.write_config()).arg("--output").arg(&file);
    assert_eq!(run(command).0, 0);
    assert_eq!(counts(&imported(&first, &file)), [0, 0, 0, 202, 0]);

    let mut command = gs_server(["export", "--receptions", "--format", "csv", "--config"]);
    command.arg(first.write_config());
    let (code, out, _) = run(command);
    assert_eq!((code, out.lines().count()), (0, 203));
    let columns: Vec<usize> = out.lines().map(|line| line.split(',').count()).collect();
    assert!(columns.iter().all(|count| *count == columns[0]), "{columns:?}");
}

#[test]
fn an_import_that_was_killed_and_begun_again_is_as_if_nothing_had_been() {
    let (whole, broken) = (Folder::new(), Folder::new());
    let text = log(0, 4_000);
    imported(&whole, &written(&whole, "a.log", &text));
    let file = written(&broken, "a.log", &text);
    let database = broken.data().join("ground.sqlite3-wal");
    for kill in 0..4 {
        let mut command = import(&broken, &["--json", &file.display().to_string()]);
        command.stdout(Stdio::null());
        let mut process = Process::start(command, &broken.file("import.log"));
        // Somewhere in the middle: when it has written something, and some more.
        let _ = until("something is written", Duration::from_secs(60), || {
            let grown = std::fs::metadata(&database).is_ok_and(|found| found.len() > 1 << 20);
            (grown || process.ended().is_some()).then_some(())
        });
        pause(Duration::from_millis(60 * kill));
        process.kill9();
    }
    let done = imported(&broken, &file);
    let [frames, merged, _, repeated, _] = counts(&done);
    assert_eq!(frames + merged + repeated, 20_000, "{done}");
    assert_eq!(archive(&broken), archive(&whole));
    assert_eq!(values(&broken), values(&whole));
}

/// All values of the archive, by a server that runs for the moment.
fn values(folder: &Folder) -> Value {
    let server = Server::start(folder);
    let values: Value = server.client.read("/api/v1/telemetry/latest?satellite=sat");
    server.stop();
    let mut values = values;
    // Numbers of frames may differ.
    if let Some(items) = values["items"].as_array_mut() {
        items.iter_mut().filter_map(Value::as_object_mut).for_each(|item| drop(item.remove("frame")));
    }
    values
}

#[test]
fn ctrl_c_ends_after_what_is_being_stored_and_the_next_import_goes_on() {
    let folder = Folder::new();
    let file = written(&folder, "a.log", log(0, 20_000));
    let mut command = import(&folder, &["--json", &file.display().to_string()]);
    command.stdout(std::fs::File::create(folder.file("out")).expect("a file"));
    let mut process = Process::start(command, &folder.file("import.log"));
    let database = folder.data().join("ground.sqlite3-wal");
    until("something is written", Duration::from_secs(60), || {
        std::fs::metadata(&database).is_ok_and(|found| found.len() > 1 << 20).then_some(())
    });
    process.signal(Signal::INT);
    assert_eq!(process.wait().code(), Some(1), "{}", process.log());
    assert!(process.log().contains("goes on"), "{}", process.log());
    let out = std::fs::read_to_string(folder.file("out")).expect("its output");
    let done: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(done["stopped"], true);
    let before: u64 = counts(&done).iter().sum();
    assert!(before > 0 && before < 100_000, "{done}");
    assert_eq!(archive(&folder).len() as u64, before, "what it told is stored, and nothing else");
    let [frames, merged, _, repeated, _] = counts(&imported(&folder, &file));
    assert_eq!((repeated, frames + merged), (before, 100_000 - before));
}

#[test]
fn what_cannot_be_imported_says_so() {
    let folder = Folder::new();
    let fails = |arguments: &[&str], code: i32, words: &str| {
        let (found, out, error) = run(import(&folder, arguments));
        assert_eq!(found, code, "{arguments:?}: {out}{error}");
        assert!(error.contains(words), "{arguments:?}: {error}");
    };
    let path = |name: &str, text: &[u8]| written(&folder, name, text).display().to_string();
    fails(&["no-such-file"], 1, "no-such-file");
    fails(&[&path("empty", b"")], 1, "empty");
    fails(&[&path("text", b"nothing of ours, in words\n")], 1, "refused");
    fails(&[&path("noise", &[0, 159, 146, 150, 7, 7, 7])], 1, "");
    fails(&[&path("test", br#"{"data":"VGlueUdTLXRlc3QgMQ=="}"#)], 1, "test packet");
    fails(&["--satellite", "nobody", &path("a", b"{}")], 2, "--satellite must be one of: sat");
    fails(&["--format", "wav", &path("a", b"{}")], 2, "wav");
    fails(&[], 2, "FILE");
    let mut command = gs_server(["import", "--config", "no-such.toml", "a"]);
    command.current_dir(folder.path());
    assert_eq!(run(command).0, 2);
    // A good file after a bad one is not taken: the order is the caller's. A good one alone is.
    let line = format!("{}\n", hex(&heartbeat(9)));
    let (code, out, _) = run(import(&folder, &["--receiver", "roof", &path("a.hex", line.as_bytes())]));
    assert_eq!(code, 0);
    assert!(out.contains("1 new frames"), "{out}");
    // A token that the server does not know.
    let server = Server::start(&folder);
    let token = folder.file("data/token");
    let good = std::fs::read(&token).expect("a token");
    std::fs::write(&token, "0".repeat(64)).expect("a token");
    let (code, _, error) = run(import(&folder, &[&path("a.hex", line.as_bytes())]));
    assert_eq!(code, 3, "{error}");
    std::fs::write(&token, good).expect("a token");
    server.stop();
}

#[test]
fn reports_are_handed_in_over_the_api_once() {
    let folder = Folder::new();
    let server = Server::start(&folder);
    let at = 1_785_000_000_000_000;
    let line = rx("roof", &heartbeat(5), at);
    let (topic, text) = line.trim().split_once(' ').expect("a topic");
    let item = json!({"format": "json", "topic": topic, "text": text});
    let body = json!({"satellite": "sat", "items": [item, {"format": "hex", "text": hex(&heartbeat(6))}]})
        .to_string();
    let post =
        |key: &str, body: &str| server.client.post("/api/v1/receptions", key, body).expect("an answer");
    let report = |answer: &end_to_end::http::Answer| -> [u64; 5] {
        assert_eq!(answer.status, 200, "{}", answer.text());
        counts(&answer.json())
    };
    assert_eq!(report(&post("1", &body)), [2, 0, 0, 0, 0]);
    assert_eq!(report(&post("1", &body)), [0, 0, 0, 2, 0], "the same again changes nothing");
    assert_eq!(report(&post("2", &body)), [0, 0, 0, 2, 0], "under whatever key");
    let received: Value = server.client.read("/api/v1/receptions?original=true");
    let items = received["items"].as_array().expect("items");
    assert_eq!(items.len(), 2);
    let board = items.iter().find(|item| item["source"] == "own-mqtt").expect("the board's");
    assert_eq!((board["receiver"].as_str(), board["original"].as_str()), (Some("team/roof"), Some(text)));

    for (body, problem) in [
        (r#"{"items":[{"format":"wav","text":"x"}]}"#.to_owned(), "bad-argument"),
        (r#"{"items":[{"format":"hex"}]}"#.to_owned(), "bad-argument"),
        (r#"{"items":[{"format":"hex","text":"00","hex":"00"}]}"#.to_owned(), "bad-argument"),
        (r#"{"items":[{"format":"raw","hex":"0"}]}"#.to_owned(), "bad-argument"),
        (r#"{"satellite":"nobody","items":[]}"#.to_owned(), "unknown-satellite"),
        (
            format!("{{\"items\":[{{\"format\":\"hex\",\"text\":\"{}\"}}]}}", "0".repeat(600 << 10)),
            "body-too-large",
        ),
        ("{".to_owned(), "bad-json"),
    ] {
        let answer = post("3", &body);
        assert_eq!(answer.problem(), problem, "{}", answer.text());
    }
    let nobody = end_to_end::Client { token: "0".repeat(64), ..server.client.clone() };
    let answer = nobody.post("/api/v1/receptions", "4", &body).expect("an answer");
    assert!(matches!(answer.status, 401 | 403), "{}", answer.text());
    let after: Value = server.client.read("/api/v1/receptions");
    assert_eq!(after["items"].as_array().map(Vec::len), Some(2), "nothing of that was taken");
    server.stop();
}
