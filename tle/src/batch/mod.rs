//! SGP4 for many instants or many objects at once, in the lanes of the machine's vector unit.
//!
//! The same theory as [`Propagator`](crate::Propagator) (WGS72, the 2006 revision), written without branches. Round
//! near-earth orbits (eccentricity below [`ECCENTRICITY_BOUND`]), nine of ten objects in the sky, take the shortest way;
//! eccentric ones more steps of Kepler's equation; [`DeepSpace`] adds Sun, Moon and resonance. It differs from the scalar
//! path by less than 0.1 mm over a week on either side of the epoch, and costs a tenth or less. Widest vectors first
//! (AVX-512, AVX2, SSE, NEON), chosen when the program runs.
//!
//! What it does not do: error codes. A state that the theory refuses, or that leaves the range for which these formulas
//! were cut, is NaN in all six columns; the scalar path then tells why.
//!
//! ```
//! # use tle::{Elements, UtcInstant, batch::{NearEarth, StateColumns}};
//! # fn lookup(elements: &Elements) {
//! if let Some(orbit) = NearEarth::new(elements) {
//!     let minutes: Vec<f64> = (0..1440).map(f64::from).collect();
//!     let mut states = StateColumns::default();
//!     orbit.propagate(&minutes, &mut states);
//!     assert_eq!(states.x.len(), 1440);
//! }
//! # }
//! ```

mod coefficients;
mod columns;
mod deep_space;
mod fleet;
mod kepler;
mod kernel;
mod near_earth;
mod resonance;
mod third_body;
mod trig;

pub use coefficients::ECCENTRICITY_BOUND;
pub use columns::StateColumns;
pub use deep_space::DeepSpace;
pub use fleet::Fleet;
pub use near_earth::NearEarth;
pub use resonance::Anchors;
