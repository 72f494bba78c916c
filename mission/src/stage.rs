//! The life of a telecommand, as append-only stages.

use std::fmt;
use std::str::FromStr;

/// Where a telecommand stands. The state of a command is its last stage; nothing is overwritten.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Accepted and durable; waits for its turn.
    Queued,
    /// Counter, nonce and sealed bytes are durable. Nothing has been handed to a radio.
    Sealed,
    /// Durable *before* the bytes are handed to the radio: from here on it may have been on the air.
    Radiating,
    /// The radio reported that the bytes have left.
    Radiated,
    /// A frame of the satellite, or telemetry, proves that it was obeyed.
    Answered,
    /// It certainly did not happen: never radiated, or telemetry disproves it.
    Failed,
    /// The satellite answered with an Error.
    Rejected,
    /// Its time ran out before it was radiated.
    Expired,
    /// Withdrawn before it was radiated.
    Cancelled,
    /// It may have been obeyed, and nothing has told us. Telemetry may still settle it.
    Unknown,
}

impl Stage {
    /// All stages, in the order of a life.
    pub const ALL: [Self; 10] = [
        Self::Queued,
        Self::Sealed,
        Self::Radiating,
        Self::Radiated,
        Self::Answered,
        Self::Failed,
        Self::Rejected,
        Self::Expired,
        Self::Cancelled,
        Self::Unknown,
    ];

    /// The word, lower case, as it stands on the wire and in the database.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Sealed => "sealed",
            Self::Radiating => "radiating",
            Self::Radiated => "radiated",
            Self::Answered => "answered",
            Self::Failed => "failed",
            Self::Rejected => "rejected",
            Self::Expired => "expired",
            Self::Cancelled => "cancelled",
            Self::Unknown => "unknown",
        }
    }

    /// Whether the machine does nothing more with it of its own accord.
    pub const fn is_final(self) -> bool {
        !matches!(self, Self::Queued | Self::Sealed | Self::Radiating | Self::Radiated)
    }

    /// Whether `next` may be appended after this stage.
    ///
    /// `idempotent` commands may return to the queue after an attempt whose outcome is not known; the others never.
    pub const fn may_be_followed_by(self, next: Self, idempotent: bool) -> bool {
        match self {
            // An idempotent command that waits to be repeated may still be answered for its earlier attempt; and when
            // it is withdrawn or out of time, whether that attempt was obeyed is unknown. Unknown is also what waited
            // in a database that went back: nobody can tell what became of it in the time that was lost.
            Self::Queued => {
                matches!(next, Self::Sealed | Self::Expired | Self::Cancelled | Self::Failed | Self::Unknown)
                    || (idempotent && matches!(next, Self::Answered | Self::Rejected))
            }
            Self::Sealed => matches!(
                next,
                Self::Radiating
                    | Self::Expired
                    | Self::Cancelled
                    | Self::Failed
                    | Self::Queued
                    | Self::Unknown
            ),
            // Back to the queue only when the radio is certain that nothing left the antenna.
            Self::Radiating => matches!(
                next,
                Self::Radiated
                    | Self::Unknown
                    | Self::Failed
                    | Self::Queued
                    | Self::Answered
                    | Self::Rejected
            ),
            Self::Radiated => {
                matches!(next, Self::Answered | Self::Rejected | Self::Unknown | Self::Failed)
                    || (idempotent && matches!(next, Self::Queued))
            }
            Self::Unknown => {
                matches!(next, Self::Answered | Self::Rejected | Self::Failed)
                    || (idempotent && matches!(next, Self::Queued | Self::Expired | Self::Cancelled))
            }
            Self::Answered | Self::Failed | Self::Rejected | Self::Expired | Self::Cancelled => false,
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is none of the stages.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no stage of a command")]
pub struct UnknownStage(pub String);

impl FromStr for Stage {
    type Err = UnknownStage;
    fn from_str(word: &str) -> Result<Self, UnknownStage> {
        Self::ALL.into_iter().find(|s| s.name() == word).ok_or_else(|| UnknownStage(word.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_have_been_on_air_is_never_queued_again_unless_idempotent() {
        for from in [Stage::Radiated, Stage::Unknown] {
            assert!(!from.may_be_followed_by(Stage::Queued, false));
            assert!(from.may_be_followed_by(Stage::Queued, true));
        }
    }

    #[test]
    fn words_are_read_back() {
        for stage in Stage::ALL {
            assert_eq!(stage.name().parse(), Ok(stage));
        }
        assert!("gone".parse::<Stage>().is_err());
    }
}
