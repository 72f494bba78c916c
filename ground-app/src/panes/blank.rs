//! What is shown while nothing is known.

use super::Scene;

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    let words = match scene.model.status {
        Some(_) => "Nothing to show yet",
        None => "Waiting for the server",
    };
    ui.centered_and_justified(|ui| ui.weak(words));
}
