//! What the app knows of the world: plain values, no window and no network. [`Model::apply`] takes what the stream
//! tells; what the stream cannot tell is asked for, and kept with its age.
//!
//! Nothing grows without a bound: lists keep their newest, values their newest [`VALUES_MAX`] each.

mod connection;
mod fetched;
mod resource;
mod server_clock;
mod values;

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use api::client::StreamItem;
use api::{
    AlertView, ApprovalView, CommandView, DownloadView, EventView, FrameView, HeldElements, ImageView,
    LatestValue, LimitView, Page, ParameterView, PassList, PlanView, ReceiverView, RehearsalView, RunView,
    ScheduleView, SessionView, StationView, StreamMessage, Version,
};

pub use connection::Connection;
pub use fetched::Fetched;
pub use resource::Resource;
pub use server_clock::{ClockDoubt, ServerClock};
pub use values::{Point, VALUES_MAX, Values};

/// The server says how it is at least once a second: after so long a silence something is wrong.
const SILENCE: Duration = Duration::from_millis(2500);
/// Events that are kept at hand.
const EVENTS_MAX: usize = 2000;
/// Frames that are kept at hand.
const FRAMES_MAX: usize = 500;
/// Commands that are kept at hand.
const COMMANDS_MAX: usize = 1000;

/// What is known of one server.
#[derive(Debug)]
pub struct Model {
    /// Its address.
    pub address: String,
    /// How the line is.
    pub connection: Connection,
    /// Counts archives: what was derived from another one is void.
    pub world: u64,
    /// What time it is there.
    pub clock: ServerClock,
    /// How the station is, and when that was said.
    pub status: Option<(StationView, Instant)>,
    /// Who the server is.
    pub version: Fetched<Version>,
    /// Who we are there.
    pub session: Fetched<SessionView>,
    /// Passes of the coming two days.
    pub passes: Fetched<PassList>,
    /// Which plan gets which pass.
    pub schedule: Fetched<ScheduleView>,
    /// Plans in use.
    pub plans: Fetched<Page<PlanView>>,
    /// Runs, newest first.
    pub runs: Fetched<Page<RunView>>,
    /// Rehearsals, newest first.
    pub rehearsals: Fetched<Page<RehearsalView>>,
    /// Open alerts.
    pub alerts: Fetched<Page<AlertView>>,
    /// What waits for a second person.
    pub approvals: Fetched<Page<ApprovalView>>,
    /// Values judged by their limits.
    pub limits: Fetched<Page<LimitView>>,
    /// The newest value of each parameter, when we came.
    pub latest: Fetched<Page<LatestValue>>,
    /// Which values there are.
    pub parameters: Fetched<Page<ParameterView>>,
    /// Commands as the archive had them.
    pub commands: Fetched<Page<CommandView>>,
    /// Standing orders for images.
    pub downloads: Fetched<Page<DownloadView>>,
    /// Images, newest first.
    pub images: Fetched<Page<ImageView>>,
    /// Frames as the archive had them.
    pub frames: Fetched<Page<FrameView>>,
    /// Events as the archive had them.
    pub events: Fetched<Page<EventView>>,
    /// Elements held.
    pub elements: Fetched<Page<HeldElements>>,
    /// Who hears the satellite.
    pub receivers: Fetched<Page<ReceiverView>>,
    /// Events that came by the stream, oldest first.
    pub live_events: VecDeque<EventView>,
    /// Frames that came by the stream, oldest first.
    pub live_frames: VecDeque<FrameView>,
    /// Commands that changed, as the stream told, by number.
    pub live_commands: BTreeMap<u64, CommandView>,
    /// Runs that changed, by number.
    pub live_runs: BTreeMap<u64, RunView>,
    /// Values as they came.
    pub values: Values,
}

impl Model {
    /// Of a server that was not reached yet.
    #[must_use]
    pub fn new(address: String) -> Self {
        Self {
            address,
            connection: Connection::Connecting,
            world: 0,
            clock: ServerClock::default(),
            status: None,
            version: Fetched::default(),
            session: Fetched::default(),
            passes: Fetched::default(),
            schedule: Fetched::default(),
            plans: Fetched::default(),
            runs: Fetched::default(),
            rehearsals: Fetched::default(),
            alerts: Fetched::default(),
            approvals: Fetched::default(),
            limits: Fetched::default(),
            latest: Fetched::default(),
            parameters: Fetched::default(),
            commands: Fetched::default(),
            downloads: Fetched::default(),
            images: Fetched::default(),
            frames: Fetched::default(),
            events: Fetched::default(),
            elements: Fetched::default(),
            receivers: Fetched::default(),
            live_events: VecDeque::new(),
            live_frames: VecDeque::new(),
            live_commands: BTreeMap::new(),
            live_runs: BTreeMap::new(),
            values: Values::default(),
        }
    }

