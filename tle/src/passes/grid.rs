//! The grid: true states at equal steps of eccentric anomaly, once per satellite and shared by all its stations.

use std::f64::consts::{PI, TAU};

use crate::frames::EARTH_RATE_RAD_S;
use crate::propagator::{PropagationError, SGP4_EARTH_RADIUS_KM, SGP4_MU_KM3_S2, State};
use crate::vector::{dot, norm, sub};

use super::motion::Motion;
use super::piece::{Clock, Node, Piece};

/// Steps in a revolution. With true SGP4 at every crossing the grid need only find them: pieces of a twelfth stay within
/// 30 m.
const STEPS_PER_REVOLUTION: f64 = 10.0;
/// The Earth turns by no more than this in one step, rad: it bends the path of slow objects.
const EARTH_TURN_PER_STEP_RAD: f64 = 0.5;
/// No object that stays up goes round faster; keeps steps of nonsensical elements from shrinking. Minutes.
const SHORTEST_PERIOD_MIN: f64 = 80.0;
/// Below this eccentricity the anomaly is taken as proportional to time.
const ROUND_ECCENTRICITY: f64 = 0.05;
/// Steps in a block: bounds memory, and how far the phase may drift from the mean anomaly's rate.
const BLOCK_STEPS: usize = 512;
const BLOCK_STEPS_ECCENTRIC: usize = 96;
/// Added to every culling angle, rad: the difference of geodetic and geocentric up (0.0034) and rounding.
const CULLING_MARGIN_RAD: f64 = 0.005;
/// States of a block whose velocity is compared with the way of their position, and the difference from which on every
/// grid point takes its velocity from there, km/s. It costs a state per grid point.
const VELOCITY_SAMPLES: usize = 3;
const VELOCITY_FLAW_KM_S: f64 = 0.005;
/// Where a piece comes this close to the radius below which SGP4 calls an object decayed, true states are asked for.
const DECAY_WATCH_KM: f64 = 10.0;

/// What the grid must know of the orbit.
#[derive(Debug, Clone, Copy)]
pub(super) struct OrbitShape {
    pub(super) period_min: f64,
    pub(super) eccentricity: f64,
    /// Mean anomaly when the window begins, rad: the phase when no state tells.
    pub(super) mean_anomaly_rad: f64,
}

/// How low in the sky the lowest threshold of all stations reaches, and how near the Earth's centre the lowest stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    pub(super) lowest_threshold_rad: f64,
    /// Least height of a station above the centre, along its own up, km.
    pub(super) lowest_station_km: f64,
}

impl Reach {
    /// The greatest angle at the Earth's centre between a station's up and an object at this radius in its view, rad.
    fn half_angle_rad(&self, radius_km: f64) -> f64 {
        let ratio = self.lowest_station_km * self.lowest_threshold_rad.cos() / (radius_km + 22.0);
        (ratio.min(1.0).acos() - self.lowest_threshold_rad).max(0.0)
    }
}

/// A stretch of the grid.
#[derive(Debug, Default)]
pub(super) struct Block {
    pub(super) nodes: Vec<Node>,
    /// Why there are no states between node k and node k + 1; `None` where there are. One shorter than `nodes`.
    pub(super) faults: Vec<Option<PropagationError>>,
    /// The block opens after a time without states, which began in an earlier one.
    pub(super) opens_after: Option<PropagationError>,
    /// The block closes into a time without states.
    pub(super) closes_into: Option<PropagationError>,
    directions: [Vec<f64>; 3],
    cos_reach: Vec<f64>,
    clock: Option<Clock>,
    pieces: Vec<Option<Piece>>,
    is_round: bool,
}

impl Block {
    /// Whether a station with this up may see the object somewhere in the half steps about node k.
    #[inline]
    pub(super) fn may_see(&self, k: usize, up: [f64; 3]) -> bool {
        let [x, y, z] = &self.directions;
        x[k] * up[0] + y[k] * up[1] + z[k] * up[2] >= self.cos_reach[k]
    }

    /// The motion from node k to node k + 1.
    pub(super) fn piece(&mut self, k: usize) -> &Piece {
        let clock = self.clock.unwrap_or(Clock { e: 0.0, rate: 1.0, perigee_s: 0.0 });
        let (from, to, is_round) = (&self.nodes[k], &self.nodes[k + 1], self.is_round);
        self.pieces[k].get_or_insert_with(|| Piece::new(clock, from, to, is_round))
    }

