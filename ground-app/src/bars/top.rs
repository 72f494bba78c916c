//! Above: satellite and station, time, link, transmitter, alarms, who we are, and the way to silence.

use crate::desk::Layout;
use crate::panes::Scene;

pub(crate) fn top(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    ui.horizontal(|ui| {
        let station = scene.model.status.as_ref().map(|(status, _)| status.station.clone());
        let satellite = scene.satellite().map(|satellite| satellite.satellite.clone());
        ui.strong(satellite.as_deref().unwrap_or("no satellite"));
        ui.weak(station.as_deref().unwrap_or("no station"));
        for layout in Layout::ALL {
            if ui.selectable_label(scene.desk.layout == layout, layout.name()).clicked() {
                scene.desk.show_layout(layout);
            }
        }
    });
}
