//! How the satellite lies in space: its body with its axes, and where the Sun, the magnetic field and the Earth are.

mod space;

use egui::{Color32, Painter, Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui, WidgetInfo, lerp, vec2};

use crate::fonts;
use crate::format;
use crate::theme::Theme;
use space::{Vector, add, angle_deg, cross, dot, scaled, seen, turn, unit, unit4};

/// Half the sides of the body; three units along its third axis.
const HALF: Vector = [0.5, 0.5, 1.5];

/// Length of the arrows outside.
const REACH: f64 = 2.35;

/// What is known of the attitude. Vectors need no certain length; all but the two of the body are in the frame of
/// reference, whose third axis is drawn upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Turns vectors of the body into the frame of reference: w, x, y, z.
    pub body_to_reference: Option<[f64; 4]>,
    /// Towards the Sun.
    pub sun: Option<[f64; 3]>,
    /// Along the magnetic field.
    pub field: Option<[f64; 3]>,
    /// Towards the middle of the Earth.
    pub nadir: Option<[f64; 3]>,
    /// Where the camera looks, in the body.
    pub camera_body: [f64; 3],
    /// Where the antenna points, in the body.
    pub antenna_body: [f64; 3],
    /// Whether the satellite is in the Earth's shadow.
    pub is_eclipsed: bool,
}

/// From where it is looked at. Dragging changes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standpoint {
    /// From the first axis of the frame of reference towards the second.
    pub azimuth_deg: f64,
    /// Above the plane of both.
    pub elevation_deg: f64,
}

impl Default for Standpoint {
    fn default() -> Self {
        Self { azimuth_deg: 35.0, elevation_deg: 22.0 }
    }
}

struct Scene<'a> {
    painter: Painter,
    theme: &'a Theme,
    centre: Pos2,
    scale: f32,
    from: Standpoint,
}

impl Scene<'_> {
    fn see(&self, v: Vector) -> Vector {
        seen(v, self.from.azimuth_deg, self.from.elevation_deg)
    }

    fn place(&self, v: Vector) -> Pos2 {
        let [x, y, _] = self.see(v);
        self.centre + vec2(x as f32, -y as f32) * self.scale
    }

    /// An arrow with a name at its tip.
    fn arrow(&self, from: Vector, to: Vector, name: &str, colour: Color32, width: f32) {
        let (start, tip) = (self.place(from), self.place(to));
        let way = tip - start;
        self.painter.line_segment([start, tip], Stroke::new(width, colour));
        if way.length() > 6.0 {
            let way = way.normalized();
            let side = vec2(-way.y, way.x) * 3.5;
            let base = tip - way * 8.0;
            let head = vec![tip + way * 2.0, base + side, base - side];
            self.painter.add(Shape::convex_polygon(head, colour, Stroke::NONE));
        }
        let away = if way.length() > 1.0 { way.normalized() } else { vec2(0.0, -1.0) };
        self.painter.text(tip + away * 12.0, egui::Align2::CENTER_CENTER, name, fonts::small(), colour);
    }

    fn ring(&self, first: Vector, second: Vector, middle: Vector, radius: f64, stroke: Stroke) {
        let point = |step: i32| {
            let (s, c) = (f64::from(step) / 48.0 * std::f64::consts::TAU).sin_cos();
            self.place(add(middle, add(scaled(first, c * radius), scaled(second, s * radius))))
        };
        self.painter.add(Shape::closed_line((0..48).map(point).collect(), stroke));
    }
}

