//! From what the pieces show to passes: true SGP4 at every end and summit.

use crate::frames::EarthFixed;

use super::motion::Motion;
use super::pass::EndCause;
use super::refine::{Place, SUMMIT_OFFSET_S, crossing_from, step_to_crossing, step_to_summit, summit};
use super::scan::{Draft, Edge};
use super::search::{RawEnd, RawPass};
use super::sky::Sky;

/// Turns drafts into passes: true states at all ends and summits at once, one Newton step from each, and second states for
/// those that it does not settle.
pub(super) fn settle(
    sky: &Sky<'_>,
    motion: &mut Motion<'_>,
    drafts: &[Draft],
    start_s: f64,
    stop_s: f64,
) -> Vec<RawPass> {
    // First the ends, then the summits.
    let mut times = Vec::with_capacity(drafts.len() * 4);
    times.extend(drafts.iter().flat_map(|draft| [time_of(&draft.rise), time_of(&draft.fall)]));
    for draft in drafts {
        for t_s in summits_of(draft) {
            times.push(t_s - SUMMIT_OFFSET_S);
            times.push(t_s + SUMMIT_OFFSET_S);
        }
    }
    let mut states = Vec::with_capacity(times.len());
    motion.many(&times, &mut states);
    let mut ends = ends(sky, motion, drafts, &states).into_iter();
    let mut states = states.into_iter().skip(2 * drafts.len());
    let mut passes = Vec::with_capacity(drafts.len());
    for draft in drafts {
        let (rise, fall) = (ends.next().flatten(), ends.next().flatten());
        let mut summits = Vec::with_capacity(1 + draft.more_summits_s.len());
        for t_s in summits_of(draft) {
            let (before, after) = (states.next().flatten(), states.next().flatten());
            summits.extend(settled_summit(sky, motion, t_s, before, after));
        }
        let inwards_s = if summits.is_empty() {
            0.5 * (time_of(&draft.rise) + time_of(&draft.fall))
        } else {
            summits[0].t_s
        };
        let rise = settled_end(sky, motion, &draft.rise, rise, true, inwards_s);
        let fall = settled_end(sky, motion, &draft.fall, fall, false, inwards_s);
        let (Some(mut rise), Some(mut fall)) = (rise, fall) else { continue };
        // A crossing in the first or last moment of the window may step out of it.
        rise.place.t_s = rise.place.t_s.max(start_s);
        fall.place.t_s = fall.place.t_s.min(stop_s);
        // Only where elements are nonsense, and the quintics with them, are passes found that SGP4 does not bear out.
        let last_s = passes.last().map_or(start_s, |pass: &RawPass| pass.fall.place.t_s);
        if rise.place.t_s >= last_s && fall.place.t_s > rise.place.t_s {
            summits.retain(|place| place.t_s >= rise.place.t_s && place.t_s <= fall.place.t_s);
            passes.push(RawPass { rise, fall, summits });
        }
    }
    passes
}

const fn time_of(edge: &Edge) -> f64 {
    match *edge {
        Edge::Near(t_s, _) | Edge::At(t_s) | Edge::Window(t_s) | Edge::Lost(t_s, _) => t_s,
    }
}

fn summits_of(draft: &Draft) -> impl Iterator<Item = f64> {
    draft.summit_s.iter().chain(&draft.more_summits_s).copied()
}

/// An end after its first true state.
enum End {
    /// One step from that state settled it, or none was needed.
    Settled(Place),
    /// It did not: that state, and the one to which the step led.
    Open(Place, Option<Place>),
}

/// All ends, in the order of the drafts, with second states at once for those that need one; `None` where there is no
/// state.
fn ends(
    sky: &Sky<'_>,
    motion: &mut Motion<'_>,
    drafts: &[Draft],
    states: &[Option<EarthFixed>],
) -> Vec<Option<End>> {
    let flaw_km_s = motion.velocity_flaw_km_s();
    let mut times = Vec::new();
    let edges = drafts.iter().flat_map(|draft| [&draft.rise, &draft.fall]);
    let first = |(edge, state): (&Edge, &Option<EarthFixed>)| {
        let first = Place { t_s: time_of(edge), state: (*state)? };
        let Edge::Near(..) = edge else { return Some(End::Settled(first)) };
        let (step, settled) = step_to_crossing(sky, &first, flaw_km_s);
        if settled {
            return Some(End::Settled(step));
        }
        times.push(step.t_s);
        Some(End::Open(first, None))
    };
    let mut ends: Vec<Option<End>> = edges.zip(states).map(first).collect();
    let mut states = Vec::with_capacity(times.len());
    motion.many(&times, &mut states);
    let mut found = times.iter().zip(states);
    for end in ends.iter_mut().flatten() {
        if let End::Open(_, second) = end {
            *second = found.next().and_then(|(&t_s, state)| Some(Place { t_s, state: state? }));
        }
    }
    ends
}

fn settled_summit(
    sky: &Sky<'_>,
    motion: &mut Motion<'_>,
    t_s: f64,
    before: Option<EarthFixed>,
    after: Option<EarthFixed>,
) -> Option<Place> {
    let (before, after) = (before?, after?);
    let (place, settled) = step_to_summit(sky, t_s, &before, &after);
    if settled { Some(place) } else { summit(sky, motion, place.t_s).ok() }
}

fn settled_end(
    sky: &Sky<'_>,
    motion: &mut Motion<'_>,
    edge: &Edge,
    end: Option<End>,
    rising: bool,
    inwards_s: f64,
) -> Option<RawEnd> {
    let Some(end) = end else {
        // The theory gave out between two grid points that both had states: end the pass at the last that answers.
        return lost_end(motion, time_of(edge), inwards_s);
    };
    let place = match (end, edge) {
        (End::Settled(place), _) => place,
        (End::Open(first, second), &Edge::Near(_, bracket)) => {
            crossing_from(sky, motion, &first, second?, bracket, rising).ok()?
        }
        (End::Open(first, _), _) => first,
    };
    let cause = match *edge {
        Edge::Near(..) | Edge::At(_) => EndCause::Horizon,
        Edge::Window(_) => EndCause::Window { crossing: None },
        Edge::Lost(_, fault) => EndCause::NoState(fault),
    };
    Some(RawEnd { place, cause })
}

fn lost_end(motion: &mut Motion<'_>, outside_s: f64, inside_s: f64) -> Option<RawEnd> {
    let (mut bad_s, mut good_s) = (outside_s, inside_s);
    let mut state = motion.at(good_s).ok()?;
    let mut fault = motion.at(bad_s).err()?;
    for _ in 0..60 {
        let middle_s = 0.5 * (bad_s + good_s);
        match motion.at(middle_s) {
            Ok(found) => (good_s, state) = (middle_s, found),
            Err(found) => (bad_s, fault) = (middle_s, found),
        }
        if (bad_s - good_s).abs() < 1e-6 {
            break;
        }
    }
    Some(RawEnd { place: Place { t_s: good_s, state }, cause: EndCause::NoState(fault) })
}
