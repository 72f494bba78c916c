//! Where satellites are: mean elements in every form, SGP4, frames, look angles, Doppler, Sun and shadow.
//!
//! | module | what it holds |
//! |---|---|
//! | [`elements`] | SGP4 mean elements of one object, with every field of its OMM or TLE |
//! | [`formats`] | reading and writing elements: OMM as JSON, CSV, XML and KVN, and TLE |
//! | [`propagator`] | SGP4 and SDP4: elements and a time to position and velocity in TEME |
//! | [`batch`] | near-earth SGP4 for many instants or objects at once |
//! | [`passes`] | when a satellite stands above a station's horizon |
//! | [`prelaunch`] | elements from a state vector, and for another lift-off time |
//! | [`time`] | UTC instants in microseconds, and UT1-UTC |
//! | [`frames`] | sidereal time, TEME to Earth-fixed |
//! | [`geodetic`] | the WGS84 ellipsoid |
//! | [`station`], [`mask`], [`look`] | a place, its horizon, and look angles with their rates |
//! | [`doppler`] | what the station hears, and what it must send |
//! | [`doppler_fit`] | how late a satellite is, from the frequencies at which stations heard it |
//! | [`sun`], [`shadow`] | where the Sun stands; umbra and penumbra and the times of their edges |
//! | [`ground`] | sub-satellite point, ground track, footprint |
//! | [`gravity`] | the acceleration of an orbit, as far as interpolation needs it |
//! | [`vector`] | three numbers that belong together |
//!
//! Everything is a pure function of its arguments: no clock, no file, no network, no randomness. Angles are radians
//! and units SI or km inside; names tell unit and frame (`r_teme_km`, `elevation_deg`).
//!
//! ```
//! use tle::formats::{Checksums, sets};
//! use tle::{EarthOrientation, Propagator, Station, UtcInstant, doppler, ecef_from_teme, gmst_rad};
//!
//! let text = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
//!             2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";
//! let elements = sets(text, Checksums::Strict)?.next().ok_or("no set")??.elements;
//! let at: UtcInstant = "2020-07-13T05:19:25Z".parse()?;
//! let state = Propagator::new(&elements)?.at(at)?;
//! let object = ecef_from_teme(&state, gmst_rad(at, EarthOrientation::UT1_IS_UTC));
//! let look = Station::new(46.5191, 6.5668, 410.0)?.look(&object);
//! let heard_hz = doppler::received_hz(437e6, look.range_rate_km_s);
//! println!("azimuth {:.1}, elevation {:.1}, heard at {heard_hz:.0} Hz", look.azimuth_deg, look.elevation_deg);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! It does **not** fetch elements, model refraction or polar motion, or read ephemerides of other theories (SGP4-XP is
//! refused): what it cannot do well it says.

pub mod batch;
pub mod doppler;
pub mod doppler_fit;
pub mod elements;
pub mod formats;
pub mod frames;
pub mod geodetic;
pub mod gravity;
pub mod ground;
pub mod look;
pub mod mask;
pub mod passes;
pub mod prelaunch;
pub mod propagator;
pub mod shadow;
pub mod station;
pub mod sun;
pub mod time;
pub mod vector;

pub use elements::{Elements, best_for};
pub use frames::{EarthFixed, ecef_from_teme, gmst_rad};
pub use geodetic::Geodetic;
pub use look::LookAngles;
pub use mask::HorizonMask;
pub use propagator::{Fault, PropagationError, Propagator, State};
pub use station::Station;
pub use time::{EarthOrientation, UtcInstant};
