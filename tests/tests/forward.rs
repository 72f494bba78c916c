//! Passing on through the real program: what a simulated satellite sends, heard over the pseudo-terminal, arrives at a far
//! end on this machine, each frame once, also when the server is killed in the middle of a request.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU16, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use api::FrameView;
use end_to_end::process::{gs_server, run};
use end_to_end::wait::{PATIENCE, pause, until};
use end_to_end::{Folder, Server, Twin};
use serde_json::Value;

const TOKEN: &str = "c4nary-0f-the-far-end";
const KEY: &str = "whsec_Y2FuYXJ5LW9mLXRoZS13ZWJob29rLXRhcmdldA==";

/// A far end that takes POSTs over HTTP/1.1 and keeps them: SiDS as SatNOGS DB speaks it.
#[derive(Clone)]
struct FarEnd {
    address: SocketAddr,
    requests: Arc<Mutex<Vec<(String, String)>>>,
    /// What it answers; 0: nothing at all, however long one waits.
    status: Arc<AtomicU16>,
}

impl FarEnd {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let far_end = Self {
            address: listener.local_addr().expect("its address"),
            requests: Arc::default(),
            status: Arc::new(AtomicU16::new(201)),
        };
        let server = far_end.clone();
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let server = server.clone();
                std::thread::spawn(move || server.serve(stream));
            }
        });
        far_end
    }

    fn answer(&self, status: u16) {
        self.status.store(status, Ordering::SeqCst);
    }

    /// The head and the body of everything that came.
    fn requests(&self) -> Vec<(String, String)> {
        self.requests.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// How often each frame came, in hex.
    fn frames(&self) -> BTreeMap<String, usize> {
        let mut frames = BTreeMap::new();
        for (_, body) in self.requests() {
            let frame = field(&body, "frame").to_ascii_lowercase();
            *frames.entry(frame).or_default() += 1;
        }
        frames
    }

    fn serve(&self, mut stream: TcpStream) -> Option<()> {
        let mut reader = BufReader::new(stream.try_clone().ok()?);
        let (mut head, mut length) = (String::new(), 0);
        loop {
            let mut line = String::new();
            reader.read_line(&mut line).ok().filter(|count| *count > 0)?;
            let lower = line.to_ascii_lowercase();
            if let Some(value) = lower.strip_prefix("content-length:") {
                length = value.trim().parse().ok()?;
            }
            if line.trim().is_empty() {
                break;
            }
            head.push_str(&line);
        }
        let mut body = vec![0; length];
        reader.read_exact(&mut body).ok()?;
        let status = self.status.load(Ordering::SeqCst);
        let request = (head, String::from_utf8_lossy(&body).into_owned());
        self.requests.lock().unwrap_or_else(PoisonError::into_inner).push(request);
        if status == 0 {
            // Until the other side gives up.
            let _end = reader.read(&mut [0]);
            return None;
        }
        let answer = format!("HTTP/1.1 {status} x\r\ncontent-length: 0\r\nconnection: close\r\n\r\n");
        stream.write_all(answer.as_bytes()).ok()
    }
}

/// A field of a form; nothing in these needs to be unescaped but what is not looked at.
fn field<'a>(form: &'a str, name: &str) -> &'a str {
    form.split('&').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('=')).unwrap_or_default()
}

/// A station that passes on to two far ends: to the one really, to the other as a dry run.
fn station(live: &FarEnd, dry: &FarEnd) -> Folder {
    let mut folder = Folder::new();
    folder.heartbeat_s = 2;
    folder.station = "call_sign = \"HB9XYZ\"\nlatitude_deg = 47.378\nlongitude_deg = 8.548\n".to_owned();
    folder.satellite = "norad_cat_id = 99123\n".to_owned();
    folder.log = "debug".to_owned();
    for (name, secret) in [("db.token", TOKEN), ("lab.key", KEY)] {
        folder.write_key(name, secret, 0o600);
    }
    folder.sections = format!(
        "[[forward]]\nname = \"db\"\nkind = \"sids\"\nurl = \"http://{}/api/telemetry/\"\nsecret_file = \"db.token\"\n\
         live = true\nper_minute = 600\n\n\
         [[forward]]\nname = \"lab\"\nkind = \"webhook\"\nurl = \"http://{}/frames\"\nsecret_file = \"lab.key\"\n",
        live.address, dry.address
    );
    folder
}

/// `gs-server forward …`, and everything it ever said.
struct Verbs<'a> {
    folder: &'a Folder,
    said: String,
}

impl Verbs<'_> {
    fn run(&mut self, words: &[&str]) -> (i32, String) {
        let mut command = gs_server([&["forward"], words].concat());
        command.arg("--config").arg(self.folder.write_config());
        let (code, out, error) = run(command);
        self.said.push_str(&out);
        self.said.push_str(&error);
        (code, if code == 0 || code == 1 && error.is_empty() { out } else { error })
    }

    fn json(&mut self, expected: i32, words: &[&str]) -> Value {
        let (code, text) = self.run(&[words, &["--json"]].concat());
        assert_eq!(code, expected, "{words:?}: {text}");
        serde_json::from_str(&text).expect("JSON")
    }

    /// Numbers of what is in this state with `db`, the oldest first.
    fn in_state(&mut self, state: &str) -> Vec<u64> {
        let listed = self.json(0, &["list", "--target", "db", "--state", state, "--limit", "1000"]);
        let numbers =
            listed["forwards"].as_array().expect("a list").iter().filter_map(|one| one["id"].as_u64());
        let mut numbers: Vec<u64> = numbers.collect();
        numbers.reverse();
        numbers
    }

    fn target(&mut self, expected: i32, name: &str) -> Value {
        let listed = self.json(expected, &["targets"]);
        let targets = listed["targets"].as_array().expect("targets");
        targets.iter().find(|target| target["name"] == name).expect("the target").clone()
    }
}

