//! Passes: when a satellite stands above a station's horizon.
//!
//! One grid of true states per satellite, at equal steps of eccentric anomaly, serves all its stations. A test of the
//! angle at the Earth's centre leaves the few steps in which a station may see the satellite; there a quintic through
//! position, velocity and acceleration at both grid points shows rises, falls and summits. Every AOS and LOS then takes
//! one or two steps with true SGP4, and every summit is computed from two true states; what is too close to call on the
//! quintic (a summit within a few hundred metres of the threshold) is decided by SGP4 alone.
//!
//! | file | what it holds |
//! |---|---|
//! | `request`, `pass` | what to look for, what is found |
//! | `motion` | true states by the window's clock, in vector lanes |
//! | `grid`, `piece` | grid points and the quintics between them; where states begin and end |
//! | `sky` | clearance and climb: functions whose roots are crossings and summits |
//! | `scan` | one station's way along the grid |
//! | `refine`, `settle` | true SGP4 at crossings and summits: one of them, all of them |
//! | `horizon` | masks by azimuth |
//! | `search`, `many` | one satellite; many, on all cores |
//!
//! Deliberately absent: refraction (it would make AOS seconds earlier than any other program says; offer it for
//! pointing), and light time.
//!
//! Time is bounded for any input: windows up to [`LONGEST_WINDOW_DAYS`], a least step, a most number of steps in every
//! iteration. Stretches without a state shorter than a grid step are found where an orbit dips below the surface,
//! and stretches *with* states between two grid points without are not looked for.

mod grid;
mod horizon;
mod many;
mod motion;
mod pass;
mod piece;
mod refine;
mod request;
mod scan;
mod search;
mod settle;
mod sky;

pub use many::find_many;
pub use pass::{EndCause, GAPS_MAX, Gap, Pass, PassEnd, PassPoint, SatellitePasses};
pub use request::{LONGEST_WINDOW_DAYS, PassSearch, SearchError};
pub use search::PassFinder;
