//! `GET /api/v1/stream?after=SEQUENCE&topics=…`: what happens, in order, each once and without a hole, and the status.
//!
//! The archive is the queue. A stream remembers the last event it looked at; what is newer is read from the archive until
//! there is no more, then taken from the feed, and from the archive again whenever the feed had to leave something out. What
//! came last is at hand for all: a stream that begins or goes on within that asks the archive nothing.
//! So a slow client costs no memory: it lags behind in the archive, and one that takes nothing at all is let go.

mod feed;
mod recent;
mod wanted;

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use api::{API_VERSION, ProblemKind, StreamMessage, StreamRequest, Topic};
use axum::extract::State;
use axum::extract::ws::{
    CloseFrame, Message, Utf8Bytes, WebSocket, WebSocketUpgrade, close_code,
    rejection::WebSocketUpgradeRejection,
};
use axum::response::Response;
use futures_util::SinkExt as _;
use serde::Deserialize;
use tokio::sync::broadcast::error::RecvError;

use super::App;
use super::extract::Query;
use super::problem::Failure;
use crate::clock::{wall_sleep, within};
use crate::people::Caller;
use crate::storage::{EventQuery, Page, StoreError};
pub(super) use feed::Feed;
pub(super) use feed::Prepared;
use feed::{Batch, follow_each_other, write};
use recent::After;
use wanted::Wanted;

/// Bytes that a client's message may have.
const MESSAGE_MAX: usize = 4 * 1024;
/// Bytes of a message that are taken, so that its sender can be told that it is too long.
const MESSAGE_READ: usize = 64 * 1024;
/// Messages of a client between two pings; pings and pongs of its own count, too.
const SAID_MAX: u32 = 60;
/// Bytes that are gathered before they are written.
const WRITE_BUFFER: usize = 16 * 1024;
/// Bytes that may wait to be written before a send waits.
const WRITE_BUFFER_MAX: usize = 256 * 1024;
/// Bytes read at once: clients have little to say.
const READ_BUFFER: usize = 1024;
/// Events read from the archive at once.
const REPLAY_PAGE: u32 = 500;
/// Messages that must go out within [`PATIENCE`].
const TOGETHER: usize = 64;
/// A client that takes nothing for so long is let go.
const PATIENCE: Duration = Duration::from_secs(10);
/// A ping comes so often; a client that does not answer three in a row is gone.
const PING_EVERY: Duration = Duration::from_secs(15);
const PINGS_UNANSWERED: u32 = 3;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Asked {
    after: Option<i64>,
    topics: Option<String>,
    satellite: Option<String>,
}

