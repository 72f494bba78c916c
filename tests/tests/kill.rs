//! `kill -9` of the server at random moments, while the satellite lives on and remembers everything.
//!
//! The twin's journal is the witness of what was radiated; a watcher remembers what the stream and the API published; an
//! operator remembers what was acknowledged. After all kills the three are held against the archive.
//!
//! `KILLS` (200) and `KILL_SEED` (1) may be given in the environment; a failure prints them.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use api::{CommandView, DownloadView, EventView, FrameView, ImageView, OutcomeWord, Page};
use end_to_end::operator::Operator;
use end_to_end::process::gs_server;
use end_to_end::wait::{now, pause, until};
use end_to_end::watch::Watcher;
use end_to_end::{Client, Folder, Process, Server, Twin, journal};
use protocol::{DownFrame, Downlink, SealedUplink, Telecommand, open};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use satellite::JournalEntry;

/// Simulated seconds per second: an image takes a few seconds, and a machine that is late by 50 ms is late by one second.
const SPEED: f64 = 20.0;
/// A restart takes no longer; the test fails at ten times as much, for the machine may be busy.
const READY_WITHIN: Duration = Duration::from_secs(2);

fn from_environment(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

#[test]
fn kill_nine_at_any_moment_loses_nothing_that_was_told_and_repeats_no_nonce() {
    let kills = from_environment("KILLS", 200);
    let seed = from_environment("KILL_SEED", 1);
    eprintln!("KILLS={kills} KILL_SEED={seed}");
    let mut folder = Folder::new();
    folder.speed = Some(SPEED);
    folder.heartbeat_s = 10;
    let mut twin = Twin::start(&folder, &["--seed", &seed.to_string()]);

    let first = Server::start(&folder);
    let client = first.client.clone();
    let watcher = Watcher::default();
    let done = Arc::new(AtomicBool::new(false));
    let (watching, operating) = {
        let (watcher, following, done) = (watcher.clone(), client.clone(), Arc::clone(&done));
        let operator = Operator::new(client.clone(), seed);
        (
            std::thread::spawn(move || watcher.follow(&following)),
            std::thread::spawn(move || operator.work(&done)),
        )
    };
    let began = now();
    let ready = kill_again_and_again(&folder, first, &watcher, kills, seed);
    let took = began.elapsed();
    let last = Server::start(&folder);
    finish_an_image(&client);
    done.store(true, Ordering::Relaxed);
    let operator = operating.join().expect("the operator");
    pause(Duration::from_secs(1));
    watcher.done.store(true, Ordering::Relaxed);
    watching.join().expect("the watcher");
    assert!(twin.process.ended().is_none(), "the twin must live through it all");

    // The station goes on: what was radiated is looked up before what is stored, and what was sent after it.
    let earlier = journal::read(&folder.journal());
    let events: Vec<EventView> = client.all("/api/v1/events");
    let frames: Vec<FrameView> = client.all("/api/v1/frames");
    let commands = commands(&client);
    let entries = journal::read(&folder.journal());
    let radiated = radiated_is_stored(&folder, &earlier, &commands);
    let bridges = held_chunks_are_not_requested(&events, &frames, &commands);
    let published = published_is_kept(&watcher, &events, &frames, &entries);
    acknowledged_exists_once(&client, &operator, &commands);
    let images = images_are_the_satellites(&client, &folder);
    assert!(images > 0, "not one image came home");
    let in_hand = in_hand_at_kills(&events);
    if kills >= 100 {
        assert!(
            in_hand["sealed"] + in_hand["radiating"] >= 10,
            "the kills met too few commands in hand: {in_hand:?}"
        );
    }
    last.stop();

    let slowest = ready.iter().max().copied().unwrap_or_default();
    let late = ready.iter().filter(|took| **took > READY_WITHIN).count();
    eprintln!(
        "{kills} kills in {took:.1?} (0 violations: below {:.2} % at 95 %); ready again after {:.0?} in the middle, {slowest:.0?} at most, \
         {late} times above {READY_WITHIN:?}; published {published:?} events and frames; radiated {radiated}, bridges {bridges}, \
         images {images}; in hand when killed {in_hand:?}; {} intents acknowledged, {} asked again",
        300.0 / kills as f64,
        middle(&ready),
        operator.acknowledged.len(),
        operator.repeated,
    );
    assert!(slowest < 10 * READY_WITHIN, "ready again only after {slowest:?}");
}

fn middle(times: &[Duration]) -> Duration {
    let mut sorted = times.to_vec();
    sorted.sort_unstable();
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

/// Kills and starts; how long each start took that was let come to its end.
fn kill_again_and_again(
    folder: &Folder,
    first: Server,
    watcher: &Watcher,
    kills: u64,
    seed: u64,
) -> Vec<Duration> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut ready = vec![first.ready_after];
    let mut life = Some(first);
    for _ in 0..kills {
        if random.random_bool(0.15) {
            // In the middle of a start.
            if let Some(mut server) = life.take() {
                server.process.kill9();
            }
            let mut command = gs_server(["serve", "--config"]);
            command.arg(folder.write_config()).stdout(std::process::Stdio::null());
            let mut starting = Process::start(command, &folder.file("serve.log"));
            pause(Duration::from_millis(random.random_range(0..200)));
            starting.kill9();
            continue;
        }
        let mut server = life.take().unwrap_or_else(|| {
            let server = Server::start(folder);
            ready.push(server.ready_after);
            server
        });
        if random.random_bool(0.5) {
            pause(Duration::from_millis(random.random_range(0..2_000)));
        } else {
            // Shortly after a command reached a stage: between seal, witness, mark, transmission and answer.
            let before = watcher.stages.load(Ordering::Relaxed);
            let began = now();
            while watcher.stages.load(Ordering::Relaxed) == before
                && began.elapsed() < Duration::from_millis(1_500)
            {
                pause(Duration::from_millis(1));
            }
            let most_us = if random.random_bool(0.6) { 5_000 } else { 60_000 };
            pause(Duration::from_micros(random.random_range(0..most_us)));
        }
        server.process.kill9();
    }
    drop(life);
    ready
}

/// In peace at last: a download comes to its end.
fn finish_an_image(client: &Client) {
    until("a download is complete", Duration::from_secs(120), || {
        let page: Page<DownloadView> = client.read("/api/v1/downloads?limit=1000");
        page.items.iter().any(|download| download.state == "complete").then_some(())
    });
}

/// Every command with its stages.
fn commands(client: &Client) -> BTreeMap<u64, CommandView> {
    let list: Vec<CommandView> = client.all("/api/v1/commands");
    list.iter()
        .map(|command| (command.id, client.read(&format!("/api/v1/commands/{}", command.id))))
        .collect()
}

/// How many kills met a command in each stage between the queue and the answer.
fn in_hand_at_kills(events: &[EventView]) -> BTreeMap<&'static str, usize> {
    let mut found = BTreeMap::from(["sealed", "radiating", "radiated"].map(|stage| (stage, 0)));
    let mut stages: HashMap<u64, &str> = HashMap::new();
    for event in events {
        match (event.kind.as_str(), event.command) {
            ("command-stage", Some(id)) => {
                let words = event.message.split(" is ").nth(1).unwrap_or_default();
                stages.insert(id, words.split(':').next().unwrap_or_default());
            }
            ("station", _) => {
                for (stage, count) in &mut found {
                    *count += stages.values().filter(|at| *at == stage).count();
                }
                // What a start finds, it settles or goes on with; counted once.
                stages.clear();
            }
            _ => {}
        }
    }
    found
}

