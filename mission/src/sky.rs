//! The sky over the station: elements, how far they can be trusted, and passes ahead.
//!
//! Pure functions of elements, a place and the time. The engine uses them to know whether a satellite is in view
//! (`station::sky`); the shell uses the same ones for tables and plots.

use std::fmt;
use std::sync::Arc;

use tle::passes::{EndCause, Pass, PassFinder, PassSearch};
use tle::{EarthOrientation, Elements, UtcInstant};

use crate::clock::UtcUs;
use crate::id::ElementsId;
use crate::level::Level;

/// Element sets of one satellite that the engine keeps at hand, the newest by epoch. The archive keeps all.
pub const SETS_KEPT: usize = 64;
/// Element sets that may be added at once.
pub const SETS_AT_ONCE: usize = 1000;
/// Passes that the status tells of one satellite.
pub const PASSES_TOLD: usize = 16;
/// How far ahead passes are sought, microseconds: two days.
pub const AHEAD_US: i64 = 2 * 86_400_000_000;
/// A timing error above which elements say nothing about the presence of a satellite any more, s.
pub const USELESS_TIMING_ERROR_S: f64 = 120.0;

/// Where the station stands and what it sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// The place with its horizon mask.
    pub place: tle::Station,
    /// The least elevation at which anything can be heard, degrees; where the mask is higher, the mask counts.
    pub min_elevation_deg: f64,
    /// UT1-UTC.
    pub orientation: EarthOrientation,
}

/// A set of elements with its number in the archive.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementSet {
    /// Its number.
    pub id: ElementsId,
    /// The elements.
    pub elements: Arc<Elements>,
}

/// Of several sets of one object, the one for this instant: the newest at or before it, else the nearest; of two with
/// the same epoch the one that was added later.
#[must_use]
pub fn best_set(sets: &[ElementSet], at: UtcUs) -> Option<&ElementSet> {
    let at = instant(at);
    let newest =
        sets.iter().filter(|set| set.elements.epoch <= at).max_by_key(|set| (set.elements.epoch, set.id));
    newest.or_else(|| sets.iter().min_by_key(|set| (set.elements.epoch, std::cmp::Reverse(set.id))))
}

/// How old elements are, what error of AOS and LOS that lets expect, and how much anybody should care.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementsAge {
    /// Days since the epoch; negative before it.
    pub age_days: f64,
    /// Expected error of AOS and LOS, s (one sigma, a rule of thumb).
    pub timing_error_s: f64,
    /// Watch from 5 s or 7 days, warning from 20 s or 14 days, distress when they say nothing any more.
    pub level: Level,
}

impl ElementsAge {
    /// Age and expected error at an instant.
    ///
    /// The rule of thumb: public elements are about 2 km (0.3 s) off at their epoch, and drift along the track by 0.15 s
    /// a day; on top, a third of what drag has done since the epoch is uncertain, because the density of the air is. Drag
    /// is taken from the mean motion's derivative, and for low orbits never below 2e-5 rev/day^2, since elements made before
    /// launch have none.
    #[must_use]
    pub fn at(elements: &Elements, at: UtcUs) -> Self {
        let age_days = elements.age_days(instant(at));
        let is_low = elements.mean_motion_rev_day > 6.4;
        let least = if is_low { 2e-5 } else { 0.0 };
        // Half the derivative times the square of the days is revolutions.
        let drag_rev_day2 = elements.mean_motion_dot.abs().max(least);
        let days = age_days.abs();
        let drag_s = drag_rev_day2 * days * days / elements.mean_motion_rev_day.max(0.01) * 86_400.0;
        let timing_error_s = 0.3 + 0.15 * days + drag_s / 3.0;
        let level = if timing_error_s > USELESS_TIMING_ERROR_S || !timing_error_s.is_finite() {
            Level::Distress
        } else if timing_error_s >= 20.0 || days >= 14.0 {
            Level::Warning
        } else if timing_error_s >= 5.0 || days >= 7.0 {
            Level::Watch
        } else {
            Level::Normal
        };
        Self { age_days, timing_error_s, level }
    }

    /// They still tell whether the satellite is in view.
    #[must_use]
    pub fn is_useful(&self) -> bool {
        self.level < Level::Distress
    }
}

/// A pass to come, or the one that lasts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassAhead {
    /// Above the station's horizon from here on. For an object that does not rise, where the search began.
    pub aos_at: UtcUs,
    /// Greatest elevation.
    pub tca_at: UtcUs,
    /// Below the horizon from here on; `None` for an object that does not set, or whose elements end.
    pub los_at: Option<UtcUs>,
    /// Elevation at TCA, degrees.
    pub max_elevation_deg: f64,
    /// Azimuths at AOS, TCA and LOS, degrees from north over east.
    pub azimuths_deg: [f64; 3],
    /// The elements it was computed from.
    pub elements: ElementsId,
}

