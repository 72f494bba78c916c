//! The way of a mount's axes along a path, chosen for the whole pass.
//!
//! A direction can be looked into in several ways: turned round once more (overlap), or leaning over the zenith (flip). Which
//! of them is right at AOS is decided by what comes later, so the whole path is gone through by dynamic programming: each
//! sample has one state per way, and a step costs the seconds by which the mount comes too late (it must turn further than
//! its rates allow), then the angle that it is off, then how far it turns. The cheapest chain wins. A pass that any way
//! holds from end to end is therefore followed without unwinding; where none does, the mount turns round where that costs the
//! least time, or waits at its stop when that is cheaper; near the zenith it leans over instead of spinning round.

use super::direction::{Direction, Position};
use super::mount::{Branch, Mount};
use super::path::SkySample;
use crate::clock::UtcUs;

/// Where a mount stands, and since when it may move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// From now on it can turn.
    pub at: UtcUs,
    /// Here it stands.
    pub position: Position,
}

/// The mount has to turn round in the middle of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unwinding {
    /// When it begins.
    pub at: UtcUs,
    /// How far the azimuth turns, degrees.
    pub turn_deg: f64,
    /// How long that takes, s.
    pub takes_s: f64,
}

/// A stretch in which the antenna will not look at the satellite: it is too fast near the zenith, or out of reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keyhole {
    /// Off by more than the dead band from here.
    pub from: UtcUs,
    /// To here.
    pub until: UtcUs,
    /// The largest angle between antenna and satellite, degrees.
    pub worst_deg: f64,
}

/// Positions of a mount over the time of a pass.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    legs: Vec<Leg>,
    unwindings: Vec<Unwinding>,
    keyholes: Vec<Keyhole>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    at: UtcUs,
    position: Position,
    /// The mount turns round on its way here: nothing in between is on the path.
    jump: bool,
}

/// What is compared, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Cost {
    late_us: i64,
    off_udeg_s: i64,
    turned_udeg: i64,
}

impl Cost {
    const NONE: Self = Self { late_us: 0, off_udeg_s: 0, turned_udeg: 0 };

    fn plus(self, other: Self) -> Self {
        Self {
            late_us: self.late_us.saturating_add(other.late_us),
            off_udeg_s: self.off_udeg_s.saturating_add(other.off_udeg_s),
            turned_udeg: self.turned_udeg.saturating_add(other.turned_udeg),
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "saturates; degrees and seconds of a pass are small")]
fn micro(value: f64) -> i64 {
    (value * 1e6).round() as i64
}

#[expect(clippy::cast_precision_loss, reason = "microseconds stay far below 2^53 for 285 years")]
fn seconds(from: UtcUs, until: UtcUs) -> f64 {
    until.0.saturating_sub(from.0) as f64 / 1e6
}

impl Route {
    /// Chooses the way along a path in order of time. `start` is where the mount stands and when, if that is known: a
    /// mount that cannot be in place in time prefers what is near. `None` when the path has no finite sample.
    #[must_use]
    pub fn plan(mount: &Mount, path: &[SkySample], start: Option<Start>) -> Option<Self> {
        let path: Vec<SkySample> =
            path.iter().copied().filter(|sample| sample.direction.is_finite()).collect();
        let first = path.first()?;
        let branches: Vec<Branch> = mount.branches().collect();
        let at = |sample: &SkySample| -> Vec<Position> {
            branches.iter().map(|branch| mount.on_branch(sample.direction, *branch)).collect()
        };
        let mut positions = at(first);
        let mut costs: Vec<Cost> = positions
            .iter()
            .map(|position| {
                let off = off(mount, *position, first.direction, 1.0);
                match &start {
                    Some(start) => {
                        off.plus(turn(mount, start.position, *position, seconds(start.at, first.at)))
                    }
                    None => off,
                }
            })
            .collect();
        let mut came_from: Vec<Vec<usize>> = Vec::with_capacity(path.len());
        for pair in path.windows(2) {
            let [before, sample] = pair else { continue };
            let dt_s = seconds(before.at, sample.at);
            let next = at(sample);
            let mut back = vec![0; branches.len()];
            let mut next_costs = Vec::with_capacity(branches.len());
            for (to, position) in next.iter().enumerate() {
                let (from, cheapest) = costs
                    .iter()
                    .enumerate()
                    .map(|(from, cost)| (from, cost.plus(turn(mount, positions[from], *position, dt_s))))
                    // Of two that cost the same, the one that stays.
                    .min_by_key(|(from, cost)| (*cost, *from != to))?;
                back[to] = from;
                next_costs.push(cheapest.plus(off(mount, *position, sample.direction, dt_s)));
            }
            came_from.push(back);
            (positions, costs) = (next, next_costs);
        }
        let mut branch = costs.iter().enumerate().min_by_key(|(_, cost)| **cost)?.0;
        let mut chosen = vec![branch];
        for back in came_from.iter().rev() {
            branch = back[branch];
            chosen.push(branch);
        }
        chosen.reverse();
        Some(Self::along(mount, &path, chosen.into_iter().map(|branch| branches[branch])))
    }

