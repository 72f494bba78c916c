//! An armed plan in a pass that lasts, with the real server and the twin behind a pseudo-terminal: killed in the middle of
//! it again and again, taken over by an operator, ended by SIGTERM.
//!
//! The pass is arranged around the machine's time, and time runs as fast as life: what a restart costs is what it costs.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::collections::{BTreeMap, HashSet};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use api::{CommandView, Page, RunReport, RunView};
use end_to_end::process::{gs_server, run};
use end_to_end::wait::{PATIENCE, now, pause, until, utc_us};
use end_to_end::{Client, Folder, Server, Twin, journal, overhead};
use protocol::{SealedUplink, Telecommand, open};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// The run goes on so soon after the server is ready; the test fails at ten times as much, for the machine may be busy.
const RESUMED_WITHIN: Duration = Duration::from_secs(2);
const KILLS: usize = 6;

/// A station with a place; its satellite beats every ten seconds.
fn station() -> Folder {
    let mut folder = Folder::new();
    folder.heartbeat_s = 10;
    folder.station = overhead::PLACE.to_owned();
    folder.satellite = overhead::NUMBER.to_owned();
    folder
}

fn post(client: &Client, path: &str, key: &str, body: &Value) {
    let answer = client.post(path, key, &body.to_string()).expect("an answer");
    assert!(answer.status < 300, "{path}: {}", answer.text());
}

/// Elements by which a pass began a few seconds ago, and an armed plan for it.
fn begin(folder: &Folder, client: &Client, plan: &Value) {
    let text = overhead::elements(folder, utc_us() - 5_000_000);
    post(client, "/api/v1/elements", "elements", &json!({"satellite": "sat", "text": text}));
    post(client, "/api/v1/plans", "plan", plan);
    post(client, &format!("/api/v1/plans/{}/arm", plan["name"].as_str().expect("a name")), "arm", &json!({}));
}

fn runs(client: &Client) -> Vec<RunView> {
    client.read::<Page<RunView>>("/api/v1/runs").items
}

fn run_of(client: &Client, id: u64) -> RunView {
    let found = runs(client).into_iter().find(|run| run.id == id);
    found.unwrap_or_else(|| panic!("run {id} is gone"))
}

fn until_run(client: &Client, state: &str) -> RunView {
    until(&format!("the run is {state}"), 4 * PATIENCE, || {
        runs(client).into_iter().find(|run| run.state == state)
    })
    .0
}

/// Every packet that was radiated, opened; no nonce was used twice.
fn radiated(folder: &Folder) -> Vec<(u64, Telecommand)> {
    let entries = journal::read(&folder.journal());
    let packets = journal::radiated(&entries);
    let mut nonces = HashSet::new();
    let mut all = Vec::new();
    for packet in packets.iter().filter(|packet| packet.windows(8).any(|eight| eight == b"DESTINY_")) {
        assert_eq!(packet.len(), 240, "a cut packet was radiated");
        let sealed = SealedUplink::from_bytes((*packet).try_into().expect("240 bytes")).expect("an uplink");
        assert!(nonces.insert(sealed.nonce()), "nonce {} was radiated twice", sealed.nonce());
        let opened = open(&folder.key(), &sealed).expect("our key");
        all.push((sealed.nonce().counter().0, opened.telecommand().expect("a telecommand")));
    }
    all
}

/// What the plan asked for, by number, each with all its stages.
fn asked(client: &Client) -> BTreeMap<u64, CommandView> {
    let list: Vec<CommandView> = client.all("/api/v1/commands");
    let by_plan = list.iter().filter(|command| command.principal.starts_with("plan:"));
    by_plan.map(|command| (command.id, client.read(&format!("/api/v1/commands/{}", command.id)))).collect()
}

