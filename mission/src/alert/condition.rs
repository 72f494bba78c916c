//! What may hold and should not.

use std::fmt;
use std::str::FromStr;

use crate::id::SatelliteId;
use crate::level::Level;

/// What is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum AlertKind {
    /// A value beyond its limits. Subject: satellite and parameter.
    Limit,
    /// In view, and nothing is heard. Subject: the satellite.
    Beacon,
    /// Nothing was heard in pass after pass. Subject: the satellite.
    Silent,
    /// Elements are old, or tell nothing. Subject: the satellite.
    Elements,
    /// The disk fills up. Subject: the data folder.
    Disk,
    /// The archive takes nothing. Subject: the archive.
    Storage,
    /// Nobody says that the machine's clock is right. Subject: the station.
    Clock,
    /// A plan failed, or was missed or dropped. Subject: the plan.
    Plan,
    /// A link is lost. Subject: the link.
    Link,
    /// The rotator does not do as it is told. Subject: the station.
    Rotator,
    /// Nothing is sealed. Subject: the key.
    Sealing,
    /// The backup failed. Subject: whoever makes it.
    Backup,
    /// A way in for what others heard refuses us. Subject: the ear.
    Ear,
    /// An event of a kind and level that a rule names. Subject: the kind, and whom it concerns.
    Event,
    /// Messages to a target do not arrive. Subject: the target.
    Delivery,
}

impl AlertKind {
    /// All kinds.
    pub const ALL: [Self; 15] = [
        Self::Limit,
        Self::Beacon,
        Self::Silent,
        Self::Elements,
        Self::Disk,
        Self::Storage,
        Self::Clock,
        Self::Plan,
        Self::Link,
        Self::Rotator,
        Self::Sealing,
        Self::Backup,
        Self::Ear,
        Self::Event,
        Self::Delivery,
    ];

    /// The word in the configuration, in the database and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Limit => "limit",
            Self::Beacon => "beacon",
            Self::Silent => "silent",
            Self::Elements => "elements",
            Self::Disk => "disk",
            Self::Storage => "storage",
            Self::Clock => "clock",
            Self::Plan => "plan",
            Self::Link => "link",
            Self::Rotator => "rotator",
            Self::Sealing => "sealing",
            Self::Backup => "backup",
            Self::Ear => "ear",
            Self::Event => "event",
            Self::Delivery => "delivery",
        }
    }
}

impl fmt::Display for AlertKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is no kind of alert.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no kind of alert: use {known}", known = AlertKind::ALL.map(AlertKind::name).join(", "))]
pub struct UnknownAlertKind(pub String);

impl FromStr for AlertKind {
    type Err = UnknownAlertKind;
    fn from_str(word: &str) -> Result<Self, UnknownAlertKind> {
        let known = Self::ALL.into_iter().find(|kind| kind.name() == word);
        known.ok_or_else(|| UnknownAlertKind(word.chars().take(40).collect()))
    }
}

/// Something that holds now, or has just happened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Condition {
    /// What kind.
    pub kind: AlertKind,
    /// What it is about; with the rule it names the alert.
    pub subject: String,
    /// The satellite it concerns, if one.
    pub satellite: Option<SatelliteId>,
    /// How grave.
    pub level: Level,
    /// One sentence that stands alone.
    pub message: String,
}

impl Condition {
    /// A condition that concerns no satellite.
    pub fn new(
        kind: AlertKind,
        subject: impl Into<String>,
        level: Level,
        message: impl Into<String>,
    ) -> Self {
        Self { kind, subject: subject.into(), satellite: None, level, message: message.into() }
    }

    /// The same, about this satellite.
    #[must_use]
    pub fn of(mut self, satellite: &SatelliteId) -> Self {
        self.satellite = Some(satellite.clone());
        self
    }
}