/// Each packet on the air carries a nonce of its own and was in the archive, marked, before; how many there were.
fn radiated_is_stored(
    folder: &Folder,
    entries: &[JournalEntry],
    commands: &BTreeMap<u64, CommandView>,
) -> usize {
    // "counter C, tag T" of the stage `sealed`, where the stage `radiating` of the same attempt follows.
    let mut marked: HashMap<String, &CommandView> = HashMap::new();
    for command in commands.values() {
        let stages = command.stages.as_deref().unwrap_or_default();
        for sealed in stages.iter().filter(|stage| stage.stage == "sealed") {
            if stages.iter().any(|stage| stage.stage == "radiating" && stage.attempt == sealed.attempt) {
                assert!(
                    marked.insert(sealed.why.clone(), command).is_none(),
                    "{} was sealed twice",
                    sealed.why
                );
            }
        }
    }
    let (packets, chatter): (Vec<&[u8]>, Vec<&[u8]>) = journal::radiated(entries)
        .into_iter()
        .partition(|packet| packet.windows(8).any(|eight| eight == b"DESTINY_"));
    // A twin that this machine let wait for a second of simulated time finds the mode switch and its repetitions as one
    // burst, which no module takes for a switch. It leads to no satellite: its first bytes are read as an address.
    for packet in chatter {
        assert!(is_mode_switch(packet), "neither a telecommand nor a mode switch: {}", hex::encode(packet));
    }
    let mut nonces = HashSet::new();
    for packet in &packets {
        assert_eq!(packet.len(), 240, "a cut packet was radiated: {}", hex::encode(packet));
        let sealed = SealedUplink::from_bytes((*packet).try_into().expect("240 bytes")).expect("an uplink");
        let nonce = sealed.nonce();
        assert!(nonces.insert(nonce), "nonce {nonce} was radiated twice");
        let opened = open(&folder.key(), &sealed).expect("our key");
        let tag = opened.tag().expect("a tag");
        let why = format!("counter {}, tag {tag}", nonce.counter());
        let command = marked.get(&why).unwrap_or_else(|| {
            let of_it = commands.values().filter(|c| c.stages.iter().flatten().any(|stage| stage.why == why));
            panic!("{why}: radiated and not in the archive as radiating: {:#?}", of_it.collect::<Vec<_>>())
        });
        let telecommand = opened.telecommand().expect("a telecommand");
        assert_eq!(telecommand.name(), command.command, "{why}");
        assert_eq!(api::telecommand::arguments(&telecommand), command.arguments, "{why}");
    }
    packets.len()
}

