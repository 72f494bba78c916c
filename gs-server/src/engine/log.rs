//! Committed events as lines of the log: what somebody reads who asks in the morning what happened at night.
//!
//! A link's own words are logged where they are said (`links`), so its events are no warnings a second time.

use mission::Level;
use mission::record::EventKind;

use crate::storage::StoredEvent;

/// How loud an event is. Each frame and chunk would drown the rest, so these need `gs_server::engine=debug`.
fn loudness(kind: EventKind, level: Level) -> tracing::Level {
    match (kind, level) {
        (EventKind::FrameHeard | EventKind::ChunkReceived | EventKind::Bridge, Level::Normal) => {
            tracing::Level::DEBUG
        }
        (EventKind::Link, _) | (_, Level::Normal | Level::Watch) => tracing::Level::INFO,
        (_, Level::Warning) => tracing::Level::WARN,
        (_, Level::Distress | Level::Critical | Level::Severe) => tracing::Level::ERROR,
    }
}

/// Logs an event **that is committed**; its number leads to the whole of it.
pub(super) fn event(event: &StoredEvent) {
    let record = &event.record;
    macro_rules! line {
        ($loudness:expr) => {
            tracing::event!(
                $loudness,
                sequence = event.sequence,
                kind = record.kind.name(),
                satellite = record.satellite.as_ref().map(tracing::field::display),
                link = record.link.as_ref().map(tracing::field::display),
                key = record.key.as_ref().map(tracing::field::display),
                "{}",
                record.message
            )
        };
    }
    // The level of a line is a constant to `tracing`.
    match loudness(record.kind, record.level) {
        tracing::Level::ERROR => line!(tracing::Level::ERROR),
        tracing::Level::WARN => line!(tracing::Level::WARN),
        tracing::Level::INFO => line!(tracing::Level::INFO),
        _ => line!(tracing::Level::DEBUG),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_quiet_commands_are_told_and_trouble_is_loud() {
        for (kind, level, loud) in [
            (EventKind::FrameHeard, Level::Normal, tracing::Level::DEBUG),
            (EventKind::FrameHeard, Level::Watch, tracing::Level::INFO),
            (EventKind::CommandStage, Level::Normal, tracing::Level::INFO),
            (EventKind::CommandStage, Level::Watch, tracing::Level::INFO),
            (EventKind::Link, Level::Warning, tracing::Level::INFO),
            (EventKind::ChunkConflict, Level::Warning, tracing::Level::WARN),
            (EventKind::Sealing, Level::Critical, tracing::Level::ERROR),
        ] {
            assert_eq!(loudness(kind, level), loud, "{kind:?} {level:?}");
        }
    }
}
