//! The sky over a station, seen from below: north up, the horizon at the rim, the zenith in the middle.

use egui::epaint::{Mesh, Vertex};
use egui::{Align2, Painter, Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui, WidgetInfo, vec2};
use jiff::{SignedDuration, Timestamp};

use crate::labels::{self, Labels};
use crate::theme::Theme;
use crate::{fonts, format};

/// A direction from the station: azimuth from north over east and elevation above the horizon, both in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// From north over east, degrees.
    pub azimuth_deg: f64,
    /// Above the horizon, degrees.
    pub elevation_deg: f64,
}

impl Direction {
    /// Azimuth and elevation in degrees.
    #[must_use]
    pub const fn new(azimuth_deg: f64, elevation_deg: f64) -> Self {
        Self { azimuth_deg, elevation_deg }
    }
}

/// Where the satellite is at one time of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkySample {
    /// When.
    pub at: Timestamp,
    /// Where.
    pub direction: Direction,
}

/// Where the antenna looks and how wide it sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Antenna {
    /// Where it looks.
    pub direction: Direction,
    /// From edge to edge of the beam (half power), degrees.
    pub beam_width_deg: f64,
}

/// What a sky plot shows.
#[derive(Debug, Clone, Copy)]
pub struct SkyPlot<'a> {
    /// The time that parts the path into past and coming.
    pub now: Timestamp,
    /// One pass from AOS to LOS, in order of time; every 10 s is close enough.
    pub path: &'a [SkySample],
    /// The horizon as it is seen there: azimuth and elevation in degrees, in order of azimuth; empty for a free view.
    pub mask: &'a [(f64, f64)],
    /// The antenna, where there is one that turns.
    pub antenna: Option<Antenna>,
    /// The Sun.
    pub sun: Option<Direction>,
}

struct Disk {
    centre: Pos2,
    radius: f32,
}

impl Disk {
    fn at(&self, direction: Direction) -> Pos2 {
        let (x, y) = project(direction);
        self.centre + vec2(x, y) * self.radius
    }
}

/// On a disk of radius 1: right and down from its middle. Below the horizon it lies outside.
fn project(direction: Direction) -> (f32, f32) {
    let radius = (90.0 - direction.elevation_deg) / 90.0;
    let azimuth = direction.azimuth_deg.to_radians();
    ((radius * azimuth.sin()) as f32, (-radius * azimuth.cos()) as f32)
}

/// The direction at a place on the disk of radius 1; nothing outside the rim.
fn unproject(x: f32, y: f32) -> Option<Direction> {
    let radius = f64::from(x.hypot(y));
    let azimuth_deg = f64::from(x).atan2(f64::from(-y)).to_degrees().rem_euclid(360.0);
    (radius <= 1.0).then(|| Direction::new(azimuth_deg, 90.0 * (1.0 - radius)))
}

