//! What is told to many at once: events made ready once for all streams, and the status.
//!
//! One task listens to the hub. It hands on at once what comes after a pause, and gathers what follows within a moment into
//! a batch, so that a burst costs each stream one write. What a topic says of an event is looked up and written when the first
//! stream asks for it, and shared from then on.

use std::sync::Arc;
use std::time::Duration;

use api::{StreamMessage, StreamValue, Topic};
use axum::extract::ws::Utf8Bytes;
use mission::record::EventKind;
use protocol::DownFrame;
use tokio::sync::broadcast::{self, error::RecvError};
use tokio::sync::{OnceCell, watch};
use tokio_util::sync::CancellationToken;

use super::super::{App, commands, events, extract, frames, runs, station};
use super::recent::{After, Recent};
use crate::clock::wall_sleep;
use crate::storage::{Page, Scope, Store, StoreError, StoredEvent};

/// After a batch, what comes within this time goes out together.
const GATHER: Duration = Duration::from_millis(30);
/// Events of a batch at most.
const BATCH_MAX: usize = 256;
/// Batches that a stream may lag behind before it has to read the archive: seconds of a busy station.
const BATCHES: usize = 256;
/// Status messages are at least this far apart.
const STATUS_PAUSE: Duration = Duration::from_millis(250);
/// A status comes at least so often, so that the client sees that we live.
const STATUS_QUIET: Duration = Duration::from_secs(1);

/// An event, and what each topic says of it once somebody has asked.
pub(in crate::http) struct Prepared {
    event: Arc<StoredEvent>,
    told: [OnceCell<Option<Utf8Bytes>>; 5],
}

impl Prepared {
    pub(in crate::http) fn new(event: Arc<StoredEvent>) -> Self {
        Self { event, told: Default::default() }
    }

    pub(super) fn sequence(&self) -> i64 {
        self.event.sequence
    }

    /// Whether it is told to somebody who wants to hear of these satellites (of all when there are none).
    pub(super) fn concerns(&self, satellites: &[String]) -> bool {
        let of = self.event.record.satellite.as_ref();
        satellites.is_empty() || of.is_none_or(|id| satellites.iter().any(|name| name == id.as_str()))
    }

    /// What a topic says of it; `None` when nothing.
    pub(in crate::http) async fn text(
        &self,
        topic: Topic,
        store: &Store,
    ) -> Result<Option<Utf8Bytes>, StoreError> {
        let (place, kind) = match topic {
            Topic::Events => (0, None),
            Topic::Frames => (1, Some(EventKind::FrameHeard)),
            Topic::Telemetry => (2, Some(EventKind::FrameHeard)),
            Topic::Commands => (3, Some(EventKind::CommandStage)),
            Topic::Runs => (4, Some(EventKind::Plan)),
            Topic::Status => return Ok(None),
        };
        if kind.is_some_and(|kind| kind != self.event.record.kind) {
            return Ok(None);
        }
        let Some(told) = self.told.get(place) else { return Ok(None) };
        let made = told.get_or_try_init(|| async {
            let message = message(&self.event, topic, store).await?;
            Ok::<_, StoreError>(message.as_ref().and_then(write))
        });
        made.await.cloned()
    }
}

/// A message as it goes out; `None` (and a line in the log) when it cannot be written, which would be a fault of ours.
pub(super) fn write(message: &StreamMessage) -> Option<Utf8Bytes> {
    match serde_json::to_string(message) {
        Ok(text) => Some(Utf8Bytes::from(text)),
        Err(error) => {
            tracing::error!(%error, "A message of the stream could not be written.");
            None
        }
    }
}

async fn message(
    event: &StoredEvent,
    topic: Topic,
    store: &Store,
) -> Result<Option<StreamMessage>, StoreError> {
    let (sequence, record) = (event.sequence, &event.record);
    let row = |id: u64| i64::try_from(id).unwrap_or(i64::MAX);
    Ok(match topic {
        Topic::Events => Some(StreamMessage::Event(events::view(event))),
        Topic::Frames | Topic::Telemetry => {
            let Some(id) = record.subject.frame else { return Ok(None) };
            let Some(heard) = store.frame(row(id.0)).await? else { return Ok(None) };
            if topic == Topic::Frames {
                let frame = frames::view(&heard.frame, heard.receptions);
                return Ok(Some(StreamMessage::Frame { sequence, frame }));
            }
            let values = values(&heard.frame.bytes);
            // Nested frames change nothing, and chunks bring no values.
            (!values.is_empty() && !heard.frame.nested).then(|| StreamMessage::Telemetry {
                sequence,
                frame: id.0,
                satellite: heard.frame.satellite,
                station: heard.frame.station,
                link: heard.frame.link,
                at: extract::time(heard.frame.heard_at_us),
                values,
            })
        }
        Topic::Commands => {
            let Some(id) = record.subject.command else { return Ok(None) };
            let life = store.command(row(id.0)).await?;
            life.map(|life| commands::short_life(&life))
                .transpose()?
                .map(|command| StreamMessage::Command { sequence, command })
        }
        Topic::Runs => {
            let Some(satellite) = &record.satellite else { return Ok(None) };
            let scope = Scope { satellite: Some(satellite.to_string()), ..Scope::default() };
            let newest = Page { after: None, before: None, limit: 1 };
            match store.runs(&scope, &newest).await?.first() {
                Some(row) => Some(StreamMessage::Run { sequence, run: runs::view_of(store, row).await? }),
                None => None,
            }
        }
        Topic::Status => None,
    })
}

