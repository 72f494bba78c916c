//! The world as a flat map: land, night, ground tracks, footprints, stations, and who hears the satellite.

use egui::{Align2, Painter, Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};
use jiff::{SignedDuration, Timestamp};

use crate::geo::{self, Place};
use crate::labels::{self, Labels};
use crate::map_base::{Base, Projection, View};
use crate::theme::Theme;
use crate::{fonts, format};

/// A place at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackPoint {
    /// When.
    pub at: Timestamp,
    /// Below the satellite.
    pub place: Place,
}

/// A satellite.
#[derive(Debug, Clone, PartialEq)]
pub struct Satellite<'a> {
    /// Its name.
    pub name: &'a str,
    /// Below it, now; nothing when its elements are not known.
    pub place: Option<Place>,
    /// Where it was and will be, in order of time; a point a minute is close enough.
    pub track: &'a [TrackPoint],
    /// The edge of what sees it, in order; empty for none.
    pub footprint: &'a [Place],
    /// Drawn in the accent colour: the one that the desk looks at.
    pub is_ours: bool,
}

/// A ground station of ours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station<'a> {
    /// Its name.
    pub name: &'a str,
    /// Where it stands.
    pub place: Place,
}

/// Somebody else's station that reports what it heard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver<'a> {
    /// Its name.
    pub name: &'a str,
    /// Where it stands.
    pub place: Place,
    /// When it last heard the satellite.
    pub last_heard: Timestamp,
}

/// What a map shows.
#[derive(Debug, Clone, Copy)]
pub struct World<'a> {
    /// The time that parts tracks into past and coming.
    pub now: Timestamp,
    /// Where the Sun is overhead; without it no night is drawn.
    pub subsolar: Option<Place>,
    /// Satellites.
    pub satellites: &'a [Satellite<'a>],
    /// Our stations.
    pub stations: &'a [Station<'a>],
    /// Others'.
    pub receivers: &'a [Receiver<'a>],
}

/// Something on the map, by its index in [`World`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thing {
    /// A satellite.
    Satellite(usize),
    /// A station of ours.
    Station(usize),
    /// Somebody else's.
    Receiver(usize),
}

/// What the pointer does on a map.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pointed {
    /// The place under the pointer.
    pub place: Option<Place>,
    /// The thing under it.
    pub thing: Option<Thing>,
    /// Whether it was clicked.
    pub is_clicked: bool,
}

/// What a map keeps between frames.
#[derive(Debug, Default)]
pub struct WorldMap {
    /// Where it looks.
    pub view: View,
    base: Base,
}

impl WorldMap {
    /// A map that looks there to begin with.
    #[must_use]
    pub fn new(view: View) -> Self {
        Self { view, base: Base::default() }
    }

    /// Draws the world in the place that there is, `height` points high at the most. Wheel or pinch zooms at the pointer,
    /// dragging moves, a double click shows the whole Earth again; with the keyboard on it, arrows, plus and minus.
    pub fn show(&mut self, ui: &mut Ui, height: f32, world: &World<'_>) -> (Response, Pointed) {
        let theme = Theme::current(ui);
        let width = ui.available_width().min(height * 2.0);
        let (response, painter) = ui.allocate_painter(vec2(width, width / 2.0), Sense::click_and_drag());
        self.hands(ui, &response);
        let projection = Projection::new(response.rect, self.view);
        self.view = projection.view;
        let painter = painter.with_clip_rect(painter.clip_rect().intersect(projection.rect));
        if ui.is_rect_visible(response.rect) {
            painter.rect_filled(projection.rect, 4.0, theme.sea);
            painter.add(self.base.land(projection, theme.land));
            let mut labels = Labels::new();
            if let Some(subsolar) = world.subsolar {
                painter.add(self.base.night(projection, subsolar, theme.night));
            }
            graticule(&painter, projection, theme, &mut labels);
            if let Some(subsolar) = world.subsolar {
                sun(&painter, projection.at(subsolar), theme);
            }
            paint_world(&painter, projection, world, theme, &mut labels);
        }
        crate::lamps::focus_ring(ui, response.rect.shrink(3.0), &response);
        let pointer = response.hover_pos();
        let pointed = Pointed {
            place: pointer.and_then(|at| projection.place(at)),
            thing: pointer.and_then(|at| nearest(projection, world, at)),
            is_clicked: response.clicked(),
        };
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, told(world)));
        let response = match pointed.place {
            Some(place) if !response.dragged() => {
                response.on_hover_text_at_pointer(hover_text(world, place, pointed.thing))
            }
            _ => response,
        };
        (response, pointed)
    }

    fn hands(&mut self, ui: &Ui, response: &Response) {
        let projection = Projection::new(response.rect, self.view);
        if response.dragged() {
            self.view = projection.dragged(response.drag_delta());
        }
        if response.double_clicked() {
            self.view = View::default();
        }
        if let Some(pointer) = response.hover_pos() {
            let factor = ui.input(|input| input.zoom_delta() * (input.smooth_scroll_delta().y / 200.0).exp());
            if (factor - 1.0).abs() > 1e-4 {
                self.view = projection.zoomed(factor, pointer);
            }
        }
        if response.has_focus() {
            ui.memory_mut(|memory| {
                let all = egui::EventFilter {
                    horizontal_arrows: true,
                    vertical_arrows: true,
                    ..Default::default()
                };
                memory.set_focus_lock_filter(response.id, all);
            });
            let (by, factor) = ui.input(|input| {
                let key = |key| f32::from(u8::from(input.key_pressed(key)));
                let by = vec2(
                    key(egui::Key::ArrowLeft) - key(egui::Key::ArrowRight),
                    key(egui::Key::ArrowUp) - key(egui::Key::ArrowDown),
                );
                let closer = key(egui::Key::Plus) + key(egui::Key::Equals) - key(egui::Key::Minus);
                (by * 40.0, 1.25_f32.powf(closer))
            });
            if by != egui::Vec2::ZERO {
                self.view = projection.dragged(by);
            } else if (factor - 1.0).abs() > 1e-4 {
                self.view = projection.zoomed(factor, response.rect.center());
            }
        }
    }
}