impl SkyPlot<'_> {
    /// Draws it as large as the place allows, `height` points high at the most.
    pub fn show(&self, ui: &mut Ui, height: f32) -> Response {
        let theme = Theme::current(ui);
        let size = vec2(ui.available_width(), height);
        let (response, painter) = ui.allocate_painter(size, Sense::hover());
        let rect = response.rect;
        let disk =
            Disk { centre: rect.center(), radius: (rect.width().min(rect.height()) / 2.0 - 22.0).max(20.0) };
        let mut labels = Labels::new();
        if ui.is_rect_visible(rect) {
            self.grid(&painter, &disk, theme, &mut labels);
            self.sun(&painter, &disk, theme, &mut labels);
            if let Some(antenna) = self.antenna {
                labels.keep_off(Rect::from_center_size(disk.at(antenna.direction), vec2(28.0, 28.0)));
            }
            self.path(&painter, &disk, theme, rect, &mut labels);
            Self::heights(&painter, &disk, theme, rect, &mut labels);
            self.antenna(&painter, &disk, theme);
            if let Some(here) = self.place_at(&disk, self.now) {
                painter.circle_filled(here, 8.0, theme.accent.gamma_multiply(0.25));
                painter.circle_filled(here, 5.0, theme.accent);
            }
        }
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, self.told()));
        match response.hover_pos().and_then(|pointer| self.hover_text(&disk, pointer)) {
            Some(text) => response.on_hover_text_at_pointer(text),
            None => response,
        }
    }

    /// What the plot shows, in words.
    fn told(&self) -> String {
        match (self.path.first(), self.path.last(), self.highest()) {
            (Some(aos), Some(los), Some(tca)) => format!(
                "Sky plot: AOS {}, highest {} at {}, LOS {}",
                format::time(aos.at),
                format::degrees(Some(tca.direction.elevation_deg)),
                format::time(tca.at),
                format::time(los.at)
            ),
            _ => "Sky plot: no pass".into(),
        }
    }

    fn highest(&self) -> Option<&SkySample> {
        self.path.iter().max_by(|a, b| a.direction.elevation_deg.total_cmp(&b.direction.elevation_deg))
    }

    fn grid(&self, painter: &Painter, disk: &Disk, theme: &Theme, labels: &mut Labels) {
        painter.circle_filled(disk.centre, disk.radius, theme.ground);
        self.mask(painter, disk, theme);
        let thin = Stroke::new(1.0, theme.line);
        for elevation_deg in [60.0, 30.0] {
            painter.circle_stroke(disk.centre, disk.radius * (90.0 - elevation_deg) / 90.0, thin);
        }
        painter
            .line_segment([disk.centre - vec2(disk.radius, 0.0), disk.centre + vec2(disk.radius, 0.0)], thin);
        painter
            .line_segment([disk.centre - vec2(0.0, disk.radius), disk.centre + vec2(0.0, disk.radius)], thin);
        painter.circle_stroke(disk.centre, disk.radius, Stroke::new(1.5, theme.faint));
        for (name, turn) in [("N", 0.0_f32), ("E", 90.0), ("S", 180.0), ("W", 270.0)] {
            let (x, y) = (turn.to_radians().sin(), -turn.to_radians().cos());
            let at = disk.centre + vec2(x, y) * (disk.radius + 11.0);
            let colour = if name == "N" { theme.text } else { theme.dim };
            labels::fixed(labels, painter, at, Align2::CENTER_CENTER, name, fonts::body(), colour);
        }
    }

    /// How high the rings are, on the side where nothing lies.
    fn heights(painter: &Painter, disk: &Disk, theme: &Theme, within: Rect, labels: &mut Labels) {
        for elevation_deg in [60.0_f32, 30.0, 0.0] {
            let text = format!("{elevation_deg}°");
            let size = labels::size(painter, &text, &fonts::small());
            let ring = disk.radius * (90.0 - elevation_deg) / 90.0;
            let (x, y) = (size.x / 2.0 + 3.0, ring - size.y / 2.0 - 1.0);
            let places = [vec2(x, -y), vec2(x, y), vec2(-x, -y), vec2(-x, y)];
            labels.write(painter, within, disk.centre, &places, &text, fonts::small(), theme.dim);
        }
    }

    fn mask(&self, painter: &Painter, disk: &Disk, theme: &Theme) {
        if self.mask.is_empty() {
            return;
        }
        let mut mesh = Mesh::default();
        let mut edge = Vec::with_capacity(181);
        for step in 0..=180_u32 {
            let azimuth_deg = f64::from(step) * 2.0;
            let rim = disk.at(Direction::new(azimuth_deg, 0.0));
            let seen = disk.at(Direction::new(azimuth_deg, mask_elevation_deg(self.mask, azimuth_deg)));
            for pos in [rim, seen] {
                mesh.vertices.push(Vertex { pos, uv: egui::epaint::WHITE_UV, color: theme.raised });
            }
            edge.push(seen);
            if step > 0 {
                let at = 2 * step;
                mesh.indices.extend([at - 2, at - 1, at, at - 1, at + 1, at]);
            }
        }
        painter.add(mesh);
        painter.add(Shape::line(edge, Stroke::new(1.0, theme.faint)));
    }

    fn sun(&self, painter: &Painter, disk: &Disk, theme: &Theme, labels: &mut Labels) {
        let Some(sun) = self.sun.filter(|sun| sun.elevation_deg >= 0.0) else { return };
        let at = disk.at(sun);
        painter.circle_stroke(at, 4.0, Stroke::new(1.5, theme.dim));
        for ray in 0..8_u8 {
            let turn = f32::from(ray) / 8.0 * std::f32::consts::TAU;
            let out = vec2(turn.sin(), turn.cos());
            painter.line_segment([at + out * 6.5, at + out * 9.0], Stroke::new(1.5, theme.dim));
        }
        labels.keep_off(Rect::from_center_size(at, vec2(18.0, 18.0)));
    }

    /// Where the satellite is drawn at that time: between two samples straight on the plot, so that nothing goes the long
    /// way round at north.
    fn place_at(&self, disk: &Disk, at: Timestamp) -> Option<Pos2> {
        let after = self.path.partition_point(|sample| sample.at <= at);
        let (before, after) = (self.path.get(after.checked_sub(1)?)?, self.path.get(after));
        let Some(after) = after else {
            return (before.at == at).then(|| disk.at(before.direction));
        };
        let whole = after.at.duration_since(before.at).as_secs_f32();
        let part = if whole > 0.0 { at.duration_since(before.at).as_secs_f32() / whole } else { 0.0 };
        Some(disk.at(before.direction).lerp(disk.at(after.direction), part))
    }

    fn path(&self, painter: &Painter, disk: &Disk, theme: &Theme, within: Rect, labels: &mut Labels) {
        let (Some(first), Some(last), Some(highest)) = (self.path.first(), self.path.last(), self.highest())
        else {
            let text = "no pass";
            painter.text(
                disk.centre + vec2(0.0, disk.radius / 2.0),
                Align2::CENTER_CENTER,
                text,
                fonts::small(),
                theme.dim,
            );
            return;
        };
        let parted = self.path.partition_point(|sample| sample.at <= self.now);
        let here = self.place_at(disk, self.now);
        let place = |sample: &SkySample| disk.at(sample.direction);
        let (past, coming) = self.path.split_at(parted);
        let past: Vec<Pos2> = past.iter().map(place).chain(here).collect();
        let coming: Vec<Pos2> = here.into_iter().chain(coming.iter().map(place)).collect();
        for point in past.iter().chain(&coming) {
            labels.keep_off(Rect::from_center_size(*point, vec2(4.0, 4.0)));
        }
        painter.add(Shape::line(past, Stroke::new(1.5, theme.faint)));
        painter.add(Shape::line(coming, Stroke::new(2.0, theme.accent)));
        for (name, sample) in [("AOS", first), ("LOS", last), ("TCA", highest)] {
            let at = place(sample);
            let colour = if sample.at < self.now { theme.faint } else { theme.accent };
            painter.circle_filled(at, 3.5, colour);
            let text = format!("{name} {}", format::time(sample.at));
            let size = labels::size(painter, &text, &fonts::small_figures());
            let outwards = (at - disk.centre).normalized();
            let mut places = vec![outwards * (size.x / 2.0 + 10.0)];
            places.extend(labels::around(size, 8.0));
            places.extend(labels::around(size, 22.0));
            labels.write(painter, within, at, &places, &text, fonts::small_figures(), theme.text);
        }
        self.ticks(painter, disk, theme, within, labels);
    }

    fn ticks(&self, painter: &Painter, disk: &Disk, theme: &Theme, within: Rect, labels: &mut Labels) {
        let (Some(first), Some(last)) = (self.path.first(), self.path.last()) else { return };
        let mut second = first.at.as_second().div_euclid(60) * 60 + 60;
        // A pass of hours is no pass of ours: its ticks stop rather than cost
        for _ in 0..120 {
            let Ok(at) = Timestamp::from_second(second) else { return };
            if at > last.at {
                return;
            }
            second += 60;
            let near = SignedDuration::from_secs(2);
            let (Some(here), Some(next)) = (
                self.place_at(disk, at),
                at.checked_add(near).ok().and_then(|next| self.place_at(disk, next)),
            ) else {
                continue;
            };
            let along = (next - here).normalized();
            let across = vec2(-along.y, along.x);
            let colour = if at < self.now { theme.faint } else { theme.accent };
            painter.line_segment([here - across * 4.0, here + across * 4.0], Stroke::new(1.5, colour));
            let text = format!(":{:02}", at.as_second().div_euclid(60).rem_euclid(60));
            labels.write(
                painter,
                within,
                here,
                &[across * 20.0, -across * 20.0],
                &text,
                fonts::small_figures(),
                theme.dim,
            );
        }
    }

    fn antenna(&self, painter: &Painter, disk: &Disk, theme: &Theme) {
        let Some(antenna) = self.antenna else { return };
        let at = disk.at(antenna.direction);
        let stroke = Stroke::new(1.5, theme.text);
        for out in [vec2(1.0, 0.0), vec2(-1.0, 0.0), vec2(0.0, 1.0), vec2(0.0, -1.0)] {
            painter.line_segment([at + out * 5.0, at + out * 13.0], stroke);
        }
        let beam: Vec<Pos2> = beam(antenna).into_iter().map(|direction| disk.at(direction)).collect();
        painter.add(Shape::dashed_line(&beam, Stroke::new(1.0, theme.dim), 4.0, 4.0));
    }

    fn hover_text(&self, disk: &Disk, pointer: Pos2) -> Option<String> {
        let from = (pointer - disk.centre) / disk.radius;
        let direction = unproject(from.x, from.y)?;
        let look = format!(
            "azimuth {}, elevation {}",
            format::degrees(Some(direction.azimuth_deg)),
            format::degrees(Some(direction.elevation_deg))
        );
        let near = self
            .path
            .iter()
            .map(|sample| (disk.at(sample.direction).distance(pointer), sample))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(distance, _)| *distance < 12.0);
        Some(match near {
            Some((_, sample)) => format!(
                "{}: azimuth {}, elevation {}",
                format::time(sample.at),
                format::degrees(Some(sample.direction.azimuth_deg)),
                format::degrees(Some(sample.direction.elevation_deg))
            ),
            None => look,
        })
    }
}

