//! States as columns: what the kernel writes and the pass search reads.

use fearless_simd::{Simd, prelude::*};

/// Positions and velocities in TEME, one number of each state per column. A state without an answer is NaN throughout.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StateColumns {
    /// Position along x, km.
    pub x: Vec<f64>,
    /// Position along y, km.
    pub y: Vec<f64>,
    /// Position along z, km.
    pub z: Vec<f64>,
    /// Velocity along x, km/s.
    pub vx: Vec<f64>,
    /// Velocity along y, km/s.
    pub vy: Vec<f64>,
    /// Velocity along z, km/s.
    pub vz: Vec<f64>,
}

impl StateColumns {
    /// How many states.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// One state: position in km and velocity in km/s. `None` past the end, and where the theory had no answer.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<([f64; 3], [f64; 3])> {
        let r = [*self.x.get(index)?, *self.y.get(index)?, *self.z.get(index)?];
        let v = [*self.vx.get(index)?, *self.vy.get(index)?, *self.vz.get(index)?];
        (!r[0].is_nan()).then_some((r, v))
    }

    /// Makes room for so many states; what they hold is to be written next.
    pub(super) fn resize(&mut self, len: usize) {
        for column in [&mut self.x, &mut self.y, &mut self.z, &mut self.vx, &mut self.vy, &mut self.vz] {
            column.resize(len, f64::NAN);
        }
    }

    /// Writes lanes from one place on, as far as there is room; the place after them.
    #[inline(always)]
    pub(super) fn put<S: Simd>(&mut self, from: usize, state: [S::f64s; 6]) -> usize {
        let to = (from + S::f64s::LEN).min(self.len());
        let columns = [&mut self.x, &mut self.y, &mut self.z, &mut self.vx, &mut self.vy, &mut self.vz];
        for (column, value) in columns.into_iter().zip(state) {
            column[from..to].copy_from_slice(&value.as_slice()[..to - from]);
        }
        to
    }
}
