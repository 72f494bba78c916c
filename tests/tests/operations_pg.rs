//! The verbs of whoever looks after a station whose archive is a PostgreSQL.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::process::Command;
use std::time::Duration;

use end_to_end::process::{gs_server, run};
use end_to_end::wait::until;
use end_to_end::{Folder, Server, Twin};
use migrations::cluster::Database;
use serde_json::Value;

fn verb<const N: usize>(folder: &Folder, words: [&str; N]) -> (i32, String, String) {
    let mut command = gs_server(words);
    command.arg("--config").arg(folder.write_config());
    run(command)
}

fn finding(folder: &Folder, check: &str) -> (i32, Value) {
    let (code, out, error) = verb(folder, ["doctor", "--json"]);
    let report: Value = serde_json::from_str(&out).expect(&error);
    let findings = report["findings"].as_array().expect("findings");
    (code, findings.iter().find(|finding| finding["check"] == check).cloned().unwrap_or_default())
}

fn told(finding: &Value) -> &str {
    finding["found"].as_str().unwrap_or_default()
}

fn run_it(command: &mut Command) -> i32 {
    let status = command.status().expect("PostgreSQL's tools");
    status.code().unwrap_or(-1)
}

#[test]
fn audit_doctor_backup_and_redecode_know_a_postgresql() {
    let database = Database::fresh().expect("a database");
    let address = database.address().expect("an address");
    let mut folder = Folder::new();
    folder.heartbeat_s = 5;
    folder.storage = format!("database = \"{address}\"\n");

    let (_, empty) = finding(&folder, "database");
    assert_eq!(empty["verdict"], "ok", "{empty}");
    assert!(told(&empty).contains("is empty"), "{empty}");

    let _twin = Twin::start(&folder, &[]);
    let server = Server::start(&folder);
    let body = r#"{"command":"Ping"}"#;
    for key in ["a", "b", "c"] {
        assert_eq!(server.client.post("/api/v1/commands", key, body).expect("an answer").status, 201);
    }
    until("a heartbeat came", Duration::from_secs(60), || {
        let frames = server.client.all::<Value>("/api/v1/frames");
        (!frames.is_empty()).then_some(())
    });
    // Beside the server.
    let (code, listed, error) = verb(&folder, ["audit", "list"]);
    assert_eq!(code, 0, "{error}");
    assert!(listed.matches("command.create").count() == 3, "{listed}");
    let (code, verdict, error) = verb(&folder, ["audit", "verify"]);
    assert_eq!(code, 0, "{error}");
    assert!(verdict.contains("all as they were written") && verdict.contains("head "), "{verdict}");
    let (_, found) = finding(&folder, "database");
    assert_eq!(found["verdict"], "ok", "{found}");
    for word in ["bench", "schema ", "PostgreSQL 1"] {
        assert!(told(&found).contains(word), "{word}: {found}");
    }
    let (_, clock) = finding(&folder, "database's clock");
    assert_eq!(clock["verdict"], "ok", "{clock}");
    // The server of the tests forgets on purpose.
    let (code, disk) = finding(&folder, "database's disk");
    assert_eq!((code, &disk["verdict"]), (1, &Value::from("warning")), "{disk}");
    assert!(told(&disk).contains("fsync = off"), "{disk}");
    let (code, _, error) = verb(&folder, ["redecode"]);
    assert_eq!(code, 3, "the station is at work: {error}");
    let text = end_to_end::reports::log(0, 3);
    let items: Vec<Value> = text
        .lines()
        .filter_map(|line| line.split_once(' '))
        .map(|(topic, body)| serde_json::json!({"format": "json", "topic": topic, "text": body}))
        .collect();
    let body = serde_json::json!({ "items": items }).to_string();
    let answer = server.client.post("/api/v1/receptions", "reports", &body).expect("an answer");
    assert_eq!(answer.status, 200, "{}", answer.text());
    let (code, beside, error) = verb(&folder, ["export", "--receptions", "--own"]);
    assert_eq!(code, 0, "{error}");
    assert!(beside.lines().count() > 15, "15 reports, and what the station heard: {beside}");
    assert_eq!(beside.matches("\"source\":\"own-mqtt\"").count(), 15, "{beside}");
    server.stop();
    let (code, alone, error) = verb(&folder, ["export", "--receptions"]);
    assert_eq!((code, alone.lines().count()), (0, 15), "{error}");
    assert!(beside.starts_with(&alone), "the same, without a server");

    let (code, out, error) = verb(&folder, ["redecode", "--json"]);
    assert_eq!(code, 0, "{error}");
    let report: Value = serde_json::from_str(&out).expect("JSON");
    assert!(report["frames"].as_u64() >= Some(1) && report["damaged"] == 0, "{report}");
    let target = folder.file("ground.tar");
    let (code, _, error) = verb(&folder, ["backup", target.to_str().expect("a name")]);
    assert_eq!(code, 3, "{error}");
    assert!(error.contains(&format!("pg_dump --format=custom --file=ground.dump {address}")), "{error}");
    assert!(!target.exists());

    // The archive goes to another database by PostgreSQL's own tools, and is whole there.
    let other = Database::fresh().expect("a database");
    let other_address = other.address().expect("an address");
    let dump = folder.file("ground.dump");
    let mut command = Command::new("pg_dump");
    assert_eq!(run_it(command.arg("--format=custom").arg("--file").arg(&dump).arg(&address)), 0);
    let mut command = Command::new("pg_restore");
    command.args(["--no-owner", "--exit-on-error", "--dbname", &other_address]).arg(&dump);
    assert_eq!(run_it(&mut command), 0);
    folder.storage = format!("database = \"{other_address}\"\n");
    let (_, found) = finding(&folder, "database");
    assert_eq!(found["verdict"], "ok", "{found}");
    let (code, again, error) = verb(&folder, ["audit", "verify"]);
    assert_eq!(code, 0, "{again} {error}");
    let server = Server::start(&folder);
    assert!(!server.client.all::<Value>("/api/v1/frames").is_empty());
    server.stop();
    folder.storage = format!("database = \"{address}\"\n");

    database.tamper_with_the_audit(2).expect("somebody tampers");
    let (code, verdict, error) = verb(&folder, ["audit", "verify"]);
    assert_eq!(code, 1, "{verdict}");
    assert!(error.contains("row of audit") && error.contains('2'), "{error}");

    // A newer program was here; then the database is gone.
    database.pretend_a_newer_schema().expect("told");
    let (_, newer) = finding(&folder, "database");
    assert_eq!(newer["verdict"], "warning", "{newer}");
    assert!(told(&newer).contains("schema 999"), "{newer}");
    folder.storage = "database = \"postgres://ground@127.0.0.1:1/ground\"\n".into();
    let (code, away) = finding(&folder, "database");
    assert_eq!((code, &away["verdict"]), (1, &Value::from("warning")), "{away}");
    assert!(told(&away).contains("does not answer"), "{away}");
}