    fn along(mount: &Mount, path: &[SkySample], branches: impl Iterator<Item = Branch>) -> Self {
        let mut route =
            Self { legs: Vec::with_capacity(path.len()), unwindings: Vec::new(), keyholes: Vec::new() };
        for (sample, branch) in path.iter().zip(branches) {
            let position = mount.on_branch(sample.direction, branch);
            let before = route.legs.last().copied();
            // The way that the satellite goes is less than half a turn between two samples.
            let jump =
                before.is_some_and(|leg| (leg.position.azimuth_deg - position.azimuth_deg).abs() > 180.0);
            if let (Some(before), true) = (before, jump) {
                route.unwindings.push(Unwinding {
                    at: before.at,
                    turn_deg: (before.position.azimuth_deg - position.azimuth_deg).abs(),
                    takes_s: mount.slew_s(before.position, position),
                });
            }
            route.legs.push(Leg { at: sample.at, position, jump });
        }
        route.keyholes = route.lags(mount, path);
        route
    }

    /// Lets the mount follow as fast as it can, and looks where it is not where it should be.
    fn lags(&self, mount: &Mount, path: &[SkySample]) -> Vec<Keyhole> {
        let mut found: Vec<Keyhole> = Vec::new();
        let Some(first) = self.legs.first() else { return found };
        let (mut position, mut before, mut open) = (first.position, first.at, false);
        for (leg, sample) in self.legs.iter().zip(path) {
            position = mount.after(position, leg.position, seconds(before, leg.at));
            before = leg.at;
            let off_deg = position.direction().angle_deg(mount.wanted(sample.direction));
            let is_off = off_deg > mount.settings().dead_band_deg;
            match found.last_mut().filter(|_| open) {
                Some(keyhole) if is_off => {
                    keyhole.until = leg.at;
                    keyhole.worst_deg = keyhole.worst_deg.max(off_deg);
                }
                _ if is_off => found.push(Keyhole { from: leg.at, until: leg.at, worst_deg: off_deg }),
                _ => {}
            }
            open = is_off;
        }
        found
    }

    /// Where the mount should stand at an instant: before the path at its beginning, after it at its end.
    #[must_use]
    pub fn at(&self, at: UtcUs) -> Position {
        let next = self.legs.partition_point(|leg| leg.at < at);
        let (Some(leg), before) = (self.legs.get(next).or(self.legs.last()), next.checked_sub(1)) else {
            return Position { azimuth_deg: 0.0, elevation_deg: 0.0 };
        };
        let Some(before) = before.and_then(|before| self.legs.get(before)) else { return leg.position };
        let span_s = seconds(before.at, leg.at);
        if leg.jump || span_s <= 0.0 {
            return leg.position;
        }
        let share = (seconds(before.at, at) / span_s).clamp(0.0, 1.0);
        let between = |a: f64, b: f64| a + (b - a) * share;
        Position {
            azimuth_deg: between(before.position.azimuth_deg, leg.position.azimuth_deg),
            elevation_deg: between(before.position.elevation_deg, leg.position.elevation_deg),
        }
    }

    /// When the path begins and ends.
    #[must_use]
    pub fn span(&self) -> (UtcUs, UtcUs) {
        let at = |leg: Option<&Leg>| leg.map_or(UtcUs(0), |leg| leg.at);
        (at(self.legs.first()), at(self.legs.last()))
    }

    /// When a mount that stands at `from` must leave to be in place at the beginning, `spare_s` earlier than it would have to.
    /// A mount that stands nobody knows where takes its longest way.
    #[must_use]
    pub fn leave_at(&self, mount: &Mount, from: Option<Position>, spare_s: f64) -> UtcUs {
        let begin = self.span().0;
        let slew_s = from.map_or_else(|| mount.longest_slew_s(), |from| mount.slew_s(from, self.at(begin)));
        begin.plus(-micro(slew_s + spare_s))
    }

    /// Where it must turn round in the middle, in order of time: none where there is a way without.
    #[must_use]
    pub fn unwindings(&self) -> &[Unwinding] {
        &self.unwindings
    }

    /// Where the antenna will not look at the satellite, in order of time.
    #[must_use]
    pub fn keyholes(&self) -> &[Keyhole] {
        &self.keyholes
    }
}

/// What it costs to turn within a time.
fn turn(mount: &Mount, from: Position, to: Position, within_s: f64) -> Cost {
    let late_s = (mount.slew_s(from, to) - within_s.max(0.0)).max(0.0);
    let turned_deg =
        (from.azimuth_deg - to.azimuth_deg).abs() + (from.elevation_deg - to.elevation_deg).abs();
    Cost { late_us: micro(late_s), off_udeg_s: 0, turned_udeg: micro(turned_deg) }
}

/// What it costs to look past a direction for a time.
fn off(mount: &Mount, position: Position, direction: Direction, for_s: f64) -> Cost {
    let off_deg = position.direction().angle_deg(mount.wanted(direction));
    if off_deg < 1e-6 {
        return Cost::NONE;
    }
    let late_s = if off_deg > mount.settings().dead_band_deg { for_s } else { 0.0 };
    Cost { late_us: micro(late_s), off_udeg_s: micro(off_deg * for_s), turned_udeg: 0 }
}