impl PassAhead {
    fn of(pass: &Pass, elements: ElementsId) -> Self {
        let end = |cause: EndCause, at: UtcInstant| match cause {
            EndCause::Horizon => Some(at),
            EndCause::Window { crossing } => crossing,
            EndCause::NoState(_) => None,
        };
        let aos = end(pass.aos.cause, pass.aos.at).unwrap_or(pass.aos.at);
        Self {
            aos_at: utc(aos),
            tca_at: utc(pass.tca.at),
            los_at: end(pass.los.cause, pass.los.at).map(utc),
            max_elevation_deg: pass.tca.look.elevation_deg,
            azimuths_deg: [pass.aos.look.azimuth_deg, pass.tca.look.azimuth_deg, pass.los.look.azimuth_deg],
            elements,
        }
    }

    /// The satellite is above the horizon at this instant.
    #[must_use]
    pub fn lasts_at(&self, at: UtcUs) -> bool {
        self.aos_at <= at && self.los_at.is_none_or(|los| at < los)
    }

    /// It is over at this instant.
    #[must_use]
    pub fn is_over_at(&self, at: UtcUs) -> bool {
        self.los_at.is_some_and(|los| los <= at)
    }

    /// The same pass, told by other elements perhaps: they overlap.
    #[must_use]
    pub fn is_same_as(&self, aos_at: UtcUs, los_at: Option<UtcUs>) -> bool {
        self.los_at.is_none_or(|los| aos_at < los) && los_at.is_none_or(|los| self.aos_at < los)
    }
}

/// Why elements tell no passes.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SkyFault {
    /// SGP4 takes no such elements.
    #[error("{0}")]
    Elements(#[from] tle::propagator::ElementsError),
    /// No state at this time: decayed, as a rule.
    #[error("{0}")]
    NoState(tle::PropagationError),
    /// The window cannot be searched.
    #[error("{0}")]
    Search(#[from] tle::passes::SearchError),
}

/// The passes of one set over the station from `start` to `stop`, in order of time, the one in progress with its true AOS.
///
/// # Errors
/// [`SkyFault`] when the elements tell nothing in the whole window.
pub fn passes_of(
    set: &ElementSet,
    site: &Site,
    start: UtcUs,
    stop: UtcUs,
) -> Result<Vec<PassAhead>, SkyFault> {
    let finder = PassFinder::new(&set.elements)?;
    let search = PassSearch {
        orientation: site.orientation,
        ..PassSearch::new(instant(start), instant(stop), site.min_elevation_deg)
    };
    let found = finder.find(std::slice::from_ref(&site.place), &search)?;
    if let Some(gap) = found.gaps.first()
        && gap.from <= instant(start)
        && gap.until >= instant(stop)
    {
        return Err(SkyFault::NoState(gap.fault));
    }
    Ok(found.stations.iter().flatten().map(|pass| PassAhead::of(pass, set.id)).collect())
}

/// Whether the Sun shines on a satellite at an instant; penumbra counts as shadow. `None` when it has no state then.
#[must_use]
pub fn sunlit_at(orbit: &tle::Propagator, at: UtcUs) -> Option<bool> {
    let at = instant(at);
    let state = orbit.at(at).ok()?;
    Some(tle::shadow::light(state.r_teme_km, at) == tle::shadow::Light::Sunlit)
}

/// The engine's time as an instant of `tle`.
#[must_use]
pub const fn instant(at: UtcUs) -> UtcInstant {
    UtcInstant::from_unix_us(at.0)
}

/// An instant of `tle` as the engine's time.
#[must_use]
pub const fn utc(at: UtcInstant) -> UtcUs {
    UtcUs(at.unix_us())
}

/// An instant as people say it now: `14:32Z` within the next twelve hours, `2026-11-22 14:32Z` beyond.
#[must_use]
pub fn clock_time(at: UtcUs, now: UtcUs) -> impl fmt::Display {
    let text = instant(at).to_string();
    // 2026-11-22T14:32:07.123456Z
    let (date, time) = (text.get(..10).unwrap_or_default(), text.get(11..16).unwrap_or_default());
    if at.0.saturating_sub(now.0).abs() < 12 * 3_600_000_000 {
        format!("{time}Z")
    } else {
        format!("{date} {time}Z")
    }
}
