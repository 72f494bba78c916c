//! The faces: egui's own two, and the icons. None of them is copied into this repository; each comes with its crate.
//!
//! Figures of both faces have one width each (a test holds them to it), so a number does not jump when it changes.

use egui::{Context, FontDefinitions, FontFamily, FontId};

use crate::theme::sizes;

/// Gives the context its faces. Once, before the first frame.
pub fn install(context: &Context) {
    let mut faces = FontDefinitions::default();
    let monospaced = faces.families.get(&FontFamily::Monospace).and_then(|family| family.first()).cloned();
    // The monospaced face has arrows and signs that the proportional one lacks
    if let (Some(face), Some(family)) = (monospaced, faces.families.get_mut(&FontFamily::Proportional)) {
        family.push(face);
    }
    context.set_fonts(faces);
    egui_material_icons::initialize(context);
}

/// The proportional face at this height in points.
#[must_use]
pub fn text(size: f32) -> FontId {
    FontId::new(size, FontFamily::Proportional)
}

/// The monospaced face at this height in points: values, times, bytes.
#[must_use]
pub fn figures(size: f32) -> FontId {
    FontId::new(size, FontFamily::Monospace)
}

/// The face of labels in plots, maps and tables.
#[must_use]
pub fn small() -> FontId {
    text(sizes().small)
}

/// The face of nearly everything.
#[must_use]
pub fn body() -> FontId {
    text(sizes().body)
}

/// The face of small figures: ticks and times beside plots.
#[must_use]
pub fn small_figures() -> FontId {
    figures(sizes().small)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_fonts(look: impl Fn(&mut egui::Ui)) {
        let context = Context::default();
        install(&context);
        let mut output = context.run_ui(egui::RawInput::default(), |_| {});
        output.textures_delta.set.clear();
        let output = context.run_ui(egui::RawInput::default(), |ui| look(ui));
        output.drop_without_applying_deltas();
    }

    #[test]
    fn every_figure_of_a_face_is_equally_wide() {
        with_fonts(|ui| {
            for size in [12.0, 14.0, 18.0, 28.0] {
                for face in [text(size), figures(size)] {
                    let widths: Vec<f32> = ui.fonts_mut(|fonts| {
                        ('0'..='9').map(|figure| fonts.glyph_width(&face, figure)).collect()
                    });
                    assert!(
                        widths.iter().all(|width| (width - widths[0]).abs() < 1e-3),
                        "{face:?}: {widths:?}"
                    );
                }
            }
        });
    }

    /// What `format`, the lamps and the plots write beyond ASCII.
    #[test]
    fn no_sign_of_ours_is_a_box() {
        with_fonts(|ui| {
            for face in [body(), figures(14.0)] {
                for sign in "−–±°µ·×…≥≤σ∞√→←↑↓▲▼".chars() {
                    assert!(ui.fonts_mut(|fonts| fonts.has_glyph(&face, sign)), "{sign} in {face:?}");
                }
            }
        });
    }
}
