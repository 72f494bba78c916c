//! The picture as it grows, and the order to bring it home.

use egui::{Align2, Color32, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use ui::{Theme, fonts};

use super::album::{Order, active_download};
use super::{Scene, blank, words};

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    /// Times as large as it fits, and where its middle is.
    zoom: f32,
    moved: egui::Vec2,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let Some(satellite) = scene.satellite().cloned() else { return blank::show(ui, scene) };
    let mut album = std::mem::take(&mut scene.kept.album);
    album.turn(scene, ui.ctx());
    let image = album.image(scene.model, &satellite.satellite).cloned();
    ui.horizontal_wrapped(|ui| {
        if let Some(image) = &image {
            ui.label(format!("Image {}", image.id));
            ui.weak(format!("{}/{} chunks", image.held, image.chunks));
            let told = match (image.complete, scene.now_us) {
                (true, _) => Some("complete".to_owned()),
                (false, Some(now_us)) => {
                    let los_us = satellite.los_at.map(|los| los.unix_us());
                    album.eta(image, now_us, los_us).map(|eta| eta_words(eta, now_us, los_us))
                }
                _ => None,
            };
            if let Some(told) = told {
                ui.label(told);
            }
        }
        order_button(ui, scene, &mut album, &satellite.satellite, image.as_ref());
        if let Some(told) = &album.told {
            ui.weak(told);
        }
        if let Some(why) = album.failure() {
            ui.weak(why);
        }
        save_button(ui, scene, &album, image.as_ref());
    });
    match &image {
        Some(image) => picture(ui, &mut scene.kept.picture, &album, image),
        None => drop(ui.weak("No image was declared yet")),
    }
    scene.kept.album = album;
}

fn eta_words(eta: super::album::Eta, now_us: i64, los_us: Option<i64>) -> String {
    let at = ui::format::time(super::history::at(eta.at_us));
    let left = words::age(now_us, eta.at_us);
    match (eta.missing_at_los, los_us) {
        (Some(0), Some(_)) => format!("whole at {at} (in {left}), before LOS"),
        (Some(missing), Some(los_us)) => {
            let los = ui::format::time(super::history::at(los_us));
            format!("not before LOS at {los}: {missing} chunks stay for the next pass")
        }
        _ => format!("whole at {at} (in {left})"),
    }
}

fn order_button(
    ui: &mut Ui,
    scene: &Scene<'_>,
    album: &mut super::album::Album,
    satellite: &str,
    image: Option<&api::ImageView>,
) {
    let session = scene.model.session.value();
    let may = session.is_some_and(|session| session.rights.iter().any(|right| right == "command"));
    let live = scene.model.connection.is_live();
    let (words, order) = match active_download(scene.model, satellite) {
        Some(download) => ("Cancel the download", Order::Cancel(download.id)),
        None if image.is_some_and(|image| image.complete) => return,
        None => ("Bring the image home", Order::Bring(satellite.to_owned())),
    };
    let button = ui.add_enabled(may && live, egui::Button::new(words));
    let button = match (may, live) {
        (false, _) => button.on_disabled_hover_text("You need the right 'command'"),
        (_, false) => button.on_disabled_hover_text("The server is away"),
        _ => button.on_hover_text("Asks for what is missing, over as many passes as it takes"),
    };
    // A key that is still held from elsewhere orders nothing.
    if button.clicked() && !ui.input(|input| input.key_pressed(egui::Key::Enter)) {
        album.order(scene, order);
    }
}

fn save_button(
    ui: &mut Ui,
    scene: &mut Scene<'_>,
    album: &super::album::Album,
    image: Option<&api::ImageView>,
) {
    let (Some(held), Some(image)) = (&album.held, image) else { return };
    let exports = &mut scene.kept.exports;
    let button = ui.add_enabled(!exports.is_busy(), egui::Button::new("Save the JPEG"));
    if button.clicked() {
        let bytes = held.bytes.clone();
        let part = if held.complete { "" } else { "-incomplete" };
        let name = format!("image-{}{part}.jpg", image.id);
        exports.save(scene.desk.plots.folder.as_deref(), &name, scene.courier, move || Ok(bytes));
    }
    exports.show(ui);
}

fn picture(ui: &mut Ui, state: &mut State, album: &super::album::Album, image: &api::ImageView) {
    let theme = Theme::current(ui);
    let (rect, response) =
        ui.allocate_exact_size(ui.available_size().max(vec2(40.0, 40.0)), Sense::click_and_drag());
    let name = match album.pixels.texture() {
        Some(_) if image.complete => format!("Picture {}, complete", image.id),
        Some(_) => format!("Picture {}, {} of {} chunks", image.id, image.held, image.chunks),
        None => format!("Picture {}, nothing to show yet", image.id),
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name.as_str()));
    if state.zoom < 1.0 {
        state.zoom = 1.0;
    }
    if response.hovered() {
        let zoom = ui.input(egui::InputState::zoom_delta);
        state.zoom = (state.zoom * zoom).clamp(1.0, 32.0);
    }
    if response.double_clicked() {
        (state.zoom, state.moved) = (1.0, egui::Vec2::ZERO);
    }
    if response.dragged() {
        state.moved += response.drag_delta();
    }
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 4.0, theme.ground);
    let size = vec2(f32::from(image.width_px.max(1)), f32::from(image.height_px.max(1)));
    let fit = (rect.width() / size.x).min(rect.height() / size.y);
    let shown = size * fit * state.zoom;
    let room = ((shown - rect.size()) / 2.0).max(egui::Vec2::ZERO);
    state.moved = state.moved.clamp(-room, room);
    let place = Rect::from_center_size(rect.center() + state.moved, shown);
    hatch(&painter.with_clip_rect(place.intersect(rect)), theme);
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    match album.pixels.texture() {
        Some(texture) => drop(painter.image(texture.id(), place, whole, Color32::WHITE)),
        None => {
            let words = "Nothing to show yet: the beginning of the file is missing";
            painter.text(rect.center(), Align2::CENTER_CENTER, words, fonts::body(), theme.dim);
        }
    }
    painter.rect_stroke(place, 0.0, Stroke::new(1.0, theme.line), egui::StrokeKind::Outside);
}

/// What is missing.
fn hatch(painter: &egui::Painter, theme: &Theme) {
    let stroke = Stroke::new(1.0, theme.line);
    let visible = painter.clip_rect();
    let mut x = visible.left() - visible.height();
    while x < visible.right() {
        painter.line_segment([pos2(x, visible.bottom()), pos2(x + visible.height(), visible.top())], stroke);
        x += 12.0;
    }
}
