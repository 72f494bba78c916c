//! A satellite's way through the sky of a station.

use tle::{Elements, LookAngles, Propagator, UtcInstant, ecef_from_teme, gmst_rad};

use super::direction::Direction;
use crate::clock::UtcUs;
use crate::sky::Site;

/// Samples that a path has at most: one a second for a low satellite, fewer for one that stays for hours.
pub const PATH_SAMPLES: i64 = 8_000;

/// Where something stands in the sky at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkySample {
    /// When.
    pub at: UtcUs,
    /// Where. Geometric, without refraction.
    pub direction: Direction,
}

/// Why there is no path.
#[derive(Debug, thiserror::Error)]
pub enum PathError {
    /// The elements are none.
    #[error("the elements cannot be used")]
    Elements(#[from] tle::propagator::ElementsError),
    /// The theory has no state at the beginning.
    #[error("the elements say nothing of this time")]
    NoState(#[from] tle::PropagationError),
    /// It ends before it begins.
    #[error("the pass ends before it begins")]
    Empty,
}

/// Where the satellite stands over a site at an instant.
///
/// # Errors
/// What the theory says when it has no state.
pub fn look_at(propagator: &Propagator, site: &Site, at: UtcUs) -> Result<LookAngles, tle::PropagationError> {
    let at = UtcInstant::from_unix_us(at.0);
    let object = ecef_from_teme(&propagator.at(at)?, gmst_rad(at, site.orientation));
    Ok(site.place.look(&object))
}

/// The way of a satellite from `from` to `until`, a sample a second or [`PATH_SAMPLES`] in all, the ends included. It ends
/// early where the elements do.
///
/// # Errors
/// [`PathError`] when there is not even a first sample.
pub fn sky_path(
    elements: &Elements,
    site: &Site,
    from: UtcUs,
    until: UtcUs,
) -> Result<Vec<SkySample>, PathError> {
    let span_us = until.0.saturating_sub(from.0);
    if span_us < 0 {
        return Err(PathError::Empty);
    }
    let propagator = Propagator::new(elements)?;
    let step_us = (span_us / PATH_SAMPLES).max(1_000_000);
    let steps = span_us / step_us + i64::from(span_us % step_us != 0);
    let mut path = Vec::with_capacity(usize::try_from(steps).unwrap_or(0) + 1);
    for step in 0..=steps {
        let at = UtcUs(from.0.saturating_add(step.saturating_mul(step_us)).min(until.0));
        match look_at(&propagator, site, at) {
            Ok(look) => {
                let direction = Direction::new(look.azimuth_deg, look.elevation_deg);
                if direction.is_finite() {
                    path.push(SkySample { at, direction });
                }
            }
            Err(error) if path.is_empty() => return Err(error.into()),
            Err(_) => break,
        }
    }
    if path.is_empty() { Err(PathError::Empty) } else { Ok(path) }
}