pub(super) async fn open(
    State(app): State<App>,
    Query(asked): Query<Asked>,
    caller: Caller,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Failure> {
    let wanted = Wanted::read(&app, asked.topics.as_deref(), asked.satellite.as_deref())?;
    let upgrade = upgrade.map_err(|_| {
        Failure::new(ProblemKind::UpgradeRequired, "Open this path as a WebSocket (ws:// or wss://).")
    })?;
    let place = Arc::clone(&app.streams).try_acquire_owned().map_err(|_| {
        let most = app.state.streams_max;
        Failure::new(ProblemKind::TooManyStreams, format!("{most} streams are open already (http.streams)."))
    })?;
    let upgrade = upgrade
        .max_message_size(MESSAGE_READ)
        .max_frame_size(MESSAGE_READ)
        .read_buffer_size(READ_BUFFER)
        .write_buffer_size(WRITE_BUFFER)
        .max_write_buffer_size(WRITE_BUFFER_MAX);
    Ok(upgrade.on_upgrade(move |socket| async move {
        let metrics = app.state.engine.metrics().clone();
        let open = metrics.stream();
        let mut follower = Follower { app, caller, socket, wanted, last: 0, unanswered: 0, said: 0 };
        let why = follower.follow(asked.after).await;
        drop(open);
        metrics.stream_ended(why.word());
        follower.close(why).await;
        drop(place);
    }))
}

/// Why a stream ends.
#[derive(Debug, Clone, PartialEq, Eq)]
enum End {
    /// The client closed, or the line broke.
    Gone,
    /// The client takes nothing.
    TooSlow,
    /// The client says what nobody understands.
    Nonsense,
    /// The client asks for what there is not; why.
    Refused(String),
    /// The client says too much.
    Talks,
    /// A message of the client is too long.
    TooLong,
    /// The server stops.
    Stopping,
    /// The archive cannot be read.
    Archive,
    /// Whoever follows may not look any more.
    LoggedOut,
}

impl End {
    /// The word of it in metrics.
    const fn word(&self) -> &'static str {
        match self {
            Self::Gone => "gone",
            Self::TooSlow => "too-slow",
            Self::Nonsense => "nonsense",
            Self::Refused(_) => "refused",
            Self::Talks => "talks",
            Self::TooLong => "too-long",
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
    wanted: Wanted,
    /// The last event that was looked at, or that the client had.
    last: i64,
    unanswered: u32,
    said: u32,
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
        let mut batches = self.app.feed.batches();
        let mut status = self.app.feed.status();
        status.mark_unchanged();
        let at_hand = self.greet(after).await?;
        self.catch_up(at_hand).await?;
        self.send(&StreamMessage::Live { sequence: self.last }).await?;
        if self.wanted.has(Topic::Status)
            && let Some(now) = self.app.feed.status_now(&self.app)
        {
            self.put([now]).await?;
        }

        let app = self.app.clone();
        let caller = self.caller.clone();
        let mut gone = Box::pin(app.state.people.until_gone(&caller));
        let mut ping_due = Box::pin(wall_sleep(PING_EVERY));
        loop {
            tokio::select! {
                biased;
                () = app.state.stop.cancelled() => return ControlFlow::Break(End::Stopping),
                () = &mut gone => return ControlFlow::Break(End::LoggedOut),
                heard = self.socket.recv() => self.hear(heard).await?,
                batch = batches.recv() => self.take(batch).await?,
                changed = status.changed(), if self.wanted.has(Topic::Status) => {
                    if changed.is_err() {
                        return ControlFlow::Break(End::Stopping);
                    }
                    let now = status.borrow_and_update().clone();
                    self.put([now]).await?;
                }
                () = &mut ping_due => {
                    self.ping().await?;
                    ping_due = Box::pin(wall_sleep(PING_EVERY));
                }
            }
        }
    }

    /// Says where the stream begins; what follows there, when it is at hand.
    async fn greet(&mut self, after: Option<i64>) -> ControlFlow<End, Option<After>> {
        let at_hand = self.app.feed.after(after);
        let last_sequence = match &at_hand {
            Some(after) => after.last,
            None => archive(self.app.state.store.last_event_seq().await)?,
        };
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
        self.send(&hello).await?;
        ControlFlow::Continue(at_hand)
    }

    /// Everything after the last event that was looked at: from what is at hand, or from the archive.
    async fn catch_up(&mut self, at_hand: Option<After>) -> ControlFlow<End> {
        match at_hand {
            Some(after) => {
                for batch in after.batches {
                    self.pass_on(&batch).await?;
                }
                ControlFlow::Continue(())
            }
            None => self.replay().await,
        }
    }

    /// Everything that the archive has after the last event that was looked at.
    async fn replay(&mut self) -> ControlFlow<End> {
        loop {
            let page = Page { after: Some(self.last), before: None, limit: REPLAY_PAGE };
            let query = EventQuery { page, ..EventQuery::default() };
            let found = archive(self.app.state.store.events(&query).await)?;
            let full = found.len() >= REPLAY_PAGE as usize;
            let events: Vec<Prepared> =
                found.into_iter().map(|event| Prepared::new(Arc::new(event))).collect();
            for some in events.chunks(TOGETHER) {
                self.tell(some).await?;
            }
            if !full {
                return ControlFlow::Continue(());
            }
            if self.app.state.stop.is_cancelled() {
                return ControlFlow::Break(End::Stopping);
            }
        }
    }

    async fn take(&mut self, batch: Result<Arc<Batch>, RecvError>) -> ControlFlow<End> {
        match batch {
            Ok(batch) => self.pass_on(&batch).await,
            Err(RecvError::Lagged(_)) => {
                let at_hand = self.app.feed.after(Some(self.last));
                self.catch_up(at_hand).await
            }
            Err(RecvError::Closed) => ControlFlow::Break(End::Stopping),
        }
    }

    async fn pass_on(&mut self, batch: &Batch) -> ControlFlow<End> {
        let known = batch.events.partition_point(|event| event.sequence() <= self.last);
        let Some(fresh) = batch.events.get(known..).filter(|fresh| !fresh.is_empty()) else {
            return ControlFlow::Continue(());
        };
        // The archive fills a hole, whatever made it.
        let follows = fresh.first().is_some_and(|event| event.sequence() == self.last.saturating_add(1));
        match follows && follow_each_other(fresh) {
            true => self.tell(fresh).await,
            false => self.replay().await,
        }
    }

    /// What is wanted of these events.
    async fn tell(&mut self, events: &[Prepared]) -> ControlFlow<End> {
        let mut texts = Vec::with_capacity(events.len());
        for event in events {
            if event.concerns(&self.wanted.satellites) {
                for topic in self.wanted.topics() {
                    texts.extend(archive(event.text(topic, &self.app.state.store).await)?);
                }
            }
        }
        if let Some(last) = events.last() {
            self.last = last.sequence();
        }
        self.put(texts).await
    }

    async fn ping(&mut self) -> ControlFlow<End> {
        if self.unanswered >= PINGS_UNANSWERED {
            return ControlFlow::Break(End::Gone);
        }
        self.unanswered += 1;
        self.said = 0;
        sent(within(PATIENCE, self.socket.send(Message::Ping(Vec::new().into()))).await)
    }

    async fn hear(&mut self, heard: Option<Result<Message, axum::Error>>) -> ControlFlow<End> {
        self.said = self.said.saturating_add(1);
        if self.said > SAID_MAX {
            return ControlFlow::Break(End::Talks);
        }
        match heard {
            Some(Ok(Message::Pong(_) | Message::Ping(_))) => {
                self.unanswered = 0;
                ControlFlow::Continue(())
            }
            Some(Ok(Message::Text(text))) if text.len() > MESSAGE_MAX => ControlFlow::Break(End::TooLong),
            Some(Ok(Message::Text(text))) => match serde_json::from_str(&text) {
                Ok(request) => self.change(request).await,
                Err(_) => ControlFlow::Break(End::Nonsense),
            },
            Some(Ok(Message::Binary(_))) => ControlFlow::Break(End::Nonsense),
            Some(Ok(Message::Close(_)) | Err(_)) | None => ControlFlow::Break(End::Gone),
        }
    }

    async fn change(&mut self, request: StreamRequest) -> ControlFlow<End> {
        let app = self.app.clone();
        if let Err(why) = self.wanted.change(&app, request) {
            return ControlFlow::Break(End::Refused(why));
        }
        let subscribed = StreamMessage::Subscribed {
            topics: self.wanted.topics().collect(),
            satellites: self.wanted.satellites.clone(),
            sequence: self.last,
        };
        self.send(&subscribed).await
    }

    async fn send(&mut self, message: &StreamMessage) -> ControlFlow<End> {
        match write(message) {
            Some(text) => self.put([text]).await,
            None => ControlFlow::Break(End::Archive),
        }
    }

    /// Sends messages together: in few writes, and none when there are none.
    async fn put(&mut self, texts: impl IntoIterator<Item = Utf8Bytes>) -> ControlFlow<End> {
        let mut texts = texts.into_iter().peekable();
        if texts.peek().is_none() {
            return ControlFlow::Continue(());
        }
        let all = async {
            for text in texts {
                self.socket.feed(Message::Text(text)).await?;
            }
            self.socket.flush().await
        };
        sent(within(PATIENCE, all).await)
    }

    async fn close(mut self, why: End) {
        let (code, reason): (_, Cow<'static, str>) = match why {
            End::Gone => return,
            End::TooSlow => (close_code::POLICY, "too slow: nothing was taken for 10 s".into()),
            End::Nonsense => (close_code::UNSUPPORTED, "this stream does not understand that message".into()),
            End::Refused(why) => (close_code::POLICY, why.into()),
            End::Talks => (close_code::POLICY, "too many messages".into()),
            End::TooLong => (close_code::SIZE, "a message may have 4096 bytes at most".into()),
            End::Stopping => (close_code::AWAY, "the server is stopping".into()),
            End::LoggedOut => (close_code::POLICY, "logged out: log in again".into()),
            End::Archive => (close_code::ERROR, "the archive cannot be read at present".into()),
        };
        // A close frame bears 123 bytes of reason.
        let mut reason = reason.into_owned();
        reason.truncate(reason.floor_char_boundary(120));
        let frame = CloseFrame { code, reason: Utf8Bytes::from(reason) };
        let word = async {
            self.socket.send(Message::Close(Some(frame))).await?;
            // What the client still says is taken: a line that is closed over it would lose our word.
            while let Some(Ok(_)) = self.socket.recv().await {}
            Ok::<_, axum::Error>(())
        };
        // Who takes nothing does not take this either.
        let _ = within(Duration::from_secs(1), word).await;
    }
}

fn sent(result: Option<Result<(), axum::Error>>) -> ControlFlow<End> {
    match result {
        Some(Ok(())) => ControlFlow::Continue(()),
        Some(Err(_)) => ControlFlow::Break(End::Gone),
        None => ControlFlow::Break(End::TooSlow),
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