/// Draws body and directions in a place of this size, with the angle from the camera to the Earth below.
pub fn attitude_ui(ui: &mut Ui, attitude: &Attitude, from: &mut Standpoint, size: egui::Vec2) -> Response {
    let theme = Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(size, Sense::drag());
    let off_deg = off_nadir_deg(attitude);
    let told = match off_deg {
        Some(off_deg) => format!("camera {} from nadir", format::degrees(Some(off_deg))),
        None if attitude.body_to_reference.and_then(unit4).is_none() => "attitude unknown".to_owned(),
        None => "nadir unknown".to_owned(),
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Attitude: {told}")));
    if response.dragged() {
        from.azimuth_deg = (from.azimuth_deg - f64::from(response.drag_delta().x) * 0.5).rem_euclid(360.0);
        from.elevation_deg =
            (from.elevation_deg + f64::from(response.drag_delta().y) * 0.5).clamp(-90.0, 90.0);
    }
    if response.double_clicked() {
        *from = Standpoint::default();
    }
    if !ui.is_rect_visible(rect) {
        return response;
    }
    let drawing = Rect::from_min_max(rect.min, rect.max - vec2(0.0, 20.0));
    let scale = drawing.size().min_elem() / 2.0 / (REACH as f32 + 0.55);
    let scene = Scene { painter: ui.painter_at(rect), theme, centre: drawing.center(), scale, from: *from };
    let faint = Stroke::new(1.0, theme.line);
    scene.painter.circle_stroke(scene.centre, REACH as f32 * scale, faint);
    scene.ring([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3], REACH, faint);
    draw(&scene, attitude);
    let at = rect.center_bottom() - vec2(0.0, 2.0);
    scene.painter.text(at, egui::Align2::CENTER_BOTTOM, told, fonts::small(), theme.dim);
    response
}

/// The angle between where the camera looks and the middle of the Earth.
fn off_nadir_deg(attitude: &Attitude) -> Option<f64> {
    let turning = attitude.body_to_reference.and_then(unit4)?;
    angle_deg(turn(turning, attitude.camera_body), attitude.nadir?)
}

/// Directions that lead away from the one who looks, the body, then those that lead towards him.
fn draw(scene: &Scene<'_>, attitude: &Attitude) {
    let theme = scene.theme;
    let sun_name = if attitude.is_eclipsed { "Sun (eclipse)" } else { "Sun" };
    let sun_colour = if attitude.is_eclipsed { theme.faint } else { theme.warning };
    let outside = [
        (attitude.sun, sun_name, sun_colour),
        (attitude.field, "field", theme.series(3)),
        (attitude.nadir, "Earth", theme.series(2)),
    ];
    let arrows: Vec<_> = outside
        .into_iter()
        .filter_map(|(vector, name, colour)| Some((scaled(unit(vector?)?, REACH), name, colour)))
        .collect();
    let is_behind = |v: Vector| scene.see(v)[2] < 0.0;
    for (tip, name, colour) in arrows.iter().filter(|(tip, ..)| is_behind(*tip)) {
        scene.arrow([0.0; 3], *tip, name, colour.gamma_multiply(0.75), 1.5);
    }
    if let Some(turning) = attitude.body_to_reference.and_then(unit4) {
        let axis = |index: usize| {
            let mut axis = [0.0; 3];
            axis[index] = 1.0;
            turn(turning, axis)
        };
        let axes = [axis(0), axis(1), axis(2)];
        let draw_axes = |behind: bool| {
            for (index, name) in ["x", "y", "z"].into_iter().enumerate() {
                if is_behind(axes[index]) == behind {
                    let (start, tip) =
                        (scaled(axes[index], HALF[index]), scaled(axes[index], HALF[index] + 0.55));
                    scene.arrow(start, tip, name, theme.dim, 1.5);
                }
            }
        };
        let antenna = unit(attitude.antenna_body).map(|antenna| turn(turning, antenna));
        let rod = |behind: bool| {
            if let Some(antenna) = antenna.filter(|&antenna| is_behind(antenna) == behind) {
                rods(scene, axes, antenna);
            }
        };
        draw_axes(true);
        rod(true);
        body(scene, attitude, axes, turning);
        rod(false);
        draw_axes(false);
    } else {
        let told = "attitude unknown";
        scene.painter.text(scene.centre, egui::Align2::CENTER_CENTER, told, fonts::small(), theme.dim);
    }
    for (tip, name, colour) in arrows.iter().filter(|(tip, ..)| !is_behind(*tip)) {
        // From the surface on: what lies within the body is not seen.
        let start = if attitude.body_to_reference.is_some() { scaled(*tip, 0.28) } else { [0.0; 3] };
        scene.arrow(start, *tip, name, *colour, 2.0);
    }
}

/// The faces that are seen, the farthest first, lit by the Sun where it is known.
fn body(scene: &Scene<'_>, attitude: &Attitude, axes: [Vector; 3], turning: [f64; 4]) {
    let theme = scene.theme;
    let light = attitude.sun.and_then(unit).filter(|_| !attitude.is_eclipsed);
    let camera = unit(attitude.camera_body).map(|camera| turn(turning, camera));
    let mut faces: Vec<(f64, usize, f64)> = Vec::new();
    for index in 0..3 {
        for side in [-1.0, 1.0] {
            let towards = scene.see(scaled(axes[index], side))[2];
            // One that is seen edge-on would be a line only.
            if towards > 0.02 {
                faces.push((towards * HALF[index], index, side));
            }
        }
    }
    faces.sort_by(|one, other| one.0.total_cmp(&other.0));
    for (_, index, side) in faces {
        let normal = scaled(axes[index], side);
        let (first, second) = ((index + 1) % 3, (index + 2) % 3);
        let middle = scaled(normal, HALF[index]);
        let corner = |a: f64, b: f64| {
            add(middle, add(scaled(axes[first], a * HALF[first]), scaled(axes[second], b * HALF[second])))
        };
        let lit = match light {
            Some(light) => 0.15 + 0.75 * dot(normal, light).max(0.0),
            None => 0.2 + 0.25 * scene.see(normal)[2],
        };
        let fill = mixed(theme.raised, theme.dim, lit as f32);
        let edge = Stroke::new(1.0, mixed(fill, theme.text, 0.45));
        let outline =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| scene.place(corner(a, b)));
        scene.painter.add(Shape::convex_polygon(outline.to_vec(), fill, edge));
        let faint = Stroke::new(1.0, mixed(fill, theme.text, 0.18));
        if index != 2 {
            // The units.
            let along_first = first == 2;
            for cut in [-1.0 / 3.0, 1.0 / 3.0] {
                let ends = if along_first {
                    [corner(cut, -1.0), corner(cut, 1.0)]
                } else {
                    [corner(-1.0, cut), corner(1.0, cut)]
                };
                scene.painter.line_segment(ends.map(|end| scene.place(end)), faint);
            }
        }
        if camera.is_some_and(|camera| dot(camera, normal) > 0.9) {
            let lens = Stroke::new(1.5, theme.accent);
            scene.ring(axes[first], axes[second], middle, 0.3, lens);
            scene.ring(axes[first], axes[second], middle, 0.13, lens);
        }
    }
}

