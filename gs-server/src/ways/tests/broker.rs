//! Our own broker with real clients: it takes what boards say, and passes nothing on to anybody.

use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::json;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

use super::bench::*;
use crate::clock::{wall_sleep, within};

/// A client that writes what it is sent into a file.
fn listener(port: u16, topics: &[&str], file: &std::path::Path, more: &[&str]) -> Program {
    let out = std::fs::File::create(file).unwrap();
    let mut command = Command::new("mosquitto_sub");
    command.args(["-h", "127.0.0.1", "-p", &port.to_string(), "-v", "-k", "5"]).args(more);
    for topic in topics {
        command.args(["-t", topic]);
    }
    Program(command.stdout(out).stderr(Stdio::null()).spawn().unwrap())
}

fn ear(port: u16, more: &str) -> String {
    format!("[[ears]]\nname = \"own\"\nkind = \"broker\"\nlisten = \"127.0.0.1:{port}\"\n{more}")
}

const LOGINS: &str = "boards = [{ user = \"team\", password_file = \"team.pw\" }, { user = \"other\", password_file = \"other.pw\" }]\n";
const TEAM: [&str; 4] = ["-u", "team", "-P", "correct horse"];

fn home(port: u16, more: &str) -> Home {
    let folder = tempfile::tempdir().unwrap();
    private(folder.path(), "team.pw", "correct horse\n");
    private(folder.path(), "other.pw", "battery staple\n");
    Home::within(folder, &ear(port, more))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn it_takes_receptions_and_never_passes_anything_on() {
    let port = free_port();
    let home = home(port, LOGINS);
    let bench = home.serve(START).await;
    // As the firmware subscribes, and as somebody who wants everything.
    let board = home.folder.path().join("board");
    let _board = listener(port, &["tinygs/global/#", "tinygs/team/roof/cmnd/#"], &board, &TEAM);
    let nosy = home.folder.path().join("nosy");
    let _nosy = listener(port, &["tinygs/team/#", "#"], &nosy, &TEAM);
    bench.way("own", |way| way["connected"] == 2).await;

    let login = |more: &[&'static str]| [&TEAM[..], more].concat();
    for command in ["tx", "reset", "update", "begine", "weblogin", "sleep", "log"] {
        for topic in ["tinygs/team/roof/cmnd/", "tinygs/global/cmnd/"] {
            for qos in ["0", "1", "2"] {
                let topic = format!("{topic}{command}");
                assert!(
                    publish(port, &topic, "DEADBEEF", &login(&["-q", qos, "-r"])).await,
                    "it is taken, and ends there"
                );
            }
        }
    }
    for name in ["welcome", "ping"] {
        let message = if name == "ping" { PING } else { WELCOME };
        assert!(publish(port, &format!("tinygs/team/roof/tele/{name}"), message, &login(&["-q", "1"])).await);
    }
    for qos in ["0", "1", "2"] {
        let message = rx(&heartbeat(qos.parse::<u32>().unwrap() * 1_000), START.0);
        assert!(publish(port, "tinygs/team/roof/tele/rx", &message, &login(&["-q", qos])).await);
    }
    bench.way("own", |way| way["counts"]["receptions"] == 3).await;
    bench.until_heard((3, 0, 1)).await;
    let way = bench.get("ears/ways").await["items"][0].clone();
    assert_eq!(way["counts"]["other-topics"], 7 * 2 * 3, "{way}");
    wall_sleep(Duration::from_secs(7)).await; // longer than the clients' keep-alive
    bench.way("own", |way| way["connected"] == 2).await;
    for file in [&board, &nosy] {
        assert_eq!(std::fs::read_to_string(file).unwrap(), "", "{}", file.display());
    }
    let receivers = bench.get("receivers").await;
    assert_eq!(receivers["items"][0]["board"]["version"], 2_603_242);
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn strangers_and_boards_under_other_names_bring_nothing_in() {
    let port = free_port();
    let home = home(port, LOGINS);
    let bench = home.serve(START).await;
    let message = rx(&heartbeat(1_000), START.0);
    let topic = "tinygs/team/roof/tele/rx";
    assert!(!publish(port, topic, &message, &[]).await, "without a name");
    assert!(!publish(port, topic, &message, &["-u", "team", "-P", "hunter2"]).await);
    assert!(!publish(port, topic, &message, &["-u", "nobody", "-P", "correct horse"]).await);
    assert!(!publish(port, topic, &message, &[&TEAM[..], &["-V", "5"]].concat()).await, "MQTT 5");
    assert!(publish(port, topic, &message, &["-u", "other", "-P", "battery staple", "-q", "1"]).await);
    let way = bench.way("own", |way| way["counts"]["other-topics"] == 1).await;
    assert_eq!(way["counts"]["wrong-logins"], 3, "{way}");
    assert_eq!(bench.heard().await, (0, 0, 0));
    assert!(publish(port, topic, &message, &[&TEAM[..], &["-q", "1"]].concat()).await);
    bench.until_heard((1, 0, 1)).await;
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_board_is_tuned_when_it_says_hello_and_its_will_is_done() {
    let port = free_port();
    let folder = tempfile::tempdir().unwrap();
    let modem = json!({"mode": "LoRa", "freq": 435.0, "bw": 125.0, "sf": 9, "cr": 5, "sat": "PixelSat-I"});
    std::fs::write(folder.path().join("modem.json"), modem.to_string()).unwrap();
    // On this machine nobody need log in.
    let home = Home::within(folder, &ear(port, "modem_file = \"modem.json\"\n"));
    let bench = home.serve(START).await;
    let mut board = tokio::net::TcpStream::connect(("127.0.0.1", port)).await.unwrap();
    let text = |text: &str| [&(text.len() as u16).to_be_bytes()[..], text.as_bytes()].concat();
    let packet = |kind: u8, body: Vec<u8>| {
        let length = body.len();
        [&[kind, (length & 0x7F) as u8 | 0x80, (length >> 7) as u8][..], &body].concat()
    };
    // CONNECT as the firmware does: clean, a will of QoS 2, keep-alive 15 s.
    let hello = [
        text("MQTT"),
        vec![4, 0b0001_0110, 0, 15],
        text("A0B1C2D3E4F5"),
        text("tinygs/team/roof/tele/status"),
        text("0"),
    ]
    .concat();
    board.write_all(&packet(0x10, hello)).await.unwrap();
    board
        .write_all(&packet(0x30, [text("tinygs/team/roof/tele/welcome"), WELCOME.into()].concat()))
        .await
        .unwrap();
    let mut said = Vec::new();
    let _ = within(Duration::from_secs(5), async {
        let mut part = [0; 512];
        while !said.windows(5).any(|word| word == b"\"sat\"") {
            let count = board.read(&mut part).await.unwrap();
            said.extend_from_slice(&part[..count]);
        }
    })
    .await;
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(said.contains("tinygs/team/roof/cmnd/begine") && said.contains("PixelSat-I"), "{said:?}");
    let online = async |wanted: bool| {
        for _ in 0..500 {
            if bench.get("receivers").await["items"][0]["board"]["online"] == wanted {
                return;
            }
            wall_sleep(Duration::from_millis(10)).await;
        }
        panic!("online was never {wanted}");
    };
    online(true).await;
    drop(board);
    online(false).await;
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn silent_noisy_and_too_many_clients_are_bounded() {
    let port = free_port();
    let home = home(port, LOGINS);
    let bench = home.serve(START).await;
    // More than may be without a name, and one that does not speak MQTT: none of them stays, and boards get in after.
    let mut silent = Vec::new();
    for _ in 0..40 {
        silent.push(tokio::net::TcpStream::connect(("127.0.0.1", port)).await.unwrap());
    }
    bench.way("own", |way| way["counts"]["turned-away"].as_u64() >= Some(20)).await;
    drop(silent);
    bench.way("own", |way| way["counts"]["no-hello"].as_u64() >= Some(16)).await;
    let mut stranger = tokio::net::TcpStream::connect(("127.0.0.1", port)).await.unwrap();
    stranger.write_all(b"GET / HTTP/1.1\r\nhost: x\r\n\r\n").await.unwrap();
    let mut answer = Vec::new();
    let ended = within(Duration::from_secs(5), stranger.read_to_end(&mut answer)).await;
    assert!(ended.is_some() && answer.is_empty());
    let long = rx(&heartbeat(1_000), START.0)
        .replace("\"mode\"", &format!("\"x\":\"{}\",\"mode\"", "y".repeat(60_000)));
    assert!(publish(port, "tinygs/team/roof/tele/rx", &long, &[&TEAM[..], &["-q", "0"]].concat()).await);
    bench.way("own", |way| way["counts"]["too-long"] == 1).await;
    let message = rx(&heartbeat(1_000), START.0);
    assert!(publish(port, "tinygs/team/roof/tele/rx", &message, &[&TEAM[..], &["-q", "1"]].concat()).await);
    bench.until_heard((1, 0, 1)).await;
    bench.stop().await;
}

/// Whoever has a board's password, and nothing good in mind: everything is counted, little is held, and the radio is heard.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_flood_of_lies_is_counted_and_the_radio_goes_on() {
    use std::io::Write as _;
    let port = free_port();
    let home = home(port, LOGINS);
    let bench = home.serve(START).await;
    let messages = std::env::var("FLOOD").ok().and_then(|count| count.parse().ok()).unwrap_or(2_000_u32);
    let before_kib = resident_kib();
    let mut flood = Command::new("mosquitto_pub")
        .args(["-h", "127.0.0.1", "-p", &port.to_string(), "-t", "tinygs/team/roof/tele/rx", "-l"])
        .args(TEAM)
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = flood.stdin.take().unwrap();
    let writer = std::thread::spawn(move || {
        for number in 0..messages {
            let line = match number % 8 {
                0 => "{\"data\":7}".to_owned(),
                1 => format!("{{\"data\":{}", "[".repeat(5_000)),
                2 => rx(b"TinyGS-test", START.0),
                3 => rx(b"foreign", START.0),
                4 => "x".repeat(18_000),
                _ => rx(&heartbeat(number), START.0 - i64::from(number) * 1_000),
            };
            writeln!(input, "{line}").unwrap();
        }
    });
    let mut radio = 0;
    let mut most_kib = before_kib;
    let total = |way: &serde_json::Value| {
        let counts = way["counts"].as_object().unwrap();
        let passed_over = counts.get("too-long").map_or(0, |count| count.as_u64().unwrap());
        let read: u64 = [
            "receptions",
            "not-a-report",
            "malformed",
            "too-deep",
            "test-packet",
            "foreign",
            "no-bytes",
            "no-room",
            "bad-bytes",
        ]
        .iter()
        .filter_map(|what| counts.get(*what)?.as_u64())
        .sum();
        passed_over + read
    };
    let mut done = 0;
    while done < u64::from(messages) {
        let link = mission::LinkId::new("radio").unwrap();
        let received = mission::Clock::now(&bench.clock);
        let bytes = heartbeat(4_000_000_000 + radio);
        let heard =
            crate::engine::EngineMessage::Bytes { link, bytes, source: mission::Source::Radio, received };
        bench.ready.inbox.send(heard).await;
        radio += 1;
        done = total(&bench.get("ears/ways").await["items"][0]);
        most_kib = most_kib.max(resident_kib());
        wall_sleep(Duration::from_millis(50)).await;
    }
    writer.join().unwrap();
    assert!(flood.wait().unwrap().success());
    let way = bench.get("ears/ways").await["items"][0].clone();
    assert_eq!(total(&way), u64::from(messages), "each by its reason: {way}");
    let mut of_radio = 0;
    for _ in 0..500 {
        let link = crate::storage::Scope { link: Some("radio".into()), ..Default::default() };
        let page = crate::storage::Page { limit: 1_000, ..Default::default() };
        let query = crate::storage::FrameQuery { scope: link, page, ..Default::default() };
        of_radio = bench.ready.store.frames(&query).await.unwrap().len();
        if of_radio == (radio as usize).min(1_000) {
            break;
        }
        wall_sleep(Duration::from_millis(10)).await;
    }
    assert_eq!(of_radio, (radio as usize).min(1_000), "nothing that the radio heard is lost");
    println!(
        "{messages} messages, {radio} frames by radio meanwhile, memory grew by {} KiB: {way}",
        most_kib - before_kib
    );
    assert!(most_kib - before_kib < 64 << 10, "{} KiB", most_kib - before_kib);
    bench.stop().await;
}

fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|kib| kib.parse().ok()).unwrap_or(0)
}
