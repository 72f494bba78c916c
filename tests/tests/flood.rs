//! Ten thousand reports a second for ten seconds, and whatever else is sent to break a reader, to a real server whose
//! radio goes on hearing.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::collections::BTreeSet;
use std::io::Write as _;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use end_to_end::crowd::peak_kib;
use end_to_end::folder::free_address;
use end_to_end::mqtt::{Board, publish};
use end_to_end::process::{gs_server, run};
use end_to_end::reports::{chunk, heartbeat, hex, log, rx};
use end_to_end::wait::{now, pause, until, utc_us};
use end_to_end::{Folder, Server};
use serde_json::{Value, json};

/// Reports that are offered in a second.
const RATE: u64 = 10_000;
/// Reports of a delivery.
const TOGETHER: usize = 250;
/// Those who deliver.
const SENDERS: usize = 8;
/// Boards that publish.
const BOARDS: u64 = 4;
/// What the server may grow by.
const GROWTH_KIB: u64 = 16 << 10;

/// A server whose radio is a port of ours, and the other end of it.
fn with_radio(folder: &Folder) -> (Server, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let text = folder.config_text();
    let (before, rest) = text.split_once("[[links]]").expect("a link");
    let (_, after) = rest.split_once("[storage]").expect("storage");
    let link = format!(
        "[[links]]\nname = \"radio\"\nsatellite = \"sat\"\nkind = \"tcp\"\nconnect = \"{address}\"\nsimulated = true\nrssi = false\n"
    );
    let path = folder.file("station.toml");
    std::fs::write(&path, format!("{before}{link}[storage]{after}")).expect("a configuration");
    let mut command = gs_server(["serve", "--config"]);
    command.arg(path);
    let server = Server::start_by(folder, command);
    let (radio, _) = listener.accept().expect("the server's connection");
    (server, radio)
}

/// Messages of every kind; which, its number decides.
fn message(number: u64) -> String {
    let at_us = 1_780_000_000_000_000 + i64::try_from(number % 50_000_000).unwrap_or(0) * 1_000_000;
    let rx = |station: &str, frame: &[u8], at_us: i64| {
        rx(station, frame, at_us).split_once(' ').map_or(String::new(), |(_, body)| body.trim_end().into())
    };
    match number % 20 {
        0 => "{\"data\":7}".to_owned(),
        1 => "x".repeat(100),
        2 => format!("{{\"raw\":{}", "[".repeat(200)),
        3 => "{\"data\":\"not base64!\",\"crc_error\":false}".to_owned(),
        4 => rx("a", b"TinyGS-test", at_us),
        5 => rx("a", b"somebody else's", at_us),
        // A clock of 1970 and one of 2090.
        6 => rx("b", &heartbeat(number as u32), 31_000_000),
        7 => rx("b", &heartbeat(number as u32), 3_800_000_000_000_000),
        8..12 => rx("c", &heartbeat(number as u32), at_us),
        _ => rx("d", &chunk((number % 3_000) as u16, (number / 3_000) as u8), at_us),
    }
}

/// A message as an item of a delivery.
fn item(text: &str) -> Value {
    json!({"format": "json", "text": text})
}

/// What is counted of this source; nothing yet where nothing came.
fn counts_of(server: &Server, source: &str) -> Value {
    let ears = server.client.read::<Value>("/api/v1/ears");
    let mut ears = ears["items"].as_array().cloned().unwrap_or_default();
    ears.retain(|ear| ear["source"] == source);
    ears.pop().unwrap_or_default()
}

/// Refusals by reason, all of them.
fn refused(server: &Server, source: &str) -> (u64, Value) {
    let reasons = counts_of(server, source)["refused"].clone();
    let sum = reasons.as_object().map_or(0, |reasons| reasons.values().filter_map(Value::as_u64).sum());
    (sum, reasons)
}

/// What happens while it rains reports: the radio hears a frame every 50 ms, and all of them are to be in the archive.
struct Flood {
    server: Server,
    radio: TcpStream,
    sent: u32,
    before_kib: u64,
    taken_before: u64,
    refused_before: u64,
}