    fn clear(&mut self) {
        self.nodes.clear();
        self.faults.clear();
        self.opens_after = None;
        self.closes_into = None;
        self.pieces.clear();
    }

    fn push(&mut self, node: Node, cell: Result<(), PropagationError>) {
        if !self.nodes.is_empty() {
            self.faults.push(cell.err());
        }
        self.nodes.push(node);
    }

    /// Cosines for the culling test, from the finished nodes.
    fn close(&mut self, reach: &Reach, clock: Clock) {
        self.clock = Some(clock);
        self.pieces.resize(self.nodes.len().saturating_sub(1), None);
        for axis in 0..3 {
            let column = &mut self.directions[axis];
            column.clear();
            column.extend(self.nodes.iter().map(|node| node.state.r_ecef_km[axis] / node.radius_km));
        }
        self.cos_reach.clear();
        if clock.e == 0.0 {
            self.reach_of_round_orbit(reach);
        } else {
            self.reach_by_node(reach);
        }
    }

    /// Where a station must stand to see anything of the half steps about a node. The way along a step is its inertial arc
    /// and the Earth's turning; any point of it is within half of that of one of its two nodes.
    fn reach_by_node(&mut self, reach: &Reach) {
        // An apogee between two nodes lies higher than both.
        const SWELL: f64 = 1.04;
        let mut before = (0.0f64, 0.0f64);
        for (k, node) in self.nodes.iter().enumerate() {
            let after = self.nodes.get(k + 1).map_or((0.0, 0.0), |next| {
                let arc = dot(node.direction_teme, next.direction_teme).clamp(-1.0, 1.0).acos();
                (arc + EARTH_RATE_RAD_S * (next.t_s - node.t_s), next.radius_km)
            });
            let radius_km = node.radius_km.max(before.1).max(after.1) * SWELL;
            let angle = reach.half_angle_rad(radius_km) + 0.5 * before.0.max(after.0) + CULLING_MARGIN_RAD;
            self.cos_reach.push(angle.min(PI).cos());
            before = (after.0, node.radius_km);
        }
    }

    /// The same for all nodes at once, by the longest step and the greatest height.
    fn reach_of_round_orbit(&mut self, reach: &Reach) {
        const SWELL: f64 = 1.002;
        let (mut cos_arc, mut step_s, mut radius_km) = (1.0f64, 0.0f64, 0.0f64);
        for pair in self.nodes.windows(2) {
            cos_arc = cos_arc.min(dot(pair[0].direction_teme, pair[1].direction_teme));
            step_s = step_s.max(pair[1].t_s - pair[0].t_s);
            radius_km = radius_km.max(pair[0].radius_km).max(pair[1].radius_km);
        }
        let way = cos_arc.clamp(-1.0, 1.0).acos() + EARTH_RATE_RAD_S * step_s;
        let angle = reach.half_angle_rad(radius_km * SWELL) + 0.5 * way + CULLING_MARGIN_RAD;
        self.cos_reach.resize(self.nodes.len(), angle.min(PI).cos());
    }
}

/// Walks the window in blocks.
#[derive(Debug)]
pub(super) struct Grid {
    reach: Reach,
    clock: Clock,
    step_rad: f64,
    next_s: f64,
    stop_s: f64,
    /// The node that the next block begins with, or why there is none.
    last: Option<Result<Node, PropagationError>>,
    times: Vec<f64>,
    anomalies: Vec<f64>,
    states: Vec<Result<State, PropagationError>>,
    velocities_are_flawed: bool,
    /// How far below its two grid points the perigee may lie, and what to watch above the surface, km.
    dip_km: f64,
}

