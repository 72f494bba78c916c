//! One station along the grid: rises, falls and summits, found on the pieces; what is too close to call is asked of SGP4.

use crate::propagator::PropagationError;

use super::grid::Block;
use super::motion::Motion;
use super::piece::Piece;
use super::refine::{crossing_between, summit};
use super::sky::{Sight, Sky};

/// Parts in which a piece is looked at for summits. A summit and a valley within one part would both be missed: they are
/// half a revolution apart on round low orbits, but shallow ones come close together on slow orbits. There, a part whose
/// ends both lean towards a turn is halved, so many times at most.
const PARTS_ROUND: usize = 1;
const HALVINGS_MAX: u32 = 3;
/// How far the tangents of both ends may miss each other, in lengths of the part, and the part still be halved.
const LEAN_MARGIN: f64 = 0.5;
/// How far a piece may be from SGP4, km, with a margin of five: measured 0.02 near Earth, 0.5 far out. A summit whose
/// clearance is within twice that is computed by true SGP4 before anything is said about it.
const PIECE_ERROR_KM: f64 = 0.1;
/// Of a piece's length along the path, for orbits that the Earth's turning and the Moon bend more.
const PIECE_ERROR_PART: f64 = 2e-4;

/// How a pass begins or ends, before it is refined.
#[derive(Debug, Clone, Copy)]
pub(super) enum Edge {
    /// The threshold is crossed near this time, and between the two others.
    Near(f64, [f64; 2]),
    /// The threshold is crossed at this time, already by true SGP4.
    At(f64),
    /// The window begins or ends.
    Window(f64),
    /// The elements have no state beyond.
    Lost(f64, PropagationError),
}

/// A pass as the pieces show it.
#[derive(Debug, Clone)]
pub(super) struct Draft {
    pub(super) rise: Edge,
    pub(super) fall: Edge,
    /// First summit, if there is any.
    pub(super) summit_s: Option<f64>,
    /// Further summits: passes of slow objects have several.
    pub(super) more_summits_s: Vec<f64>,
}

/// What is known of the station at the end of the last cell looked at.
#[derive(Debug, Clone, Copy)]
struct Carry {
    /// The cell, counted over all blocks.
    cell: u64,
    above: bool,
    climb: f64,
}

/// A point of a cell: a grid point, a part's end or a summit.
#[derive(Debug, Clone, Copy)]
struct Point {
    p: f64,
    /// By true SGP4, where it was asked.
    t_s: Option<f64>,
    above: bool,
}

impl Point {
    fn time_s(&self, piece: &Piece) -> f64 {
        self.t_s.unwrap_or_else(|| piece.time_s(self.p))
    }
}

/// One end of a part: where, and what is seen there.
#[derive(Debug, Clone, Copy)]
struct Mark {
    p: f64,
    sight: Sight,
}

/// One station's way through the blocks.
#[derive(Debug)]
pub(super) struct Scan<'a> {
    sky: Sky<'a>,
    carry: Option<Carry>,
    open: Option<(Edge, Option<f64>, Vec<f64>)>,
    /// Finished passes, in order of time.
    pub(super) drafts: Vec<Draft>,
    cells_before: u64,
}

impl<'a> Scan<'a> {
    pub(super) fn new(sky: Sky<'a>) -> Self {
        Self { sky, carry: None, open: None, drafts: Vec::new(), cells_before: 0 }
    }