/// How far apart the lines of the grid are, degrees: some six to ten of them across the map.
fn grid_step_deg(zoom: f32) -> u16 {
    [(1.8, 30), (3.5, 15), (7.0, 10), (14.0, 5), (30.0, 2)]
        .into_iter()
        .find(|(below, _)| zoom < *below)
        .map_or(1, |(_, step)| step)
}

fn graticule(painter: &Painter, projection: Projection, theme: &Theme, labels: &mut Labels) {
    let step = grid_step_deg(projection.view.zoom);
    let rect = projection.rect;
    let thin = Stroke::new(0.5, theme.line);
    let equator = Stroke::new(1.0, theme.line);
    let lines = |half: u16| {
        (0..=2 * (half / step))
            .map(move |line| i32::from(line) * i32::from(step) - i32::from(half / step * step))
    };
    for latitude in lines(90) {
        let y = projection.flat(0.0, f64::from(latitude)).y;
        if !rect.y_range().contains(y) || latitude.abs() == 90 {
            continue;
        }
        painter.hline(rect.x_range(), y, if latitude == 0 { equator } else { thin });
        let name = match latitude {
            0 => "0°".to_owned(),
            _ => format!("{}° {}", latitude.abs(), if latitude < 0 { "S" } else { "N" }),
        };
        labels::fixed(
            labels,
            painter,
            pos2(rect.left() + 6.0, y - 1.0),
            Align2::LEFT_BOTTOM,
            &name,
            fonts::small(),
            theme.faint,
        );
    }
    for longitude in lines(180).skip(1) {
        let x = projection.at(Place::new(f64::from(longitude), 0.0)).x;
        if !rect.x_range().contains(x) {
            continue;
        }
        painter.vline(x, rect.y_range(), if longitude == 0 { equator } else { thin });
        let name = match longitude {
            0 | 180 => format!("{longitude}°"),
            _ => format!("{}° {}", longitude.abs(), if longitude < 0 { "W" } else { "E" }),
        };
        let size = labels::size(painter, &name, &fonts::small());
        let below = [vec2(size.x / 2.0 + 3.0, -size.y / 2.0 - 3.0)];
        labels.write(painter, rect, pos2(x, rect.bottom()), &below, &name, fonts::small(), theme.faint);
    }
}

fn sun(painter: &Painter, at: Pos2, theme: &Theme) {
    painter.circle_stroke(at, 4.0, Stroke::new(1.5, theme.dim));
    for ray in 0..8_u8 {
        let turn = f32::from(ray) / 8.0 * std::f32::consts::TAU;
        let out = vec2(turn.sin(), turn.cos());
        painter.line_segment([at + out * 6.5, at + out * 9.0], Stroke::new(1.5, theme.dim));
    }
}

/// A line on the flat map, once for each copy of the map that it lies on.
fn line(painter: &Painter, projection: Projection, places: &[Place], stroke: Stroke) {
    if places.len() < 2 {
        return;
    }
    let unrolled = geo::unroll(places.iter().copied());
    let points: Vec<Pos2> =
        unrolled.iter().map(|place| projection.flat(place.longitude_deg, place.latitude_deg)).collect();
    let bounds = Rect::from_points(&points);
    // A line of several turns (a track of many hours) is wider than the map: more copies may be in view
    let turns = (bounds.width() / projection.turn()).ceil() as i32 + 1;
    for turn in -turns..=turns {
        let by = vec2(turn as f32 * projection.turn(), 0.0);
        if bounds.translate(by).intersects(projection.rect) {
            painter.add(Shape::line(points.iter().map(|point| *point + by).collect(), stroke));
        }
    }
}

