//! Messages of boards on their way into the archive: a bounded queue, and one worker behind it.
//!
//! Whoever reads a socket waits a moment while the queue is full, which holds the sender back, and then drops what came
//! and counts it: what our own radio hears goes first.

use std::sync::Arc;
use std::time::Duration;

use mission::SatelliteId;
use mission::reception::{Content, Ear, Refusal};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use super::boards::{Boards, Told};
use super::status::Way;
use crate::clock::{wall_sleep, within};
use crate::ingest::formats::{self, Context, RECEPTION_MAX, Read, Topic};
use crate::ingest::{Aliases, Ears};

/// Messages that wait: of 16 KiB at most, for four megabytes.
const QUEUE: usize = 256;
/// Messages that are taken together.
const TOGETHER: usize = 64;
/// So long a reader waits for room.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often a delivery is tried while storage does not keep up, a second apart, before it is begun anew.
const TRIES: u32 = 30;

/// A message that waits.
struct Waiting {
    topic: Topic,
    payload: Vec<u8>,
    arrived: mission::UtcUs,
}

/// The way into the queue. Cheap to clone.
#[derive(Clone)]
pub(super) struct Intake {
    queue: mpsc::Sender<Waiting>,
    ears: Ears,
    boards: Boards,
    way: Arc<Way>,
}

/// The worker behind it.
pub(super) struct Worker {
    queue: mpsc::Receiver<Waiting>,
    ears: Ears,
    aliases: Aliases,
    satellite: SatelliteId,
    boards: Boards,
    way: Arc<Way>,
}

impl Intake {
    pub(super) fn new(
        ears: Ears,
        aliases: Aliases,
        satellite: SatelliteId,
        boards: Boards,
        way: Arc<Way>,
    ) -> (Self, Worker) {
        let (sender, receiver) = mpsc::channel(QUEUE);
        let worker = Worker {
            queue: receiver,
            ears: ears.clone(),
            aliases,
            satellite,
            boards: boards.clone(),
            way: Arc::clone(&way),
        };
        (Self { queue: sender, ears, boards, way }, worker)
    }

    /// Takes a message in. What is none of a board's, or finds no room, is counted and gone.
    pub(super) async fn message(&self, topic: &str, payload: &[u8]) -> Told {
        self.way.count("messages");
        let Some(topic) = Topic::parse(topic) else {
            self.way.count("other-topics");
            return Told::Nothing;
        };
        self.of_board(topic, payload).await
    }

    /// The same, of a topic that was looked at.
    pub(super) async fn of_board(&self, topic: Topic, payload: &[u8]) -> Told {
        let arrived = self.ears.now();
        if (topic.kind.as_str(), topic.name.as_str()) != ("tele", "rx") {
            if depth(payload) > formats::DEPTH_MAX {
                self.way.count(Refusal::TooDeep.name());
                return Told::Nothing;
            }
            return self.boards.told(&topic, &self.way.name, payload, arrived);
        }
        if payload.len() > RECEPTION_MAX {
            self.too_long();
            return Told::Nothing;
        }
        let waiting = Waiting { topic, payload: payload.to_vec(), arrived };
        match within(PATIENCE, self.queue.send(waiting)).await {
            Some(Ok(())) => {}
            // The server ends.
            Some(Err(_)) => {}
            None => self.way.count("no-room"),
        }
        Told::Nothing
    }

    /// A reception that was passed over unread, because it was too long.
    pub(super) fn too_long(&self) {
        self.way.count(Refusal::TooLong.name());
        self.ears.refuse(Ear::OwnMqtt, Refusal::TooLong);
    }
}

impl Worker {
    /// Works until `stop`, and takes in then what waits already.
    pub(super) async fn run(mut self, stop: CancellationToken) {
        let mut waiting = Vec::with_capacity(TOGETHER);
        loop {
            tokio::select! {
                biased;
                count = self.queue.recv_many(&mut waiting, TOGETHER) => {
                    if count == 0 {
                        return stop.cancelled().await;
                    }
                }
                () = stop.cancelled() => return,
            }
            let found = waiting.drain(..).flat_map(|waiting| self.read(&waiting)).collect::<Vec<Read>>();
            self.deliver(found, &stop).await;
        }
    }

    fn read(&self, waiting: &Waiting) -> Vec<Read> {
        let Waiting { topic, payload, arrived } = waiting;
        let context = Context {
            arrived: Some(*arrived),
            board_read_at_reception: self.boards.reads_at_reception(topic),
            ..Context::file(self.aliases.admission(&self.satellite, self.ears.now()))
        };
        let found = formats::rx(topic, payload, &context);
        for read in &found {
            let has_bytes = !matches!(read, Ok(reception) if reception.content == Content::Detection);
            self.boards.heard(topic, &self.way.name, has_bytes, *arrived);
            match read {
                Ok(_) => self.way.count("receptions"),
                Err(refused) => self.way.count(refused.reason.name()),
            }
        }
        found
    }

    /// Nothing is given up while the server runs: the archive takes it, sooner or later.
    async fn deliver(&self, found: Vec<Read>, stop: &CancellationToken) {
        // Refusals are counted once, receptions may be delivered again.
        let (receptions, mut refused): (Vec<Read>, Vec<Read>) = found.into_iter().partition(Read::is_ok);
        loop {
            let mut all = receptions.clone();
            all.append(&mut refused);
            match self.ears.take_patiently(&self.satellite, Ear::OwnMqtt, all, TRIES).await {
                Ok(outcome) => {
                    self.way.brought(outcome.frames + outcome.merged + outcome.without_frame > 0);
                    return;
                }
                Err(error) => {
                    tracing::warn!(ear = %self.way.name, %error, "what came is not stored yet: {error}");
                    self.way.count("store-retries");
                }
            }
            tokio::select! {
                () = stop.cancelled() => return,
                () = wall_sleep(Duration::from_secs(1)) => {}
            }
        }
    }
}

/// How deep lists and objects lie in one another, by their brackets outside of strings.
fn depth(text: &[u8]) -> u32 {
    let (mut depth, mut most, mut in_string, mut escaped) = (0_u32, 0, false, false);
    for byte in text {
        match byte {
            _ if escaped => escaped = false,
            b'\\' if in_string => escaped = true,
            b'"' => in_string = !in_string,
            b'{' | b'[' if !in_string => {
                depth += 1;
                most = most.max(depth);
            }
            b'}' | b']' if !in_string => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    most
}
