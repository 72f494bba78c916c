//! Frames and events, newest first.

use super::{Scene, blank};

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    blank::show(ui, scene);
}
