//! A server as whoever looks after the machine sees it: doctor, metrics, backups that it takes by itself.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt as _;
use std::time::Duration;

use end_to_end::process::{gs_server, run};
use end_to_end::wait::{PATIENCE, until};
use end_to_end::{Folder, Server, Twin};
use serde_json::Value;

fn doctor(folder: &Folder) -> (i32, Value) {
    let mut command = gs_server(["doctor", "--json", "--config"]);
    command.arg(folder.write_config());
    let (code, out, error) = run(command);
    (code, serde_json::from_str(&out).unwrap_or(Value::String(error)))
}

fn finding<'a>(report: &'a Value, check: &str) -> &'a Value {
    let findings = report["findings"].as_array().expect("findings");
    findings.iter().rev().find(|finding| finding["check"] == check).unwrap_or(&Value::Null)
}

#[test]
fn the_doctor_finds_what_is_wrong_and_says_what_to_do() {
    let folder = Folder::new();
    let twin = Twin::start(&folder, &[]);
    let (code, report) = doctor(&folder);
    assert_eq!(code, 0, "{report:#}");
    assert_eq!(finding(&report, "data folder")["verdict"], "watch", "there is none yet: {report:#}");
    let server = Server::start(&folder);
    let (code, report) = doctor(&folder);
    assert_eq!(code, 0, "{report:#}");
    assert!(
        finding(&report, "server")["found"].as_str().is_some_and(|found| found.contains("ready")),
        "{report:#}"
    );
    assert_eq!(finding(&report, "database")["verdict"], "ok", "{report:#}");
    server.stop();
    drop(twin);

    // One fault after the other; each is named, and its remedy.
    std::fs::set_permissions(folder.data(), Permissions::from_mode(0o755)).expect("a mode");
    std::fs::set_permissions(folder.file("twin.key"), Permissions::from_mode(0o644)).expect("a mode");
    let _ = std::fs::remove_file(folder.port());
    let _taken = std::net::TcpListener::bind(folder.address).expect("the server's port");
    let (code, report) = doctor(&folder);
    assert_eq!(code, 1, "{report:#}");
    for check in ["data folder", "key of sat", "port of pty", "server"] {
        let found = report["findings"].as_array().expect("findings").iter().any(|finding| {
            finding["check"] == check && finding["verdict"] == "warning" && finding["remedy"].is_string()
        });
        assert!(found, "{check}: {report:#}");
    }
    let mut bytes = std::fs::read(folder.data().join("ground.sqlite3")).expect("a database");
    let at = bytes.windows(5).position(|five| five == b"bench").expect("the station's name");
    bytes[at] ^= 1;
    std::fs::write(folder.data().join("ground.sqlite3"), bytes).expect("written");
    let (code, report) = doctor(&folder);
    assert_eq!((code, &finding(&report, "database")["verdict"]), (1, &Value::from("warning")), "{report:#}");
    let mut command = gs_server(["doctor", "--config"]);
    command.arg(folder.file("nowhere.toml"));
    assert_eq!(run(command).0, 1);
}

#[test]
fn a_server_takes_its_backups_and_tells_how_it_is() {
    let mut folder = Folder::new();
    folder.heartbeat_s = 5;
    folder.storage = format!("[backup]\nfolder = \"{}\"\nkeep = 3\n", folder.file("safe").display());
    let _twin = Twin::start(&folder, &[]);
    let server = Server::start(&folder);
    let metrics = || server.client.get("/metrics").expect("metrics").text();
    let value = |name: &str| -> Option<f64> {
        metrics().lines().find(|line| line.split(' ').next() == Some(name))?.rsplit_once(' ')?.1.parse().ok()
    };
    until("a backup is taken", PATIENCE, || value("gs_backup_timestamp_seconds").map(drop));
    let backups: Vec<_> =
        folder.file("safe").read_dir().expect("a folder").flatten().map(|e| e.path()).collect();
    assert_eq!(backups.len(), 1, "{backups:?}");
    let mut verify = gs_server(["backup", "verify"]);
    verify.arg(&backups[0]);
    assert_eq!(run(verify).0, 0);
    let frames = "gs_stored_frames_total{satellite=\"sat\",link=\"pty\"}";
    until("a frame is stored", Duration::from_secs(60), || value(frames).filter(|count| *count >= 1.0));
    assert_eq!(value("gs_link_up{satellite=\"sat\",link=\"pty\"}"), Some(1.0), "{}", metrics());
    assert!(value("gs_engine_input_seconds_count") > Some(0.0), "{}", metrics());
    assert!(value("gs_disk_free_bytes") > Some(0.0) && value("gs_disk_level").is_some());
    assert_eq!(server.client.get("/readyz").expect("an answer").status, 200);
    server.stop();
    // A start is no reason for another one: the day is not over.
    let server = Server::start(&folder);
    until("the disk was looked at", PATIENCE, || {
        let text = server.client.get("/metrics").expect("metrics").text();
        text.contains("\ngs_disk_level ").then_some(())
    });
    assert_eq!(folder.file("safe").read_dir().expect("a folder").count(), 1);
    server.stop();
}

#[test]
fn systemd_hears_that_it_is_ready_that_it_lives_and_that_it_stops() {
    let folder = Folder::new();
    let path = folder.file("notify");
    let socket = std::os::unix::net::UnixDatagram::bind(&path).expect("a socket");
    socket.set_read_timeout(Some(PATIENCE)).expect("a time-out");
    let next = || {
        let mut buffer = [0; 256];
        let count = socket.recv(&mut buffer).expect("the server says something");
        String::from_utf8_lossy(&buffer[..count]).trim().to_owned()
    };
    let mut command = gs_server(["serve", "--config"]);
    command.arg(folder.write_config()).env("NOTIFY_SOCKET", &path).env("WATCHDOG_USEC", "400000");
    let server = Server::start_by(&folder, command);
    assert_eq!(next(), "READY=1");
    assert_eq!((next(), next()), ("WATCHDOG=1".to_owned(), "WATCHDOG=1".to_owned()));
    server.stop();
    let last = std::iter::repeat_with(next).find(|word| word != "WATCHDOG=1");
    assert_eq!(last.as_deref(), Some("STOPPING=1"));
}
