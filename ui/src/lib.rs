//! What operators look at, drawn from plain values: it knows no wire, no server and no satellite of ours.
//!
//! Each widget is a function of values. What a widget must keep between frames (a zoom, a projected map) lives in a
//! small struct that its owner holds.

pub mod theme;

pub use theme::{Mode, Theme};