fn values(bytes: &[u8]) -> Vec<StreamValue> {
    let packet = DownFrame::parse(bytes).ok().and_then(|frame| frame.packet().ok());
    let points = packet.iter().flat_map(mission::telemetry::points);
    points
        .map(|point| StreamValue {
            parameter: point.parameter,
            unit: point.unit.to_owned(),
            value: point.value,
        })
        .collect()
}

/// Events that go out together, in order.
pub(super) struct Batch {
    pub(super) events: Vec<Prepared>,
}

impl Batch {
    pub(super) fn first(&self) -> Option<i64> {
        self.events.first().map(Prepared::sequence)
    }

    pub(super) fn last(&self) -> Option<i64> {
        self.events.last().map(Prepared::sequence)
    }

    /// Each event follows the one before.
    pub(super) fn is_whole(&self) -> bool {
        follow_each_other(&self.events)
    }
}

pub(super) fn follow_each_other(events: &[Prepared]) -> bool {
    events
        .iter()
        .zip(events.iter().skip(1))
        .all(|(one, next)| next.sequence() == one.sequence().saturating_add(1))
}

/// Where streams listen. Cheap to clone.
#[derive(Clone)]
pub(in crate::http) struct Feed {
    batches: broadcast::Sender<Arc<Batch>>,
    status: watch::Sender<Utf8Bytes>,
    recent: Arc<Recent>,
}

impl Feed {
    pub(in crate::http) fn new() -> Self {
        Self {
            batches: broadcast::Sender::new(BATCHES),
            status: watch::Sender::new(Utf8Bytes::default()),
            recent: Arc::default(),
        }
    }

    pub(super) fn batches(&self) -> broadcast::Receiver<Arc<Batch>> {
        self.batches.subscribe()
    }

    pub(super) fn status(&self) -> watch::Receiver<Utf8Bytes> {
        self.status.subscribe()
    }

    /// What there is after an event, as far as it is at hand. Subscribe to the [batches](Self::batches) before.
    pub(super) fn after(&self, event: Option<i64>) -> Option<After> {
        self.recent.after(event)
    }

    /// Gathers and hands out until `stop`.
    pub(in crate::http) async fn run(self, app: App, stop: CancellationToken) {
        let hub = app.state.hub.subscribe();
        tokio::select! {
            () = stop.cancelled() => {}
            () = self.gather(hub) => {}
            () = self.tell_status(&app) => {}
        }
    }

    async fn gather(&self, mut hub: broadcast::Receiver<Arc<StoredEvent>>) {
        loop {
            // A hub that left something out is no matter here: streams see the hole and read the archive.
            let first = match hub.recv().await {
                Ok(event) => event,
                Err(RecvError::Lagged(_)) => continue,
                Err(RecvError::Closed) => return,
            };
            let mut events = vec![Prepared::new(first)];
            while events.len() < BATCH_MAX
                && let Ok(event) = hub.try_recv()
            {
                events.push(Prepared::new(event));
            }
            let batch = Arc::new(Batch { events });
            // At hand before it is sent: whoever subscribes in between has it twice, and not never.
            self.recent.add(&batch);
            // Nobody listening is no error.
            let _ = self.batches.send(batch);
            wall_sleep(GATHER).await;
        }
    }

    async fn tell_status(&self, app: &App) {
        if let Ok(last) = app.state.store.last_event_seq().await {
            self.recent.begin(last);
        }
        let mut changes = app.state.engine.status_changes();
        loop {
            if self.status.receiver_count() > 0
                && let Some(text) = self.status_now(app)
            {
                self.status.send_replace(text);
            }
            wall_sleep(STATUS_PAUSE).await;
            let quiet = wall_sleep(STATUS_QUIET.saturating_sub(STATUS_PAUSE));
            tokio::select! {
                changed = changes.changed() => if changed.is_err() { return },
                () = quiet => {}
            }
        }
    }

    /// The status as it is now.
    pub(super) fn status_now(&self, app: &App) -> Option<Utf8Bytes> {
        let status = app.state.engine.status();
        write(&StreamMessage::Status(station::view(app, &status, self.recent.last())))
    }
}
