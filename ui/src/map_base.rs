//! What lies under a map: the view (where and how close), the land and the night as meshes, made anew only when the view
//! or the Sun has moved.

use std::sync::Arc;

use egui::epaint::{Mesh, Vertex, WHITE_UV};
use egui::{Color32, Pos2, Rect, Vec2, pos2, vec2};

use crate::geo::{Place, sun_elevation_deg, wrap_deg};
use crate::land::{self, Land};

/// Closer than this no operator needs to see.
const ZOOM_MAX: f32 = 60.0;
/// From here on the fine land is drawn.
const FINE_FROM: f32 = 3.0;

/// Where a flat map looks, and how close.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// In the middle.
    pub centre: Place,
    /// 1 shows the whole Earth.
    pub zoom: f32,
}

impl Default for View {
    fn default() -> Self {
        Self { centre: Place::new(0.0, 0.0), zoom: 1.0 }
    }
}

/// A view on a place of the screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Where the map is drawn; twice as wide as it is high.
    pub rect: Rect,
    /// Where it looks.
    pub view: View,
}

impl Projection {
    /// The largest map in the middle of `within`, with the view kept on the Earth.
    #[must_use]
    pub fn new(within: Rect, view: View) -> Self {
        let width = within.width().min(within.height() * 2.0).max(2.0);
        let rect = Rect::from_center_size(within.center(), vec2(width, width / 2.0));
        let zoom = if view.zoom.is_finite() { view.zoom.clamp(1.0, ZOOM_MAX) } else { 1.0 };
        let reach = 90.0 - 90.0 / f64::from(zoom);
        let centre =
            Place::new(wrap_deg(view.centre.longitude_deg), view.centre.latitude_deg.clamp(-reach, reach));
        Self { rect, view: View { centre, zoom } }
    }

    /// Points a degree.
    #[must_use]
    pub fn scale(&self) -> f32 {
        self.rect.width() / 360.0 * self.view.zoom
    }

    /// Where longitude and latitude lie, without wrapping: the map goes on to both sides.
    #[must_use]
    pub fn flat(&self, longitude_deg: f64, latitude_deg: f64) -> Pos2 {
        let (x, y) =
            (longitude_deg - self.view.centre.longitude_deg, self.view.centre.latitude_deg - latitude_deg);
        self.rect.center() + vec2(x as f32, y as f32) * self.scale()
    }

    /// Where a place is seen: of its copies the one nearest to the middle.
    #[must_use]
    pub fn at(&self, place: Place) -> Pos2 {
        let x = wrap_deg(place.longitude_deg - self.view.centre.longitude_deg);
        self.flat(self.view.centre.longitude_deg + x, place.latitude_deg)
    }

    /// The place under a point; nothing outside the map.
    #[must_use]
    pub fn place(&self, at: Pos2) -> Option<Place> {
        let from = (at - self.rect.center()) / self.scale();
        let latitude_deg = self.view.centre.latitude_deg - f64::from(from.y);
        (self.rect.contains(at) && latitude_deg.abs() <= 90.0)
            .then(|| Place::new(wrap_deg(self.view.centre.longitude_deg + f64::from(from.x)), latitude_deg))
    }

    /// By how much the copies of the map lie beside it, points.
    #[must_use]
    pub fn turn(&self) -> f32 {
        360.0 * self.scale()
    }

    /// The view moved by a drag of so many points.
    #[must_use]
    pub fn dragged(&self, by: Vec2) -> View {
        let by = by / self.scale();
        let centre = self.view.centre;
        let centre =
            Place::new(centre.longitude_deg - f64::from(by.x), centre.latitude_deg + f64::from(by.y));
        Self::new(self.rect, View { centre, ..self.view }).view
    }

    /// The view closer by a factor, with what is under the pointer left there.
    #[must_use]
    pub fn zoomed(&self, factor: f32, pointer: Pos2) -> View {
        let from = pointer - self.rect.center();
        let zoom = (self.view.zoom * factor).clamp(1.0, ZOOM_MAX);
        let moved = from / self.scale() - from / (self.rect.width() / 360.0 * zoom);
        let centre = Place::new(
            self.view.centre.longitude_deg + f64::from(moved.x),
            self.view.centre.latitude_deg - f64::from(moved.y),
        );
        Self::new(self.rect, View { centre, zoom }).view
    }
}

/// The meshes under a map, kept between frames.
#[derive(Debug, Default)]
pub struct Base {
    land: Option<(Projection, Color32, Arc<Mesh>)>,
    night: Option<(Projection, Place, Color32, Arc<Mesh>)>,
    /// How often a mesh was made: what a test counts.
    pub made: usize,
}

