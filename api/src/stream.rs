//! What the WebSocket says, and what may be said to it.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::{CommandView, EventView, FrameView, RunView, StationView, Time};

/// What a stream may tell of.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Topic {
    /// Every event.
    Events,
    /// How the station is.
    Status,
    /// Frames that were heard, byte for byte.
    Frames,
    /// The values in frames that were heard.
    Telemetry,
    /// Commands, at each of their stages.
    Commands,
    /// Runs of plans, whenever something happens to one.
    Runs,
}

impl Topic {
    /// All topics.
    pub const ALL: [Self; 6] =
        [Self::Events, Self::Status, Self::Frames, Self::Telemetry, Self::Commands, Self::Runs];

    /// The word on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Events => "events",
            Self::Status => "status",
            Self::Frames => "frames",
            Self::Telemetry => "telemetry",
            Self::Commands => "commands",
            Self::Runs => "runs",
        }
    }
}

impl fmt::Display for Topic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is no topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownTopic(String);

impl fmt::Display for UnknownTopic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = Topic::ALL.map(Topic::name).join(", ");
        write!(f, "'{}' is no topic; there are {known}", self.0)
    }
}

impl std::error::Error for UnknownTopic {}

impl FromStr for Topic {
    type Err = UnknownTopic;

    fn from_str(word: &str) -> Result<Self, UnknownTopic> {
        let found = Self::ALL.into_iter().find(|topic| topic.name() == word);
        found.ok_or_else(|| UnknownTopic(word.chars().take(40).collect()))
    }
}

/// One message of `/api/v1/stream`, client to server. A client need not say anything.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum StreamRequest {
    /// Tell of these topics, too, from the next event on.
    Subscribe {
        /// Which.
        topics: Vec<Topic>,
        /// From now on only of these satellites, and of what concerns none; an empty list: of all. `null`: as before.
        #[serde(default)]
        satellites: Option<Vec<String>>,
    },
    /// Do not tell of these topics any more.
    Unsubscribe {
        /// Which.
        topics: Vec<Topic>,
    },
}

/// One message of `/api/v1/stream`, server to client.
///
/// Whatever has a `sequence` comes in its order, each once and without a hole: to resume, ask for what follows the last
/// one that came.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum StreamMessage {
    /// The first message.
    Hello {
        /// Version of the API.
        api: u32,
        /// Version of the server.
        version: String,
        /// The newest event in the archive.
        last_sequence: i64,
        /// The stream goes on after this event.
        after: i64,
        /// `after` as asked for lies ahead of this archive: it is another archive than the client knows. What the
        /// client holds is void; the stream begins at the end of this one.
        reset: bool,
    },
    /// What the stream tells of from here on: the answer to each request.
    Subscribed {
        /// Topics.
        topics: Vec<Topic>,
        /// Satellites; empty: all.
        satellites: Vec<String>,
        /// It holds for what follows this event.
        sequence: i64,
    },
    /// An event (topic `events`).
    Event(EventView),
    /// A frame was heard (topic `frames`).
    Frame {
        /// The event that told of it.
        sequence: i64,
        /// The frame, not decoded.
        frame: FrameView,
    },
    /// The values of a frame that was heard (topic `telemetry`).
    Telemetry {
        /// The event that told of the frame.
        sequence: i64,
        /// The frame.
        frame: u64,
        /// Satellite.
        satellite: String,
        /// Station.
        station: String,
        /// Link.
        link: String,
        /// When it was heard.
        at: Time,
        /// The values in it.
        values: Vec<StreamValue>,
    },
    /// A command reached a stage (topic `commands`).
    Command {
        /// The event that told of the stage.
        sequence: i64,
        /// The command as it is now.
        command: CommandView,
    },
    /// Something happened to a plan, and this is its satellite's newest run (topic `runs`).
    Run {
        /// The event that told of it.
        sequence: i64,
        /// The run as it is now.
        run: RunView,
    },
    /// The archive has been read to its end; what follows is live.
    Live {
        /// The last event that was looked at.
        sequence: i64,
    },
    /// How the station is now (topic `status`). Not kept, not numbered, at most about four a second.
    Status(StationView),
}

impl StreamMessage {
    /// Where it stands in the sequence of events; a client that has it resumes after it.
    #[must_use]
    pub fn sequence(&self) -> Option<i64> {
        match self {
            Self::Event(event) => Some(event.sequence),
            Self::Frame { sequence, .. }
            | Self::Telemetry { sequence, .. }
            | Self::Command { sequence, .. }
            | Self::Run { sequence, .. } => Some(*sequence),
            Self::Hello { .. } | Self::Subscribed { .. } | Self::Live { .. } | Self::Status(_) => None,
        }
    }
}

/// One value of a frame.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StreamValue {
    /// Parameter, e.g. `heartbeat.temp`.
    pub parameter: String,
    /// Unit; empty when it has none or nobody knows it.
    pub unit: String,
    /// The value; `null` when invalid (a failed sensor).
    pub value: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_says_its_type() {
        let text = serde_json::to_string(&StreamMessage::Live { sequence: 7 }).unwrap();
        assert_eq!(text, r#"{"type":"live","sequence":7}"#);
    }

    #[test]
    fn a_request_names_topics_and_nothing_else() {
        let read = |text: &str| serde_json::from_str::<StreamRequest>(text);
        let wanted = StreamRequest::Subscribe { topics: vec![Topic::Frames], satellites: None };
        assert_eq!(read(r#"{"type":"subscribe","topics":["frames"]}"#).unwrap(), wanted);
        for wrong in [
            r#"{"type":"subscribe","topics":["all"]}"#,
            r#"{"type":"subscribe"}"#,
            r#"{"type":"subscribe","topics":[],"x":1}"#,
            r#"{"type":"event"}"#,
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
        assert!("loud".parse::<Topic>().unwrap_err().to_string().contains("events, status"));
    }
}
