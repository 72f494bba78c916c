//! Below: the last event, and how the line is.

use crate::model::Connection;
use crate::panes::Scene;

pub(crate) fn bottom(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    ui.horizontal(|ui| {
        let words = match &scene.model.connection {
            Connection::Connecting => format!("connecting to {}", scene.model.address),
            Connection::CatchingUp { .. } => "catching up".to_owned(),
            Connection::Live { .. } => "live".to_owned(),
            Connection::Lost { why, .. } => format!("the server is away: {why}"),
        };
        ui.label(words);
        if let Some(event) = scene.model.live_events.back() {
            ui.weak(&event.message);
        }
    });
}
