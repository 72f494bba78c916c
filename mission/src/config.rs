//! What the engine must know beforehand: the station, its satellites and its links.

use protocol::Key;
use radio::airtime::LinkTiming;

use crate::id::{LinkId, SatelliteId, StationId};
use crate::limits::LimitRule;
use crate::schedule::Window;
use crate::sky::Site;

/// A station with its satellites and links.
#[derive(Debug, Clone)]
pub struct StationConfig {
    /// The station.
    pub station: StationId,
    /// The satellites that it hears and commands.
    pub satellites: Vec<SatelliteConfig>,
    /// The ways to its radios.
    pub links: Vec<LinkConfig>,
    /// Where it stands; without it no pass is known.
    pub site: Option<Site>,
    /// When it may transmit and when it is closed.
    pub times: Times,
}

/// When a station may transmit, and when it is closed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Times {
    /// It may transmit in these windows only; `None`: always.
    pub licence: Option<Vec<Window>>,
    /// Nothing is planned and nothing is transmitted in these: maintenance, wind, people on the roof; with the reason.
    pub blackouts: Vec<(Window, String)>,
    /// Between two satellites the antenna needs this long, s.
    pub switch_over_s: u32,
}

/// A satellite: its profile, its key, its limits.
#[derive(Debug, Clone)]
pub struct SatelliteConfig {
    /// The satellite.
    pub id: SatelliteId,
    /// What differs between satellites.
    pub profile: Profile,
    /// The key that seals its telecommands; without one it can be heard, not commanded.
    pub key: Option<Key>,
    /// Limits on its values.
    pub limits: Vec<LimitRule>,
}

/// The satellite profile of the ICD: what differs between satellites, or may turn out otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    /// Address of its radio module.
    pub address: u16,
    /// Answers carry the tag of their request.
    pub tags: bool,
    /// It knows GetImageRanges.
    pub ranges: bool,
    /// How its uplink counter runs.
    pub counter: CounterRule,
    /// Microseconds between two heartbeats.
    pub heartbeat_period_us: u64,
    /// The ground's module appends an RSSI byte to each radio packet.
    pub rssi: bool,
}

impl Default for Profile {
    fn default() -> Self {
        Self {
            address: 0xDE69,
            tags: true,
            ranges: false,
            counter: CounterRule::Time,
            heartbeat_period_us: 60_000_000,
            rssi: true,
        }
    }
}

/// How the uplink counter runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CounterRule {
    /// The greater of last + 1 and microseconds since 1970.
    Time,
    /// Last + 1.
    Sequence,
}

/// A way to a radio.
#[derive(Debug, Clone)]
pub struct LinkConfig {
    /// The link.
    pub id: LinkId,
    /// Whom it hears and reaches.
    pub satellite: SatelliteId,
    /// Airtime, UART and turn-round of this link.
    pub timing: LinkTiming,
    /// Whether it may transmit when the station starts.
    pub armed: bool,
    /// A file or another ear: it never transmits.
    pub receive_only: bool,
}