fn paint_world(
    painter: &Painter,
    projection: Projection,
    world: &World<'_>,
    theme: &Theme,
    labels: &mut Labels,
) {
    let rect = projection.rect;
    for satellite in world.satellites {
        let colour = if satellite.is_ours { theme.accent } else { theme.dim };
        line(painter, projection, satellite.footprint, Stroke::new(1.0, colour.gamma_multiply(0.7)));
        let parted = satellite.track.partition_point(|point| point.at <= world.now);
        let (past, coming) = satellite.track.split_at(parted);
        let place = |point: &TrackPoint| point.place;
        let past: Vec<Place> = past.iter().map(place).chain(satellite.place).collect();
        let coming: Vec<Place> = satellite.place.into_iter().chain(coming.iter().map(place)).collect();
        line(painter, projection, &past, Stroke::new(1.5, theme.faint));
        line(painter, projection, &coming, Stroke::new(if satellite.is_ours { 2.0 } else { 1.0 }, colour));
    }
    for receiver in world.receivers {
        let at = projection.at(receiver.place);
        if rect.contains(at) {
            let age = world.now.duration_since(receiver.last_heard);
            if age <= SignedDuration::from_hours(24) {
                painter.circle_filled(at, 2.5, theme.text);
            } else if age <= SignedDuration::from_hours(24 * 7) {
                painter.circle_filled(at, 2.0, theme.dim);
            } else {
                painter.circle_stroke(at, 1.5, Stroke::new(1.0, theme.faint));
            }
        }
    }
    for station in world.stations {
        let at = projection.at(station.place);
        if rect.contains(at) {
            let corners = vec![at + vec2(0.0, -6.0), at + vec2(5.5, 4.0), at + vec2(-5.5, 4.0)];
            let edge = Stroke::new(1.0, theme.ground);
            painter.add(Shape::convex_polygon(corners, theme.text, edge));
            labels.keep_off(Rect::from_center_size(at, vec2(12.0, 12.0)));
        }
    }
    for satellite in world.satellites {
        let Some(at) = satellite.place.map(|place| projection.at(place)) else { continue };
        if rect.contains(at) {
            let colour = if satellite.is_ours { theme.accent } else { theme.dim };
            if satellite.is_ours {
                painter.circle_filled(at, 8.0, colour.gamma_multiply(0.25));
            }
            painter.circle_filled(at, if satellite.is_ours { 5.0 } else { 3.5 }, colour);
            labels.keep_off(Rect::from_center_size(at, vec2(12.0, 12.0)));
        }
    }
    let satellites = world.satellites.iter().filter_map(|satellite| {
        Some((satellite.name, satellite.place?, if satellite.is_ours { theme.text } else { theme.dim }))
    });
    for (name, place, colour) in
        satellites.chain(world.stations.iter().map(|station| (station.name, station.place, theme.text)))
    {
        let at = projection.at(place);
        if rect.contains(at) {
            let size = labels::size(painter, name, &fonts::small());
            labels.write(painter, rect, at, &labels::around(size, 9.0), name, fonts::small(), colour);
        }
    }
}

fn nearest(projection: Projection, world: &World<'_>, pointer: Pos2) -> Option<Thing> {
    let satellites = world.satellites.iter().enumerate();
    let satellites = satellites.filter_map(|(index, one)| Some((Thing::Satellite(index), one.place?)));
    let stations = world.stations.iter().enumerate().map(|(index, one)| (Thing::Station(index), one.place));
    let receivers =
        world.receivers.iter().enumerate().map(|(index, one)| (Thing::Receiver(index), one.place));
    satellites
        .chain(stations)
        .chain(receivers)
        .map(|(thing, place)| (thing, projection.at(place).distance(pointer)))
        .filter(|(_, distance)| *distance < 9.0)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(thing, _)| thing)
}

fn hover_text(world: &World<'_>, place: Place, thing: Option<Thing>) -> String {
    let here = format::place(place.longitude_deg, place.latitude_deg);
    let at = |place: Place| format::place(place.longitude_deg, place.latitude_deg);
    match thing {
        Some(Thing::Satellite(index)) => world.satellites.get(index).map_or(here, |one| {
            format!("{} over {}", one.name, one.place.map_or(format::UNKNOWN.into(), at))
        }),
        Some(Thing::Station(index)) => {
            world.stations.get(index).map_or(here, |one| format!("{}, {}", one.name, at(one.place)))
        }
        Some(Thing::Receiver(index)) => world.receivers.get(index).map_or(here, |one| {
            let age = format::age(world.now.duration_since(one.last_heard));
            format!("{}, {}, heard it {age} ago", one.name, at(one.place))
        }),
        None => here,
    }
}

fn told(world: &World<'_>) -> String {
    let ours = world.satellites.iter().find(|satellite| satellite.is_ours);
    match ours.and_then(|ours| Some((ours.name, ours.place?))) {
        Some((name, place)) => {
            format!("World map: {name} over {}", format::place(place.longitude_deg, place.latitude_deg))
        }
        None => "World map".into(),
    }
}
