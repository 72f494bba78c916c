//! The frame of the window: line, layouts, theme, palette, keys.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use ground_app::desk::Layout;
use ground_app::panes::Pane;

use crate::common::{Seat, SeatOptions};

#[test]
fn it_connects_and_keys_show_layouts_theme_palette_and_the_list_of_keys() {
    let mut seat = Seat::take();
    assert_eq!(seat.failures(), [""; 0], "no question of ours is refused");
    assert!(seat.model().version.value().is_some_and(|version| version.simulated));
    for layout in
        [Layout::Plan, Layout::Satellite, Layout::Images, Layout::Archive, Layout::Health, Layout::Pass]
    {
        seat.layout(layout);
        // Each name once on the screen, and nothing without a name that hands can use
        seat.harness.run_ok();
        assert!(seat.has(layout.name()), "{layout:?}");
    }

    seat.click("Satellite");
    assert_eq!(seat.harness.state().desk().layout, Layout::Satellite);
    seat.layout(Layout::Pass);

    seat.press_with(Modifiers::COMMAND, Key::T);
    assert_eq!(seat.harness.state().desk().theme, ui::Mode::Light);
    assert!(!seat.harness.ctx.global_style().visuals.dark_mode);
    seat.press_with(Modifiers::COMMAND, Key::Plus);
    assert!((seat.harness.ctx.zoom_factor() - 1.1).abs() < 1e-3);
    seat.press_with(Modifiers::COMMAND, Key::Num0);
    assert!((seat.harness.ctx.zoom_factor() - 1.0).abs() < 1e-3);

    seat.press(Key::Questionmark);
    assert!(seat.has("Layout Archive"), "the list of keys");
    seat.press(Key::Escape);
    assert!(!seat.has("Layout Archive"));

    seat.press_with(Modifiers::COMMAND, Key::K);
    seat.type_into("Find", "who hears");
    assert_eq!(seat.harness.state().desk().layout, Layout::Pass, "keys that are typed do nothing else");
    seat.press(Key::Enter);
    assert_eq!(seat.harness.state().desk().layout, Layout::Health, "it has the pane");

    seat.press(Key::A);
    assert!(shown(&seat).contains(&Pane::Alarms));
}

#[test]
fn the_bars_tell_what_must_never_be_out_of_sight_at_any_width() {
    for size in [[1280.0, 800.0], [800.0, 600.0], [3840.0, 2160.0]] {
        let mut seat = Seat::take_with(SeatOptions { size, draws: true, ..SeatOptions::default() });
        seat.until_in_pass();
        for part in
            ["UTC clock", "LOS −", "Transmitter ", "0 severe", "Cease transmission", "SIMULATED", "local"]
        {
            assert!(seat.shows(part), "{part} at {size:?}: {:?}", seat.labels());
        }
        let button = seat.harness.get_by_label("Cease transmission").rect();
        assert!(button.right() <= size[0] && button.bottom() <= 160.0, "{button:?} at {size:?}");
        seat.picture(&format!("bars-{}", size[0]));
    }
}

fn shown(seat: &Seat) -> Vec<Pane> {
    let mut desk = seat.harness.state().desk().clone();
    let tree = desk.take_tree();
    let active = tree.active_tiles();
    active.iter().filter_map(|id| tree.tiles.get_pane(id)).copied().collect()
}
