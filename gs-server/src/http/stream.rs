//! `GET /api/v1/stream?after=SEQUENCE`: events in order, each once and without a hole, and the status.
//!
//! The archive is the queue. A stream remembers the last event it sent; what is newer is read from the archive until
//! there is no more, then taken from the hub, and from the archive again whenever the hub had to leave something out.
//! So a slow client costs no memory: it lags behind in the archive, and one that takes nothing at all is let go.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use api::{API_VERSION, ProblemKind, StreamMessage};
use axum::extract::State;
use axum::extract::ws::{
    CloseFrame, Message, Utf8Bytes, WebSocket, WebSocketUpgrade, close_code,
    rejection::WebSocketUpgradeRejection,
};
use axum::response::Response;
use serde::Deserialize;
use tokio::sync::broadcast::{self, error::RecvError};

use super::App;
use super::extract::Query;
use super::problem::Failure;
use super::{events, station};
use crate::clock::{wall_sleep, within};
use crate::people::Caller;
use crate::storage::{EventQuery, Page, StoreError, StoredEvent};

/// Bytes that a client's message may have; it has nothing to say.
const MESSAGE_MAX: usize = 64 * 1024;
/// Bytes that may wait to be written before a send waits.
const WRITE_BUFFER: usize = 64 * 1024;
/// Events read from the archive at once.
const REPLAY_PAGE: u32 = 500;
/// A client that takes nothing for so long is let go.
const PATIENCE: Duration = Duration::from_secs(10);
/// Status messages are at least this far apart.
const STATUS_PAUSE: Duration = Duration::from_millis(250);
/// A status comes at least so often, so that the client sees that we live.
const STATUS_QUIET: Duration = Duration::from_secs(1);
/// A ping comes so often; a client that does not answer three in a row is gone.
const PING_EVERY: Duration = Duration::from_secs(15);
const PINGS_UNANSWERED: u32 = 3;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Asked {
    after: Option<i64>,
}

pub(super) async fn open(
    State(app): State<App>,
    Query(asked): Query<Asked>,
    caller: Caller,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Failure> {
    let upgrade = upgrade.map_err(|_| {
        Failure::new(ProblemKind::UpgradeRequired, "Open this path as a WebSocket (ws:// or wss://).")
    })?;
    let place = Arc::clone(&app.streams).try_acquire_owned().map_err(|_| {
        Failure::new(ProblemKind::TooManyStreams, format!("{} streams are open already.", super::STREAMS_MAX))
    })?;
    let upgrade = upgrade
        .max_message_size(MESSAGE_MAX)
        .max_frame_size(MESSAGE_MAX)
        .write_buffer_size(0)
        .max_write_buffer_size(WRITE_BUFFER);
    Ok(upgrade.on_upgrade(move |socket| async move {
        let metrics = app.state.engine.metrics().clone();
        let open = metrics.stream();
        let mut follower = Follower { app, caller, socket, last: 0, unanswered: 0 };
        let why = follower.follow(asked.after).await;
        drop(open);
        metrics.stream_ended(why.word());
        follower.close(why).await;
        drop(place);
    }))
}

/// Why a stream ends.
#[derive(Debug, Clone, Copy)]
enum End {
    /// The client closed, or the line broke.
    Gone,
    /// The client takes nothing.
    TooSlow,
    /// The client speaks, which it must not.
    Talks,
    /// The server stops.
    Stopping,
    /// The archive cannot be read.
    Archive,
    /// Whoever follows may not look any more.
    LoggedOut,
}

impl End {
    /// The word of it in metrics.
    const fn word(self) -> &'static str {
        match self {
            Self::Gone => "gone",
            Self::TooSlow => "too-slow",
            Self::Talks => "talks",
            Self::Stopping => "stopping",
            Self::Archive => "archive",
            Self::LoggedOut => "logged-out",
        }
    }
}

struct Follower {
    app: App,
    /// Who follows.
    caller: Caller,
    socket: WebSocket,
    /// The last event that was sent, or that the client had.
    last: i64,
    unanswered: u32,
}

impl Follower {
    async fn follow(&mut self, after: Option<i64>) -> End {
        match self.run(after).await {
            ControlFlow::Break(end) => end,
            ControlFlow::Continue(()) => End::Gone,
        }
    }

    async fn run(&mut self, after: Option<i64>) -> ControlFlow<End> {
        // First the subscription, then the archive: what is committed in between is in both.
        let mut hub = self.app.state.hub.subscribe();
        self.greet(after).await?;
        self.replay().await?;
        self.send(&StreamMessage::Live { sequence: self.last }).await?;
        self.status().await?;

        let app = self.app.clone();
        let caller = self.caller.clone();
        let mut gone = Box::pin(app.state.people.until_gone(&caller));
        let mut status = app.state.engine.status_changes();
        let mut status_due = Box::pin(wall_sleep(STATUS_QUIET));
        let mut status_allowed = Box::pin(wall_sleep(STATUS_PAUSE));
        let mut may_tell = false;
        let mut ping_due = Box::pin(wall_sleep(PING_EVERY));
        loop {
            tokio::select! {
                biased;
                () = app.state.stop.cancelled() => return ControlFlow::Break(End::Stopping),
                () = &mut gone => return ControlFlow::Break(End::LoggedOut),
                heard = self.socket.recv() => self.hear(heard)?,
                event = hub.recv() => self.pass_on(event).await?,
                () = &mut status_allowed, if !may_tell => may_tell = true,
                changed = status.changed(), if may_tell => {
                    if changed.is_err() {
                        return ControlFlow::Break(End::Stopping);
                    }
                    self.status().await?;
                    may_tell = false;
                    status_allowed = Box::pin(wall_sleep(STATUS_PAUSE));
                    status_due = Box::pin(wall_sleep(STATUS_QUIET));
                }
                () = &mut status_due => {
                    self.status().await?;
                    status_due = Box::pin(wall_sleep(STATUS_QUIET));
                }
                () = &mut ping_due => {
                    self.ping().await?;
                    ping_due = Box::pin(wall_sleep(PING_EVERY));
                }
            }
        }
    }