impl Grid {
    pub(super) fn new(shape: OrbitShape, reach: Reach, start_s: f64, stop_s: f64) -> Self {
        let e = if shape.eccentricity < ROUND_ECCENTRICITY { 0.0 } else { shape.eccentricity };
        let rate = TAU / (shape.period_min.max(SHORTEST_PERIOD_MIN) * 60.0);
        let longest_step_s = EARTH_TURN_PER_STEP_RAD / EARTH_RATE_RAD_S;
        let step_rad = (TAU / STEPS_PER_REVOLUTION).min(longest_step_s * rate / (1.0 + e));
        let axis_km = (SGP4_MU_KM3_S2 / (rate * rate)).cbrt();
        let clock = Clock { e, rate, perigee_s: start_s - shape.mean_anomaly_rad / rate };
        Self {
            reach,
            clock,
            step_rad,
            next_s: start_s,
            stop_s,
            last: None,
            times: Vec::new(),
            anomalies: Vec::new(),
            states: Vec::new(),
            velocities_are_flawed: false,
            dip_km: axis_km * e * step_rad * step_rad / 8.0 + 5.0 * DECAY_WATCH_KM,
        }
    }

    /// Fills the next block; false at the end of the window. The first node of a block is the last of the one before.
    pub(super) fn next(&mut self, motion: &mut Motion<'_>, block: &mut Block) -> bool {
        if self.next_s >= self.stop_s {
            return false;
        }
        block.clear();
        self.set_clock(motion);
        self.lay_out();
        let mut states = std::mem::take(&mut self.states);
        states.clear();
        motion.many_teme(&self.times, |_, _, state| states.push(state));
        self.velocities_are_flawed = self.flawed(motion, &states);
        self.fill(motion, &states, block);
        self.states = states;
        block.is_round = motion.is_round();
        block.close(&self.reach, self.clock);
        self.next_s = self.times.last().copied().unwrap_or(self.stop_s);
        true
    }

    /// Sets the phase by the osculating orbit, so that steps fall where the motion is, whatever perturbed it since.
    fn set_clock(&mut self, motion: &mut Motion<'_>) {
        if self.clock.e == 0.0 {
            self.clock.perigee_s = self.next_s;
            return;
        }
        let anomaly = motion
            .teme(self.next_s)
            .map_or_else(|_| self.clock.anomaly(self.next_s), |state| osculating_anomaly(&state));
        self.clock.perigee_s = self.next_s - (anomaly - self.clock.e * anomaly.sin()) / self.clock.rate;
    }

    /// The block's times. Its first is there already as a node, unless the window begins here.
    fn lay_out(&mut self) {
        let from = self.clock.anomaly(self.next_s);
        let steps = if self.clock.e == 0.0 { BLOCK_STEPS } else { BLOCK_STEPS_ECCENTRIC };
        self.times.clear();
        self.anomalies.clear();
        if self.last.is_none() {
            self.times.push(self.next_s);
            self.anomalies.push(from);
        }
        for step in 1..=steps {
            let anomaly = from + self.step_rad * step as f64;
            let t_s = self.clock.time_s(anomaly);
            if t_s >= self.stop_s {
                self.times.push(self.stop_s);
                self.anomalies.push(self.clock.anomaly(self.stop_s));
                return;
            }
            self.times.push(t_s);
            self.anomalies.push(anomaly);
        }
    }

    /// Whether SGP4's velocities are no guide here: drag has taken over, as a rule.
    fn flawed(&self, motion: &mut Motion<'_>, states: &[Result<State, PropagationError>]) -> bool {
        if motion.is_round() {
            return false;
        }
        (1..=VELOCITY_SAMPLES).any(|k| {
            let index = (states.len() - 1) * k / VELOCITY_SAMPLES;
            let Ok(state) = &states[index] else { return true };
            let path = motion.along_its_path(state, self.times[index]);
            norm(sub(path.v_teme_km_s, state.v_teme_km_s)) > VELOCITY_FLAW_KM_S
        })
    }

    /// A grid point from a state.
    fn node(&self, motion: &mut Motion<'_>, t_s: f64, anomaly: f64, state: &State) -> Node {
        let path = if self.velocities_are_flawed { motion.along_its_path(state, t_s) } else { *state };
        Node::new(t_s, anomaly, motion.turned(&path, t_s), state.r_teme_km)
    }

