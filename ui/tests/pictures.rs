//! What is painted, by software Vulkan or OpenGL: the land of the map by its pixels, and a few small pictures.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use egui::Color32;
use egui_kittest::{Harness, SnapshotOptions, kittest::Queryable as _};
use image::RgbaImage;
use ui::geo::Place;
use ui::lamps::{self, Link, Transmitter};
use ui::map::{World, WorldMap};
use ui::map_base::{Projection, View};
use ui::{Level, Mode, Theme};

const SIZE: [f32; 2] = [720.0, 360.0];

fn now() -> jiff::Timestamp {
    "2026-11-22T14:03:07Z".parse().unwrap()
}

/// The widget alone, without margins.
fn draw<'a>(size: [f32; 2], mode: Mode, mut paint: impl FnMut(&mut egui::Ui) + 'a) -> Harness<'a> {
    let mut is_installed = false;
    let mut harness = Harness::builder().with_size(size).wgpu().build_ui(move |ui| {
        if is_installed {
            let all = ui.max_rect();
            ui.painter().rect_filled(all.expand(20.0), 0.0, Theme::current(ui).panel);
            paint(ui);
        } else {
            is_installed = true;
            ui::install(ui.ctx(), mode);
        }
    });
    harness.run_steps(4);
    harness
}

fn world(view: View, subsolar: Option<Place>, mode: Mode) -> (RgbaImage, egui::Rect) {
    let mut map = WorldMap::new(view);
    let mut harness = draw(SIZE, mode, move |ui| {
        let world = World { now: now(), subsolar, satellites: &[], stations: &[], receivers: &[] };
        map.show(ui, SIZE[1], &world);
    });
    let rect = harness.get_by_label("World map").rect();
    (harness.render().unwrap(), rect)
}

fn colour(picture: &RgbaImage, rect: egui::Rect, view: View, place: Place) -> Color32 {
    let at = Projection::new(rect, view).at(place);
    let [r, g, b, _] = picture.get_pixel(at.x as u32, at.y as u32).0;
    Color32::from_rgb(r, g, b)
}

fn is_near(a: Color32, b: Color32) -> bool {
    a.to_array().iter().zip(b.to_array()).all(|(a, b)| a.abs_diff(b) <= 2)
}

#[test]
fn on_the_map_the_atlantic_is_sea_and_the_poles_are_right() {
    // In light also from the other side, where the map's edge lies in the Atlantic
    for (mode, centre) in [(Mode::Dark, 0.0), (Mode::Light, 140.0)] {
        let theme = Theme::of(mode);
        let view = View { centre: Place::new(centre, 0.0), zoom: 1.0 };
        let (picture, rect) = world(view, None, mode);
        assert!(rect.width() > 600.0, "{rect:?}");
        for (x, y, wanted, name) in [
            (-40.0, 45.0, theme.sea, "mid-Atlantic"),
            (20.0, 88.0, theme.sea, "Arctic sea"),
            (-155.0, 88.0, theme.sea, "Arctic sea"),
            (20.0, -88.0, theme.land, "Antarctica"),
            (-155.0, -88.0, theme.land, "Antarctica"),
            (10.0, 24.0, theme.land, "Sahara"),
            (100.0, 55.0, theme.land, "Siberia"),
            (177.0, 66.5, theme.land, "Chukotka"),
            (-140.0, 20.0, theme.sea, "Pacific"),
        ] {
            let found = colour(&picture, rect, view, Place::new(x, y));
            assert!(is_near(found, wanted), "{name} from {centre} in {mode:?}: {found:?}, not {wanted:?}");
        }
    }
}

#[test]
fn close_up_the_fine_land_is_where_the_view_looks() {
    let view = View { centre: Place::new(10.0, 45.0), zoom: 12.0 };
    let (picture, rect) = world(view, None, Mode::Dark);
    let theme = Theme::of(Mode::Dark);
    assert!(is_near(colour(&picture, rect, view, Place::new(6.57, 46.52)), theme.land));
    assert!(is_near(colour(&picture, rect, view, Place::new(7.0, 40.5)), theme.sea), "Mediterranean");
}

#[test]
fn night_is_where_the_sun_is_not() {
    let view = View::default();
    let (picture, rect) = world(view, Some(Place::new(0.0, 0.0)), Mode::Light);
    let theme = Theme::of(Mode::Light);
    let day = colour(&picture, rect, view, Place::new(-25.0, 5.0));
    let night = colour(&picture, rect, view, Place::new(-155.0, 5.0));
    assert!(is_near(day, theme.sea), "{day:?}");
    assert!(!is_near(night, theme.sea) && night.r() < day.r(), "{night:?}");
}

/// A snapshot hangs on the version of the software renderer: few and small.
#[test]
fn lamps_look_as_they_did() {
    let mut all = egui_kittest::SnapshotResults::new();
    for (mode, name) in [(Mode::Dark, "lamps-dark"), (Mode::Light, "lamps-light")] {
        let mut harness = draw([430.0, 170.0], mode, |ui| {
            ui.horizontal(|ui| {
                lamps::transmitter_lamp(ui, Transmitter::Safe);
                lamps::transmitter_lamp(ui, Transmitter::Armed);
                lamps::transmitter_lamp(ui, Transmitter::OnAir);
            });
            lamps::link_lamp(ui, "Radio", Link::Ok, Some(jiff::SignedDuration::from_secs(4)));
            ui.horizontal(|ui| {
                for level in [Level::Watch, Level::Distress, Level::Severe] {
                    ui::level::mark(ui, level);
                }
            });
            lamps::alarm_counts(ui, [2, 1, 0, 1, 0]);
        });
        harness.snapshot_options(name, &SnapshotOptions::new().threshold(1.5).max_failed_pixels(60));
        all.extend_harness(&mut harness);
    }
}
