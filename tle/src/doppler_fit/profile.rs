//! The search for starting points: how well each lateness fits, with signs and oscillators chosen for it.

use crate::propagator::PropagationError;

use super::model::{Model, UNHEARD_DEG};
use super::{FitSettings, Observation, Sign};

/// From one tried lateness to the next, s. In a low overhead pass the shift bends over half a minute.
const GRID_S: f64 = 4.0;
/// So many of the best hollows are looked into.
const STARTS_MAX: usize = 6;

/// Where a refinement begins.
#[derive(Debug, Clone)]
pub(super) struct Start {
    pub(super) late_s: f64,
    /// By receiver.
    pub(super) signs: Vec<Sign>,
    /// Constant error of each receiver against the satellite, Hz.
    pub(super) offsets_hz: Vec<f64>,
    /// Whether the other sign would have fitted a receiver as well: it tells nothing then.
    pub(super) is_mute: Vec<bool>,
    cost: f64,
}

/// The hollows of the profile, best first.
pub(super) fn starts(
    model: &Model<'_>,
    observations: &[Observation],
    settings: &FitSettings,
) -> Result<Vec<Start>, PropagationError> {
    let steps = (settings.search_s / GRID_S).ceil() as i64;
    let mut by_receiver: Vec<Vec<&Observation>> = vec![Vec::new(); model.receivers.len()];
    for seen in observations {
        by_receiver[seen.receiver].push(seen);
    }
    let mut tried = Vec::new();
    for step in -steps..=steps {
        tried.push(start_at(model, &by_receiver, settings, step as f64 * GRID_S)?);
    }
    let mut hollows: Vec<Start> = (0..tried.len())
        .filter(|&i| {
            let before = i.checked_sub(1).is_none_or(|j| tried[j].cost >= tried[i].cost);
            before && tried.get(i + 1).is_none_or(|after| after.cost >= tried[i].cost)
        })
        .map(|i| tried[i].clone())
        .collect();
    hollows.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    hollows.truncate(STARTS_MAX);
    Ok(hollows)
}

fn start_at(
    model: &Model<'_>,
    by_receiver: &[Vec<&Observation>],
    settings: &FitSettings,
    late_s: f64,
) -> Result<Start, PropagationError> {
    let count = by_receiver.len();
    let mut start = Start {
        late_s,
        signs: vec![Sign::Above; count],
        offsets_hz: vec![0.0; count],
        is_mute: vec![false; count],
        cost: 0.0,
    };
    for (index, seen) in by_receiver.iter().enumerate().filter(|(_, seen)| !seen.is_empty()) {
        let receiver = &model.receivers[index];
        let mut shifts = Vec::with_capacity(seen.len());
        for one in seen {
            shifts.push(model.shift(one, late_s, 0.0)?);
        }
        let spread_hz = receiver.oscillator_error_hz.hypot(settings.satellite_error_hz).max(1.0);
        let try_sign = |sign: Sign| {
            let off: Vec<f64> = seen
                .iter()
                .zip(&shifts)
                .filter(|(_, shift)| shift.elevation_deg > UNHEARD_DEG)
                .map(|(one, shift)| one.applied_hz + sign.factor() * one.error_hz - shift.hz)
                .collect();
            let offset_hz = shrunk_median(&off, spread_hz, settings.expected_noise_hz);
            let unheard = (seen.len() - off.len()) as f64;
            let cost: f64 =
                off.iter().map(|hz| capped_huber((hz - offset_hz) / settings.expected_noise_hz)).sum();
            (cost + unheard * capped_huber(f64::INFINITY) + 0.5 * (offset_hz / spread_hz).powi(2), offset_hz)
        };
        let (sign, (cost, offset_hz), other_cost) = match receiver.sign {
            Some(sign) => (sign, try_sign(sign), f64::INFINITY),
            None => {
                let (above, below) = (try_sign(Sign::Above), try_sign(Sign::Below));
                if above.0 <= below.0 { (Sign::Above, above, below.0) } else { (Sign::Below, below, above.0) }
            }
        };
        (start.signs[index], start.offsets_hz[index]) = (sign, offset_hz);
        start.is_mute[index] = other_cost - cost < 4.0;
        start.cost += cost;
    }
    Ok(start)
}

/// Huber's cost of a residual in units of its noise, from where outliers cost all the same.
pub(super) fn capped_huber(units: f64) -> f64 {
    let (knee, cap) = (1.5, 4.0);
    let size = units.abs().min(cap);
    if size <= knee { 0.5 * size * size } else { knee * size - 0.5 * knee * knee }
}

/// The median, drawn towards 0 where few measurements stand against what is expected of an oscillator.
fn shrunk_median(off: &[f64], spread_hz: f64, noise_hz: f64) -> f64 {
    let weight = off.len() as f64 / (noise_hz * noise_hz);
    median(off.to_vec()) * weight / (weight + 1.0 / (spread_hz * spread_hz))
}

/// The middle; 0 of nothing.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}