    /// The station's sky.
    pub(super) const fn sky(&self) -> &Sky<'a> {
        &self.sky
    }

    /// Looks through a block. `first`: it opens the window.
    pub(super) fn block(&mut self, block: &mut Block, motion: &mut Motion<'_>, first: bool) {
        if block.nodes.is_empty() {
            return;
        }
        let up = self.sky.axes.up;
        let mut edge = match block.opens_after {
            Some(fault) => Some(Edge::Lost(block.nodes[0].t_s, fault)),
            None if first => Some(Edge::Window(block.nodes[0].t_s)),
            None => None,
        };
        let mut near = block.may_see(0, up);
        for k in 0..block.faults.len() {
            let next_near = block.may_see(k + 1, up);
            if let Some(fault) = block.faults[k] {
                self.close(Edge::Lost(block.nodes[k].t_s, fault));
                edge = Some(Edge::Lost(block.nodes[k + 1].t_s, fault));
            } else {
                if near || next_near || self.open.is_some() {
                    let cell = self.cells_before + k as u64;
                    self.cell(block.piece(k), cell, edge, motion);
                }
                edge = None;
            }
            near = next_near;
        }
        self.cells_before += block.faults.len() as u64;
        if let (Some(fault), Some(last)) = (block.closes_into, block.nodes.last()) {
            self.close(Edge::Lost(last.t_s, fault));
        }
    }

    /// Ends a pass that the window's end cuts.
    pub(super) fn finish(&mut self, stop_s: f64) {
        self.close(Edge::Window(stop_s));
    }

    fn close(&mut self, fall: Edge) {
        self.carry = None;
        if let Some((rise, summit_s, more_summits_s)) = self.open.take() {
            self.drafts.push(Draft { rise, fall, summit_s, more_summits_s });
        }
    }

    fn sight(&self, piece: &Piece, p: f64) -> Sight {
        let motion = piece.motion(p);
        self.sky.sight(motion.r, motion.r1, motion.r2)
    }

    fn mark(&self, piece: &Piece, index: usize) -> Mark {
        let motion = &piece.marks()[index];
        Mark { p: index as f64 / piece.parts() as f64, sight: self.sky.sight(motion.r, motion.r1, motion.r2) }
    }

    /// Looks through one cell. `edge`: there is nothing before it.
    fn cell(&mut self, piece: &Piece, cell: u64, edge: Option<Edge>, motion: &mut Motion<'_>) {
        let mut from = self.mark(piece, 0);
        let mut above = from.sight.clearance > 0.0;
        if let Some(carry) = self.carry.filter(|carry| carry.cell == cell) {
            // The same place as the end of the cell before, but for rounding: it must look the same.
            above = carry.above;
            from.sight.climb = from.sight.climb.abs().copysign(carry.climb);
        }
        if above && self.open.is_none() {
            // Nothing can be above the threshold where the cells before were ruled out, unless there are none.
            self.open = Some((
                edge.unwrap_or(Edge::Near(piece.time_s(0.0), [piece.time_s(0.0); 2])),
                None,
                Vec::new(),
            ));
        }
        let mut point = Point { p: 0.0, t_s: None, above };
        let halvings = if piece.parts() == PARTS_ROUND { 0 } else { HALVINGS_MAX };
        for index in 1..=piece.parts() {
            let to = self.mark(piece, index);
            point = self.part(piece, point, [from, to], halvings, motion);
            from = to;
        }
        self.carry = Some(Carry { cell: cell + 1, above: point.above, climb: from.sight.climb });
    }

    /// Looks through a part from the point at its beginning; the point at its end.
    fn part(
        &mut self,
        piece: &Piece,
        mut point: Point,
        [from, to]: [Mark; 2],
        halvings: u32,
        motion: &mut Motion<'_>,
    ) -> Point {
        let rising = from.sight.climb > 0.0;
        if rising != (to.sight.climb > 0.0) {
            let turn = self.turn(piece, [from.p, to.p], [from.sight.climb, to.sight.climb], motion);
            self.between(piece, point, turn, motion);
            if rising && turn.above {
                self.note_summit(turn.time_s(piece));
            }
            point = turn;
        } else if halvings > 0 && leans_to_a_turn(&from, &to) {
            let p = 0.5 * (from.p + to.p);
            let middle = Mark { p, sight: self.sight(piece, p) };
            let point = self.part(piece, point, [from, middle], halvings - 1, motion);
            return self.part(piece, point, [middle, to], halvings - 1, motion);
        }
        let end = Point { p: to.p, t_s: None, above: to.sight.clearance > 0.0 };
        self.between(piece, point, end, motion);
        end
    }

    /// The place between two parts' ends, with these climbs, where the elevation turns.
    fn turn(&self, piece: &Piece, ends: [f64; 2], climbs: [f64; 2], motion: &mut Motion<'_>) -> Point {
        let falling = if climbs[0] > 0.0 { -1.0 } else { 1.0 };
        let p = root(ends, climbs.map(|climb| falling * climb), |p| {
            let sight = self.sight(piece, p);
            (falling * sight.climb, falling * sight.climb1)
        });
        let clearance = self.clearance(piece, p);
        let unsure = 2.0 * (PIECE_ERROR_KM + PIECE_ERROR_PART * piece.length_km());
        if clearance.abs() > unsure {
            return Point { p, t_s: None, above: clearance > 0.0 };
        }
        match summit(&self.sky, motion, piece.time_s(p)) {
            Ok(truth) => {
                Point { p, t_s: Some(truth.t_s), above: self.sky.clearance(truth.state.r_ecef_km) > 0.0 }
            }
            Err(_) => Point { p, t_s: None, above: clearance > 0.0 },
        }
    }

    /// The elevation goes one way from one point to the next: a crossing between them, or none.
    fn between(&mut self, piece: &Piece, from: Point, to: Point, motion: &mut Motion<'_>) {
        if from.above == to.above {
            return;
        }
        let rising = if to.above { 1.0 } else { -1.0 };
        let (low, high) = (self.clearance(piece, from.p) * rising, self.clearance(piece, to.p) * rising);
        let crossing = if low <= 0.0 && high > 0.0 {
            let p = root([from.p, to.p], [low, high], |p| {
                let (r, r1) = piece.path(p);
                let (clearance, slope) = self.sky.clearance_and_slope(r, r1);
                (rising * clearance, rising * slope)
            });
            Edge::Near(piece.time_s(p), [from.time_s(piece), to.time_s(piece)])
        } else {
            // The piece does not show what SGP4 said of the summit.
            let (from_s, to_s) = (from.time_s(piece), to.time_s(piece));
            Edge::At(crossing_between(&self.sky, motion, from_s, to_s, to.above))
        };
        if to.above {
            self.open = Some((crossing, None, Vec::new()));
        } else {
            self.close(crossing);
        }
    }

    fn clearance(&self, piece: &Piece, p: f64) -> f64 {
        self.sky.clearance(piece.position(p))
    }

    fn note_summit(&mut self, t_s: f64) {
        if let Some((_, summit_s, more)) = &mut self.open {
            if summit_s.is_none() {
                *summit_s = Some(t_s);
            } else {
                more.push(t_s);
            }
        }
    }
}

