//! A picture as it comes down: what is there in its place, what is missing hatched.

use egui::{
    Color32, ColorImage, Key, Pos2, Rect, Response, Role, Sense, Stroke, StrokeKind, TextureHandle,
    TextureOptions, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use crate::fonts;
use crate::theme::Theme;

/// Largest magnification: points for one pixel.
const MOST: f32 = 32.0;

/// A picture's pixels on the graphics card, and how it is looked at.
#[derive(Default)]
pub struct Picture {
    texture: Option<TextureHandle>,
    pending: Option<ColorImage>,
    size: [usize; 2],
    /// Part of the pixels that are there.
    held: f32,
    /// Points for one pixel; none fits all of it into its place.
    zoom: Option<f32>,
    /// What lies in the middle, in pixels.
    centre: Vec2,
}

/// Bytes that do not make a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoPicture {
    /// Width and height that were named.
    pub size: [usize; 2],
    /// Bytes that came.
    pub found: usize,
}

impl std::fmt::Display for NoPicture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [width, height] = self.size;
        write!(f, "{} bytes are no picture of {width} × {height} pixels with four bytes each", self.found)
    }
}

impl std::error::Error for NoPicture {}

impl Picture {
    /// Takes pixels, four bytes each (red, green, blue, opacity, not premultiplied), row by row. Those with opacity 0
    /// are missing. To be called when there is something new, not each frame; zoom and place stay.
    ///
    /// # Errors
    /// [`NoPicture`] when the number of bytes does not fit the size.
    pub fn set_rgba(&mut self, size: [usize; 2], rgba: &[u8]) -> Result<(), NoPicture> {
        let bytes = size[0].checked_mul(size[1]).and_then(|pixels| pixels.checked_mul(4));
        if bytes != Some(rgba.len()) || rgba.is_empty() {
            return Err(NoPicture { size, found: rgba.len() });
        }
        let held = rgba.chunks_exact(4).filter(|pixel| pixel[3] != 0).count();
        self.held = held as f32 / (size[0] * size[1]) as f32;
        if self.size != size {
            self.size = size;
            self.fit();
        }
        self.pending = Some(ColorImage::from_rgba_unmultiplied(size, rgba));
        Ok(())
    }

    /// Forgets the pixels.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Width and height in pixels; zeros where there is no picture.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Part of the pixels that are there, from 0 to 1.
    #[must_use]
    pub fn held(&self) -> f32 {
        self.held
    }

    /// Shows all of it, in the middle.
    pub fn fit(&mut self) {
        self.zoom = None;
        self.centre = vec2(self.size[0] as f32, self.size[1] as f32) / 2.0;
    }

    /// Points for one pixel in a place of this size.
    fn scale(&self, place: Vec2) -> f32 {
        self.zoom.unwrap_or_else(|| self.fitting(place))
    }

    fn fitting(&self, place: Vec2) -> f32 {
        let [width, height] = self.size.map(|side| side.max(1) as f32);
        (place.x / width).min(place.y / height).clamp(0.01, 8.0)
    }

    /// Magnifies by `factor` and leaves the pixel at `at` (from the middle of the place) where it is.
    fn magnify(&mut self, factor: f32, at: Vec2, place: Vec2) {
        let before = self.scale(place);
        let least = self.fitting(place).min(1.0);
        let after = (before * factor).clamp(least, MOST);
        self.centre += at / before - at / after;
        self.zoom = Some(after);
        self.hold();
    }

    /// Keeps the middle of the place on the picture.
    fn hold(&mut self) {
        let size = vec2(self.size[0] as f32, self.size[1] as f32);
        self.centre = self.centre.clamp(Vec2::ZERO, size);
    }
}

/// Draws the picture in a place of this size. The wheel with Ctrl (or a pinch) magnifies, dragging moves it, a double
/// click shows all; with the keyboard plus, minus, 0 and the arrows.
pub fn picture_ui(ui: &mut Ui, picture: &mut Picture, name: &str, size: Vec2) -> Response {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let per_cent = (picture.held * 100.0).floor();
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Image, true, format!("Picture {name}, {per_cent} % there"))
    });
    hands(ui, picture, &response, rect);
    if let Some(image) = picture.pending.take() {
        match &mut picture.texture {
            Some(texture) => texture.set(image, TextureOptions::LINEAR),
            None => picture.texture = Some(ui.ctx().load_texture("picture", image, TextureOptions::LINEAR)),
        }
    }
    if !ui.is_rect_visible(rect) {
        return response;
    }
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, theme.ground);
    let Some(texture) = &picture.texture else {
        painter.text(rect.center(), egui::Align2::CENTER_CENTER, "no picture yet", fonts::small(), theme.dim);
        return response;
    };
    let scale = picture.scale(rect.size());
    let [width, height] = picture.size.map(|side| side as f32 * scale);
    let place = Rect::from_min_size(rect.center() - picture.centre * scale, vec2(width, height));
    if picture.held < 1.0 {
        hatch(&painter.with_clip_rect(place.intersect(rect)), theme, place.intersect(rect));
    }
    let all = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    painter.image(texture.id(), place, all, Color32::WHITE);
    painter.rect_stroke(place, 0.0, Stroke::new(1.0, theme.line), StrokeKind::Outside);
    let told =
        format!("{} × {} · {:.0} %", picture.size[0], picture.size[1], scale * ui.pixels_per_point() * 100.0);
    let galley = painter.layout_no_wrap(told, fonts::figures(11.0), theme.text);
    let at = rect.left_bottom() + vec2(8.0, -galley.size().y - 6.0);
    painter.rect_filled(
        Rect::from_min_size(at, galley.size()).expand(3.0),
        3.0,
        theme.ground.gamma_multiply(0.8),
    );
    painter.galley(at, galley, theme.text);
    if response.has_focus() {
        painter.rect_stroke(rect, 0.0, Stroke::new(1.0, theme.accent), StrokeKind::Inside);
    }
    response
}

