//! What is in the sky, computed and written down: element files to passes and looks, and these to tables, plots and
//! calendars. Pure: no clock, no archive, no network; `tle` knows the orbits, [`api`] the words on the wire.
//!
//! | file | what it holds |
//! |---|---|
//! | `source` | texts of elements to [`Catalogue`]: sets by object, what was refused and where |
//! | `place` | a named station |
//! | `predict` | [`predict`]: passes of a catalogue over places, on all cores |
//! | `looks` | [`look_at`]: where everything stands at instants |
//! | `row` | one pass or look of `tle` to its words on the wire |
//! | `track` | a pass as points for a plot |
//! | `plot`, `timeline` | [`sky_plot_svg`], [`timeline_svg`] |
//! | `theme` | a drawing in the dark or the light colours, or in those of the page around it |
//! | `svg` | the canvas of all drawings, reports' too |
//! | `calendar` | [`icalendar`] |
//! | `table` | passes and looks for people |

mod calendar;
mod looks;
mod place;
mod plot;
mod predict;
mod row;
mod source;
pub(crate) mod svg;
mod table;
mod theme;
mod timeline;
mod track;

pub use calendar::icalendar;
pub use looks::{Looks, look_at};
pub use place::{Place, PlaceError};
pub use plot::{PlotError, PlotForm, SkyPlot, plot_pass, plot_pass_at, sky_plot_svg};
pub use predict::{PASSES_MAX, PredictError, Prediction, predict};
pub use row::{elements_of, elements_view, fine_time, instant, pass_view};
pub use source::{Catalogue, Object};
pub use table::{look_table, pass_table};
pub use theme::{Theme, with_tokens};
pub use timeline::{Timeline, timeline_svg, timeline_svg_of_width};
pub use track::{SkyTrack, TrackPoint};
