//! What to look for.

use crate::time::{EarthOrientation, UtcInstant};

/// The longest window a search takes, days: ten years. Elements are good for days.
pub const LONGEST_WINDOW_DAYS: i64 = 3653;

/// A window of time and a threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassSearch {
    /// Where the window begins. It may lie before the epoch of the elements.
    pub start: UtcInstant,
    /// Where it ends. A window of no length has no passes.
    pub stop: UtcInstant,
    /// The elevation above which a pass is a pass, degrees, -90 to 90. Where a station has a horizon mask of its own, the
    /// higher of the two counts.
    pub min_elevation_deg: f64,
    /// How far the Earth has turned.
    pub orientation: EarthOrientation,
    /// Whether to look outside the window for the true AOS and LOS of the passes that it cuts.
    pub beyond_window: bool,
}

impl PassSearch {
    /// A window at a threshold, UT1 taken as UTC, with the true ends of clipped passes.
    #[must_use]
    pub const fn new(start: UtcInstant, stop: UtcInstant, min_elevation_deg: f64) -> Self {
        Self {
            start,
            stop,
            min_elevation_deg,
            orientation: EarthOrientation::UT1_IS_UTC,
            beyond_window: true,
        }
    }

    /// Says what cannot be searched.
    pub(super) fn check(&self) -> Result<(), SearchError> {
        if self.stop < self.start {
            return Err(SearchError::Reversed { start: self.start, stop: self.stop });
        }
        // Begun days count.
        let days =
            self.stop.us_since(self.start).saturating_add(crate::time::DAY_US - 1) / crate::time::DAY_US;
        if days > LONGEST_WINDOW_DAYS {
            return Err(SearchError::WindowTooLong { days });
        }
        if self.start < UtcInstant::EARLIEST || self.stop > UtcInstant::LATEST {
            return Err(SearchError::OutsideCalendar { start: self.start, stop: self.stop });
        }
        if !(-90.0..=90.0).contains(&self.min_elevation_deg) {
            return Err(SearchError::Elevation { found_deg: self.min_elevation_deg });
        }
        Ok(())
    }
}

/// A search that cannot be made.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SearchError {
    /// The window ends before it begins.
    #[error("the window ends at {stop}, before it begins at {start}: exchange the two")]
    Reversed {
        /// Begin given.
        start: UtcInstant,
        /// End given.
        stop: UtcInstant,
    },
    /// The window is longer than [`LONGEST_WINDOW_DAYS`].
    #[error("the window has {days} days: search at most {LONGEST_WINDOW_DAYS} at a time")]
    WindowTooLong {
        /// Whole days given.
        days: i64,
    },
    /// The window reaches outside the years 1900 to 2200.
    #[error("the window from {start} to {stop} reaches outside the years 1900 to 2200")]
    OutsideCalendar {
        /// Begin given.
        start: UtcInstant,
        /// End given.
        stop: UtcInstant,
    },
    /// The threshold is no elevation.
    #[error("the least elevation {found_deg} is outside -90 to 90 degrees")]
    Elevation {
        /// Degrees given.
        found_deg: f64,
    },
    /// The one who asked said stop.
    #[error("the search was stopped after {done} of {total} satellites")]
    Stopped {
        /// Satellites searched.
        done: usize,
        /// Satellites given.
        total: usize,
    },
}
