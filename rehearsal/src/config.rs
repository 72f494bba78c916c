//! What kind of world.

use mission::config::Times;
use mission::{Intent, Profile, SatelliteId, Site};
use radio::airtime::LinkTiming;
use satellite::{ChannelConfig, Orbit, PassProfile};
use tle::{Elements, Station};

/// A world by its seed.
#[derive(Debug, Clone)]
pub struct WorldConfig {
    /// Everything random follows from it.
    pub seed: u64,
    /// The air: losses, flips, bursts, passes. Its seed is set from `seed`.
    pub channel: ChannelConfig,
    /// What the satellite flies; `None`: made up by the seed. It decides the passes where `channel.passes` follows it.
    pub orbit: Option<Orbit>,
    /// UTC at the beginning, ms since 1970.
    pub utc_at_zero_ms: u64,
    /// Size of the satellite's images in bytes.
    pub image_bytes: u32,
    /// A real picture instead of a pattern (slow to make).
    pub real_picture: bool,
    /// The satellite knows GetImageRanges, and ground uses it.
    pub ranges: bool,
    /// Answers carry tags.
    pub tags: bool,
    /// Ground is told when the satellite comes into view, and when it will be lost; where an orbit decides that, ground is
    /// given the elements and the station's place instead, and finds out by itself.
    pub view_is_known: bool,
    /// What people do.
    pub operator: Operator,
    /// What goes wrong on the ground.
    pub chaos: Chaos,
    /// Others who hear the satellite, wherever it is; `None`: nobody does.
    pub strangers: Option<Strangers>,
    /// A station and a satellite that exist, with what they are told at the beginning; `None`: made up.
    pub known: Option<Box<Known>>,
}

/// A station and a satellite that exist.
#[derive(Debug, Clone)]
pub struct Known {
    /// What it is called.
    pub satellite: SatelliteId,
    /// What differs between satellites. The twin knows the same packets and keeps the same rhythm.
    pub profile: Profile,
    /// Modem and turn-round of both ends.
    pub timing: LinkTiming,
    /// What ground believes of its place; the channel has its own.
    pub site: Site,
    /// When the station may transmit, and when it is closed.
    pub times: Times,
    /// What ground believes of the orbit; the twin flies [`WorldConfig::orbit`].
    pub elements: Elements,
    /// From the end of the boot to the first heartbeat, microseconds.
    pub first_heartbeat_us: u64,
    /// What is wanted once ground has its elements, in this order.
    pub intents: Vec<Intent>,
}

/// What people do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    /// Nothing at all.
    Absent,
    /// Order the image once.
    WantsImage,
    /// Order images, take pictures, send every kind of command at random moments, cancel some.
    Busy,
}

/// Others who hear the satellite and report it later.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strangers {
    /// The chance that anybody hears a frame.
    pub hear: f64,
    /// How long after the frame their report comes, seconds.
    pub delay_s: f64,
    /// They hear in other passes than ours: nothing while the satellite is in our view. For them the satellite is given a
    /// schedule in each of our passes, of gaps that the image has then.
    pub abroad: bool,
}

/// What goes wrong on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Chaos {
    /// Mean seconds between two kills while the satellite is in view; `None` for no kills.
    pub kill_every_s: Option<f64>,
    /// Chance that a batch cannot be stored.
    pub persist_fails: f64,
    /// Chance that the witness cannot be raised.
    pub witness_fails: f64,
    /// Mean seconds between two losses of the port while the satellite is in view.
    pub unplug_every_s: Option<f64>,
}

impl WorldConfig {
    /// A satellite that is always in view over a clean channel, and an operator who wants its image.
    pub fn seeded(seed: u64) -> Self {
        Self {
            seed,
            channel: ChannelConfig::perfect(),
            orbit: None,
            // 2027-03-20T12:00:00Z
            utc_at_zero_ms: 1_805_544_000_000,
            image_bytes: 12_000,
            real_picture: false,
            ranges: false,
            tags: true,
            view_is_known: false,
            operator: Operator::WantsImage,
            chaos: Chaos::default(),
            strangers: None,
            known: None,
        }
    }

    /// The same with losses and flips on the air.
    #[must_use]
    pub fn lossy(mut self, loss: f64, flips: f64) -> Self {
        self.channel.loss = loss;
        self.channel.flips = flips;
        self
    }

    /// The same with stored passes, like those of an orbit, instead of a satellite that stands still.
    #[must_use]
    pub fn with_passes(mut self) -> Self {
        self.channel.passes = PassProfile::default();
        self.channel.elevation_loss = true;
        self
    }

    /// The same with the true passes of an orbit over a station, from this UTC (ms since 1970) on.
    #[must_use]
    pub fn with_orbit(mut self, orbit: Orbit, station: Station, utc_at_zero_ms: u64) -> Self {
        self.channel.passes = PassProfile::seen_from(station);
        self.channel.elevation_loss = true;
        (self.orbit, self.utc_at_zero_ms) = (Some(orbit), utc_at_zero_ms);
        self
    }
}