    async fn greet(&mut self, after: Option<i64>) -> ControlFlow<End> {
        let last_sequence = archive(self.app.state.store.last_event_seq().await)?;
        // Whoever knows more than the archive knows another archive.
        let reset = after.is_some_and(|after| after > last_sequence);
        self.last = after.filter(|_| !reset).unwrap_or(last_sequence).max(0);
        let hello = StreamMessage::Hello {
            api: API_VERSION,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            last_sequence,
            after: self.last,
            reset,
        };
        self.send(&hello).await
    }

    /// Everything that the archive has after the last event that was sent.
    async fn replay(&mut self) -> ControlFlow<End> {
        loop {
            let page = Page { after: Some(self.last), before: None, limit: REPLAY_PAGE };
            let query = EventQuery { page, ..EventQuery::default() };
            let found = archive(self.app.state.store.events(&query).await)?;
            for event in &found {
                self.event(event).await?;
            }
            if found.len() < REPLAY_PAGE as usize {
                return ControlFlow::Continue(());
            }
            if self.app.state.stop.is_cancelled() {
                return ControlFlow::Break(End::Stopping);
            }
        }
    }

    async fn pass_on(
        &mut self,
        event: Result<Arc<StoredEvent>, broadcast::error::RecvError>,
    ) -> ControlFlow<End> {
        match event {
            Ok(event) if event.sequence <= self.last => ControlFlow::Continue(()),
            // The archive fills a hole, whatever made it.
            Ok(event) if event.sequence > self.last.saturating_add(1) => self.replay().await,
            Ok(event) => self.event(&event).await,
            Err(RecvError::Lagged(_)) => self.replay().await,
            Err(RecvError::Closed) => ControlFlow::Break(End::Stopping),
        }
    }

    async fn event(&mut self, event: &StoredEvent) -> ControlFlow<End> {
        self.last = event.sequence;
        self.send(&StreamMessage::Event(events::view(event))).await
    }

    async fn status(&mut self) -> ControlFlow<End> {
        let status = self.app.state.engine.status();
        let view = station::view(&self.app, &status, self.last);
        self.send(&StreamMessage::Status(view)).await
    }

    async fn ping(&mut self) -> ControlFlow<End> {
        if self.unanswered >= PINGS_UNANSWERED {
            return ControlFlow::Break(End::Gone);
        }
        self.unanswered += 1;
        self.put(Message::Ping(Vec::new().into())).await
    }

    fn hear(&mut self, heard: Option<Result<Message, axum::Error>>) -> ControlFlow<End> {
        match heard {
            Some(Ok(Message::Pong(_) | Message::Ping(_))) => {
                self.unanswered = 0;
                ControlFlow::Continue(())
            }
            Some(Ok(Message::Text(_) | Message::Binary(_))) => ControlFlow::Break(End::Talks),
            Some(Ok(Message::Close(_)) | Err(_)) | None => ControlFlow::Break(End::Gone),
        }
    }

    async fn send(&mut self, message: &StreamMessage) -> ControlFlow<End> {
        match serde_json::to_string(message) {
            Ok(text) => self.put(Message::Text(Utf8Bytes::from(text))).await,
            Err(error) => {
                tracing::error!(%error, "A message of the stream could not be written.");
                ControlFlow::Break(End::Archive)
            }
        }
    }

    async fn put(&mut self, message: Message) -> ControlFlow<End> {
        match within(PATIENCE, self.socket.send(message)).await {
            Some(Ok(())) => ControlFlow::Continue(()),
            Some(Err(_)) => ControlFlow::Break(End::Gone),
            None => ControlFlow::Break(End::TooSlow),
        }
    }

    async fn close(mut self, why: End) {
        let (code, reason) = match why {
            End::Gone => return,
            End::TooSlow => (close_code::POLICY, "too slow: nothing was taken for 10 s"),
            End::Talks => (close_code::UNSUPPORTED, "this stream takes no messages"),
            End::Stopping => (close_code::AWAY, "the server is stopping"),
            End::LoggedOut => (close_code::POLICY, "logged out: log in again"),
            End::Archive => (close_code::ERROR, "the archive cannot be read at present"),
        };
        let frame = CloseFrame { code, reason: Utf8Bytes::from_static(reason) };
        // Who takes nothing does not take this either.
        let _ = within(Duration::from_secs(1), self.socket.send(Message::Close(Some(frame)))).await;
    }
}

fn archive<T>(result: Result<T, StoreError>) -> ControlFlow<End, T> {
    match result {
        Ok(value) => ControlFlow::Continue(value),
        Err(error) => {
            tracing::warn!(
                error = &error as &dyn std::error::Error,
                "A stream ends: the archive could not be read."
            );
            ControlFlow::Break(End::Archive)
        }
    }
}