#[test]
fn each_frame_goes_out_once_and_what_a_kill_left_open_waits_for_a_person() {
    let (live, dry) = (FarEnd::start(), FarEnd::start());
    let folder = station(&live, &dry);
    let mut verbs = Verbs { folder: &folder, said: String::new() };
    let _twin = Twin::start(&folder, &[]);
    let mut server = Server::start(&folder);
    until("three frames have arrived", PATIENCE, || (live.requests().len() >= 3).then_some(()));

    // Killed while the far end has a request and has not answered it.
    live.answer(0);
    let before = live.requests().len();
    until("a request is held back", PATIENCE, || (live.requests().len() > before).then_some(()));
    let held = verbs.in_state("sending");
    assert_eq!(held.len(), 1, "marked before it leaves: {held:?}");
    server.process.kill9();
    live.answer(201);
    server = Server::start(&folder);
    until("what the server did not live to see is unknown", PATIENCE, || {
        (verbs.in_state("unknown") == held).then_some(())
    });
    let goal = live.requests().len() + 2;
    until("the next frames arrive", PATIENCE, || (live.requests().len() >= goal).then_some(()));
    assert_eq!(verbs.in_state("unknown"), held, "nobody asked for it");

    // Paused: what is heard waits; then it goes out.
    let (code, line) = verbs.run(&["pause", "db"]);
    assert!(code == 0 && line.contains("paused"), "{code}: {line}");
    until("something waits", PATIENCE, || (verbs.in_state("waiting").len() >= 2).then_some(()));
    let count = live.requests().len();
    pause(Duration::from_secs(1));
    assert_eq!(live.requests().len(), count, "paused is paused");
    assert!(verbs.target(0, "db")["paused_by"].is_string());
    assert!(verbs.json(0, &["resume", "db"])["paused_by"].is_null());
    until("nothing waits", PATIENCE, || verbs.in_state("waiting").is_empty().then_some(()));
    each_once(&server, &live);

    // A person looks at it and repeats it; of what has arrived there is nothing to repeat.
    let held = held[0].to_string();
    let shown = verbs.json(0, &["show", &held]);
    let body = shown["request"]["body"].as_str().expect("a request").to_owned();
    assert_eq!((field(&body, "noradID"), field(&body, "source")), ("99123", "HB9XYZ"), "{body}");
    let sent = verbs.in_state("sent");
    let first = sent.first().expect("some were sent").to_string();
    let (code, why) = verbs.run(&["retry", &first]);
    assert!(code == 3 && why.contains("It is sent"), "{code}: {why}");
    assert_eq!(verbs.json(0, &["retry", &held])["state"], "waiting");
    until("it is sent", PATIENCE, || verbs.in_state("unknown").is_empty().then_some(()));
    until("it has arrived", PATIENCE, || {
        (live.requests().iter().filter(|(_, came)| *came == body).count() == 2).then_some(())
    });
    let (code, why) = verbs.run(&["pause", "nobody"]);
    assert!(code == 2 && why.contains("no target 'nobody'") && why.contains("db, lab"), "{code}: {why}");

    // The far end wants no more of us: the state of the target says so, and so does the exit code.
    live.answer(401);
    until("the target fails", PATIENCE, || (verbs.run(&["targets"]).0 == 1).then_some(()));
    let failing = verbs.target(1, "db");
    assert!(failing["failing"].as_str().is_some_and(|why| why.contains("401")), "{failing}");
    let lab = verbs.target(1, "lab");
    assert!(lab["dry"].as_u64() > Some(5) && lab["sent"] == 0 && dry.requests().is_empty(), "{lab}");

    let mut said = verbs.said;
    for path in
        ["/api/v1/forwards?limit=1000", "/api/v1/forwards/targets", "/api/v1/events?limit=1000", "/metrics"]
    {
        said.push_str(&server.client.get(path).expect("an answer").text());
    }
    said.push_str(&server.process.log());
    server.stop();
    for secret in [TOKEN, KEY, KEY.trim_start_matches("whsec_")] {
        assert!(!said.contains(secret), "the log or an answer has '{secret}'");
    }
    let shown = format!("Token {TOKEN}");
    assert!(
        live.requests().iter().all(|(head, _)| head.contains(&shown)),
        "the far end is shown it each time"
    );
}

/// Every frame of the archive that is older than the newest that arrived has arrived, and none twice.
fn each_once(server: &Server, live: &FarEnd) {
    let came = live.frames();
    assert!(came.values().all(|count| *count == 1), "twice: {came:?}");
    let frames: Vec<FrameView> = server.client.all("/api/v1/frames");
    let archived: Vec<&str> = frames.iter().map(|frame| frame.hex.as_str()).collect();
    assert!(came.keys().all(|frame| archived.contains(&frame.as_str())), "made up: {came:?}");
    let newest = archived.iter().rposition(|frame| came.contains_key(*frame)).expect("some arrived");
    let missing: Vec<_> = archived[..newest].iter().filter(|frame| !came.contains_key(**frame)).collect();
    assert!(missing.is_empty() && came.len() >= 8, "{} arrived, missing: {missing:?}", came.len());
}
