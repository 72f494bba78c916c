//! Horizons that differ by azimuth: passes found above the lowest point of the mask are cut to what it leaves.

use crate::frames::EarthFixed;
use crate::look::LookAngles;
use crate::station::Station;

use super::motion::Motion;
use super::pass::EndCause;
use super::refine::Place;
use super::search::{RawEnd, RawPass};

/// Samples along a pass: every so many seconds, but within bounds.
const SAMPLE_S: f64 = 10.0;
const SAMPLES_MIN: f64 = 12.0;
const SAMPLES_MAX: f64 = 4000.0;

/// The lowest threshold in any azimuth, degrees.
pub(super) fn lowest_deg(station: &Station, min_elevation_deg: f64) -> f64 {
    if station.mask().points().is_empty() {
        min_elevation_deg
    } else {
        station.mask().range_deg().0.max(min_elevation_deg)
    }
}

/// Cuts passes above the lowest threshold to the parts above the mask.
pub(super) fn cut(
    station: &Station,
    min_elevation_deg: f64,
    motion: &mut Motion<'_>,
    passes: Vec<RawPass>,
) -> Vec<RawPass> {
    let lowest_deg = lowest_deg(station, min_elevation_deg);
    let (_, highest_deg) = station.mask().range_deg();
    if station.mask().points().is_empty() || highest_deg <= lowest_deg {
        return passes;
    }
    let view = View { station, min_elevation_deg, lowest_deg };
    passes.iter().flat_map(|pass| view.parts(motion, pass)).collect()
}

struct View<'a> {
    station: &'a Station,
    min_elevation_deg: f64,
    lowest_deg: f64,
}

impl View<'_> {
    /// Elevation above the threshold of its azimuth, degrees.
    fn margin_deg(&self, state: &EarthFixed) -> f64 {
        let look = LookAngles::from_axes(self.station.axes(), state);
        look.elevation_deg - self.threshold_deg(look.azimuth_deg)
    }

    fn threshold_deg(&self, azimuth_deg: f64) -> f64 {
        self.station.mask().elevation_deg(azimuth_deg).max(self.min_elevation_deg)
    }

    fn margin_at(&self, motion: &mut Motion<'_>, t_s: f64) -> f64 {
        motion.at(t_s).map_or(f64::NEG_INFINITY, |state| self.margin_deg(&state))
    }

    /// Whether an end of the pass, which may stand exactly on the threshold, belongs to what the mask leaves.
    fn end_is_open(&self, end: &RawEnd) -> bool {
        if end.cause == EndCause::Horizon {
            let look = LookAngles::from_axes(self.station.axes(), &end.place.state);
            self.threshold_deg(look.azimuth_deg) <= self.lowest_deg + 1e-9
        } else {
            self.margin_deg(&end.place.state) > 0.0
        }
    }

    fn parts(&self, motion: &mut Motion<'_>, pass: &RawPass) -> Vec<RawPass> {
        let (from_s, to_s) = (pass.rise.place.t_s, pass.fall.place.t_s);
        let steps = ((to_s - from_s) / SAMPLE_S).ceil().clamp(SAMPLES_MIN, SAMPLES_MAX) as usize;
        let times: Vec<f64> =
            (0..=steps).map(|k| from_s + (to_s - from_s) * (k as f64 / steps as f64)).collect();
        let mut states = Vec::with_capacity(times.len());
        motion.many(&times, &mut states);
        let mut samples: Vec<(f64, f64)> = times
            .iter()
            .zip(&states)
            .map(|(&t_s, state)| {
                (t_s, state.as_ref().map_or(f64::NEG_INFINITY, |state| self.margin_deg(state)))
            })
            .collect();
        let sign = |open: bool| if open { f64::MIN_POSITIVE } else { -f64::MIN_POSITIVE };
        samples[0].1 = sign(self.end_is_open(&pass.rise));
        samples[steps].1 = sign(self.end_is_open(&pass.fall));
        self.add_turns(motion, &mut samples);

        let mut parts = Vec::new();
        let mut open = (samples[0].1 > 0.0).then_some(pass.rise);
        for pair in samples.windows(2) {
            let [(low_s, low), (high_s, high)] = [pair[0], pair[1]];
            if (low > 0.0) == (high > 0.0) {
                continue;
            }
            let Some(place) = self.crossing(motion, low_s, high_s, high > 0.0) else { continue };
            let end = RawEnd { place, cause: EndCause::Horizon };
            match open.take() {
                None => open = Some(end),
                Some(rise) => parts.push(part(pass, rise, end)),
            }
        }
        if let Some(rise) = open {
            parts.push(part(pass, rise, pass.fall));
        }
        parts.retain(|part| part.fall.place.t_s > part.rise.place.t_s);
        parts
    }

    /// Where a sample is a turning point and so near the threshold that the curve between may cross it: adds the turning
    /// point itself.
    fn add_turns(&self, motion: &mut Motion<'_>, samples: &mut Vec<(f64, f64)>) {
        let mut turns = Vec::new();
        for trio in samples.windows(3) {
            let (before, here, after) = (trio[0].1, trio[1].1, trio[2].1);
            let (rise, fall) = (here - before, here - after);
            let reach = rise.abs().max(fall.abs());
            if !(rise * fall > 0.0 && here.abs() <= reach && (here > 0.0) == (rise < 0.0)) {
                continue;
            }
            // Golden section for the extremum on the far side of the threshold.
            let sign = if rise > 0.0 { 1.0 } else { -1.0 };
            let golden = 0.618_033_988_749_895;
            let (mut low_s, mut high_s) = (trio[0].0, trio[2].0);
            for _ in 0..40 {
                let (a_s, b_s) = (high_s - golden * (high_s - low_s), low_s + golden * (high_s - low_s));
                if sign * self.margin_at(motion, a_s) > sign * self.margin_at(motion, b_s) {
                    high_s = b_s;
                } else {
                    low_s = a_s;
                }
            }
            let t_s = 0.5 * (low_s + high_s);
            turns.push((t_s, self.margin_at(motion, t_s)));
        }
        samples.extend(turns);
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    }

    /// The crossing between two times by halving: the mask has corners, and may have steps.
    fn crossing(&self, motion: &mut Motion<'_>, from_s: f64, to_s: f64, rising: bool) -> Option<Place> {
        let (mut low_s, mut high_s) = (from_s, to_s);
        for _ in 0..60 {
            if high_s - low_s < 1e-7 {
                break;
            }
            let middle_s = 0.5 * (low_s + high_s);
            if (self.margin_at(motion, middle_s) > 0.0) == rising {
                high_s = middle_s;
            } else {
                low_s = middle_s;
            }
        }
        let t_s = 0.5 * (low_s + high_s);
        motion.at(t_s).ok().map(|state| Place { t_s, state })
    }
}

fn part(pass: &RawPass, rise: RawEnd, fall: RawEnd) -> RawPass {
    let within = |place: &&Place| place.t_s >= rise.place.t_s && place.t_s <= fall.place.t_s;
    RawPass { rise, fall, summits: pass.summits.iter().filter(within).copied().collect() }
}