impl Flood {
    /// Begins to count when pools and caches are filled: what some thousand different reports, an hour of a network, leave
    /// behind.
    fn begin(server: Server, radio: TcpStream, source: &str) -> Self {
        for turn in 0..24_u64 {
            let first = (1_000_000 + turn) * TOGETHER as u64;
            let items: Vec<Value> =
                (first..first + TOGETHER as u64).map(|number| item(&message(number))).collect();
            let warm = json!({ "items": items }).to_string();
            let answer = server.client.post("/api/v1/receptions", &format!("warm-{turn}"), &warm);
            let answer = answer.expect("an answer");
            assert_eq!(answer.status, 200, "{}", answer.text());
        }
        let pid = server.process.pid();
        // The peak begins anew from what it has now.
        std::fs::write(format!("/proc/{pid}/clear_refs"), "5").expect("procfs");
        let before_kib = peak_kib(pid);
        let (taken_before, refused_before) = (taken(&server, source), refused(&server, source).0);
        Self { server, radio, sent: 0, before_kib, taken_before, refused_before }
    }

    /// The radio hears, for so long.
    fn hear(&mut self, began: Instant, seconds: u64) {
        while began.elapsed() < Duration::from_secs(seconds) {
            self.radio.write_all(&heartbeat(4_000_000_000 + self.sent)).expect("the radio's line");
            self.sent += 1;
            pause(Duration::from_millis(50));
        }
    }

    fn grown_kib(&self) -> u64 {
        peak_kib(self.server.process.pid()).saturating_sub(self.before_kib)
    }

    /// Everything that the radio heard is there, memory was kept, and nothing panicked.
    fn end(self, grown_kib: u64, offered: u64, seconds: u64, words: &str) {
        let server = self.server;
        until("the radio's frames are stored", Duration::from_secs(20), || {
            (own(&server) == u64::from(self.sent)).then_some(())
        });
        let delay_s = engine_delay_s(&server);
        println!(
            "{offered} offered in {seconds} s, {words}; {} frames by radio, all stored, 99 of 100 at the engine within \
             {delay_s} s; memory grew by {grown_kib} KiB from {} KiB",
            self.sent, self.before_kib
        );
        assert!(offered * 100 >= seconds * RATE * 95, "only {offered} were offered in {seconds} s");
        assert!(grown_kib <= GROWTH_KIB, "{grown_kib} KiB");
        assert!(!server.process.log().contains("panicked"), "{}", server.process.log());
        server.stop();
    }
}

/// How long it rains, seconds.
fn seconds() -> u64 {
    std::env::var("FLOOD_S").ok().and_then(|seconds| seconds.parse().ok()).unwrap_or(10)
}