    /// Takes what the stream tells; `unix_us` is this machine's clock. Returns what must be asked for anew.
    pub fn apply(&mut self, item: StreamItem, now: Instant, unix_us: i64) -> Vec<Resource> {
        match item {
            StreamItem::Connected { version, .. } => {
                self.connection = Connection::CatchingUp { version };
                Resource::ALL.to_vec()
            }
            StreamItem::Gap { .. } => {
                // Another archive: what is held is of another world.
                let fresh = Self {
                    connection: Connection::CatchingUp { version: String::new() },
                    world: self.world + 1,
                    ..Self::new(self.address.clone())
                };
                *self = fresh;
                Resource::ALL.to_vec()
            }
            StreamItem::Live { .. } => {
                self.connection = Connection::Live { since: now };
                Vec::new()
            }
            StreamItem::Lost { why, again_in } => {
                let since = match self.connection {
                    Connection::Lost { since, .. } => since,
                    _ => now,
                };
                self.connection = Connection::Lost { since, why, again_at: now + again_in };
                Vec::new()
            }
            StreamItem::Message(message) => self.hear(*message, now, unix_us),
        }
    }

    fn hear(&mut self, message: StreamMessage, now: Instant, unix_us: i64) -> Vec<Resource> {
        match message {
            StreamMessage::Status(status) => {
                self.clock.hear(status.at.unix_us(), status.simulated, now, unix_us);
                self.status = Some((status, now));
                Vec::new()
            }
            StreamMessage::Event(event) => {
                let stale = Resource::touched_by(&event.kind);
                push(&mut self.live_events, event, EVENTS_MAX);
                stale.to_vec()
            }
            StreamMessage::Frame { frame, .. } => {
                push(&mut self.live_frames, frame, FRAMES_MAX);
                Vec::new()
            }
            StreamMessage::Telemetry { satellite, at, values, frame, .. } => {
                for value in values {
                    let point = Point { at_us: at.unix_us(), value: value.value, frame };
                    self.values.add(&satellite, &value.parameter, &value.unit, point);
                }
                Vec::new()
            }
            StreamMessage::Command { command, .. } => {
                keep(&mut self.live_commands, command.id, command, COMMANDS_MAX);
                Vec::new()
            }
            StreamMessage::Run { run, .. } => {
                keep(&mut self.live_runs, run.id, run, COMMANDS_MAX);
                vec![Resource::Runs]
            }
            StreamMessage::Hello { .. } | StreamMessage::Subscribed { .. } | StreamMessage::Live { .. } => {
                Vec::new()
            }
        }
    }

    /// How long what is shown has been old: the line is lost, or the server has been silent for too long. `None` while all
    /// is well, and before anything came.
    #[must_use]
    pub fn old_for(&self, now: Instant) -> Option<Duration> {
        let silent = self.clock.silent_for(now);
        match self.connection {
            Connection::Connecting => None,
            Connection::Lost { since, .. } => {
                Some(silent.unwrap_or_default().max(now.saturating_duration_since(since)))
            }
            Connection::CatchingUp { .. } | Connection::Live { .. } => {
                silent.filter(|silent| *silent > SILENCE)
            }
        }
    }

    /// The commands, newest first: each as it was told last.
    pub fn all_commands(&self) -> impl Iterator<Item = &CommandView> {
        let old = self.commands.value().map_or(&[][..], |page| &page.items);
        let old = old.iter().filter(|command| !self.live_commands.contains_key(&command.id));
        let mut all: Vec<&CommandView> = self.live_commands.values().chain(old).collect();
        all.sort_unstable_by_key(|command| std::cmp::Reverse(command.id));
        all.into_iter()
    }
}

fn push<T>(ring: &mut VecDeque<T>, item: T, most: usize) {
    if ring.len() >= most {
        ring.pop_front();
    }
    ring.push_back(item);
}

fn keep<T>(map: &mut BTreeMap<u64, T>, id: u64, item: T, most: usize) {
    map.insert(id, item);
    while map.len() > most {
        map.pop_first();
    }
}
