//! The stream, followed for as long as one likes: it comes back by itself and goes on where it was.

use std::pin::Pin;
use std::time::Duration;

use futures_util::{SinkExt as _, StreamExt as _};
use reqwest::header::{
    CONNECTION, HeaderValue, SEC_WEBSOCKET_ACCEPT, SEC_WEBSOCKET_KEY, SEC_WEBSOCKET_VERSION, UPGRADE,
};
use reqwest::{StatusCode, Upgraded};
use tokio::time::Instant;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::{client::generate_key, derive_accept_key};
use tokio_tungstenite::tungstenite::protocol::{Role, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Error, Message};

use super::operation::Operation;
use super::{Client, ClientError, Filter, timers};
use crate::{StreamMessage, StreamRequest, Topic};

pub(super) const STREAM: Operation = Operation::get("stream");
/// The server says something every 15 s at least; a longer silence means that the line is dead.
const SILENCE: Duration = Duration::from_secs(40);
/// A handshake takes no longer.
const HANDSHAKE: Duration = Duration::from_secs(10);
/// Waits between attempts; the last one is kept.
const WAITS_MS: [u64; 6] = [250, 500, 1000, 2000, 4000, 8000];
/// Bytes that a message of the server may have.
const MESSAGE_MAX: usize = 16 << 20;

/// What a stream is to tell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StreamOptions {
    /// Begin after this event; `None`: with what comes next.
    pub after: Option<i64>,
    /// Topics.
    pub topics: Vec<Topic>,
    /// Only of these satellites and of what concerns none; empty: of all.
    pub satellites: Vec<String>,
}

impl Default for StreamOptions {
    fn default() -> Self {
        Self { after: None, topics: vec![Topic::Events, Topic::Status], satellites: Vec::new() }
    }
}

/// What a stream gives.
#[derive(Debug, Clone, PartialEq)]
pub enum StreamItem {
    /// The server is there; what was missed comes first.
    Connected {
        /// The stream goes on after this event.
        after: i64,
        /// Version of the server.
        version: String,
    },
    /// It is another archive than before: what one holds is void.
    Gap {
        /// The event up to which one had everything.
        had: i64,
        /// The stream goes on after this event of the new archive.
        after: i64,
    },
    /// What was missed has come; what follows is live.
    Live {
        /// The last event that was looked at.
        sequence: i64,
    },
    /// News. Whatever has a sequence comes once and in its order, also over a loss.
    Message(Box<StreamMessage>),
    /// The server is not there. The next attempt comes by itself.
    Lost {
        /// Why.
        why: String,
        /// When it is tried again.
        again_in: Duration,
    },
}

/// What has been given out.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Cursor {
    /// Everything up to here.
    after: Option<i64>,
    /// Parts of the next event that was begun: topics may each say something of one event.
    at: i64,
    seen: Vec<&'static str>,
}

impl Cursor {
    /// Whether a message is new, and remembers it.
    fn take(&mut self, sequence: i64, kind: &'static str) -> bool {
        if self.after.is_some_and(|after| sequence <= after) {
            return false;
        }
        if sequence != self.at || self.seen.is_empty() {
            if !self.seen.is_empty() {
                self.after = Some(self.at);
            }
            self.at = sequence;
            self.seen.clear();
        } else if self.seen.contains(&kind) {
            return false;
        }
        self.seen.push(kind);
        true
    }

    /// Everything up to here has come.
    fn reach(&mut self, sequence: i64) {
        self.after = Some(sequence);
        self.seen.clear();
    }

    /// What to resume after: an event that was begun is asked for once more.
    fn resume(&self) -> Option<i64> {
        match self.seen.is_empty() {
            true => self.after,
            false => Some(self.at.saturating_sub(1)),
        }
    }
}

type Socket = WebSocketStream<Upgraded>;
type Connecting = Pin<Box<dyn Future<Output = Result<Socket, ClientError>> + Send>>;

enum State {
    Waiting(Instant),
    Connecting(Connecting),
    Open(Box<Socket>),
}