#[test]
fn a_flood_of_lies_over_http_costs_the_radio_nothing_and_little_memory() {
    let seconds = seconds();
    let folder = Folder::new();
    let (server, radio) = with_radio(&folder);
    let mut flood = Flood::begin(server, radio, "file");
    let deliveries = seconds * RATE / TOGETHER as u64;
    let bodies: Vec<String> = (1..=deliveries)
        .map(|delivery| {
            let first = delivery * TOGETHER as u64;
            let items: Vec<Value> =
                (first..first + TOGETHER as u64).map(|number| item(&message(number))).collect();
            json!({ "items": items }).to_string()
        })
        .collect();
    let (bodies, next) = (Arc::new(bodies), Arc::new(AtomicU64::new(0)));
    let [offered, read, turned_away] = [0; 3].map(|_| Arc::new(AtomicU64::new(0)));
    let began = now();
    // Each takes the next delivery when it is due, however long another has been waiting for its answer.
    let senders: Vec<_> = (0..SENDERS)
        .map(|_| {
            let (client, bodies, next) =
                (flood.server.client.clone(), Arc::clone(&bodies), Arc::clone(&next));
            let [offered, read, turned_away] = [&offered, &read, &turned_away].map(Arc::clone);
            std::thread::spawn(move || {
                loop {
                    let delivery = next.fetch_add(1, Ordering::Relaxed);
                    let Some(body) = bodies.get(delivery as usize) else { return };
                    let due = Duration::from_micros(delivery * TOGETHER as u64 * 1_000_000 / RATE);
                    pause(due.saturating_sub(began.elapsed()));
                    if began.elapsed() > Duration::from_secs(seconds) {
                        return;
                    }
                    offered.fetch_add(TOGETHER as u64, Ordering::Relaxed);
                    let answer = client.post("/api/v1/receptions", &format!("flood-{delivery}"), body);
                    match answer.expect("an answer").status {
                        200 => read.fetch_add(TOGETHER as u64, Ordering::Relaxed),
                        503 => turned_away.fetch_add(1, Ordering::Relaxed),
                        other => unreachable!("status {other}"),
                    };
                }
            })
        })
        .collect();
    flood.hear(began, seconds);
    senders.into_iter().for_each(|sender| sender.join().expect("a sender"));
    let grown_kib = flood.grown_kib();
    let [offered, read, turned_away] =
        [offered, read, turned_away].map(|counter| counter.load(Ordering::Relaxed));
    let (refused_now, reasons) = refused(&flood.server, "file");
    // Nothing vanishes: what was read was taken or refused, each refusal by its reason, and so was each delivery that
    // was turned away.
    let taken_now = taken(&flood.server, "file") - flood.taken_before;
    assert_eq!(taken_now + (refused_now - flood.refused_before - turned_away), read, "{reasons}");
    assert_eq!(reasons["no-room"].as_u64().unwrap_or(0), turned_away, "{reasons}");
    for reason in ["bad-bytes", "foreign", "malformed", "no-bytes", "test-packet"] {
        assert!(reasons[reason].as_u64() > Some(0), "{reason}: {reasons}");
    }
    let words = format!("{read} read, {turned_away} deliveries turned away, {reasons}");
    flood.end(grown_kib, offered, seconds, &words);
}

/// A folder whose server has a broker, and where that listens.
fn with_broker() -> (Folder, SocketAddr) {
    let mut folder = Folder::new();
    let broker = free_address();
    folder.sections = format!("[[ears]]\nname = \"boards\"\nkind = \"broker\"\nlisten = \"{broker}\"\n");
    (folder, broker)
}

#[test]
fn a_flood_of_lies_over_mqtt_costs_the_radio_nothing_and_little_memory() {
    let seconds = seconds();
    let (folder, broker) = with_broker();
    let (server, radio) = with_radio(&folder);
    let mut flood = Flood::begin(server, radio, "own-mqtt");
    let began = Arc::new(OnceLock::new());
    let offered = Arc::new(AtomicU64::new(0));
    let boards: Vec<_> = (0..BOARDS)
        .map(|board| {
            let topic = format!("tinygs/team/board{board}/tele/rx");
            // Every 10 ms its part of the 10,000 in a second.
            let part = RATE / 100 / BOARDS;
            let parts: Vec<Vec<u8>> = (0..seconds * 100)
                .map(|slot| {
                    let first = TOGETHER as u64 + (slot * BOARDS + board) * part;
                    (first..first + part)
                        .flat_map(|number| publish(&topic, message(number).as_bytes(), None))
                        .collect()
                })
                .collect();
            let mut client = Board::connect(broker, &format!("board{board}")).expect("a connection");
            let (offered, began) = (Arc::clone(&offered), Arc::clone(&began));
            std::thread::spawn(move || {
                let began: Instant = *began.wait();
                for (slot, packets) in parts.iter().enumerate() {
                    pause(Duration::from_millis(slot as u64 * 10).saturating_sub(began.elapsed()));
                    if began.elapsed() > Duration::from_secs(seconds) {
                        break;
                    }
                    client.send(packets).expect("the broker takes it");
                    offered.fetch_add(part, Ordering::Relaxed);
                }
                client
            })
        })
        .collect();
    began.set(now()).expect("once");
    flood.hear(*began.wait(), seconds);
    let boards: Vec<Board> = boards.into_iter().map(|board| board.join().expect("a board")).collect();
    let offered = offered.load(Ordering::Relaxed);
    // Nothing vanishes: each message was taken, or refused by a reason that is told.
    let (source, refused_before) = ("own-mqtt", flood.refused_before);
    let mut counted = 0;
    let (reasons, _) = until("every message is counted", Duration::from_secs(120), || {
        let (refused_now, reasons) = refused(&flood.server, source);
        counted = taken(&flood.server, source) + refused_now - refused_before;
        (counted == offered).then_some(reasons)
    });
    let grown_kib = flood.grown_kib();
    for reason in ["bad-bytes", "foreign", "malformed", "no-bytes", "no-room", "test-packet"] {
        assert!(reasons[reason].as_u64() > Some(0), "{reason}: {reasons}");
    }
    let words = format!("{} taken, {reasons}", taken(&flood.server, source));
    flood.end(grown_kib, offered, seconds, &words);
    drop(boards);
}