/// Four rods that spread from the end where the antenna is.
fn rods(scene: &Scene<'_>, axes: [Vector; 3], antenna: Vector) {
    let stroke = Stroke::new(1.5, scene.theme.text);
    let index = (0..3).max_by(|&a, &b| dot(axes[a], antenna).abs().total_cmp(&dot(axes[b], antenna).abs()));
    let Some(index) = index else { return };
    let foot = scaled(antenna, HALF[index]);
    let first = axes[(index + 1) % 3];
    let second = unit(cross(antenna, first)).unwrap_or(axes[(index + 2) % 3]);
    for way in [first, second, scaled(first, -1.0), scaled(second, -1.0)] {
        let tip = add(foot, add(scaled(way, 0.95), scaled(antenna, 0.35)));
        scene.painter.line_segment([scene.place(add(foot, scaled(way, 0.2))), scene.place(tip)], stroke);
    }
}

fn mixed(one: Color32, other: Color32, part: f32) -> Color32 {
    let [one, other] = [one, other].map(|colour| colour.to_array().map(f32::from));
    let of = |index: usize| lerp(one[index]..=other[index], part.clamp(0.0, 1.0)).round() as u8;
    Color32::from_rgb(of(0), of(1), of(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_of_the_camera_is_that_in_the_frame_of_reference() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let mut attitude = Attitude {
            body_to_reference: Some([2.0 * half, 0.0, 2.0 * half, 0.0]),
            sun: None,
            field: None,
            nadir: Some([7_000.0, 0.0, 0.0]),
            camera_body: [0.0, 0.0, 1.0],
            antenna_body: [0.0, 0.0, -1.0],
            is_eclipsed: false,
        };
        // A quarter turn about y takes z to x.
        assert!(off_nadir_deg(&attitude).unwrap() < 1e-6);
        attitude.nadir = Some([0.0, 1.0, 0.0]);
        assert!((off_nadir_deg(&attitude).unwrap() - 90.0).abs() < 1e-6);
        attitude.body_to_reference = Some([0.0; 4]);
        assert_eq!(off_nadir_deg(&attitude), None);
        attitude.body_to_reference = Some([f64::NAN; 4]);
        assert_eq!(off_nadir_deg(&attitude), None);
    }
}
