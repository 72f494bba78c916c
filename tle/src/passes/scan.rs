//! One station along the grid: rises, falls and summits, found on the pieces; what is too close to call is asked of SGP4.

use crate::propagator::PropagationError;

use super::grid::Block;
use super::motion::Motion;
use super::piece::Piece;
use super::refine::{crossing_between, summit};
use super::sky::{Sight, Sky};

/// Parts in which a piece is looked at for summits. A summit and a valley within one part would both be missed: they are
/// half a revolution apart on round low orbits, but shallow ones come close together on slow orbits.
const PARTS_ROUND: usize = 1;
const PARTS: usize = 8;
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
    t_s: f64,
    above: bool,
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

    /// Looks through one cell. `edge`: there is nothing before it.
    fn cell(&mut self, piece: &Piece, cell: u64, edge: Option<Edge>, motion: &mut Motion<'_>) {
        let carried = self.carry.filter(|carry| carry.cell == cell);
        let (mut above, mut climb) = if let Some(carry) = carried {
            (carry.above, carry.climb)
        } else {
            let sight = self.sight(piece, 0.0);
            (sight.clearance > 0.0, sight.climb)
        };
        if above && self.open.is_none() {
            // Nothing can be above the threshold where the cells before were ruled out, unless there are none.
            self.open = Some((
                edge.unwrap_or(Edge::Near(piece.time_s(0.0), [piece.time_s(0.0); 2])),
                None,
                Vec::new(),
            ));
        }
        let mut from = Point { p: 0.0, t_s: piece.time_s(0.0), above };
        let parts = if motion.is_round() { PARTS_ROUND } else { PARTS };
        for part in 1..=parts {
            let p = part as f64 / parts as f64;
            let sight = self.sight(piece, p);
            if (climb > 0.0) != (sight.climb > 0.0) {
                let turn = self.turn(piece, [from.p, p], [climb, sight.climb], motion);
                self.between(piece, from, turn, motion);
                if climb > 0.0 && turn.above {
                    self.note_summit(turn.t_s);
                }
                from = turn;
            }
            let to = Point { p, t_s: piece.time_s(p), above: sight.clearance > 0.0 };
            self.between(piece, from, to, motion);
            from = to;
            above = to.above;
            climb = sight.climb;
        }
        self.carry = Some(Carry { cell: cell + 1, above, climb });
    }

    /// The place between two parts' ends, with these climbs, where the elevation turns.
    fn turn(&self, piece: &Piece, ends: [f64; 2], climbs: [f64; 2], motion: &mut Motion<'_>) -> Point {
        let falling = if climbs[0] > 0.0 { -1.0 } else { 1.0 };
        let p = root(ends, climbs.map(|climb| falling * climb), |p| {
            let sight = self.sight(piece, p);
            (falling * sight.climb, falling * sight.climb1)
        });
        let clearance = self.clearance(piece, p);
        let t_s = piece.time_s(p);
        let unsure = 2.0 * (PIECE_ERROR_KM + PIECE_ERROR_PART * piece.length_km());
        if clearance.abs() > unsure {
            return Point { p, t_s, above: clearance > 0.0 };
        }
        match summit(&self.sky, motion, t_s) {
            Ok(truth) => Point { p, t_s: truth.t_s, above: self.sky.clearance(truth.state.r_ecef_km) > 0.0 },
            Err(_) => Point { p, t_s, above: clearance > 0.0 },
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
            Edge::Near(piece.time_s(p), [from.t_s, to.t_s])
        } else {
            // The piece does not show what SGP4 said of the summit.
            Edge::At(crossing_between(&self.sky, motion, from.t_s, to.t_s, to.above))
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
    fn root_is_found_on_flat_and_steep_curves() {
        let cubic = |x: f64| ((x - 0.7).powi(3) + 1e-3 * (x - 0.7), 3.0 * (x - 0.7).powi(2) + 1e-3);
        let steep = |x: f64| ((50.0 * (x - 0.11)).tanh(), 50.0 / (50.0 * (x - 0.11)).cosh().powi(2));
        assert!((root([0.0, 1.0], [cubic(0.0).0, cubic(1.0).0], cubic) - 0.7).abs() < 1e-5);
        assert!((root([0.0, 1.0], [steep(0.0).0, steep(1.0).0], steep) - 0.11).abs() < 1e-5);
    }
}
