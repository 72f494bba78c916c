//! Bad input against the real process: each is refused with its remedy, or survived with a record of it.
//!
//! What a test elsewhere shows as well is not shown again here:
//!
//! | bad input | here | elsewhere |
//! | --- | --- | --- |
//! | unknown port; port that goes and comes | what the process says, and what it costs | `gs-server/tests/run/serial.rs`, `serial_absent.rs` |
//! | key of the wrong length, key file 0644 | | `gs-server/tests/cli/files.rs`; other modes, links, owners: `keys.rs` |
//! | unknown configuration key | key, line, remedy at the start | `gs-server/tests/cli/files.rs` |
//! | full disk | limits of the configuration and of the shell; `kill -9` meanwhile | `gs-server/tests/run/disk.rs`; memory that is full too: `mission` |
//! | damaged database | at the start | each row with its checksum: `storage/tests` |
//! | second server on a folder, port taken | exit code and sentence | `gs-server/tests/run/start_and_end.rs` |
//! | body of the wrong shape or size | whole requests over a socket | every field: `http/tests` |
//! | witness or database rolled back | files put back | each case of the table: `mission`, `sealing.rs` |
//! | simulated key, real link | exit code and sentence | `gs-server/tests/run/start_and_end.rs` (folder and clock too) |
//! | plan with an unknown step, a critical step without approval, a limit exceeded | | `gs-server/tests/cli/plan.rs`, `http/tests/plans.rs`, each field: `plan/tests.rs` |
//! | plan longer than its pass | | `gs-server/src/plan/tests.rs`, `gs-server/tests/cli/rehearse.rs` |
//! | plan attached to a pass that moved or is gone | | `mission/tests/station/plans.rs` (`chosen_pass_that_new_elements_take_away_is_told`), `schedule/calm.rs` |
//! | rotator that refuses, position outside its limits | | `gs-server/src/hamlib/tests/rotator.rs`, `hamlib.rs` here |
//! | rotator or radio that is dead for long | | `mission/tests/station/health.rs` |
//! | stations file with a wrong field, elements without its satellite | | `gs-server/src/cli/schedule/file.rs`, `gs-server/tests/cli/schedule.rs` |
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::collections::HashMap;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use api::{CommandView, EventView, FrameView, Health};
use end_to_end::process::{gs_server, run};
use end_to_end::pty::heartbeat;
use end_to_end::wait::{PATIENCE, now, pause, until};
use end_to_end::{Client, Folder, Pty, Server, binary, folder};
use protocol::{FRAME_LEN, SealedUplink, open};

const STRAPPED: &str = "mode_pins = \"strapped\"\ntransmit_unverified = true\nrssi = false\n";
const DATABASE: &str = "ground.sqlite3";
/// Address and channel for the module, and a frame.
const ON_THE_WIRE: usize = 3 + FRAME_LEN;
/// A busy machine may take ten times as long as the promise; a test that fails at once on it helps nobody.
const SLACK: u32 = 10;

/// A station whose radio is the test itself.
fn strapped() -> Folder {
    let mut folder = Folder::new();
    folder.link = STRAPPED.to_owned();
    folder.storage = "reserve_bytes = 65536\n".to_owned();
    folder
}

/// The satellite, as far as a test plays it.
struct Radio {
    pty: Pty,
    beats: u32,
    heard: Vec<u8>,
}

impl Radio {
    fn at(folder: &Folder) -> Self {
        Self { pty: Pty::at(&folder.port()), beats: 0, heard: Vec::new() }
    }

    fn beat(&mut self) {
        self.beats += 1;
        self.pty.write(&heartbeat(self.beats * 60_000));
    }