#[test]
fn what_was_acknowledged_outlives_kill_9_and_the_rest_is_sent_again() {
    let (folder, broker) = with_broker();
    let topic = "tinygs/team/roof/tele/rx";
    let in_archive = |server: &Server| -> BTreeSet<String> {
        let frames: Vec<Value> = server.client.all("/api/v1/frames");
        frames.iter().filter_map(|frame| frame["hex"].as_str().map(str::to_owned)).collect()
    };
    let hex_of = |number: u16| hex(&heartbeat(u32::from(number) * 1_000));
    let mut unacknowledged: BTreeSet<u16> = (1..=4_000).collect();
    for turn in 0..4 {
        let mut server = Server::start(&folder);
        let mut board = Board::connect(broker, "roof").expect("a connection");
        let mut ear = board.twice().expect("a handle");
        let wanted = unacknowledged.clone();
        let packets: Vec<u8> = wanted
            .iter()
            .flat_map(|number| {
                let at_us = utc_us() - i64::from(*number) * 1_000;
                let line = rx("roof", &heartbeat(u32::from(*number) * 1_000), at_us);
                let body = line.split_once(' ').map_or("", |(_, body)| body).trim_end();
                publish(topic, body.as_bytes(), Some(*number))
            })
            .collect();
        // All at once: what is not stored yet waits in the server, or on the line.
        let writer = std::thread::spawn(move || board.send(&packets));
        let enough = if turn < 3 { 500 } else { wanted.len() };
        let mut acknowledged = BTreeSet::new();
        while acknowledged.len() < enough {
            acknowledged.insert(ear.acknowledged().expect("a word"));
        }
        server.process.kill9();
        // What was on its way to us when it died counts as said.
        while let Ok(number) = ear.acknowledged() {
            acknowledged.insert(number);
        }
        let _ = writer.join().expect("the writer");
        unacknowledged.retain(|number| !acknowledged.contains(number));
        let server = Server::start(&folder);
        let there = in_archive(&server);
        let lost: Vec<&u16> =
            acknowledged.iter().filter(|number| !there.contains(&hex_of(**number))).collect();
        assert!(lost.is_empty(), "turn {turn}: {} acknowledged and lost: {lost:?}", lost.len());
        server.stop();
    }
    assert!(unacknowledged.is_empty());
    let server = Server::start(&folder);
    assert_eq!(in_archive(&server), (1..=4_000).map(hex_of).collect(), "each of them once");
    server.stop();
}

/// Reports that were taken, new or known.
fn taken(server: &Server, source: &str) -> u64 {
    let counts = counts_of(server, source);
    let taken = &counts["taken"];
    ["frames", "merged", "without_frame", "repeated"].iter().filter_map(|name| taken[name].as_u64()).sum()
}

/// Receptions of our own radio.
fn own(server: &Server) -> u64 {
    let frames: Vec<Value> = server.client.all("/api/v1/frames?station=bench");
    frames.iter().filter_map(|frame| frame["receptions"].as_array()).map(|list| list.len() as u64).sum()
}