/// A stream that comes back by itself. It ends when it is dropped.
pub struct EventStream {
    client: Client,
    options: StreamOptions,
    cursor: Cursor,
    state: State,
    failures: usize,
}

impl Client {
    /// Follows the stream.
    #[must_use]
    pub fn stream(&self, options: StreamOptions) -> EventStream {
        let cursor = Cursor { after: options.after, ..Cursor::default() };
        let state = State::Waiting(timers::after(Duration::ZERO));
        EventStream { client: self.clone(), options, cursor, state, failures: 0 }
    }

    async fn open_stream(self, filter: Filter) -> Result<Socket, ClientError> {
        let url = self.url(STREAM.path, &filter)?;
        let key = generate_key();
        let request = self
            .http
            .get(url.clone())
            .header(CONNECTION, "upgrade")
            .header(UPGRADE, "websocket")
            .header(SEC_WEBSOCKET_VERSION, "13")
            .header(SEC_WEBSOCKET_KEY, &key);
        let response = self.send(request, &url, HANDSHAKE).await?;
        let strange = |why: &str| ClientError::Strange {
            url: url.to_string(),
            status: response.status().as_u16(),
            why: why.to_owned(),
        };
        let accepted = response.headers().get(SEC_WEBSOCKET_ACCEPT).map(HeaderValue::as_bytes);
        if response.status() != StatusCode::SWITCHING_PROTOCOLS
            || accepted != Some(derive_accept_key(key.as_bytes()).as_bytes())
        {
            return Err(strange("it is no WebSocket"));
        }
        let upgraded = response
            .upgrade()
            .await
            .map_err(|error| ClientError::NoAnswer { url: url.to_string(), why: super::chain(error) })?;
        let config = WebSocketConfig::default()
            .max_message_size(Some(MESSAGE_MAX))
            .max_frame_size(Some(MESSAGE_MAX))
            .read_buffer_size(16 * 1024);
        Ok(WebSocketStream::from_raw_socket(upgraded, Role::Client, Some(config)).await)
    }
}

impl EventStream {
    /// What comes next; waits until there is something. Nothing is lost when this is dropped while it waits.
    pub async fn next(&mut self) -> StreamItem {
        loop {
            if let Some(item) = self.step().await {
                return item;
            }
        }
    }

    /// Where a new stream would have to go on.
    #[must_use]
    pub fn resume_after(&self) -> Option<i64> {
        self.cursor.resume()
    }

    /// Asks for other topics or satellites, now and after every loss.
    pub async fn ask(&mut self, request: StreamRequest) {
        match &request {
            StreamRequest::Subscribe { topics, satellites } => {
                for topic in
                    topics.iter().filter(|topic| !self.options.topics.contains(topic)).collect::<Vec<_>>()
                {
                    self.options.topics.push(*topic);
                }
                if let Some(satellites) = satellites {
                    self.options.satellites.clone_from(satellites);
                }
            }
            StreamRequest::Unsubscribe { topics } => {
                self.options.topics.retain(|topic| !topics.contains(topic));
            }
        }
        let text = serde_json::to_string(&request).unwrap_or_default();
        if let State::Open(socket) = &mut self.state {
            // A line that broke is noticed by the next look at it.
            let _ = timers::within(HANDSHAKE, socket.send(Message::text(text))).await;
        } else {
            // What is being opened was asked for otherwise.
            self.state = State::Waiting(timers::after(Duration::ZERO));
        }
    }

