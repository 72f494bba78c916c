//! What the WebSocket says.

use serde::{Deserialize, Serialize};

use crate::{EventView, StationView};

/// One message of `/api/v1/stream`, server to client. The client says nothing.
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
    /// An event: each once, in order, without a hole.
    Event(EventView),
    /// The archive has been read to its end; what follows is live.
    Live {
        /// The last event sent.
        sequence: i64,
    },
    /// How the station is now. Not kept, not numbered, at most about four a second.
    Status(StationView),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_says_its_type() {
        let text = serde_json::to_string(&StreamMessage::Live { sequence: 7 }).unwrap();
        assert_eq!(text, r#"{"type":"live","sequence":7}"#);
    }
}