/// Whether these are pieces of `C0 C1 C2 C3 02 MODE` and nothing else.
fn is_mode_switch(packet: &[u8]) -> bool {
    packet.iter().all(|byte| matches!(byte, 0xC0..=0xC3 | 0x00..=0x03))
}

/// No chunk is asked for while it is held, unless a bridge was justified; the number of bridges.
fn held_chunks_are_not_requested(
    events: &[EventView],
    frames: &[FrameView],
    commands: &BTreeMap<u64, CommandView>,
) -> usize {
    let chunk_of: HashMap<u64, u16> = frames
        .iter()
        .filter_map(|frame| {
            let bytes = hex::decode(&frame.hex).ok()?;
            match DownFrame::parse(&bytes).ok()?.packet().ok()? {
                Downlink::ImageChunk(chunk) => Some((frame.id, chunk.index.0)),
                _ => None,
            }
        })
        .collect();
    let bridged: BTreeSet<u64> =
        events.iter().filter(|e| e.kind == "bridge").filter_map(|event| event.command).collect();
    let mut held: BTreeSet<u16> = BTreeSet::new();
    for event in events {
        match event.kind.as_str() {
            "image-declared" if event.image.is_some() => held.clear(),
            "chunk-received" if event.image.is_some() => {
                held.extend(event.frame.and_then(|id| chunk_of.get(&id)))
            }
            "command-stage"
                if event.message.contains(" is queued") || event.message.contains(" is radiating") =>
            {
                let Some(command) = event.command.and_then(|id| commands.get(&id)) else { continue };
                let again: Vec<u16> =
                    asked(command).into_iter().filter(|index| held.contains(index)).collect();
                assert!(
                    again.is_empty() || bridged.contains(&command.id),
                    "event {}: {} - asks for {again:?}, which are held",
                    event.sequence,
                    event.message
                );
            }
            _ => {}
        }
    }
    bridged.len()
}