#[test]
fn a_plan_goes_on_after_each_kill_and_radiates_nothing_twice_and_loses_nothing() {
    const PINGS: usize = 14;
    let folder = station();
    let _twin = Twin::start(&folder, &[]);
    let mut server = Server::start(&folder);
    let picture = json!({"resolution": "CIF", "grey": true, "strong_compression": true});
    let plan = json!({
        "name": "night", "satellite": "sat", "transmit": true, "attach": {},
        "steps": [
            {"do": "wait-for", "until": {"heard_within_s": 15}, "timeout_s": 60},
            {"do": "command", "command": "CaptureImage", "arguments": picture, "on_failure": "continue"},
            {"do": "repeat-until", "at_most": PINGS, "steps": [{"do": "command", "command": "Ping", "on_failure": "continue"}]},
            {"do": "listen", "for_s": 2},
        ],
    });
    begin(&folder, &server.client, &plan);
    let id = until_run(&server.client, "running").id;
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut resumed = Vec::new();
    for kill in 0..KILLS {
        // At times wherever it stands, at times just after a command went on.
        let before = asked(&server.client);
        if kill % 2 == 0 {
            pause(Duration::from_millis(random.random_range(500..4_000)));
        } else {
            let began = now();
            while asked(&server.client) == before && began.elapsed() < Duration::from_secs(6) {
                pause(Duration::from_millis(2));
            }
            pause(Duration::from_millis(random.random_range(0..60)));
        }
        let stood = run_of(&server.client, id);
        assert_eq!(
            (stood.id, stood.state.as_str()),
            (id, "running"),
            "the plan ended before the kills did: {stood:?}"
        );
        server.process.kill9();
        server = Server::start(&folder);
        let (_, took) = until("the run goes on", RESUMED_WITHIN * 10, || {
            runs(&server.client)
                .into_iter()
                .find(|run| run.id == id && run.state == "running" && run.started_at.is_some())
        });
        resumed.push(took);
    }
    let ended = until_run(&server.client, "ended");
    // Those of the passes to come are planned already.
    let begun = runs(&server.client).iter().filter(|run| run.state != "planned").count();
    assert_eq!((ended.id, begun), (id, 1), "one pass, one run");
    let report: RunReport = server.client.read(&format!("/api/v1/runs/{id}"));
    let commands = asked(&server.client);
    let on_air = radiated(&folder);
    let captures = on_air.iter().filter(|(_, what)| matches!(what, Telecommand::CaptureImage { .. })).count();
    eprintln!(
        "{KILLS} kills; the run went on {:.0?} after the server was ready in the middle, {:.0?} at most; {} uplinks for {} commands; {:?}",
        middle(&resumed),
        resumed.iter().max().expect("kills"),
        on_air.len(),
        commands.len(),
        ended.outcome
    );

    assert_eq!(ended.outcome.as_deref(), Some("completed"), "{ended:?}");
    assert!(captures <= 1, "a picture is asked for once: {captures}");
    // Nothing lost and nothing asked for again: every place of the plan has one command.
    assert_eq!(commands.len(), 1 + PINGS, "{commands:#?}");
    assert_eq!(report.commands.len(), 1 + PINGS);
    let pings = commands.values().filter(|command| command.command == "Ping");
    assert!(pings.clone().all(|ping| ping.stage == "answered"), "{:#?}", pings.collect::<Vec<_>>());
    // What was on the air had been marked, each time under a counter of its own.
    let marked: HashSet<String> = commands
        .values()
        .flat_map(|command| command.stages.iter().flatten())
        .filter(|stage| stage.stage == "sealed")
        .filter_map(|stage| Some(stage.why.strip_prefix("counter ")?.split(',').next()?.to_owned()))
        .collect();
    for (counter, what) in &on_air {
        assert!(
            marked.contains(&counter.to_string()),
            "{} with counter {counter} is of no command",
            what.name()
        );
    }
    // The report tells every step to its end.
    let steps: Vec<(&str, usize)> =
        report.steps.iter().map(|step| (step.step.as_str(), step.rounds.len())).collect();
    assert_eq!(steps.iter().filter(|(place, _)| *place == "steps[2].steps[0]").count(), PINGS, "{steps:?}");
    for place in ["steps[0]", "steps[1]", "steps[2]", "steps[3]"] {
        assert!(steps.iter().any(|(found, _)| *found == place), "{place}: {steps:?}");
    }
    assert!(report.frames_heard > 0 && report.run.started_at.is_some());
    server.stop();
}