impl Base {
    /// The land in this colour.
    pub fn land(&mut self, projection: Projection, colour: Color32) -> Arc<Mesh> {
        match &self.land {
            Some((at, was, mesh)) if *at == projection && *was == colour => Arc::clone(mesh),
            _ => {
                self.made += 1;
                let land = if projection.view.zoom < FINE_FROM { land::coarse() } else { land::fine() };
                let mesh = Arc::new(land_mesh(land, projection, colour));
                self.land = Some((projection, colour, Arc::clone(&mesh)));
                mesh
            }
        }
    }

    /// The night, from nothing at sunset to `colour` where the Sun is 18 degrees down. The Sun's place is taken to a
    /// tenth of a degree, which it moves in 24 seconds.
    pub fn night(&mut self, projection: Projection, subsolar: Place, colour: Color32) -> Arc<Mesh> {
        let tenth = |angle: f64| (angle * 10.0).round() / 10.0;
        let subsolar = Place::new(tenth(wrap_deg(subsolar.longitude_deg)), tenth(subsolar.latitude_deg));
        match &self.night {
            Some((at, sun, was, mesh)) if *at == projection && *sun == subsolar && *was == colour => {
                Arc::clone(mesh)
            }
            _ => {
                self.made += 1;
                let mesh = Arc::new(night_mesh(projection, subsolar, colour));
                self.night = Some((projection, subsolar, colour, Arc::clone(&mesh)));
                mesh
            }
        }
    }
}

/// The land in view, with coasts that fade over one point so that they are not jagged.
fn land_mesh(land: &Land, projection: Projection, colour: Color32) -> Mesh {
    let mut mesh = Mesh::default();
    for piece in &land.pieces {
        for turn in [-360.0_f64, 0.0, 360.0] {
            let corner = |longitude: f32, latitude: f32| {
                projection.flat(f64::from(longitude) + turn, f64::from(latitude))
            };
            let [west, south, east, north] = piece.bounds;
            let bounds = Rect::from_two_pos(corner(west, south), corner(east, north));
            // What is out of view or smaller than half a point is not drawn
            if bounds.intersects(projection.rect) && bounds.size().max_elem() >= 0.5 {
                let corners: Vec<Pos2> = piece.corners.iter().map(|at| corner(at[0], at[1])).collect();
                fill(&mut mesh, &corners, &piece.triangles, projection.rect, colour);
                for ring in piece.rings.windows(2) {
                    let &[start, end] = ring else { continue };
                    let ring = corners.get(start..end).unwrap_or_default();
                    soften(&mut mesh, ring, projection.rect, colour, start == 0);
                }
            }
        }
    }
    mesh
}

fn vertex(pos: Pos2, color: Color32) -> Vertex {
    Vertex { pos, uv: WHITE_UV, color }
}

/// Adds the triangles in view, and of the corners only those that they need: close up, a continent is mostly elsewhere.
fn fill(mesh: &mut Mesh, corners: &[Pos2], triangles: &[u32], view: Rect, colour: Color32) {
    let mut taken = vec![u32::MAX; corners.len()];
    for triangle in triangles.chunks_exact(3) {
        let at = |index: usize| triangle.get(index).and_then(|corner| corners.get(*corner as usize)).copied();
        let (Some(a), Some(b), Some(c)) = (at(0), at(1), at(2)) else { continue };
        if !Rect::from_points(&[a, b, c]).intersects(view) {
            continue;
        }
        for (index, pos) in triangle.iter().zip([a, b, c]) {
            let Some(taken) = taken.get_mut(*index as usize) else { continue };
            if *taken == u32::MAX {
                *taken = mesh.vertices.len() as u32;
                mesh.vertices.push(vertex(pos, colour));
            }
            mesh.indices.push(*taken);
        }
    }
}

/// Adds to each edge of a ring a strip one point wide that fades away from the land.
fn soften(mesh: &mut Mesh, ring: &[Pos2], view: Rect, colour: Color32, is_outer: bool) {
    let edges = || ring.iter().zip(ring.iter().cycle().skip(1));
    let twice_area: f32 = edges().map(|(a, b)| a.x * b.y - b.x * a.y).sum();
    let outwards = if (twice_area > 0.0) == is_outer { 1.0 } else { -1.0 };
    for (&a, &b) in edges() {
        if !Rect::from_two_pos(a, b).intersects(view) {
            continue;
        }
        let along = (b - a).normalized();
        let out = vec2(along.y, -along.x) * outwards;
        let first = mesh.vertices.len() as u32;
        let clear = Color32::TRANSPARENT;
        mesh.vertices.extend([
            vertex(a, colour),
            vertex(b, colour),
            vertex(a + out, clear),
            vertex(b + out, clear),
        ]);
        mesh.indices.extend([first, first + 1, first + 2, first + 1, first + 3, first + 2]);
    }
}

