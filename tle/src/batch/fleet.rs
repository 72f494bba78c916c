//! Many objects at one instant each: a sky full of them, redrawn.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::coefficients::Coefficients;
use super::columns::StateColumns;
use super::kernel;
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

    /// Takes an object in as the last one. False, and nothing taken, for an object the kernel does not take (see
    /// [`NearEarth::new`](super::NearEarth::new)).
    pub fn push(&mut self, elements: &Elements) -> bool {
        let Some(set) = Coefficients::new(elements) else { return false };
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
    let lanes = S::f64s::LEN;
    let mut from = 0;
    while from < minutes.len() {
        let to = (from + lanes).min(minutes.len());
        let cut = |column: &[f64]| {
            if to - from == lanes {
                S::f64s::from_slice(simd, &column[from..to])
            } else {
                // The last few: the idle lanes repeat the last object, so that none of them traps or stalls.
                let mut value = S::f64s::splat(simd, column[to - 1]);
                value.as_mut_slice()[..to - from].copy_from_slice(&column[from..to]);
                value
            }
        };
        let state = kernel::propagate(simd, &columns.map(|column| cut(column)), cut(minutes));
        for (column, value) in states.window(from, to).into_iter().zip(state) {
            column.copy_from_slice(&value.as_slice()[..to - from]);
        }
        from = to;
    }
}
