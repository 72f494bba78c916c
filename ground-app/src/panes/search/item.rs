//! What can be found: frames, events, commands, and what strangers heard.

use api::client::{Client, ClientError, Filter};
use api::{CommandView, EventView, FrameView, OutsideView, Page};
use ui::Level;

use super::super::export::table::cell_of;
use super::super::words;

/// Which list is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Kind {
    /// What was heard.
    #[default]
    Frames,
    /// What happened.
    Events,
    /// What was sent.
    Commands,
    /// What strangers heard.
    Receptions,
}

impl Kind {
    pub(super) const ALL: [Self; 4] = [Self::Frames, Self::Events, Self::Commands, Self::Receptions];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Frames => "Frames",
            Self::Events => "Events",
            Self::Commands => "Commands",
            Self::Receptions => "Receptions",
        }
    }

    /// One page of it.
    pub(super) async fn page(self, client: Client, filter: Filter) -> Result<Page<Item>, ClientError> {
        fn of<T>(page: Page<T>, item: impl Fn(T) -> Item) -> Page<Item> {
            Page { items: page.items.into_iter().map(item).collect(), next: page.next }
        }
        Ok(match self {
            Self::Frames => of(client.frames(&filter).await?, |frame| Item::Frame(Box::new(frame))),
            Self::Events => of(client.events(&filter).await?, |event| Item::Event(Box::new(event))),
            Self::Commands => of(client.commands(&filter).await?, |command| Item::Command(Box::new(command))),
            Self::Receptions => {
                of(client.receptions(&filter).await?, |outside| Item::Reception(Box::new(outside)))
            }
        })
    }
}

/// One of what was found.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Item {
    Frame(Box<FrameView>),
    Event(Box<EventView>),
    Command(Box<CommandView>),
    Reception(Box<OutsideView>),
}

impl Item {
    /// UTC in microseconds since 1970.
    pub(super) fn at_us(&self) -> i64 {
        match self {
            Self::Frame(frame) => frame.heard_at.unix_us(),
            Self::Event(event) => event.at.unix_us(),
            Self::Command(command) => command.created_at.unix_us(),
            Self::Reception(outside) => outside.received_at.unix_us(),
        }
    }

    /// One word for what it is.
    pub(super) fn kind(&self) -> &str {
        match self {
            Self::Frame(frame) => frame.packet_name.as_deref().unwrap_or("unknown"),
            Self::Event(event) => &event.kind,
            Self::Command(command) => &command.stage,
            Self::Reception(outside) => &outside.kind,
        }
    }

    /// What it says.
    pub(super) fn words(&self) -> String {
        match self {
            Self::Frame(frame) => {
                let level = frame.receptions.first().and_then(|reception| reception.rssi_dbm);
                let level = ui::format::dbm(level.map(f64::from));
                let by = match (frame.receptions.len(), frame.heard_elsewhere.len()) {
                    (0, strangers) => format!("by {strangers} strangers"),
                    (_, 0) => format!("by {}", frame.station),
                    (_, strangers) => format!("by {} and {strangers} strangers", frame.station),
                };
                format!("#{} {} B {level} {by}", frame.id, frame.length)
            }
            Self::Event(event) => event.message.clone(),
            Self::Command(command) => format!("#{} {} by {}", command.id, command.command, command.principal),
            Self::Reception(outside) => {
                let who = outside.receiver_name.as_deref().or(outside.receiver.as_deref());
                let level = ui::format::dbm(outside.rssi_dbm);
                format!("{} by {} {level}", outside.source, who.unwrap_or("somebody"))
            }
        }
    }

    pub(super) fn level(&self) -> Option<Level> {
        match self {
            Self::Event(event) => words::level(&event.level),
            _ => None,
        }
    }

    /// The frame that it is about.
    pub(super) fn frame(&self) -> Option<u64> {
        match self {
            Self::Frame(frame) => Some(frame.id),
            Self::Event(event) => event.frame,
            Self::Command(_) => None,
            Self::Reception(outside) => outside.frame,
        }
    }

    /// The image that it is about.
    pub(super) fn image(&self) -> Option<u64> {
        match self {
            Self::Event(event) => event.image,
            _ => None,
        }
    }

    /// Whether the text, in small letters, stands in it; a frame's bytes count, too.
    pub(super) fn has(&self, text: &str) -> bool {
        let has = |words: &str| words.to_lowercase().contains(text);
        let more = match self {
            Self::Frame(frame) => has(&frame.hex) || has(&frame.link),
            Self::Reception(outside) => outside.label.as_deref().is_some_and(has),
            _ => false,
        };
        more || has(self.kind()) || has(&self.words())
    }

    /// The whole of it as the server says it.
    fn json(&self) -> String {
        let text = match self {
            Self::Frame(frame) => serde_json::to_string(frame),
            Self::Event(event) => serde_json::to_string(event),
            Self::Command(command) => serde_json::to_string(command),
            Self::Reception(outside) => serde_json::to_string(outside),
        };
        text.unwrap_or_default()
    }
}

/// One line each, as the server says it.
pub(super) fn ndjson(items: &[Item]) -> Vec<u8> {
    items.iter().flat_map(|item| (item.json() + "\n").into_bytes()).collect()
}

/// What is on the screen as a table.
pub(super) fn csv(items: &[Item]) -> Vec<u8> {
    let mut text = "time,kind,frame,words\n".to_owned();
    for item in items {
        let at = api::Time::from_unix_us(item.at_us());
        let frame = item.frame().map(|frame| frame.to_string()).unwrap_or_default();
        text += &format!("{at},{},{frame},{}\n", cell_of(item.kind()), cell_of(&item.words()));
    }
    text.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(message: &str) -> Item {
        let text = format!(
            r#"{{"sequence":7,"at":"2026-11-22T05:19:25.123Z","kind":"limit","level":"warning","satellite":"s",
            "station":"home","link":null,"key":null,"frame":3,"command":null,"image":null,"download":null,
            "message":"{message}"}}"#
        );
        Item::Event(serde_json::from_str(&text).unwrap())
    }

    #[test]
    fn what_is_exported_reads_back_equal() {
        let items = [event("temp is 80, above"), event("it is back")];
        let lines = String::from_utf8(ndjson(&items)).unwrap();
        let back: Vec<Item> =
            lines.lines().map(|line| Item::Event(serde_json::from_str(line).unwrap())).collect();
        assert_eq!(back, items);
        let table = String::from_utf8(csv(&items)).unwrap();
        assert_eq!(table.lines().nth(1), Some("2026-11-22T05:19:25.123Z,limit,3,\"temp is 80, above\""));
    }

    #[test]
    fn text_is_found_in_what_is_shown() {
        let item = event("Temp is HIGH");
        assert!(item.has("high") && item.has("limit") && !item.has("low"));
        assert_eq!(item.level(), Some(Level::Warning));
    }
}