/// How high the horizon is there, degrees; between two points of the mask straight, past the last one back to the first.
fn mask_elevation_deg(mask: &[(f64, f64)], azimuth_deg: f64) -> f64 {
    let after = mask.partition_point(|(azimuth, _)| *azimuth <= azimuth_deg);
    let (Some(&first), Some(&last)) = (mask.first(), mask.last()) else { return 0.0 };
    let before = after.checked_sub(1).and_then(|index| mask.get(index)).copied();
    let before = before.unwrap_or((last.0 - 360.0, last.1));
    let after = mask.get(after).copied().unwrap_or((first.0 + 360.0, first.1));
    let whole = after.0 - before.0;
    let part = if whole > 0.0 { (azimuth_deg - before.0) / whole } else { 0.0 };
    (before.1 + part * (after.1 - before.1)).clamp(0.0, 90.0)
}

/// The edge of the beam as directions, closed; below the horizon it runs along it.
fn beam(antenna: Antenna) -> Vec<Direction> {
    let radius_deg = (antenna.beam_width_deg / 2.0).clamp(0.0, 90.0);
    let look = crate::geo::Place::new(antenna.direction.azimuth_deg, antenna.direction.elevation_deg);
    crate::geo::circle(look, radius_deg, 72)
        .into_iter()
        .map(|place| Direction::new(place.longitude_deg, place.latitude_deg.max(0.0)))
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn north_is_up_and_east_is_right() {
        let close = |found: (f32, f32), wanted: (f32, f32)| {
            assert!(
                (found.0 - wanted.0).abs() < 1e-6 && (found.1 - wanted.1).abs() < 1e-6,
                "{found:?} {wanted:?}"
            );
        };
        close(project(Direction::new(0.0, 0.0)), (0.0, -1.0));
        close(project(Direction::new(90.0, 0.0)), (1.0, 0.0));
        close(project(Direction::new(180.0, 45.0)), (0.0, 0.5));
        close(project(Direction::new(123.0, 90.0)), (0.0, 0.0));
    }

    #[test]
    fn the_mask_goes_round() {
        let mask = [(10.0, 5.0), (350.0, 15.0)];
        assert!((mask_elevation_deg(&mask, 0.0) - 10.0).abs() < 1e-9);
        assert!((mask_elevation_deg(&mask, 180.0) - 10.0).abs() < 1e-9);
        assert!((mask_elevation_deg(&[(120.0, 7.0)], 300.0) - 7.0).abs() < 1e-9);
        assert_eq!(mask_elevation_deg(&[], 300.0), 0.0);
    }

    proptest! {
        #[test]
        fn a_direction_is_found_where_it_was_drawn(azimuth_deg in 0.0..360.0_f64, elevation_deg in 0.1..89.0_f64) {
            let (x, y) = project(Direction::new(azimuth_deg, elevation_deg));
            let found = unproject(x, y).unwrap();
            prop_assert!((found.elevation_deg - elevation_deg).abs() < 1e-3);
            prop_assert!(crate::geo::wrap_deg(found.azimuth_deg - azimuth_deg).abs() < 1e-2);
        }

        #[test]
        fn the_mask_stays_between_its_points(points in prop::collection::vec((0.0..360.0_f64, 0.0..40.0_f64), 1..12), azimuth_deg in 0.0..360.0_f64) {
            let mut mask = points;
            mask.sort_by(|a, b| a.0.total_cmp(&b.0));
            let found = mask_elevation_deg(&mask, azimuth_deg);
            let low = mask.iter().map(|p| p.1).fold(f64::MAX, f64::min);
            let high = mask.iter().map(|p| p.1).fold(f64::MIN, f64::max);
            prop_assert!(low - 1e-9 <= found && found <= high + 1e-9);
        }
    }
}
