//! The five levels of XTCE, used for limits and for the weight of events alike.

use std::fmt;
use std::str::FromStr;

/// How much somebody should care. Ordered: [`Level::Normal`] is the least.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Level {
    /// Inside all limits; an event that is merely worth writing down.
    #[default]
    Normal,
    /// Worth an eye.
    Watch,
    /// Worth a thought.
    Warning,
    /// Something does not work as it should.
    Distress,
    /// The mission is in danger.
    Critical,
    /// The satellite is in danger.
    Severe,
}

impl Level {
    /// All, from the least to the gravest.
    pub const ALL: [Self; 6] =
        [Self::Normal, Self::Watch, Self::Warning, Self::Distress, Self::Critical, Self::Severe];

    /// The word, lower case, as it stands on the wire and in the database.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Watch => "watch",
            Self::Warning => "warning",
            Self::Distress => "distress",
            Self::Critical => "critical",
            Self::Severe => "severe",
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is none of the levels.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no level: use normal, watch, warning, distress, critical or severe")]
pub struct UnknownLevel(pub String);

impl FromStr for Level {
    type Err = UnknownLevel;
    fn from_str(word: &str) -> Result<Self, UnknownLevel> {
        Self::ALL.into_iter().find(|l| l.name() == word).ok_or_else(|| UnknownLevel(word.to_owned()))
    }
}