/// Whether the elevation, which goes the same way at both ends, may turn and turn back between them: its climb falls towards
/// zero from both, and the tangents reach zero before they meet.
fn leans_to_a_turn(from: &Mark, to: &Mark) -> bool {
    let (a, b) = (&from.sight, &to.sight);
    if a.climb * a.climb1 >= 0.0 || b.climb * b.climb1 <= 0.0 {
        return false;
    }
    let span = to.p - from.p;
    a.climb / -a.climb1 + b.climb / b.climb1 < span * (1.0 + LEAN_MARGIN)
}

/// A step by which a root no longer matters: Newton squares what is left, and true SGP4 has the last word.
const ROOT_STEP: f64 = 2e-5;

/// The root of a function that grows through zero between two places with known values: Newton from where the chord
/// crosses, halving where that leaves the bracket.
fn root(ends: [f64; 2], values: [f64; 2], value_and_slope: impl Fn(f64) -> (f64, f64)) -> f64 {
    let [mut low, mut high] = ends;
    let chord = low - values[0] * (high - low) / (values[1] - values[0]);
    let mut x = if chord > low && chord < high { chord } else { 0.5 * (low + high) };
    for _ in 0..50 {
        let (value, slope) = value_and_slope(x);
        if value > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let next = x - value / slope;
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        if (next - x).abs() < ROOT_STEP {
            return next;
        }
        x = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn part_whose_ends_lean_to_a_turn_is_halved() {
        let mark =
            |p, climb, climb1| Mark { p, sight: Sight { clearance: 1.0, clearance1: 0.0, climb, climb1 } };
        // A parabola that dips below zero between the ends, and one that stays far above.
        let dip = |p: f64, depth: f64| mark(p, 4.0 * (p - 0.5).powi(2) - depth, 8.0 * (p - 0.5));
        assert!(leans_to_a_turn(&dip(0.0, 0.1), &dip(1.0, 0.1)));
        assert!(!leans_to_a_turn(&dip(0.0, -2.0), &dip(1.0, -2.0)));
        // The same upside down; and a climb that only grows.
        assert!(leans_to_a_turn(&mark(0.0, -0.9, 4.0), &mark(1.0, -0.9, -4.0)));
        assert!(!leans_to_a_turn(&mark(0.0, 0.5, 1.0), &mark(1.0, 1.5, 1.0)));
    }

    #[test]
    fn root_is_found_on_flat_and_steep_curves() {
        let cubic = |x: f64| ((x - 0.7).powi(3) + 1e-3 * (x - 0.7), 3.0 * (x - 0.7).powi(2) + 1e-3);
        let steep = |x: f64| ((50.0 * (x - 0.11)).tanh(), 50.0 / (50.0 * (x - 0.11)).cosh().powi(2));
        assert!((root([0.0, 1.0], [cubic(0.0).0, cubic(1.0).0], cubic) - 0.7).abs() < 1e-5);
        assert!((root([0.0, 1.0], [steep(0.0).0, steep(1.0).0], steep) - 0.11).abs() < 1e-5);
    }
}
