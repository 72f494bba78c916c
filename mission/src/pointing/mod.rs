//! Where to turn the antenna and the rig, and when: geometry and small state machines without a clock or a socket.
//!
//! | file | what it holds |
//! |---|---|
//! | `direction` | directions in the sky, and positions of a mount's two axes that look there |
//! | `mount` | what a mount can do: its ranges, its rates, how finely it is worth moving |
//! | `path` | a satellite's way through the sky of a station |
//! | `route` | the way of the axes along it: chosen for the whole pass, so that nothing unwinds in the middle |
//! | `pointer` | one command after another along a route, and what the readings say of the mount's health |
//! | `tuning` | frequencies for a rig, and how much of its tolerance a radio that is not tuned uses up |
//!
//! Every position that leaves this module is finite and inside the mount's limits: a rotator's daemon takes `nan` for
//! an angle and says that all is well.
//!
//! ```
//! use mission::pointing::{Direction, Mount, MountSettings, Route, SkySample};
//! use mission::UtcUs;
//!
//! // From north-west over north to north-east, with a mount that turns from 0 to 450 degrees.
//! let mount = Mount::new(MountSettings { azimuth_deg: (0.0, 450.0), ..MountSettings::default() })?;
//! let path: Vec<_> = (0..=80)
//!     .map(|s| SkySample { at: UtcUs(s * 1_000_000), direction: Direction::new((320 + s) as f64, 20.0) })
//!     .collect();
//! let route = Route::plan(&mount, &path, None).ok_or("an empty path")?;
//! assert!(route.unwindings().is_empty());
//! assert_eq!(route.at(UtcUs(80_000_000)).azimuth_deg, 400.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod direction;
mod mount;
mod path;
mod pointer;
mod route;
#[cfg(test)]
mod tests;
mod tuning;

pub use direction::{Direction, Position};
pub use mount::{Mount, MountFault, MountSettings};
pub use path::{PATH_SAMPLES, PathError, SkySample, look_at, sky_path};
pub use pointer::{COMMAND_INTERVAL_US, Observation, Pointer};
pub use route::{Keyhole, Route, Start, Unwinding};
pub use tuning::{DopplerMargin, RigSteps, Tuner, doppler_margin};
