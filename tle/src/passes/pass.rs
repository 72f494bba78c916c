//! What a search finds.

use crate::look::LookAngles;
use crate::propagator::PropagationError;
use crate::time::UtcInstant;

/// A maximal interval of the window in which the satellite stands above the threshold of a station.
#[derive(Debug, Clone, PartialEq)]
pub struct Pass {
    /// Acquisition of signal: where the pass begins.
    pub aos: PassEnd,
    /// Time of closest approach, by our definition the greatest elevation within the pass and the window. (The least range
    /// may come seconds before or after.)
    pub tca: PassPoint,
    /// Loss of signal: where the pass ends.
    pub los: PassEnd,
    /// Further summits of the elevation, in order of time. Slow and eccentric orbits have passes with several.
    pub other_summits: Vec<PassPoint>,
}

impl Pass {
    /// Seconds from AOS to LOS.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.los.at.seconds_since(self.aos.at)
    }

    /// Whether the window, or the elements, cut the pass at either end.
    #[must_use]
    pub fn is_clipped(&self) -> bool {
        self.aos.cause != EndCause::Horizon || self.los.cause != EndCause::Horizon
    }
}

/// A moment of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassPoint {
    /// When, to the microsecond.
    pub at: UtcInstant,
    /// Where the satellite stands in the station's sky then.
    pub look: LookAngles,
}

/// Where a pass begins or ends, and why there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassEnd {
    /// When, to the microsecond.
    pub at: UtcInstant,
    /// Where the satellite stands in the station's sky then.
    pub look: LookAngles,
    /// Why the pass begins or ends here.
    pub cause: EndCause,
}

/// Why a pass begins or ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EndCause {
    /// The satellite crosses the threshold.
    Horizon,
    /// The window begins or ends while the satellite is up.
    Window {
        /// The true AOS or LOS outside the window. `None` if it was not looked for, or is further away than two
        /// revolutions or two days, as for an object that never sets.
        crossing: Option<UtcInstant>,
    },
    /// The elements have no state beyond: decayed, as a rule.
    NoState(PropagationError),
}

/// A part of the window in which the theory has no state: nothing is known of passes there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// First instant without a state, to a microsecond or so.
    pub from: UtcInstant,
    /// The instant from which there are states again, or the end of the window.
    pub until: UtcInstant,
    /// What the theory said.
    pub fault: PropagationError,
}

/// What was found of one satellite.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SatellitePasses {
    /// The passes over each station, in the order in which the stations were given; passes in order of time.
    pub stations: Vec<Vec<Pass>>,
    /// Where the elements had no state, in order of time; at most [`GAPS_MAX`], then the first ones.
    pub gaps: Vec<Gap>,
    /// States of SGP4 that the search computed.
    pub sgp4_calls: u64,
}

/// Gaps that a search reports.
pub const GAPS_MAX: usize = 1000;

impl SatellitePasses {
    /// Passes over all stations.
    #[must_use]
    pub fn count(&self) -> usize {
        self.stations.iter().map(Vec::len).sum()
    }
}