/// A grid over the map, each corner as dark as the Sun is down there.
fn night_mesh(projection: Projection, subsolar: Place, colour: Color32) -> Mesh {
    const COLUMNS: u32 = 180;
    const ROWS: u32 = 90;
    let mut mesh = Mesh::default();
    let rect = projection.rect;
    for row in 0..=ROWS {
        for column in 0..=COLUMNS {
            let part = vec2(column as f32 / COLUMNS as f32, row as f32 / ROWS as f32);
            let pos = pos2(rect.left() + part.x * rect.width(), rect.top() + part.y * rect.height());
            let from = (pos - rect.center()) / projection.scale();
            let centre = projection.view.centre;
            let place =
                Place::new(centre.longitude_deg + f64::from(from.x), centre.latitude_deg - f64::from(from.y));
            let down = -sun_elevation_deg(place, subsolar) as f32;
            // Half of the darkness comes in civil twilight, so that the terminator itself is seen, and is soft
            let dark = 0.45 * (down / 6.0).clamp(0.0, 1.0) + 0.55 * (down / 18.0).clamp(0.0, 1.0);
            mesh.vertices.push(vertex(pos, colour.gamma_multiply(dark)));
        }
    }
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let at = row * (COLUMNS + 1) + column;
            let below = at + COLUMNS + 1;
            let corners = [at, at + 1, below, below + 1];
            let is_dark = |index: &u32| {
                mesh.vertices.get(*index as usize).is_some_and(|vertex| vertex.color != Color32::TRANSPARENT)
            };
            if corners.iter().any(is_dark) {
                mesh.indices.extend([at, at + 1, below, at + 1, below + 1, below]);
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rect() -> Rect {
        Rect::from_min_size(pos2(10.0, 20.0), vec2(800.0, 500.0))
    }

    #[test]
    fn close_up_only_what_is_in_view_is_drawn() {
        let view = View { centre: Place::new(6.6, 46.5), zoom: 40.0 };
        let mesh = Base::default().land(Projection::new(rect(), view), Color32::GRAY);
        assert!((3..3_000).contains(&mesh.vertices.len()), "{}", mesh.vertices.len());
    }

    #[test]
    fn a_mesh_is_made_once_for_a_view_and_again_when_it_moves() {
        let mut base = Base::default();
        let projection = Projection::new(rect(), View::default());
        for _ in 0..5 {
            base.land(projection, Color32::GRAY);
            base.night(projection, Place::new(10.02, 20.0), Color32::BLACK);
            base.night(projection, Place::new(10.03, 20.0), Color32::BLACK);
        }
        assert_eq!(base.made, 2);
        base.land(Projection::new(rect(), projection.zoomed(2.0, rect().center())), Color32::GRAY);
        assert_eq!(base.made, 3);
    }

    proptest! {
        #[test]
        fn a_place_is_found_where_it_is_drawn(
            x in -179.9..179.9_f64, y in -89.0..89.0_f64, cx in -180.0..180.0_f64, cy in -90.0..90.0_f64, zoom in 1.0..60.0_f32,
        ) {
            let projection = Projection::new(rect(), View { centre: Place::new(cx, cy), zoom });
            let at = projection.at(Place::new(x, y));
            if projection.rect.shrink(1.0).contains(at) {
                let found = projection.place(at).unwrap();
                prop_assert!(wrap_deg(found.longitude_deg - x).abs() < 0.01, "{found:?}");
                prop_assert!((found.latitude_deg - y).abs() < 0.01);
            }
        }

        #[test]
        fn a_zoom_leaves_the_place_under_the_pointer_there(
            px in 0.0..1.0_f32, py in 0.0..1.0_f32, factor in 1.0..4.0_f32, cx in -180.0..180.0_f64,
        ) {
            let projection = Projection::new(rect(), View { centre: Place::new(cx, 10.0), zoom: 2.0 });
            let pointer = projection.rect.lerp_inside(vec2(px, py));
            prop_assume!(projection.place(pointer).is_some());
            let before = projection.place(pointer).unwrap();
            let after = Projection::new(rect(), projection.zoomed(factor, pointer)).place(pointer).unwrap();
            prop_assert!(wrap_deg(before.longitude_deg - after.longitude_deg).abs() < 0.01);
            prop_assert!((before.latitude_deg - after.latitude_deg).abs() < 0.01);
        }

        #[test]
        fn no_view_leaves_the_earth(cx in -1e4..1e4_f64, cy in -1e4..1e4_f64, zoom in -10.0..1e4_f32) {
            let projection = Projection::new(rect(), View { centre: Place::new(cx, cy), zoom });
            for corner in [projection.rect.left_top(), projection.rect.right_bottom()] {
                let from = (corner - projection.rect.center()) / projection.scale();
                let latitude = projection.view.centre.latitude_deg - f64::from(from.y);
                prop_assert!(latitude.abs() <= 90.001);
            }
        }
    }
}
