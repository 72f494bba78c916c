//! What is asked of the planner.

use std::ops::Range;

use tle::{EarthOrientation, Elements, Station};

use crate::clock::UtcUs;

/// Listeners that one task takes.
pub const LISTENERS_MAX: usize = 5_000;
/// The longest window, days.
pub const WINDOW_DAYS_MAX: i64 = 7;

/// A station of the public network, or one's own.
#[derive(Debug, Clone, PartialEq)]
pub struct Listener {
    /// What it is called; free text of strangers.
    pub name: String,
    /// Where it stands, and its horizon.
    pub place: Station,
    /// When it was last seen alive; `None`: unknown.
    pub last_seen: Option<UtcUs>,
    /// Of the satellite's passes over it, the share in which it heard something, 0 to 1; `None`: unknown.
    pub success: Option<f64>,
}

impl Listener {
    /// The probability that it listens in a pass at this time.
    ///
    /// Its history, 0.3 where there is none; halved for each week since it was last seen, after the first hour; halved once
    /// where that is unknown. Never above 0.98.
    #[must_use]
    pub fn listening(&self, at: UtcUs) -> f64 {
        let history = self.success.filter(|share| share.is_finite()).unwrap_or(0.3).clamp(0.0, 0.98);
        let freshness = self.last_seen.map_or(0.5, |seen| {
            let hours = at.0.saturating_sub(seen.0) as f64 / 3.6e9;
            if hours <= 1.0 { 1.0 } else { 0.5_f64.powf(hours / (7.0 * 24.0)) }
        });
        history * freshness
    }
}

/// How strong the satellite is at a listener.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Margin over what half of the frames need, dB, at 500 km and the zenith.
    pub margin_500km_db: f64,
    /// How sharp the edge is, dB: fading included.
    pub edge_db: f64,
    /// Extra loss at the very horizon, dB; gone at 6 degrees.
    pub horizon_loss_db: f64,
}

impl Default for Link {
    /// 30 dBm into 0 dBi at both ends leave 14.8 dB at 500 km; 5 dB of that go to the noise of a town.
    fn default() -> Self {
        Self { margin_500km_db: 9.8, edge_db: 1.2, horizon_loss_db: 4.0 }
    }
}

impl Link {
    /// The margin at an elevation and distance, dB.
    #[must_use]
    pub fn margin_db(&self, elevation_deg: f64, range_km: f64) -> f64 {
        let spreading_db = 20.0 * (range_km.max(1.0) / 500.0).log10();
        let horizon_db = self.horizon_loss_db * (1.0 - elevation_deg / 6.0).clamp(0.0, 1.0);
        self.margin_500km_db - spreading_db - horizon_db
    }

    /// The probability that a frame with this margin is received.
    #[must_use]
    pub fn heard(&self, margin_db: f64) -> f64 {
        1.0 / (1.0 + (-margin_db / self.edge_db.max(0.05)).exp())
    }
}

/// What the satellite can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Entries that a schedule may have, 1 to 8.
    pub entries_max: usize,
    /// Chunks that an entry may have: while it sends, the satellite is deaf.
    pub chunks_max: u16,
    /// From one chunk to the next, microseconds.
    pub chunk_us: i64,
    /// What a heartbeat between two chunks takes, microseconds.
    pub heartbeat_us: i64,
    /// From one heartbeat to the next, microseconds.
    pub heartbeat_period_us: i64,
    /// From the end of an entry to the next at least, microseconds: the satellite listens.
    pub pause_us: i64,
}

impl Default for Rules {
    /// PixelSat I: 8 entries, 64 chunks, the timing of its radio, a heartbeat each minute, two seconds of silence.
    fn default() -> Self {
        let timing = radio::airtime::LinkTiming::default();
        let frame_us = |len| i64::try_from(timing.frame_us(len)).unwrap_or(i64::MAX / 4) + 5_000;
        Self {
            entries_max: 8,
            chunks_max: 64,
            chunk_us: frame_us(240),
            heartbeat_us: frame_us(133),
            heartbeat_period_us: 60_000_000,
            pause_us: 2_000_000,
        }
    }
}

impl Rules {
    /// From one chunk to the next with the heartbeats in between shared out, microseconds.
    #[must_use]
    pub fn beat_us(&self) -> i64 {
        let share = self.heartbeat_us as f64 / (self.heartbeat_period_us - self.heartbeat_us).max(1) as f64;
        (self.chunk_us as f64 * (1.0 + share)).round() as i64
    }
}