/// Chunks that the machine asks for with this command.
fn asked(command: &CommandView) -> Vec<u16> {
    if command.download.is_none() {
        return Vec::new();
    }
    let range = |first: u16, count: u16| first..first.saturating_add(count);
    match api::telecommand::parse(&command.command, &command.arguments) {
        Ok(Telecommand::GetImageChunk { first, count }) => range(first, count).collect(),
        Ok(Telecommand::GetImageRanges(ranges)) => {
            ranges.ranges.iter().flat_map(|r| range(r.first, r.count)).collect()
        }
        _ => Vec::new(),
    }
}

/// What was told is still there, and is what the satellite sent; how many events and frames.
fn published_is_kept(
    watcher: &Watcher,
    events: &[EventView],
    frames: &[FrameView],
    entries: &[JournalEntry],
) -> (usize, usize) {
    let sent: HashSet<String> = entries
        .iter()
        .filter_map(|entry| match entry {
            JournalEntry::SatelliteSent { frame, .. } => Some(hex::encode(frame)),
            _ => None,
        })
        .collect();
    let kept_events: HashMap<i64, &EventView> = events.iter().map(|event| (event.sequence, event)).collect();
    let kept_frames: HashMap<u64, &str> = frames.iter().map(|frame| (frame.id, frame.hex.as_str())).collect();
    for frame in frames {
        assert!(sent.contains(&frame.hex), "frame {} was never sent: {}", frame.id, frame.hex);
    }
    watcher.published(|told| {
        assert!(told.contradictions.is_empty(), "{:#?}", told.contradictions);
        for (place, event) in &told.events {
            assert_eq!(kept_events.get(place), Some(&event), "event {place} was told");
            if let Some(id) = event.frame {
                assert!(kept_frames.contains_key(&id), "frame {id} was told by event {place}");
            }
        }
        for (id, hex) in &told.frames {
            assert_eq!(kept_frames.get(id), Some(&hex.as_str()), "frame {id} was told");
        }
        (told.events.len(), told.frames.len())
    })
}

/// Each acknowledged intent is there, once; asked again, it is the same.
fn acknowledged_exists_once(client: &Client, operator: &Operator, commands: &BTreeMap<u64, CommandView>) {
    let ids: Vec<u64> = operator.acknowledged.values().filter_map(|said| said.outcome.command).collect();
    let distinct: BTreeSet<u64> = ids.iter().copied().collect();
    assert_eq!(distinct.len(), ids.len(), "two intents became one command");
    let theirs: BTreeSet<u64> =
        commands.values().filter(|command| command.principal == "local").map(|command| command.id).collect();
    // The one that was under way when the operator went home may be there without an answer.
    let unanswered: Vec<u64> = theirs.difference(&distinct).copied().collect();
    assert!(unanswered.len() <= 1, "commands that nobody asked for, or twice: {unanswered:?}");
    for (key, said) in &operator.acknowledged {
        if said.outcome.outcome == OutcomeWord::CommandQueued {
            assert!(said.outcome.command.is_some_and(|id| theirs.contains(&id)), "{key} is lost");
        }
        let again = client.post(said.path, key, &said.body).expect("an answer");
        assert_eq!(again.header("idempotency-replayed"), Some("true"), "{key}");
        assert_eq!(again.json::<api::Outcome>(), said.outcome, "{key}");
    }
}

/// Each complete image is one that the satellite had; how many there are.
fn images_are_the_satellites(client: &Client, folder: &Folder) -> usize {
    let images: Vec<ImageView> = client.all("/api/v1/images");
    let complete = images.iter().filter(|image| image.complete);
    let complete: Vec<(&ImageView, Vec<u8>)> = complete
        .map(|image| {
            let file = client.get(&format!("/api/v1/images/{}/file", image.id)).expect("the file");
            (image, file.body)
        })
        .collect();
    // The station goes on: what was sent is looked up after what came home, or the newest image is missing in it.
    let sent = journal::images(&journal::read(&folder.journal()));
    for (image, file) in &complete {
        assert!(sent.contains(file), "image {} is none of the satellite's {}", image.id, sent.len());
        assert_eq!(image.conflicts, 0);
    }
    complete.len()
}