fn middle(times: &[Duration]) -> Duration {
    let mut sorted = times.to_vec();
    sorted.sort_unstable();
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

fn verb(folder: &Folder, words: &[&str]) -> (i32, String, String) {
    let mut command = gs_server(words);
    command.arg("--config").arg(folder.write_config());
    run(command)
}

#[test]
fn an_operator_takes_over_in_mid_run_and_gives_back() {
    let folder = station();
    let _twin = Twin::start(&folder, &[]);
    let server = Server::start(&folder);
    let client = &server.client;
    let plan = json!({
        "name": "long", "satellite": "sat", "transmit": true, "attach": {},
        "steps": [{"do": "repeat-until", "at_most": 8, "steps": [{"do": "command", "command": "Ping", "on_failure": "continue"}]}],
    });
    let (code, _, error) = verb(&folder, &["hold", "sat"]);
    assert_eq!(code, 3, "nothing runs yet: {error}");
    begin(&folder, client, &plan);
    until_run(client, "running");
    until("the plan has asked for something", PATIENCE, || (!asked(client).is_empty()).then_some(()));
    let (code, out, error) = verb(&folder, &["hold", "sat"]);
    assert_eq!((code, out.starts_with("plan long is held")), (0, true), "{out}{error}");
    until_run(client, "held");
    // What was asked for before may still come to its end; then the plan is silent.
    until("nothing of the plan is under way", PATIENCE, || {
        let open = ["queued", "sealed", "radiating", "radiated"];
        asked(client).values().all(|command| !open.contains(&command.stage.as_str())).then_some(())
    });
    let before = asked(client).len();
    post(client, "/api/v1/commands", "mine", &json!({"command": "GetAdcsInfo"}));
    until("the operator's command is answered", PATIENCE, || {
        let list: Vec<CommandView> = client.all("/api/v1/commands");
        list.into_iter().find(|command| command.command == "GetAdcsInfo" && command.stage == "answered")
    });
    pause(Duration::from_secs(3));
    assert_eq!(asked(client).len(), before, "a plan that is held asks for nothing");
    let (code, out, error) = verb(&folder, &["release", "sat", "--json"]);
    assert_eq!(code, 0, "{error}");
    let told: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(told["name"], "long");
    let ended = until_run(client, "ended");
    assert_eq!(ended.outcome.as_deref(), Some("completed"), "{ended:?}");
    assert_eq!(asked(client).len(), 8);
    server.stop();
}

/// rotctld with its dummy.
struct Rotctld {
    child: Child,
    address: String,
}

impl Rotctld {
    fn start() -> Self {
        let port = TcpListener::bind("127.0.0.1:0")
            .and_then(|listener| listener.local_addr())
            .expect("a port")
            .port();
        let child = Command::new("rotctld")
            .args(["-m", "1", "-T", "127.0.0.1", "-t", &port.to_string()])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|error| {
                panic!("rotctld: {error}; scripts/setup.sh tools installs libhamlib-utils")
            });
        let daemon = Self { child, address: format!("127.0.0.1:{port}") };
        until("rotctld listens", PATIENCE, || TcpStream::connect(&daemon.address).ok());
        daemon
    }

    /// Azimuth and elevation, degrees.
    fn stands(&self) -> (f64, f64) {
        let (code, out, error) = run(gs_server(["rotator", "probe", "--json", "--address", &self.address]));
        assert_eq!(code, 0, "{error}");
        let told: Value = serde_json::from_str(&out).expect("JSON");
        let number = |name: &str| told[name].as_f64().expect("a number");
        (number("azimuth_deg"), number("elevation_deg"))
    }
}

impl Drop for Rotctld {
    fn drop(&mut self) {
        let _gone = self.child.kill();
        let _status = self.child.wait();
    }
}

#[test]
fn sigterm_in_mid_run_leaves_a_silent_transmitter_and_a_parked_rotator() {
    const HOME: (f64, f64) = (3.0, 1.0);
    let rotctld = Rotctld::start();
    let mut folder = station();
    folder.sections = format!(
        "[rotator]\naddress = \"{}\"\nazimuth_range = [-180, 450]\npark = [{}, {}]\n",
        rotctld.address, HOME.0, HOME.1
    );
    let _twin = Twin::start(&folder, &[]);
    let server = Server::start(&folder);
    let plan = json!({
        "name": "long", "satellite": "sat", "transmit": true, "attach": {},
        "steps": [{"do": "repeat-until", "at_most": 100, "steps": [{"do": "command", "command": "Ping", "on_failure": "continue"}]}],
    });
    begin(&folder, &server.client, &plan);
    let id = until_run(&server.client, "running").id;
    let off = |(azimuth, elevation): (f64, f64)| (azimuth - HOME.0).abs().max((elevation - HOME.1).abs());
    until("the antenna is away from its place of rest", PATIENCE, || {
        (off(rotctld.stands()) > 8.0).then_some(())
    });
    until("something was radiated", PATIENCE, || (radiated(&folder).len() > 2).then_some(()));
    server.stop();
    let at_end = radiated(&folder).len();
    until("the rotator is parked", PATIENCE, || (off(rotctld.stands()) < 1.0).then_some(()));
    pause(Duration::from_secs(2));
    assert_eq!(radiated(&folder).len(), at_end, "a server that has ended radiates nothing");
    // The next life goes on with it, in the same pass.
    let again = Server::start(&folder);
    let went_on = until_run(&again.client, "running");
    assert_eq!(went_on.id, id);
    until("it radiates again", PATIENCE, || (radiated(&folder).len() > at_end).then_some(()));
    again.stop();
}