fn hands(ui: &Ui, picture: &mut Picture, response: &Response, rect: Rect) {
    if response.clicked() {
        response.request_focus();
    }
    if response.double_clicked() {
        picture.fit();
    }
    if response.dragged() {
        let scale = picture.scale(rect.size());
        picture.zoom = Some(scale);
        picture.centre -= response.drag_delta() / scale;
        picture.hold();
    }
    if let Some(at) = response.hover_pos() {
        let zoom = ui.input(|input| input.zoom_delta());
        if (zoom - 1.0).abs() > 1e-4 {
            picture.magnify(zoom, at - rect.center(), rect.size());
        }
    }
    if response.has_focus() {
        ui.memory_mut(|memory| {
            let arrows =
                egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
            memory.set_focus_lock_filter(response.id, arrows);
        });
        let pressed = |key| ui.input(|input| input.key_pressed(key));
        for (key, factor) in [(Key::Plus, 1.5), (Key::Equals, 1.5), (Key::Minus, 1.0 / 1.5)] {
            if pressed(key) {
                picture.magnify(factor, Vec2::ZERO, rect.size());
            }
        }
        if pressed(Key::Num0) {
            picture.fit();
        }
        let step = 48.0 / picture.scale(rect.size());
        for (key, way) in [
            (Key::ArrowLeft, vec2(-step, 0.0)),
            (Key::ArrowRight, vec2(step, 0.0)),
            (Key::ArrowUp, vec2(0.0, -step)),
            (Key::ArrowDown, vec2(0.0, step)),
        ] {
            if pressed(key) {
                picture.zoom = Some(picture.scale(rect.size()));
                picture.centre += way;
                picture.hold();
            }
        }
    }
}

/// Slanting lines over an area, for what is not there.
fn hatch(painter: &egui::Painter, theme: &Theme, area: Rect) {
    painter.rect_filled(area, 0.0, theme.panel);
    let stroke = Stroke::new(1.0, theme.faint.gamma_multiply(0.55));
    let step = 8.0;
    let mut x = area.left() - area.height();
    x = (x / step).floor() * step;
    while x < area.right() {
        painter.line_segment([Pos2::new(x, area.bottom()), Pos2::new(x + area.height(), area.top())], stroke);
        x += step;
    }
}

impl std::fmt::Debug for Picture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Picture").field("size", &self.size).field("held", &self.held).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn magnifying_leaves_the_pixel_under_the_pointer(
            factor in 0.2..5.0_f32, at in (-100.0..100.0_f32, -80.0..80.0_f32),
        ) {
            let mut picture = Picture::default();
            picture.set_rgba([64, 48], &[255; 64 * 48 * 4]).unwrap();
            let (at, place) = (vec2(at.0, at.1), vec2(320.0, 240.0));
            let pixel = |picture: &Picture| picture.centre + at / picture.scale(place);
            let before = pixel(&picture);
            picture.magnify(factor, at, place);
            let inside = picture.centre.x > 0.0 && picture.centre.x < 64.0 && picture.centre.y > 0.0 && picture.centre.y < 48.0;
            prop_assert!(!inside || (pixel(&picture) - before).length() < 0.01);
        }
    }

    #[test]
    fn bytes_that_do_not_fit_are_refused_and_missing_pixels_are_counted() {
        let mut picture = Picture::default();
        let refused = picture.set_rgba([2, 2], &[0; 15]).unwrap_err();
        assert_eq!(refused.to_string(), "15 bytes are no picture of 2 × 2 pixels with four bytes each");
        assert_eq!(picture.set_rgba([0, 0], &[]), Err(NoPicture { size: [0, 0], found: 0 }));
        picture.set_rgba([2, 1], &[9, 9, 9, 255, 0, 0, 0, 0]).unwrap();
        assert_eq!((picture.size(), picture.held()), ([2, 1], 0.5));
    }
}
