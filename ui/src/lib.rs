//! What operators look at, drawn from plain values: it knows no wire, no server and no satellite of ours.
//!
//! Each widget is a function of values. What a widget must keep between frames (a zoom, a projected map) lives in a
//! small struct that its owner holds. There is no clock here: `now` is a parameter. Nothing here acts: a widget returns
//! what was clicked, dropped or held, and its owner decides.

pub mod alarms;
pub mod attitude;
pub mod bands;
mod chip;
pub mod chunk_grid;
pub mod command;
pub mod fonts;
pub mod format;
pub mod geo;
pub mod hold;
pub mod inspector;
pub mod labels;
pub mod lamps;
pub mod land;
pub mod lane;
pub mod level;
pub mod map;
pub mod map_base;
pub mod mode_chart;
pub mod picture;
pub mod plan_track;
pub mod plot;
pub mod sky;
pub mod sparkline;
pub mod theme;
pub mod time_axis;
pub mod timeline;
pub mod value;

pub use level::Level;
pub use theme::{Mode, Theme};

/// Gives the context our faces, colours, sizes and distances. Once, before the first frame.
pub fn install(context: &egui::Context, mode: Mode) {
    fonts::install(context);
    theme::apply(context, mode);
}
