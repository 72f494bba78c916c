//! Durable before radiated, as the operating system saw it: strace watches the first telecommand from its commit to
//! the write to the port.
#![expect(clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::process::{Command, Stdio};

use api::{CommandView, Outcome};
use end_to_end::strace::{Call, calls};
use end_to_end::wait::{PATIENCE, until};
use end_to_end::{Folder, Server, Twin, binary};

const SYNC: [&str; 2] = ["fsync", "fdatasync"];
const RENAME: [&str; 3] = ["rename", "renameat", "renameat2"];
const WRITE: [&str; 2] = ["write", "pwrite64"];

#[test]
fn database_then_witness_are_on_the_disk_before_the_port_is_written() {
    if let Err(why) = strace_works() {
        eprintln!(
            "\n*** SKIPPED: strace cannot watch a process here ({why}). The order of writes was NOT checked. ***\n"
        );
        return;
    }
    let mut folder = Folder::new();
    folder.speed = Some(5.0);
    folder.heartbeat_s = 10;
    let _twin = Twin::start(&folder, &[]);
    let trace = folder.file("trace");
    let mut command = Command::new("strace");
    // -D: the server is our child, and strace goes when it goes. Whole pages are shown, to find what lies in them.
    command.args(["-D", "-f", "-tt", "-y", "-s", "5000", "-e"]);
    command
        .arg("trace=openat,write,pwrite64,fsync,fdatasync,rename,renameat,renameat2")
        .arg("-o")
        .arg(&trace);
    command.arg(binary::gs_server()).args(["serve", "--config"]).arg(folder.write_config());
    let mut server = Server::start_by(&folder, command);
    let answer = server.client.post("/api/v1/commands", "ping", r#"{"command":"Ping"}"#).expect("an answer");
    let ping = answer.json::<Outcome>().command.expect("a command");
    until("Pong", 2 * PATIENCE, || {
        let command: CommandView = server.client.read(&format!("/api/v1/commands/{ping}"));
        (command.stage == "answered").then_some(())
    });
    server.process.terminate();
    let read = || {
        std::fs::read(&trace).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default()
    };
    let (text, _) =
        until("strace is done", PATIENCE, || Some(read()).filter(|text| text.contains("+++ exited")));
    check(&calls(&text));
}

fn check(calls: &[Call]) {
    let find = |what: &str, test: &dyn Fn(&Call) -> bool| {
        calls.iter().find(|call| test(call)).unwrap_or_else(|| panic!("not in the trace: {what}"))
    };
    let wal = "ground.sqlite3-wal>";
    let port = find("a telecommand written to the port", &|c| {
        c.is(&["write"], "</dev/pts/") && c.arguments.contains("DESTINY_")
    });

    // 1. The sealed bytes are written to the database's log, and the log is synced.
    let sealed = find("sealed bytes in the log", &|c| c.is(&WRITE, wal) && c.arguments.contains("DESTINY_"));
    let sealed_synced = find("a sync of the log after them", &|c| c.is(&SYNC, wal) && c.began > sealed.ended);

    // 2. The witness: a new file, synced, renamed, its folder synced.
    let is_new = |call: &Call| call.arguments.contains("/witness/") && call.arguments.contains(".new");
    let opened =
        find("a new witness", &|c| c.name == "openat" && is_new(c) && c.arguments.contains("O_CREAT"));
    let written = find("its line", &|c| c.name == "write" && is_new(c) && c.began > opened.ended);
    let synced =
        find("its sync", &|c| SYNC.contains(&c.name.as_str()) && is_new(c) && c.began > written.ended);
    let renamed =
        find("its rename", &|c| RENAME.contains(&c.name.as_str()) && is_new(c) && c.began > synced.ended);
    let folder = find("the sync of its folder", &|c| c.is(&SYNC, "/witness>") && c.began > renamed.ended);

    // 3. The command is marked as radiating, and the log is synced.
    let marked = find("the mark in the log", &|c| c.is(&WRITE, wal) && c.arguments.contains("handed to pty"));
    let mark_synced = find("a sync of the log after it", &|c| c.is(&SYNC, wal) && c.began > marked.ended);

    let order = [
        ("sealed bytes in the log", sealed),
        ("log synced", sealed_synced),
        ("witness opened", opened),
        ("witness written", written),
        ("witness synced", synced),
        ("witness renamed", renamed),
        ("witness folder synced", folder),
        ("mark in the log", marked),
        ("log synced", mark_synced),
        ("port written", port),
    ];
    for pair in order.windows(2) {
        let [(first, one), (second, other)] = pair else { continue };
        assert!(one.ended < other.began, "{second} before {first}: {other:?} {one:?}");
    }
    eprintln!("{}", order.map(|(what, call)| format!("{what} @{}", call.began)).join(", "));
}

fn strace_works() -> Result<(), String> {
    let mut command = Command::new("strace");
    command.args(["-f", "-o", "/dev/null", "true"]).stderr(Stdio::null());
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(status.to_string()),
        Err(error) => Err(error.to_string()),
    }
}