    /// Turns states into nodes, and finds where they begin and end.
    fn fill(
        &mut self,
        motion: &mut Motion<'_>,
        states: &[Result<State, PropagationError>],
        block: &mut Block,
    ) {
        // Why there is no state just before the next node, if there is none.
        let mut gap = None;
        let mut gap_since_s = self.next_s;
        match self.last.take() {
            Some(Ok(node)) => {
                let anomaly = self.clock.anomaly(node.t_s);
                block.push(Node { anomaly, ..node }, Ok(()));
            }
            Some(Err(fault)) => gap = Some(fault),
            None => {}
        }
        for (index, state) in states.iter().enumerate() {
            let t_s = self.times[index];
            match state {
                Ok(state) => {
                    let node = self.node(motion, t_s, self.anomalies[index], state);
                    if let Some(fault) = gap.take() {
                        let (edge, _) = self.edge(motion, &node, gap_since_s, fault);
                        if block.nodes.is_empty() {
                            block.opens_after = Some(fault);
                        }
                        block.push(edge, Err(fault));
                    }
                    if block.nodes.last().is_none_or(|last| last.t_s < node.t_s) {
                        self.watch_for_decay(motion, block, &node);
                        block.push(node, Ok(()));
                    }
                }
                Err(fault) => {
                    if gap.is_none() {
                        gap = Some(*fault);
                        if let Some(last) = block.nodes.last().copied() {
                            let (edge, first_fault) = self.edge(motion, &last, t_s, *fault);
                            gap = Some(first_fault);
                            if edge.t_s > last.t_s {
                                block.push(edge, Ok(()));
                            }
                        }
                    }
                    gap_since_s = t_s;
                }
            }
        }
        block.closes_into = gap;
        self.last = gap.map(Err).or_else(|| block.nodes.last().copied().map(Ok));
    }

    /// The last instant with a state between a node, which has one, and a time that has none (before or after it), and why
    /// there is none beyond.
    fn edge(
        &self,
        motion: &mut Motion<'_>,
        good: &Node,
        bad_s: f64,
        fault: PropagationError,
    ) -> (Node, PropagationError) {
        let (mut edge, mut fault) = (*good, fault);
        let (mut good_s, mut bad_s) = (good.t_s, bad_s);
        for _ in 0..60 {
            let middle_s = 0.5 * (good_s + bad_s);
            if (bad_s - good_s).abs() < 1e-6 {
                break;
            }
            match motion.teme(middle_s) {
                Ok(state) => {
                    good_s = middle_s;
                    edge = self.node(motion, middle_s, self.clock.anomaly(middle_s), &state);
                }
                Err(found) => {
                    bad_s = middle_s;
                    fault = found;
                }
            }
        }
        (edge, fault)
    }

    /// Between the last node and the next, both with states, a low perigee may dip below the surface: finds out, and
    /// pushes the edges of the time without states.
    fn watch_for_decay(&self, motion: &mut Motion<'_>, block: &mut Block, next: &Node) {
        let Some(last) = block.nodes.last().copied() else { return };
        if last.radius_km.min(next.radius_km) > SGP4_EARTH_RADIUS_KM + self.dip_km {
            return;
        }
        let piece = Piece::new(self.clock, &last, next, false);
        let watched: Vec<f64> = (1..32)
            .map(|k| f64::from(k) / 32.0)
            .filter(|&p| norm(piece.position(p)) < SGP4_EARTH_RADIUS_KM + DECAY_WATCH_KM)
            .map(|p| piece.time_s(p))
            .collect();
        let mut first_bad = None;
        let mut last_bad_s = 0.0;
        for t_s in watched {
            if let Err(fault) = motion.teme(t_s) {
                first_bad.get_or_insert((t_s, fault));
                last_bad_s = t_s;
            }
        }
        if let Some((first_bad_s, fault)) = first_bad {
            let (down, fault) = self.edge(motion, &last, first_bad_s, fault);
            if down.t_s > last.t_s {
                block.push(down, Ok(()));
            }
            let (up, _) = self.edge(motion, next, last_bad_s, fault);
            block.push(up, Err(fault));
        }
    }
}

/// Eccentric anomaly of the orbit that two-body motion would follow from here on.
fn osculating_anomaly(state: &State) -> f64 {
    let (r, v) = (state.r_teme_km, state.v_teme_km_s);
    let radius = norm(r);
    let axis = 1.0 / (2.0 / radius - dot(v, v) / SGP4_MU_KM3_S2);
    if axis <= 0.0 {
        return 0.0;
    }
    let e_sin = dot(r, v) / (SGP4_MU_KM3_S2 * axis).sqrt();
    e_sin.atan2(1.0 - radius / axis)
}
