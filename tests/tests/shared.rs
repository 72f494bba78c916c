//! Several servers on one PostgreSQL, each with a twin behind a pseudo-terminal: one archive, live events of both, a request
//! taken by one of them, a key used by one at a time; and a database that goes away in the middle of a pass.
//!
//! `RACES` (20), `RACE_KILLS` (4) and `OUTAGE_S` (6) may be given in the environment: the numbers of the acceptance are 1,000, 100
//! and 60.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use api::{ChunkMap, CommandView, EventView, FrameView, ImageView, StationView, StreamMessage};
use end_to_end::stream::{Follower, Look};
use end_to_end::wait::{PATIENCE, now, pause, until};
use end_to_end::{Client, Folder, Server, Twin, journal};
use migrations::cluster::{Cluster, Database};
use protocol::{DownFrame, Downlink};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use satellite::JournalEntry;
use sha2::{Digest as _, Sha256};

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
    // Each has sealed once and has a witness: one that is killed between its first commit and its first witness waits for a
    // person, rightly.
    for (client, key) in clients.iter().zip(["first-of-a", "first-of-b"]) {
        let answer = client.post("/api/v1/commands", key, r#"{"command":"Ping"}"#);
        assert_eq!(answer.expect("an answer").status, 201);
        all_are_answered(&clients);
    }
    let mut answers: BTreeMap<String, BTreeSet<u64>> = BTreeMap::new();
    let mut both = 0;
    for race in 0..races {
        let key = format!("race-{race}");
        if kills > 0 && race % races.div_ceil(kills) == races.div_ceil(kills) / 2 {
            let victim = random.random_range(0..2);
            // A module whose setting up was broken off may be deaf until its power is cycled: that is not what is asked here.
            if let Some(server) = &servers[victim] {
                server.until_link("ok", PATIENCE);
            }
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
        // A queue has a bound.
        if both % 100 == 0 || both == races {
            all_are_answered(&clients);
        }
    }
    let commands: Vec<CommandView> = clients[1].all("/api/v1/commands");
    let asked: Vec<&CommandView> = commands.iter().filter(|command| command.principal == "local").collect();
    assert_eq!(asked.len() as u64, races + 2, "each request is one command");
    assert_eq!(
        database.sealed_by_the_wrong_one().expect("an answer"),
        "",
        "commands that were sealed by two"
    );
    let by = database.sealed_by_station().expect("an answer");
    without_a_hole(&clients[0].all("/api/v1/events"));
    let mut nonces = BTreeSet::new();
    for (folder, server) in folders.iter().zip(&mut servers) {
        let entries = journal::read(&folder.journal());
        let accepted = entries.iter().filter_map(|entry| match entry {
            JournalEntry::Accepted { nonce, .. } => Some(*nonce),
            _ => None,
        });
        accepted.for_each(|nonce| assert!(nonces.insert(nonce), "nonce {nonce:?} was used twice"));
        eprintln!("{}: {} frames radiated", folder.name, journal::radiated(&entries).len());
        server.take().expect("a server").stop();
    }
    assert!(nonces.len() as u64 >= races, "{} requests were accepted", nonces.len());
    drop(twins);
    eprintln!("{both} races, {kills} kills; sealed: {}", by.replace('\n', ", "));
}

/// Waits until all commands of both have been sent and answered: the key goes from one to the other when there is nothing
/// left to say, or when its lease ends with a server that was killed.
fn all_are_answered(clients: &[Client; 2]) {
    let began = now();
    loop {
        let commands: Vec<CommandView> = clients[0].all("/api/v1/commands");
        let waiting: Vec<u64> =
            commands.iter().filter(|command| command.stage != "answered").map(|command| command.id).collect();
        if waiting.is_empty() {
            return;
        }
        if began.elapsed() > PATIENCE * 4 {
            let told = clients.each_ref().map(|client| {
                let station: StationView = client.read("/api/v1/station");
                (station.satellites[0].uplink.clone(), station.links[0].clone(), station.sealing[0].clone())
            });
            panic!("commands {waiting:?} are not answered: {told:#?}");
        }
        pause(Duration::from_millis(100));
    }
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

/// A station on a database of its own server, and what its satellite said since it was first heard: what was sent before
/// the port was opened cannot be in any archive.
struct Lonely {
    folder: Folder,
    twin: Twin,
    cluster: Cluster,
    first: String,
    _place: tempfile::TempDir,
}

impl Lonely {
    fn new() -> (Self, Server) {
        let place = tempfile::Builder::new().prefix("gs-pg-").tempdir().expect("a folder");
        let cluster = Cluster::own(place.path()).expect("a PostgreSQL");
        let mut folder = station("lonely", &cluster.database("ground").expect("a database"));
        folder.heartbeat_s = 5;
        let twin = Twin::start(&folder, &["--seed", "3"]);
        let server = Server::start(&folder);
        let ask = || heard(&server.client).get(2).map(|_| heard(&server.client)[0].hex.clone());
        let (first, _) = until("something was heard", PATIENCE, ask);
        (Self { folder, twin, cluster, first, _place: place }, server)
    }

    fn said(&self) -> Vec<String> {
        sent(&self.folder.journal()).into_iter().skip_while(|frame| *frame != self.first).collect()
    }

    /// Each of these is in the archive, once.
    fn is_home(&self, client: &Client, said: &[String]) {
        until("everything is in the archive", PATIENCE, || {
            let Ok(answer) = client.get("/api/v1/frames?limit=1") else { return None };
            (answer.status == 200).then_some(())?;
            let frames = heard(client);
            let held: BTreeSet<&str> = frames.iter().map(|frame| frame.hex.as_str()).collect();
            said.iter().all(|frame| held.contains(frame.as_str())).then_some(())
        });
        let mut times: BTreeMap<String, u32> = BTreeMap::new();
        for frame in heard(client) {
            *times.entry(frame.hex).or_default() += 1;
        }
        // A heartbeat tells how long the satellite has been up: no two are the same.
        assert!(said.iter().all(|frame| times[frame] == 1), "a frame stands there twice");
    }
}

/// Everything that the satellite says while the database is away comes home afterwards, once.
#[test]
fn a_database_that_goes_away_in_mid_pass_loses_nothing() {
    let outage = Duration::from_secs(from_environment("OUTAGE_S", 6));
    let (lonely, server) = Lonely::new();
    lonely.cluster.stop().expect("a stop");
    let before = lonely.said().len();
    pause(outage);
    let meanwhile = lonely.said().len() - before;
    assert!(meanwhile >= 3, "the satellite said too little: {meanwhile}");
    lonely.cluster.start().expect("a start");
    let said = lonely.said();
    lonely.is_home(&server.client, &said);
    let log = server.process.log();
    let told = log.lines().filter(|line| line.contains("takes nothing")).count();
    assert!(told <= 2 + outage.as_secs() as usize / 30, "told {told} times: a flood");
    assert!(log.contains("storage takes records again"), "the end of it is told, too");
    server.stop();

    // Once more from the start: what the reserve held is not there twice.
    let server = Server::start(&lonely.folder);
    lonely.is_home(&server.client, &said);
    without_a_hole(&server.client.all("/api/v1/events"));
    eprintln!(
        "{meanwhile} frames while the database was away for {outage:?}, {} in all, none lost",
        said.len()
    );
    server.stop();
    drop(lonely.twin);
}

/// What was heard while the database was away is in the reserve, so a server that dies meanwhile loses none of it.
#[test]
fn a_server_that_dies_while_the_database_is_away_brings_home_what_it_heard() {
    let (lonely, mut server) = Lonely::new();
    lonely.cluster.stop().expect("a stop");
    let before = lonely.said().len();
    until("the satellite said something", PATIENCE, || (lonely.said().len() >= before + 5).then_some(()));
    // The last of them may still be on its way.
    let mut said = lonely.said();
    said.truncate(said.len() - 1);
    server.process.kill9();
    lonely.cluster.start().expect("a start");
    let server = Server::start(&lonely.folder);
    lonely.is_home(&server.client, &said);
    without_a_hole(&server.client.all("/api/v1/events"));
    server.stop();
}

/// Bytes of a chunk.
const CHUNK: usize = 222;

/// A station's image, by its id: whole numbers below 2^40 are the first station's.
fn image_of(client: &Client, number: u64) -> Option<ImageView> {
    client.all::<ImageView>("/api/v1/images").into_iter().find(|image| image.id >> 40 == number)
}

/// Which chunks of a station's image are held.
fn chunks_of(client: &Client, number: u64) -> BTreeSet<u16> {
    let Some(image) = image_of(client, number) else { return BTreeSet::new() };
    let map: ChunkMap = client.read(&format!("/api/v1/images/{}/chunks", image.id));
    (0..).zip(map.map.chars()).filter_map(|(index, letter)| (letter != '.').then_some(index)).collect()
}

/// Chunks that a satellite sent after its first so many frames.
fn chunks_sent(folder: &Folder, after: usize) -> BTreeSet<u16> {
    let frames =
        sent(&folder.journal()).into_iter().skip(after).map(|frame| hex::decode(frame).expect("hex"));
    let index = |frame: Vec<u8>| match DownFrame::parse(&frame).ok()?.packet().ok()? {
        Downlink::ImageChunk(chunk) => Some(chunk.index.0),
        _ => None,
    };
    frames.filter_map(index).collect()
}

/// Two satellites hold the same image, and each station asks its own for it: a part of it each, in turn.
#[test]
fn one_image_comes_home_from_two_stations() {
    const CHUNKS: usize = 120;
    let database = Database::fresh().expect("a database");
    let address = database.address().expect("an address");
    let (a, b) = (station("station-a", &address), station("station-b", &address));
    let mut image = vec![0; CHUNKS * CHUNK - 50];
    ChaCha8Rng::seed_from_u64(9).fill(image.as_mut_slice());
    let file = a.file("image.bin");
    std::fs::write(&file, &image).expect("a file");
    let file = file.display().to_string();
    let twins = [&a, &b].map(|folder| Twin::start(folder, &["--seed", "1", "--image", &file]));
    let order = |client: &Client| {
        let answer =
            client.post("/api/v1/downloads", &format!("from-{}", client.address), "{}").expect("an answer");
        assert_eq!(answer.status, 201, "{}", answer.text());
    };

    // The first brings a third of it; the second hears nothing of it itself, and has it all the same.
    let mut server_a = Server::start(&a);
    let mut server_b = Server::start(&b);
    order(&server_a.client);
    until("a third of the image", PATIENCE * 2, || {
        (chunks_of(&server_b.client, 0).len() >= CHUNKS / 3).then_some(())
    });
    server_a.process.kill9();
    let by_a = chunks_of(&server_b.client, 0);
    until("the other has them, too", PATIENCE, || (chunks_of(&server_b.client, 1) == by_a).then_some(()));
    assert_eq!(chunks_sent(&b, 0), BTreeSet::new(), "nobody asked its satellite");

    // The second goes on, and asks for nothing that is there.
    order(&server_b.client);
    until("two thirds of it", PATIENCE * 2, || {
        (chunks_of(&server_b.client, 1).len() >= 2 * CHUNKS / 3).then_some(())
    });
    server_b.process.kill9();
    let again: Vec<u16> = chunks_sent(&b, 0).intersection(&by_a).copied().collect();
    assert_eq!(again, [0_u16; 0], "asked for again");

    // The first comes back: it takes what the other brought meanwhile, and brings the rest.
    let before = sent(&a.journal()).len();
    let server_a = Server::start(&a);
    let by_both = chunks_of(&server_a.client, 1);
    until("what the other brought", PATIENCE, || {
        chunks_of(&server_a.client, 0).is_superset(&by_both).then_some(())
    });
    until("the image is whole at the first", PATIENCE * 2, || {
        image_of(&server_a.client, 0).filter(|image| image.complete).map(drop)
    });
    let again: Vec<u16> = chunks_sent(&a, before).intersection(&by_both).copied().collect();
    assert_eq!(again, [0_u16; 0], "asked for again");

    // The second comes back, too, and has it all without asking.
    let before = sent(&b.journal()).len();
    let server_b = Server::start(&b);
    until("the image is whole at the second", PATIENCE, || {
        image_of(&server_b.client, 1).filter(|image| image.complete).map(drop)
    });
    assert_eq!(chunks_sent(&b, before), BTreeSet::new(), "asked for again");
    for (server, number) in [(&server_a, 0), (&server_b, 1)] {
        let view = image_of(&server.client, number).expect("an image");
        let file = server.client.get(&format!("/api/v1/images/{}/file", view.id)).expect("the file");
        assert_eq!((view.held as usize, view.conflicts), (CHUNKS, 0));
        assert!(file.body == image, "the file at station {number} has other bytes");
        assert_eq!(view.sha256, Some(hex::encode(Sha256::digest(&image))));
    }
    assert_eq!(database.chunks_held_twice().expect("an answer"), "", "a chunk is held twice");
    eprintln!(
        "{} chunks by the first, {} then by the second, the rest by the first",
        by_a.len(),
        by_both.len()
    );
    server_a.stop();
    server_b.stop();
    drop(twins);
}
