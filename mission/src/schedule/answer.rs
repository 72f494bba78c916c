//! What the scheduler answers: contacts, refusals, and how good the whole is.

use std::fmt;
use std::sync::Arc;

use super::PassKey;
use super::problem::Window;
use crate::clock::UtcUs;
use crate::id::{AntennaId, SatelliteId, StationId};

/// Points, in millionths, so that sums are exact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Worth(pub i64);

impl Worth {
    /// Millionths in a point.
    pub const SCALE: i64 = 1_000_000;

    /// In points.
    pub fn points(self) -> f64 {
        self.0 as f64 / Self::SCALE as f64
    }
}

impl fmt::Display for Worth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.0}", self.points())
    }
}

/// Why a contact begins after AOS or ends before LOS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Cut {
    /// The antenna serves this pass next, or served it before.
    Contact(PassKey),
    /// A blackout or the licence, in its own words.
    Closed(String),
}

/// Whether a contact counts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Role {
    /// It is the one that counts for this passage of the satellite.
    Lead,
    /// An idle antenna that listens along. It counts nothing and never transmits; the lead is named.
    Ear(PassKey),
}

/// A pass that was chosen, and how.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contact {
    /// The pass.
    pub key: PassKey,
    /// Whose pass.
    pub satellite: SatelliteId,
    /// Over which station.
    pub station: StationId,
    /// By which antenna.
    pub antenna: AntennaId,
    /// The begin: a whole second at or after AOS.
    pub start: UtcUs,
    /// The end: a whole second at or before LOS.
    pub stop: UtcUs,
    /// Whether it is the whole pass, to the second.
    pub whole: bool,
    /// What it is worth; nothing for an ear.
    pub worth: Worth,
    /// Whether it counts, or listens along.
    pub role: Role,
    /// When it may transmit, if it wants to: only one contact transmits to a satellite at a time.
    pub transmit: Option<Window>,
    /// Whether it was promised before, by the previous schedule.
    pub kept: bool,
    /// Why it begins late.
    pub cut_start: Option<Cut>,
    /// Why it ends early.
    pub cut_stop: Option<Cut>,
    /// The passes that were refused for it, or for it and others.
    pub over: Vec<PassKey>,
    /// The plan that waits for this pass.
    pub plan: Option<Arc<str>>,
}

/// A contact that stood in the way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rival {
    /// Its pass.
    pub key: PassKey,
    /// Its antenna.
    pub antenna: AntennaId,
    /// Its begin.
    pub start: UtcUs,
    /// Its end.
    pub stop: UtcUs,
    /// What it is worth.
    pub worth: Worth,
    /// Whether it was promised before: such a one gives way only to a clearly better choice.
    pub kept: bool,
}

impl fmt::Display for Rival {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}-{}Z", self.key.satellite, Clock(self.start), Clock(self.stop))
    }
}

/// Why a pass was refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reason {
    /// The candidate makes no sense: the field, and what is wrong with it.
    Invalid(&'static str),
    /// The station has no antenna for it.
    NoAntenna,
    /// The station is unfit, and why.
    Unfit(String),
    /// A blackout or the licence leaves nothing that would be enough; in their words.
    Closed {
        /// The reasons that were given, each once.
        by: Vec<String>,
        /// The longest time that is left.
        left_s: u32,
        /// How long it has to be.
        needed_s: u32,
    },
    /// The pass is shorter than the minimum.
    TooShort {
        /// How long it is.
        left_s: u32,
        /// How long it has to be.
        needed_s: u32,
    },
    /// The same passage of the satellite is taken by another station, and no antenna here is idle enough to listen along.
    HeardElsewhere(Rival),
    /// Others on the antenna that would have come cheapest are worth more.
    Loses {
        /// Them, in order of time.
        to: Vec<Rival>,
    },
}

/// A pass that was not chosen, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// The pass.
    pub key: PassKey,
    /// Whose pass.
    pub satellite: SatelliteId,
    /// Over which station.
    pub station: StationId,
    /// Its AOS.
    pub aos: UtcUs,
    /// Its LOS.
    pub los: UtcUs,
    /// What the whole pass would be worth.
    pub worth: Worth,
    /// Why it was refused.
    pub reason: Reason,
    /// The plan that waits for this pass, and waits on.
    pub plan: Option<Arc<str>>,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.reason {
            Reason::Invalid(what) => write!(f, "not a pass: {what}"),
            Reason::NoAntenna => write!(f, "no antenna of {} serves it", self.station),
            Reason::Unfit(why) => write!(f, "{} is not used: {why}", self.station),
            Reason::Closed { by, left_s, needed_s } => {
                write!(f, "closed ({}): {left_s} s are left of the {needed_s} s it needs", by.join("; "))
            }
            Reason::TooShort { left_s, needed_s } => {
                write!(f, "too short: {left_s} s of the {needed_s} s it needs")
            }
            Reason::HeardElsewhere(lead) => {
                write!(f, "heard by {} instead: {}", lead.key.station, lead)
            }
            Reason::Loses { to } => {
                write!(f, "loses to ")?;
                for (i, rival) in to.iter().enumerate() {
                    let before = if i == 0 { "" } else { " and " };
                    write!(f, "{before}{rival}")?;
                }
                let theirs = Worth(to.iter().map(|r| r.worth.0).sum());
                write!(f, ", worth {theirs} against {}", self.worth)?;
                let promised = theirs <= self.worth && to.iter().any(|r| r.kept);
                f.write_str(if promised { " but promised before" } else { "" })
            }
        }
    }
}

/// What must be remembered of a candidate until the next schedule, so that small changes move nothing. Plain values: they
/// can be stored and read back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remembered {
    /// The pass.
    pub key: PassKey,
    /// The AOS that the choice was made with, in whole seconds since 1970.
    pub aos_s: i64,
    /// The LOS that the choice was made with, in whole seconds since 1970.
    pub los_s: i64,
    /// Which question the choice answered: a checksum over everything that it depended on.
    pub question: u64,
    /// The antenna, begin and end that were chosen on those times, when it was chosen.
    pub chosen: Option<(AntennaId, i64, i64)>,
    /// Whether it was chosen as an ear.
    pub ear: bool,
}

/// The answer.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Schedule {
    /// What was chosen, in order of begin.
    pub contacts: Vec<Contact>,
    /// Everything else, in order of AOS.
    pub refused: Vec<Refused>,
    /// What the contacts are worth together, on the times they were chosen with; ears count nothing.
    pub worth: Worth,
    /// No schedule is worth more than this.
    pub bound: Worth,
    /// What the next schedule needs to know of this one.
    pub memory: Vec<Remembered>,
}

impl Schedule {
    /// Whether no schedule is worth more.
    pub fn is_proved(&self) -> bool {
        self.worth >= self.bound
    }

    /// How much more the best schedule could be worth, as a part of the bound; 0 when none is.
    pub fn gap(&self) -> f64 {
        if self.is_proved() { 0.0 } else { 1.0 - self.worth.0 as f64 / self.bound.0 as f64 }
    }

    /// The contact that serves a pass.
    pub fn contact(&self, key: &PassKey) -> Option<&Contact> {
        self.contacts.iter().find(|contact| contact.key == *key)
    }
}

/// `hh:mm` in UTC.
struct Clock(UtcUs);

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let minute = self.0.0.div_euclid(60_000_000);
        write!(f, "{:02}:{:02}", minute.div_euclid(60).rem_euclid(24), minute.rem_euclid(60))
    }
}
