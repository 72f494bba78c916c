//! Messages of boards on their way into the archive: a queue bounded by bytes, and one worker behind it.
//!
//! A message that its sender forgets at once (QoS 0) waits a moment while the queue is full, which holds the sender back;
//! then it is dropped and counted, and so is what comes until half of the queue is empty again: what our own radio hears
//! goes first. A message whose sender wants a word (QoS 1, 2) waits for room as long as it takes, and the word is said when
//! the archive has it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use mission::SatelliteId;
use mission::reception::{Content, Ear, Refusal};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, oneshot};
use tokio_util::sync::CancellationToken;

use super::boards::{Boards, Told};
use super::status::Way;
use crate::clock::{wall_sleep, within};
use crate::ingest::formats::{self, Context, RECEPTION_MAX, Read, Topic};
use crate::ingest::{Aliases, Ears};

/// Bytes that messages which wait, and those that are being stored, may have together.
const ROOM: usize = 2 << 20;
/// What a message counts for at least: it costs more than its payload.
const LEAST: usize = 2 << 10;
/// Messages that are taken together.
const TOGETHER: usize = 256;
/// So long a reader waits for room once it has become full.
const PATIENCE: Duration = Duration::from_millis(500);
/// How often a delivery is tried while storage does not keep up, a second apart, before it is begun anew.
const TRIES: u32 = 30;

/// A message that waits.
struct Waiting {
    topic: Topic,
    payload: Vec<u8>,
    arrived: mission::UtcUs,
    /// Where the sender is told that the archive has it.
    stored: Option<oneshot::Sender<()>>,
    /// Its part of the room.
    _room: OwnedSemaphorePermit,
}

/// What became of a message.
pub(super) enum Came {
    /// It is dealt with, well or not.
    Done(Told),
    /// It waits: a word comes through here when the archive has it, and none when it never will.
    Waits(oneshot::Receiver<()>),
}

/// The way into the queue. Cheap to clone.
#[derive(Clone)]
pub(super) struct Intake {
    queue: mpsc::Sender<Waiting>,
    room: Arc<Semaphore>,
    /// Somebody waited for room in vain: nobody else does until half of it is free again.
    overrun: Arc<AtomicBool>,
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
        let (sender, receiver) = mpsc::channel(ROOM / LEAST);
        let worker = Worker {
            queue: receiver,
            ears: ears.clone(),
            aliases,
            satellite,
            boards: boards.clone(),
            way: Arc::clone(&way),
        };
        let (room, overrun) = (Arc::new(Semaphore::new(ROOM)), Arc::default());
        (Self { queue: sender, room, overrun, ears, boards, way }, worker)
    }

    /// Takes a message in. What is none of a board's, or finds no room, is counted and gone. `wants_word`: the sender keeps
    /// it until it is told that the archive has it.
    pub(super) async fn message(&self, topic: &str, payload: &[u8], wants_word: bool) -> Came {
        self.way.count("messages");
        let Some(topic) = Topic::parse(topic) else {
            self.way.count("other-topics");
            return Came::Done(Told::Nothing);
        };
        self.of_board(topic, payload, wants_word).await
    }

    /// The same, of a topic that was looked at.
    pub(super) async fn of_board(&self, topic: Topic, payload: &[u8], wants_word: bool) -> Came {
        let arrived = self.ears.now();
        let nothing = Came::Done(Told::Nothing);
        if (topic.kind.as_str(), topic.name.as_str()) != ("tele", "rx") {
            if depth(payload) > formats::DEPTH_MAX {
                self.way.count(Refusal::TooDeep.name());
                return nothing;
            }
            return Came::Done(self.boards.told(&topic, &self.way.name, payload, arrived));
        }
        if payload.len() > RECEPTION_MAX {
            self.too_long();
            return nothing;
        }
        let Some(room) = self.room_for(payload.len(), wants_word).await else {
            self.way.count(Refusal::NoRoom.name());
            self.ears.refuse(Ear::OwnMqtt, Refusal::NoRoom);
            return nothing;
        };
        let (stored, word) = wants_word.then(oneshot::channel).unzip();
        let waiting = Waiting { topic, payload: payload.to_vec(), arrived, stored, _room: room };
        // Whoever has room finds a place in the queue. It is closed when the server ends: then no word comes.
        let _ = self.queue.send(waiting).await;
        word.map_or(nothing, Came::Waits)
    }

    async fn room_for(&self, bytes: usize, wants_word: bool) -> Option<OwnedSemaphorePermit> {
        let share = u32::try_from(bytes.max(LEAST)).ok()?;
        if let Ok(room) = Arc::clone(&self.room).try_acquire_many_owned(share) {
            if self.room.available_permits() > ROOM / 2 {
                self.overrun.store(false, Ordering::Relaxed);
            }
            return Some(room);
        }
        let waiting = Arc::clone(&self.room).acquire_many_owned(share);
        if wants_word {
            return waiting.await.ok();
        }
        if self.overrun.load(Ordering::Relaxed) {
            return None;
        }
        let room = within(PATIENCE, waiting).await;
        self.overrun.store(true, Ordering::Relaxed);
        room?.ok()
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
            let found = waiting.iter().flat_map(|waiting| self.read(waiting)).collect::<Vec<Read>>();
            if !self.deliver(found, &stop).await {
                return;
            }
            for stored in waiting.drain(..).filter_map(|waiting| waiting.stored) {
                // Who has gone meanwhile sends it again.
                let _ = stored.send(());
            }
        }
    }

    fn read(&self, waiting: &Waiting) -> Vec<Read> {
        let Waiting { topic, payload, arrived, .. } = waiting;
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

    /// Nothing is given up while the server runs: the archive takes it, sooner or later. Whether it has.
    async fn deliver(&self, found: Vec<Read>, stop: &CancellationToken) -> bool {
        // Refusals are counted once, receptions may be delivered again.
        let (receptions, mut refused): (Vec<Read>, Vec<Read>) = found.into_iter().partition(Read::is_ok);
        loop {
            let mut all = receptions.clone();
            all.append(&mut refused);
            match self.ears.take_patiently(&self.satellite, Ear::OwnMqtt, all, TRIES).await {
                Ok(outcome) => {
                    self.way.brought(outcome.frames + outcome.merged + outcome.without_frame > 0);
                    return true;
                }
                Err(error) => {
                    tracing::warn!(ear = %self.way.name, %error, "what came is not stored yet: {error}");
                    self.way.count("store-retries");
                }
            }
            tokio::select! {
                () = stop.cancelled() => return false,
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
