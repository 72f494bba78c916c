//! Many objects at one instant each: a sky full of them, redrawn.

use fearless_simd::{Level, Simd, dispatch};

use super::coefficients::Coefficients;
use super::columns::StateColumns;
use super::kernel;
use super::near_earth::lanes_from;
use crate::elements::Elements;
use crate::time::UtcInstant;

/// SGP4 of many near-earth objects of small eccentricity, as columns.
#[derive(Debug, Clone)]
pub struct Fleet {
    columns: Coefficients<Vec<f64>>,
    epochs: Vec<UtcInstant>,
    minutes: Vec<f64>,
    level: Level,
}

impl Fleet {
    /// An empty fleet.
    #[must_use]
    pub fn new() -> Self {
        Self {
            columns: Coefficients::default(),
            epochs: Vec::new(),
            minutes: Vec::new(),
            level: Level::new(),
        }
    }

    /// Takes an object in as the last one. False, and nothing taken, for a period of 225 minutes or more and an eccentricity
    /// of [`ECCENTRICITY_BOUND`](super::ECCENTRICITY_BOUND) or more.
    pub fn push(&mut self, elements: &Elements) -> bool {
        let round = |set: &Coefficients<f64>| set.is_round() && !set.is_deep_space();
        let Some(set) = Coefficients::new(elements).filter(round) else { return false };
        self.columns.push(&set);
        self.epochs.push(elements.epoch);
        true
    }

    /// How many objects.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.epochs.len()
    }

    /// Whether there is none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.epochs.is_empty()
    }

    /// Where every object is at one instant, in the order they were taken in.
    pub fn at(&mut self, at: UtcInstant, states: &mut StateColumns) {
        self.minutes.clear();
        self.minutes.extend(self.epochs.iter().map(|&epoch| at.minutes_since(epoch)));
        states.resize(self.epochs.len());
        dispatch!(self.level, simd => propagate(simd, &self.columns, &self.minutes, states));
    }
}

impl Default for Fleet {
    fn default() -> Self {
        Self::new()
    }
}

#[inline(always)]
fn propagate<S: Simd>(simd: S, columns: &Coefficients<Vec<f64>>, minutes: &[f64], states: &mut StateColumns) {
    let mut from = 0;
    while from < minutes.len() {
        let set = columns.map(|column| lanes_from(simd, column, from));
        let state = kernel::propagate::<S, true>(simd, &set, lanes_from(simd, minutes, from));
        from = states.put::<S>(from, state);
    }
}