/// Within what 99 of 100 of the radio's pieces came from its last byte to the engine, in seconds.
fn engine_delay_s(server: &Server) -> f64 {
    let page = server.client.get("/metrics").expect("metrics").text();
    let value = |line: &str| line.rsplit(' ').next().and_then(|value| value.parse::<f64>().ok());
    let all = page.lines().find(|line| line.starts_with("gs_engine_input_seconds_count")).and_then(value);
    let all = all.expect("a count");
    let mut buckets = page.lines().filter(|line| line.starts_with("gs_engine_input_seconds_bucket"));
    let bucket = buckets.find(|line| value(line).is_some_and(|count| count >= all * 0.99)).expect("a bucket");
    let (_, edge) = bucket.split_once("le=\"").expect("an edge");
    edge.split('"').next().and_then(|edge| edge.parse().ok()).unwrap_or(f64::INFINITY)
}

#[test]
fn an_import_beside_the_radio_does_not_delay_it() {
    let folder = Folder::new();
    let (server, mut radio) = with_radio(&folder);
    let file = folder.file("a.log");
    std::fs::write(&file, log(0, 4_000)).expect("a file");
    let mut command = gs_server(["import", "--json", "--config"]);
    command.arg(folder.file("station.toml")).arg(&file).stdout(std::process::Stdio::null());
    let began = now();
    let mut import = end_to_end::Process::start(command, &folder.file("import.log"));
    let mut sent = 0_u32;
    let ended = loop {
        radio.write_all(&heartbeat(4_000_000_000 + sent)).expect("the radio's line");
        sent += 1;
        pause(Duration::from_millis(50));
        if let Some(status) = import.ended() {
            break status;
        }
    };
    assert!(ended.success(), "{}", import.log());
    let rate = 20_000.0 / began.elapsed().as_secs_f64();
    until("the radio's frames are stored", Duration::from_secs(20), || {
        (own(&server) == u64::from(sent)).then_some(())
    });
    let delay_s = engine_delay_s(&server);
    println!(
        "{rate:.0} reports a second over the API; {sent} frames by radio, 99 of 100 at the engine within {delay_s} s"
    );
    assert!(delay_s <= 0.25, "{delay_s} s");
    server.stop();
}

#[test]
fn a_file_made_to_break_a_reader_costs_its_own_lines_and_little_memory() {
    let folder = Folder::new();
    let good = log(0, 20);
    let file = folder.file("hostile.log");
    {
        let mut out = std::io::BufWriter::new(std::fs::File::create(&file).expect("a file"));
        let mut put = |bytes: &[u8]| out.write_all(bytes).expect("the file");
        put(good.as_bytes());
        put(b"{\"data\":\"");
        (0..100).for_each(|_| put(&vec![b'A'; 1 << 20]));
        put(b"\"}\n{\"data\":");
        put("[".repeat(100_000).as_bytes());
        put("]".repeat(100_000).as_bytes());
        put(b"}\n{\"data\":true,\"rssi\":\"loud\"}\n{\"data\":\"!!!\",\"crc_error\":false}\n");
        put(log(20, 20).as_bytes());
    }
    let mut command = std::process::Command::new("/usr/bin/env");
    // What it takes at its peak, by its own accord.
    command.arg("bash").arg("-c").arg("\"$@\" & pid=$!; peak=0; while [ -r /proc/$pid/status ]; do \
        now=$(sed -n 's/^VmHWM:[[:space:]]*\\([0-9]*\\).*/\\1/p' /proc/$pid/status 2>/dev/null); \
        [ -z \"$now\" ] && break; peak=$now; sleep 0.02; done; wait $pid; code=$?; echo \"peak $peak\" >&2; exit $code");
    let server = gs_server(["import", "--json", "--config"]);
    command.arg("bash").arg(server.get_program()).args(server.get_args());
    command.arg(folder.write_config()).arg(&file);
    let (code, out, error) = run(command);
    assert_eq!(code, 0, "{out}{error}");
    let done: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((done["frames"].as_u64(), done["merged"].as_u64()), (Some(40), Some(160)), "{done}");
    assert_eq!(done["refused"], 4, "{done}");
    assert_eq!(done["reasons"].as_object().map(serde_json::Map::len), Some(4), "each by its reason: {done}");
    let peak = error.lines().find_map(|line| line.strip_prefix("peak ")?.parse::<u64>().ok());
    println!("{} KiB at the peak", peak.unwrap_or(0));
    assert!(peak.is_some_and(|kib| kib > 0 && kib < 100 << 10), "the line of 100 MB was held: {error}");
}