    async fn step(&mut self) -> Option<StreamItem> {
        match &mut self.state {
            State::Waiting(instant) => {
                timers::until(*instant).await;
                let opening = self.client.clone().open_stream(self.filter());
                self.state = State::Connecting(Box::pin(async move {
                    let late = || ClientError::NoAnswer {
                        url: "stream".to_owned(),
                        why: "the handshake takes too long".to_owned(),
                    };
                    timers::within(HANDSHAKE, opening).await.unwrap_or_else(|| Err(late()))
                }));
                None
            }
            State::Connecting(connecting) => match connecting.as_mut().await {
                Ok(socket) => {
                    self.state = State::Open(Box::new(socket));
                    None
                }
                Err(error) => Some(self.lost(error.to_string())),
            },
            State::Open(socket) => {
                let heard = timers::within(SILENCE, socket.next()).await;
                match heard {
                    None => Some(self.lost(format!("nothing came for {} s", SILENCE.as_secs()))),
                    Some(None) => Some(self.lost("the line broke".to_owned())),
                    Some(Some(Err(Error::ConnectionClosed | Error::AlreadyClosed))) => {
                        Some(self.lost("the line was closed".to_owned()))
                    }
                    Some(Some(Err(error))) => Some(self.lost(error.to_string())),
                    Some(Some(Ok(message))) => self.take(message),
                }
            }
        }
    }

    fn take(&mut self, message: Message) -> Option<StreamItem> {
        let text = match message {
            Message::Text(text) => text,
            Message::Close(frame) => {
                let why = frame.map(|frame| frame.reason.to_string()).filter(|why| !why.is_empty());
                return Some(self.lost(why.unwrap_or_else(|| "the server closed".to_owned())));
            }
            _ => return None,
        };
        // A newer server may say what this version does not know.
        let message: StreamMessage = serde_json::from_str(&text).ok()?;
        match message {
            StreamMessage::Hello { version, after, reset, .. } => {
                self.failures = 0;
                let had = self.cursor.resume();
                if reset || had.is_none() {
                    self.cursor.reach(after);
                }
                Some(match had {
                    Some(had) if reset => StreamItem::Gap { had, after },
                    _ => StreamItem::Connected { after, version },
                })
            }
            StreamMessage::Live { sequence } => {
                self.cursor.reach(sequence);
                Some(StreamItem::Live { sequence })
            }
            message => {
                let new =
                    message.sequence().is_none_or(|sequence| self.cursor.take(sequence, kind(&message)));
                new.then(|| StreamItem::Message(Box::new(message)))
            }
        }
    }

    fn lost(&mut self, why: String) -> StreamItem {
        let wait = WAITS_MS.get(self.failures).or(WAITS_MS.last()).copied().unwrap_or(1000);
        let again_in = Duration::from_millis(wait);
        self.failures = self.failures.saturating_add(1);
        self.state = State::Waiting(timers::after(again_in));
        StreamItem::Lost { why, again_in }
    }

    fn filter(&self) -> Filter {
        let topics: Vec<&str> = self.options.topics.iter().map(|topic| topic.name()).collect();
        let mut filter = Filter::new().with("topics", topics.join(","));
        if let Some(after) = self.cursor.resume() {
            filter = filter.after(after);
        }
        if !self.options.satellites.is_empty() {
            filter = filter.with("satellite", self.options.satellites.join(","));
        }
        filter
    }
}

fn kind(message: &StreamMessage) -> &'static str {
    match message {
        StreamMessage::Event(_) => "event",
        StreamMessage::Frame { .. } => "frame",
        StreamMessage::Telemetry { .. } => "telemetry",
        StreamMessage::Command { .. } => "command",
        StreamMessage::Run { .. } => "run",
        StreamMessage::Hello { .. }
        | StreamMessage::Subscribed { .. }
        | StreamMessage::Live { .. }
        | StreamMessage::Status(_) => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_of_which_half_has_come_is_asked_for_again_and_told_once() {
        let mut cursor = Cursor { after: Some(4), ..Cursor::default() };
        assert!(!cursor.take(4, "event"), "it was had already");
        assert!(cursor.take(5, "event") && cursor.take(5, "frame"));
        assert!(cursor.take(7, "event"));
        assert_eq!(cursor.resume(), Some(6));
        assert!(!cursor.take(7, "event"), "the repeated half");
        assert!(cursor.take(7, "frame"), "the half that was lost");
        assert!(!cursor.take(5, "telemetry"));
        cursor.reach(9);
        assert_eq!(cursor.resume(), Some(9));
        assert!(!cursor.take(9, "event") && cursor.take(10, "event"));
    }
}