/// The battery, as far as the transmitter drains it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    /// What it holds when full, Wh.
    pub capacity_wh: f64,
    /// What it holds at the beginning, Wh.
    pub charge_wh: f64,
    /// Below this nothing may be scheduled, Wh.
    pub floor_wh: f64,
    /// What the panels give in the Sun on average, W.
    pub sunlit_w: f64,
    /// What everything but the transmitter takes, W.
    pub load_w: f64,
    /// What the transmitter takes while it sends, W.
    pub transmit_w: f64,
}

/// An antenna that is better in one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pointing {
    /// Its direction in body axes.
    pub axis_body: [f64; 3],
    /// What is lost on average while the satellite turns as it likes, dB.
    pub loose_loss_db: f64,
    /// What is lost once it points to nadir, dB.
    pub held_loss_db: f64,
    /// Time in which a turn is done to 1/e, s.
    pub settle_s: f64,
}

/// What is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// The orbit.
    pub elements: Elements,
    /// Who may hear.
    pub listeners: Vec<Listener>,
    /// Missing chunks, ascending.
    pub missing: Vec<u16>,
    /// Nothing is scheduled before this: the schedule must be on board.
    pub from: UtcUs,
    /// The deadline: what is not heard by then does not count.
    pub until: UtcUs,
    /// When the satellite must not send by itself: passes over the own station, in which it must hear.
    pub silent: Vec<Range<UtcUs>>,
    /// The link to a listener.
    pub link: Link,
    /// The satellite's rules.
    pub rules: Rules,
    /// Its battery; `None`: not a matter.
    pub battery: Option<Battery>,
    /// Its antenna; `None`: the same in all directions, and attitude is left alone.
    pub pointing: Option<Pointing>,
    /// How far the Earth has turned.
    pub orientation: EarthOrientation,
}

impl Task {
    /// A task with PixelSat's rules, an even antenna and no worry about the battery.
    #[must_use]
    pub fn new(
        elements: Elements,
        listeners: Vec<Listener>,
        missing: Vec<u16>,
        from: UtcUs,
        until: UtcUs,
    ) -> Self {
        Self {
            elements,
            listeners,
            missing,
            from,
            until,
            silent: Vec::new(),
            link: Link::default(),
            rules: Rules::default(),
            battery: None,
            pointing: None,
            orientation: EarthOrientation::UT1_IS_UTC,
        }
    }

    pub(super) fn check(&self) -> Result<(), TaskError> {
        if self.until <= self.from {
            return Err(TaskError::Window("ends before it begins: exchange the two"));
        }
        if self.until.0.saturating_sub(self.from.0) > WINDOW_DAYS_MAX * 86_400_000_000 {
            return Err(TaskError::Window("is longer than 7 days: elements do not last so long"));
        }
        if self.listeners.len() > LISTENERS_MAX {
            return Err(TaskError::Listeners { found: self.listeners.len() });
        }
        if let Some(pair) = self.missing.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(TaskError::Missing { found: pair[1] });
        }
        let rules = &self.rules;
        let is_sound = (1..=8).contains(&rules.entries_max)
            && rules.chunks_max > 0
            && rules.chunk_us >= 1_000
            && rules.heartbeat_us >= 0
            && rules.heartbeat_period_us > rules.heartbeat_us
            && rules.pause_us >= 0;
        if is_sound { Ok(()) } else { Err(TaskError::Rules) }
    }
}

/// A task that makes no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TaskError {
    /// The window.
    #[error("the window {0}")]
    Window(&'static str),
    /// Too many listeners.
    #[error(
        "{found} listeners are more than the {LISTENERS_MAX} that a task takes: choose those below the ground track"
    )]
    Listeners {
        /// Given.
        found: usize,
    },
    /// Missing chunks out of order.
    #[error("the missing chunks are not in order at {found}: give each once, ascending")]
    Missing {
        /// The chunk at which it shows.
        found: u16,
    },
    /// Rules that no satellite has.
    #[error(
        "the rules need one to eight entries, one chunk and a millisecond for each, and heartbeats shorter than their period"
    )]
    Rules,
    /// SGP4 takes no such elements.
    #[error("{0}")]
    Elements(#[from] tle::propagator::ElementsError),
    /// No state at some time of the window.
    #[error("{0}")]
    NoState(#[from] tle::PropagationError),
    /// The window cannot be searched for passes.
    #[error("{0}")]
    Search(#[from] tle::passes::SearchError),
}