    /// The next frame from the ground, whole: its counter and tag, as the stage `sealed` tells them.
    fn frame(&mut self) -> Option<(u64, String)> {
        self.heard.extend(self.pty.read());
        if self.heard.len() < ON_THE_WIRE {
            return None;
        }
        // The module takes address and channel off before it radiates.
        let packet: Vec<u8> = self.heard.drain(..ON_THE_WIRE).skip(ON_THE_WIRE - FRAME_LEN).collect();
        let sealed = SealedUplink::from_bytes(packet.try_into().expect("240 bytes")).expect("an uplink");
        let opened = open(&Folder::new().key(), &sealed).expect("our key");
        let counter = sealed.nonce().counter();
        Some((counter.0, format!("counter {counter}, tag {}", opened.tag().expect("a tag"))))
    }
}

fn try_ping(client: &Client, key: &str) -> end_to_end::http::Answer {
    client.post("/api/v1/commands", key, r#"{"command":"Ping"}"#).expect("an answer")
}

/// Orders a Ping, says a heartbeat, and waits for the Ping on the air; its counter.
fn ping(server: &Server, radio: &mut Radio, key: &str) -> u64 {
    let answer = try_ping(&server.client, key);
    assert_eq!(answer.status, 201, "{}", answer.text());
    radio.beat();
    until("the Ping is on the air", PATIENCE, || radio.frame()).0.0
}

fn health(client: &Client) -> (u16, Health) {
    let answer = client.get("/api/v1/health").expect("an answer");
    (answer.status, answer.json())
}

fn database(folder: &Folder) -> PathBuf {
    folder.data().join(DATABASE)
}

/// `serve` that must not become ready: exit code and what it said.
fn refused(folder: &Folder) -> (i32, String) {
    let mut command = gs_server(["serve", "--config"]);
    command.arg(folder.write_config());
    let (code, out, error) = run(command);
    assert_eq!(out, "", "it was ready");
    (code, error)
}

fn says(text: &str, wanted: &[&str]) {
    for wanted in wanted {
        assert!(text.contains(wanted), "'{wanted}' is not in: {text}");
    }
}

// ---- ports

#[test]
fn a_port_that_is_not_there_is_named_and_cheap_and_one_that_goes_is_noticed_and_taken_back() {
    let folder = strapped();
    let server = Server::start(&folder);
    let (reason, _) = until("the port is named", Duration::from_secs(1) * SLACK, || {
        let link = server.station().links.remove(0);
        link.reason.filter(|why| link.state == "unavailable" && why.contains("/radio"))
    });
    says(&reason, &[&folder.port().display().to_string(), "is not there"]);
    let (status, health) = health(&server.client);
    assert_eq!(status, 200, "a port that is away makes no server unfit");
    says(&health.reasons.join("\n"), &["link pty"]);

    for _ in 0..2 {
        let mut radio = Radio::at(&folder);
        let taken = server.until_link("ok", Duration::from_secs(2) * SLACK);
        radio.beat();
        let frames = server.station().links[0].frames;
        until("a frame is heard", PATIENCE, || (server.station().links[0].frames > frames).then_some(()));
        drop(radio);
        let noticed = server.until_link("unavailable", Duration::from_secs(1) * SLACK);

        pause(Duration::from_millis(500));
        let (began, before) = (now(), server.process.cpu());
        pause(Duration::from_secs(3));
        let share = (server.process.cpu() - before).as_secs_f64() / began.elapsed().as_secs_f64();
        eprintln!(
            "taken after {taken:.0?}, gone noticed after {noticed:.0?}, {:.1} % of a processor",
            share * 100.0
        );
        assert!(share <= 0.05 * f64::from(SLACK), "{share}");
    }
    server.stop();
}

// ---- configurations and keys

#[test]
fn an_unknown_configuration_key_is_named_with_its_line_and_its_remedy() {
    let mut folder = strapped();
    folder.link.push_str("bauds = 9600\n");
    let line =
        folder.config_text().lines().position(|line| line.starts_with("bauds")).expect("it is there") + 1;
    let (code, error) = refused(&folder);
    assert_eq!(code, 2);
    says(&error, &["station.toml", &format!("line {line}"), "bauds", "unknown", "expected one of", "`baud`"]);
    assert!(!folder.data().exists(), "nothing was made");
}

#[test]
fn a_simulated_key_is_refused_by_a_real_link_and_a_real_key_by_a_simulated_one() {
    let folder = strapped();
    let real = folder.config_text().replace("simulated = true", "simulated = false");
    let serve = || {
        let mut command = gs_server(["serve", "--config"]);
        command.arg(folder.file("other.toml"));
        run(command)
    };
    std::fs::write(folder.file("other.toml"), real).expect("a configuration");
    let (code, out, error) = serve();
    assert_eq!((code, out.as_str()), (3, ""));
    says(&error, &["twin.key", "simulated", "real", "gs-server key new"]);

    folder.write_key("twin.key", &folder::key_hex(), 0o600);
    std::fs::write(folder.file("other.toml"), folder.config_text()).expect("a configuration");
    let (code, out, error) = serve();
    assert_eq!((code, out.as_str()), (3, ""));
    says(&error, &["twin.key", "gs-server key new --simulated"]);
    assert!(!folder.data().exists(), "nothing was made");
}

// ---- folders

#[test]
fn a_second_server_on_the_same_folder_or_port_is_refused_and_the_first_goes_on() {
    let folder = strapped();
    let first = Server::start(&folder);
    let (code, error) = refused(&folder);
    assert_eq!(code, 1);
    says(&error, &[&folder.address.to_string(), "in use"]);

    let mut elsewhere = gs_server(["serve", "--listen", "127.0.0.1:0", "--config"]);
    elsewhere.arg(folder.write_config());
    let (code, out, error) = run(elsewhere);
    assert_eq!((code, out.as_str()), (3, ""));
    says(&error, &["in use by another server", &format!("process {}", first.process.pid())]);
    assert_eq!(health(&first.client).0, 200);
    first.stop();
    Server::start(&folder).stop();
}

#[test]
fn a_damaged_database_is_refused_with_what_to_do_and_left_as_it_is() {
    let folder = strapped();
    let mut radio = Radio::at(&folder);
    let server = Server::start(&folder);
    server.until_link("ok", PATIENCE);
    (0..5).for_each(|_| radio.beat());
    until("they are heard", PATIENCE, || (server.station().links[0].frames == 5).then_some(()));
    server.stop();
    let path = database(&folder);
    let good = std::fs::read(&path).expect("a database");
    let damage: [(&str, Vec<u8>); 4] = [
        ("no database at all", vec![0x55; good.len()]),
        ("cut in half", good[..good.len() / 2].to_vec()),
        ("pages of junk", {
            let mut bytes = good.clone();
            bytes[4096..8 * 4096].fill(0xA5);
            bytes
        }),
        ("empty", Vec::new()),
    ];
    for (what, bytes) in damage {
        std::fs::write(&path, &bytes).expect("damage");
        let (code, error) = refused(&folder);
        assert_eq!(code, 1, "{what}: {error}");
        says(&error, &["damaged", "backup"]);
        assert!(std::fs::read(&path).expect("it is still there") == bytes, "{what}: it was changed");
    }
    std::fs::write(&path, good).expect("the backup");
    let again = Server::start(&folder);
    assert_eq!(again.client.all::<FrameView>("/api/v1/frames").len(), 5);
    again.stop();
}

// ---- requests

#[test]
fn a_request_of_the_wrong_shape_or_size_is_a_problem_with_a_reason_and_does_nothing() {
    let folder = strapped();
    let server = Server::start(&folder);
    let client = &server.client;
    let large = format!("{{\"command\":\"{}\"}}", "P".repeat(2 << 20));
    let deep = format!("{}{}", "[".repeat(30_000), "]".repeat(30_000));
    let bodies: [(&str, u16, &str); 10] = [
        ("", 422, "wrong-shape"),
        ("{\"command\":", 400, "bad-json"),
        (&deep, 400, "bad-json"),
        ("[]", 422, "wrong-shape"),
        ("{}", 422, "wrong-shape"),
        (r#"{"command":7}"#, 422, "wrong-shape"),
        (r#"{"command":"Ping","comand":"Ping"}"#, 422, "wrong-shape"),
        (r#"{"command":"Pong"}"#, 422, "bad-argument"),
        (r#"{"command":"Ping","arguments":{"count":1}}"#, 422, "bad-argument"),
        (&large, 413, "body-too-large"),
    ];
    for (number, (body, status, kind)) in bodies.into_iter().enumerate() {
        let answer = client.post("/api/v1/commands", &format!("bad-{number}"), body).expect("an answer");
        let shown: String = body.chars().take(60).collect();
        assert_eq!((answer.status, answer.problem().as_str()), (status, kind), "{shown}: {}", answer.text());
        assert_eq!(answer.header("content-type"), Some("application/problem+json"));
        assert!(answer.body.len() < 2_000, "a problem quotes no more than it must");
    }
    let token = format!("Bearer {}", client.token);
    let good = br#"{"command":"Ping"}"#;
    let text = [("authorization", token.as_str()), ("idempotency-key", "t"), ("content-type", "text/plain")];
    let answer = client.ask("POST", "/api/v1/commands", &text, good).expect("an answer");
    assert_eq!((answer.status, answer.problem().as_str()), (415, "wrong-media-type"));
    let nobody = Client { token: "0".repeat(64), ..client.clone() };
    assert_eq!(try_ping(&nobody, "nobody").problem(), "token-refused");

    assert!(client.all::<CommandView>("/api/v1/commands").is_empty(), "something was queued");
    assert_eq!(health(client).0, 200);
    server.stop();
}

// ---- full disks

/// Fills what room there is with heartbeats, and waits until the station says that storage fails.
fn fill(server: &Server, radio: &mut Radio) -> Health {
    let filled = until("storage fails", PATIENCE, || {
        radio.beat();
        pause(Duration::from_millis(20));
        let (status, health) = health(&server.client);
        (status == 503).then_some(health)
    });
    filled.0
}

/// While storage fails: frames are heard and reserved, orders are refused, nothing is radiated, the process lives.
fn nothing_goes_out(server: &mut Server, radio: &mut Radio, health: &Health) {
    assert!(health.live && !health.ready);
    says(&health.reasons.join("\n"), &["storage:"]);
    radio.beat();
    let answer = try_ping(&server.client, "while-full");
    assert_eq!((answer.status, answer.problem().as_str()), (503, "storage-failing"), "{}", answer.text());
    // A command that may go goes within two turn-rounds after a heartbeat.
    pause(Duration::from_secs(8));
    assert_eq!(radio.frame(), None, "radiated without a record");
    assert!(radio.heard.is_empty(), "radiated without a record: {:02x?}", radio.heard);
    let storage = server.station().storage;
    assert!(storage.failing.is_some() && storage.reserved > 0 && storage.frames_lost == 0, "{storage:?}");
    assert!(server.process.ended().is_none(), "it died");
}

/// Every frame that was sent is stored once, and each frame radiated is in the archive as radiating.
fn nothing_is_missing(server: &Server, radio: &Radio, radiated: &[String]) {
    let beats = radio.beats as usize;
    until("every frame is stored", PATIENCE, || {
        (server.client.all::<FrameView>("/api/v1/frames").len() >= beats).then_some(())
    });
    let mut copies: HashMap<String, usize> = HashMap::new();
    for frame in server.client.all::<FrameView>("/api/v1/frames") {
        *copies.entry(frame.hex).or_default() += 1;
    }
    assert_eq!(copies.len(), beats);
    nothing_is_unmarked(server, radiated);
}

/// Each frame radiated is in the archive as radiating.
fn nothing_is_unmarked(server: &Server, radiated: &[String]) {
    let mut marked = Vec::new();
    for command in server.client.all::<CommandView>("/api/v1/commands") {
        let command: CommandView = server.client.read(&format!("/api/v1/commands/{}", command.id));
        let stages = command.stages.unwrap_or_default();
        if stages.iter().any(|stage| stage.stage == "radiating") {
            marked.extend(stages.into_iter().filter(|stage| stage.stage == "sealed").map(|stage| stage.why));
        }
    }
    for frame in radiated {
        assert!(marked.contains(frame), "{frame} was radiated and is not in the archive: {marked:?}");
    }
}

/// The alarm that storage failed, in the durable sequence once there is room again.
fn alarmed(client: &Client) {
    until("the alarm is in the sequence", PATIENCE, || {
        let events: Vec<EventView> = client.all("/api/v1/events");
        events.iter().any(|event| event.kind == "storage" && event.level != "normal").then_some(())
    });
}

/// The first frames of a station, one of them a command's; what was radiated.
fn in_peace(server: &Server, radio: &mut Radio) -> String {
    server.until_link("ok", PATIENCE);
    let answer = try_ping(&server.client, "in-peace");
    assert_eq!(answer.status, 201, "{}", answer.text());
    radio.beat();
    until("a Ping is on the air", PATIENCE, || radio.frame()).0.1
}

#[test]
fn a_database_at_the_limit_of_its_configuration_keeps_what_it_hears_through_kill_nine() {
    let mut folder = strapped();
    Server::start(&folder).stop();
    let pages = std::fs::metadata(database(&folder)).expect("a database").len() / 4096;
    let storage = folder.storage.clone();
    folder.storage = format!("{storage}max_page_count = {}\n", pages + 16);
    let mut radio = Radio::at(&folder);
    let mut server = Server::start(&folder);
    let radiated = in_peace(&server, &mut radio);
    let health = fill(&server, &mut radio);
    says(&health.reasons.join("\n"), &["full", "limit", "make room", "max_page_count"]);
    nothing_goes_out(&mut server, &mut radio, &health);
    let reserved = server.station().storage.reserved;
    server.process.kill9();

    folder.storage = storage;
    let server = Server::start(&folder);
    eprintln!("{} frames, {reserved} of them back from the reserve", radio.beats);
    nothing_is_missing(&server, &radio, &[radiated]);
    server.until_link("ok", PATIENCE);
    let known = ping(&server, &mut radio, "room-again");
    assert!(known > 0);
    server.stop();
}

#[test]
fn a_limit_of_the_shell_stops_the_uplink_until_it_is_lifted() {
    use rustix::process::{Pid, Resource, Rlimit, prlimit};
    let folder = strapped();
    // The log lies on the same disk: it is longer than the limit from the beginning, so not one more line fits.
    std::fs::write(folder.file("serve.log"), vec![b'\n'; 8 << 20]).expect("a long log");
    let mut radio = Radio::at(&folder);
    let mut server = Server::start(&folder);
    let radiated = in_peace(&server, &mut radio);
    let wal = folder.data().join(format!("{DATABASE}-wal"));
    let (full, _) = until("the write-ahead log is longer than the reserve", PATIENCE, || {
        radio.beat();
        pause(Duration::from_millis(20));
        let length = std::fs::metadata(&wal).map_or(0, |wal| wal.len());
        (length > 128 << 10).then_some(length)
    });
    let pid = i32::try_from(server.process.pid()).ok().and_then(Pid::from_raw).expect("a process number");
    let limited = Rlimit { current: Some(full), maximum: None };
    let before = prlimit(Some(pid), Resource::Fsize, limited).expect("a limit");
    let health = fill(&server, &mut radio);
    nothing_goes_out(&mut server, &mut radio, &health);

    prlimit(Some(pid), Resource::Fsize, before).expect("no limit");
    let (_, took) = until("it recovers by itself", PATIENCE, || {
        let status = server.client.get("/api/v1/health").expect("an answer").status;
        (status == 200).then_some(())
    });
    eprintln!("{} frames; recovered {took:.1?} after there was room", radio.beats);
    nothing_is_missing(&server, &radio, &[radiated]);
    alarmed(&server.client);
    ping(&server, &mut radio, "room-again");
    server.stop();
}

#[test]
fn a_start_under_a_limit_too_small_for_a_database_says_so() {
    let folder = strapped();
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -f 16; exec \"$0\" serve --config \"$1\""]);
    command.arg(binary::gs_server()).arg(folder.write_config()).stdin(Stdio::null());
    let (code, out, error) = run(command);
    assert_eq!((code, out.as_str()), (1, ""), "{error}");
    says(&error, &["the archive cannot be opened", "ulimit -f"]);
    // What it left behind does not stand in the way.
    Server::start(&folder).stop();
}

// ---- counters

#[test]
fn a_witness_that_went_back_is_raised_without_a_word() {
    let folder = strapped();
    let mut radio = Radio::at(&folder);
    let witness = folder.data().join("witness").join(folder.key().id().to_string());

    let server = Server::start(&folder);
    server.until_link("ok", PATIENCE);
    let first = ping(&server, &mut radio, "first");
    server.stop();
    let old = std::fs::read(&witness).expect("a witness");
    let server = Server::start(&folder);
    server.until_link("ok", PATIENCE);
    let second = ping(&server, &mut radio, "second");
    server.stop();
    let new = std::fs::read(&witness).expect("a witness");
    assert!(second > first && old != new);

    std::fs::write(&witness, old).expect("the old witness");
    let server = Server::start(&folder);
    until("it is raised", PATIENCE, || (std::fs::read(&witness).ok()? == new).then_some(()));
    assert_eq!(server.station().sealing[0].locked, None);
    let events: Vec<EventView> = server.client.all("/api/v1/events");
    let said: Vec<_> = events.iter().filter(|event| event.kind == "sealing").collect();
    assert!(said.is_empty(), "{said:?}");
    server.until_link("ok", PATIENCE);
    assert!(ping(&server, &mut radio, "third") > second);
    server.stop();
}

#[test]
fn a_database_that_went_back_seals_nothing_until_somebody_confirms_and_then_above_the_witness() {
    let folder = strapped();
    let mut radio = Radio::at(&folder);
    let server = Server::start(&folder);
    server.until_link("ok", PATIENCE);
    let first = ping(&server, &mut radio, "first");
    server.stop();
    let old = std::fs::read(database(&folder)).expect("a database");
    let server = Server::start(&folder);
    server.until_link("ok", PATIENCE);
    let second = ping(&server, &mut radio, "second");
    server.stop();
    assert!(second > first);

    std::fs::write(database(&folder), old).expect("the backup");
    for suffix in ["-wal", "-shm"] {
        // There is none after an orderly end.
        let _ = std::fs::remove_file(folder.data().join(format!("{DATABASE}{suffix}")));
    }
    let server = Server::start(&folder);
    server.until_link("ok", PATIENCE);
    let locked = server.station().sealing[0].locked.clone().expect("sealing is locked");
    says(&locked, &[&second.to_string(), "witness", "database", "Confirm"]);
    until("the alarm", PATIENCE, || {
        let events: Vec<EventView> = server.client.all("/api/v1/events");
        events.iter().any(|event| event.kind == "sealing" && event.level == "critical").then_some(())
    });
    let answer = try_ping(&server.client, "third");
    radio.beat();
    pause(Duration::from_secs(8));
    assert_eq!(radio.frame(), None, "sealed without confirmation");

    let path = format!("/api/v1/keys/{}/confirm-counter", folder.key().id());
    let confirmed = server.client.post(&path, "confirm", "{}").expect("an answer");
    assert!(matches!(confirmed.status, 200 | 201), "{}", confirmed.text());
    until("sealing is open", PATIENCE, || server.station().sealing[0].locked.is_none().then_some(()));
    let again = server.client.post(&path, "confirm-again", "{}").expect("an answer");
    assert_eq!(again.problem(), "not-locked");
    if answer.status != 201 {
        assert!(ping(&server, &mut radio, "fourth") > second);
    } else {
        // The backup knows nothing of an end of the first Ping either: which of the two goes first does not matter.
        radio.beat();
        let ((third, why), _) = until("a command that waited goes out", PATIENCE, || radio.frame());
        assert!(third > second, "{third} after {second}");
        nothing_is_unmarked(&server, &[why]);
    }
    server.stop();
}
