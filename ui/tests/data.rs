//! Widgets of data, drawn in both themes and worked with by pointer and keys. With `UI_LOOK=DIR` each is also written
//! there as a PNG, to be looked at.

#![expect(clippy::expect_used, reason = "a test that cannot write its picture fails")]

use egui::{Ui, vec2};
use egui_kittest::{
    Harness, SnapshotResults,
    kittest::{NodeT as _, Queryable as _},
};
use jiff::{SignedDuration, Timestamp};
use ui::attitude::{Attitude, Standpoint, attitude_ui};
use ui::bands::{Band, bands_ui};
use ui::chunk_grid::{Cell, ChunkGrid, chunk_grid_ui};
use ui::command::{CardAction, Command, End, Lights, command_card_ui};
use ui::inspector::{Field, Inspector, inspector_ui};
use ui::mode_chart::{ModeChart, Transition, mode_chart_ui};
use ui::picture::{Picture, picture_ui};
use ui::plan_track::{Step, StepState, TrackCommand, plan_track_ui};
use ui::plot::{Curve, Limit, Series, View, plot_ui};
use ui::{Level, Mode};

fn now() -> Timestamp {
    "2026-11-22T00:07:30Z".parse().expect("a time")
}

fn before(seconds: f64) -> Timestamp {
    now() - SignedDuration::from_millis((seconds * 1e3) as i64)
}

fn harness<'a>(mode: Mode, size: [f32; 2], mut draw: impl FnMut(&mut Ui) + 'a) -> Harness<'a> {
    let mut is_set_up = false;
    Harness::builder().with_size(size).with_pixels_per_point(1.0).wgpu().build_ui(move |ui| {
        if !is_set_up {
            ui::install(ui.ctx(), mode);
            is_set_up = true;
            return;
        }
        let theme = ui::Theme::of(mode);
        egui::Frame::NONE.fill(theme.panel).inner_margin(12.0).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            draw(ui);
        });
    })
}

/// Draws something in both themes, looks at it where asked to, and compares it where it is small.
fn picture(name: &str, size: [f32; 2], is_compared: bool, mut draw: impl FnMut(&mut Ui)) {
    let mut results = SnapshotResults::new();
    for (mode, word) in [(Mode::Dark, "dark"), (Mode::Light, "light")] {
        let mut harness = harness(mode, size, &mut draw);
        harness.run_steps(4);
        if let Ok(folder) = std::env::var("UI_LOOK") {
            let file = std::path::Path::new(&folder).join(format!("{name}-{word}.png"));
            harness.render().expect("a picture").save(file).expect("a file");
        }
        if is_compared {
            harness.snapshot(format!("{name}-{word}"));
            results.extend_harness(&mut harness);
        }
    }
}

/// Ten minutes before now: a battery, its temperature with a gap and invalid samples, and a current.
fn telemetry() -> [Series; 3] {
    let mut all = [(); 3].map(|()| Series::new(Some(SignedDuration::from_secs(20))));
    for index in 0..1_200 {
        let age_s = 600.0 - f64::from(index) / 2.0;
        let wave = (age_s / 47.0).sin();
        let noise = (f64::from(index) * 12.9898).sin() * 43_758.545 % 1.0;
        all[0].push(before(age_s), Some(7.9 + 0.25 * wave + 0.03 * noise));
        if !(250.0..310.0).contains(&age_s) && index % 4 == 0 {
            let value = Some(12.0 + 9.0 * (age_s / 130.0).cos()).filter(|_| !(100.0..112.0).contains(&age_s));
            all[1].push(before(age_s), value);
        }
        all[2].push(before(age_s), Some(0.41 + 0.2 * (age_s / 90.0).sin().signum() + 0.05 * noise));
    }
    all
}

#[test]
fn plot_looks_as_before() {
    let [battery, temperature, current] = telemetry();
    let limits = [
        Limit { level: Level::Warning, low: f64::NEG_INFINITY, high: 7.7 },
        Limit { level: Level::Critical, low: 8.15, high: f64::INFINITY },
    ];
    let mut view = View::following(SignedDuration::from_secs(660), now());
    view.set_cursor(Some(before(180.0)));
    picture("plot", [720.0, 260.0], true, |ui| {
        let curves = [
            Curve { name: "Battery", unit: "V", series: &battery, limits: &limits, colour: None },
            Curve { name: "Temperature", unit: "°C", series: &temperature, limits: &[], colour: None },
            Curve { name: "Current", unit: "A", series: &current, limits: &[], colour: None },
        ];
        plot_ui(ui, "one", &curves, &mut view, now(), 236.0);
    });
}

#[test]
fn few_samples_have_markers_and_none_say_so() {
    let mut few = Series::new(None);
    few.extend((0..12).map(|index| (before(f64::from(index) * 40.0), Some(f64::from(index * index % 7)))));
    let none = Series::new(None);
    let mut view = View::following(SignedDuration::from_secs(600), now());
    picture("plot-few", [720.0, 320.0], false, |ui| {
        let curve = Curve { name: "Resets", unit: "", series: &few, limits: &[], colour: None };
        plot_ui(ui, "few", &[curve], &mut view, now(), 150.0);
        let curve = Curve { name: "Nothing", unit: "mA", series: &none, limits: &[], colour: None };
        plot_ui(ui, "none", &[curve], &mut view, now(), 140.0);
    });
}

#[test]
fn plots_that_share_a_view_move_and_read_together() {
    let [battery, _, current] = telemetry();
    let mut view = View::following(SignedDuration::from_secs(600), now());
    let mut harness = harness(Mode::Dark, [600.0, 400.0], |ui| {
        for (name, series) in [("Battery", &battery), ("Current", &current)] {
            let curve = Curve { name, unit: "V", series, limits: &[], colour: None };
            plot_ui(ui, name, &[curve], &mut view, now(), 180.0);
        }
    });
    harness.run_steps(3);
    assert_eq!(harness.query_all_by_label_contains("Plot: ").count(), 2);
    let at = harness.get_by_label_contains("Plot: Battery").rect().center();
    harness.hover_at(at);
    harness.run_steps(3);
    // Both plots speak of the moment under the pointer.
    let reading = |name: &str| harness.get_by_label_contains(name).accesskit_node().label().unwrap();
    let (battery_now, current_now) = (reading("Plot: Battery"), reading("Plot: Current"));
    harness.hover_at(at - vec2(80.0, 0.0));
    harness.run_steps(3);
    let reading = |name: &str| harness.get_by_label_contains(name).accesskit_node().label().unwrap();
    assert_ne!(reading("Plot: Battery"), battery_now);
    assert_ne!(reading("Plot: Current"), current_now);
    harness.drag_at(at);
    harness.run_steps(1);
    harness.hover_at(at + vec2(100.0, 0.0));
    harness.run_steps(1);
    harness.drop_at(at + vec2(100.0, 0.0));
    harness.run_steps(3);
    drop(harness);
    assert!(!view.is_following() && view.to() < now());
}

/// A picture of 113 chunks as it comes down.
fn grid() -> ChunkGrid {
    let mut grid = ChunkGrid::new(113);
    for chunk in 0..72 {
        grid.set(chunk, if chunk % 19 < 4 { Cell::Strangers } else { Cell::Own });
    }
    for (chunk, cell) in [(7, Cell::Conflict), (31, Cell::Missing), (32, Cell::Missing), (33, Cell::Bridge)] {
        grid.set(chunk, cell);
    }
    for chunk in 34..36 {
        grid.set(chunk, Cell::Asked);
    }
    for chunk in 60..66 {
        grid.set(chunk, Cell::Station);
    }
    for chunk in 72..90 {
        grid.set(chunk, Cell::Asked);
    }
    grid
}

#[test]
fn chunk_grid_looks_as_before() {
    let mut grid = grid();
    picture("chunk-grid", [400.0, 190.0], true, |ui| {
        chunk_grid_ui(ui, &mut grid, 120.0, |_| String::new());
    });
    let mut large = ChunkGrid::new(65_536);
    for chunk in 0..65_536 {
        let at = (chunk * 7_919) % 65_536;
        large.set(at, Cell::ALL[(chunk / 9_000) % 7]);
    }
    picture("chunk-grid-large", [720.0, 560.0], false, |ui| {
        egui::ScrollArea::vertical().show(ui, |ui| chunk_grid_ui(ui, &mut large, 480.0, |_| String::new()));
    });
}

#[test]
fn dragging_over_chunks_chooses_them() {
    let mut grid = grid();
    let mut clicked = None;
    let mut harness = harness(Mode::Dark, [400.0, 200.0], |ui| {
        let shown = chunk_grid_ui(ui, &mut grid, 120.0, |_| "heard by us".to_owned());
        clicked = shown.clicked.or(clicked);
    });
    harness.run_steps(3);
    let rect = harness.get_by_label("Chunks: 68 of 113 here, 1 in conflict").rect();
    let cell = |column: f32, row: f32| rect.min + vec2(32.0 + 14.0 * column + 7.0, 14.0 * row + 7.0);
    harness.drag_at(cell(3.0, 0.0));
    harness.run_steps(1);
    harness.hover_at(cell(8.0, 0.0));
    harness.run_steps(2);
    harness.drop_at(cell(8.0, 0.0));
    harness.run_steps(2);
    harness.hover_at(cell(9.0, 0.0));
    harness.run_steps(8);
    assert!(harness.query_by_label_contains("heard by us").is_some());
    drop(harness);
    assert_eq!(grid.selected(), Some(3..=8));
}

fn lights(reached: usize, end: Option<End>) -> Lights {
    let at = |index: usize| (index < reached).then(|| before(40.0 - 9.0 * index as f64));
    Lights { reached: [0, 1, 2, 3].map(at), is_radiating: false, end: end.map(|end| (end, before(3.0))) }
}

fn command<'a>(name: &'a str, arguments: &'a str, lights: Lights) -> Command<'a> {
    Command {
        name,
        arguments,
        who: "kaisa",
        lights,
        proof: None,
        why: "",
        attempt: 1,
        attempts_allowed: 3,
        next_at: None,
        expires_at: None,
        may_cancel: !lights.is_over(),
        may_repeat: lights.is_over(),
        is_selected: false,
    }
}

#[test]
fn command_cards_can_be_drawn_in_every_stage() {
    let radiating = Lights { is_radiating: true, ..lights(2, None) };
    let later = now() + SignedDuration::from_secs(250);
    let cards = [
        Command {
            expires_at: Some(later),
            ..command("SetTimestamp", "time=2026-11-22T00:08:00Z", lights(1, None))
        },
        Command { is_selected: true, ..command("GetImageChunks", "image=7 first=34 count=18", radiating) },
        Command { proof: Some(4711), ..command("Ping", "", lights(4, None)) },
        Command {
            proof: Some(4713),
            why: "The satellite answered: battery low.",
            ..command("TakeImage", "camera=1 exposure_ms=40", lights(4, Some(End::Rejected)))
        },
        Command {
            why: "No answer within 30 s; telemetry may settle it.",
            ..command("SetMode", "mode=Nominal", lights(3, Some(End::Unknown)))
        },
        command("SetTle", "(69 bytes)", lights(1, Some(End::Expired))),
        command("UploadSchedule", "schedule=night entries=14", lights(2, Some(End::Cancelled))),
    ];
    picture("command-cards", [420.0, 800.0], false, |ui| {
        for card in &cards {
            command_card_ui(ui, card, now());
        }
    });
}

#[test]
fn a_card_tells_what_was_clicked_and_does_nothing_itself() {
    let card = Command { proof: Some(12), ..command("Ping", "", lights(1, None)) };
    let mut actions = Vec::new();
    let mut harness =
        harness(Mode::Dark, [420.0, 140.0], |ui| actions.extend(command_card_ui(ui, &card, now())));
    harness.run_steps(3);
    for label in ["Withdraw this command", "frame 12", "Ping : queued"] {
        harness.get_by_label(label).click();
        harness.run_steps(3);
    }
    harness.key_press(egui::Key::Escape);
    harness.run_steps(2);
    drop(harness);
    assert_eq!(actions, [CardAction::Cancel, CardAction::ShowProof(12), CardAction::Select]);
}

#[test]
fn plan_track_looks_as_before() {
    let at = |second: i64| now() + SignedDuration::from_secs(second);
    let step = |name, from: i64, to: i64, state| Step { name, from: at(from), to: at(to), state, note: "" };
    let steps = [
        step("Listen for the beacon", -200, -150, StepState::Done),
        step("Set the clock", -150, -120, StepState::Done),
        step("Ask for telemetry", -120, -60, StepState::Failed),
        step("Fetch image 7", -60, 220, StepState::Running),
        step("Upload elements", 60, 160, StepState::Ahead),
        step("Quiet", 220, 260, StepState::Ahead),
        step("x", 262, 270, StepState::Skipped),
    ];
    let mark = |name, second: i64, lights| TrackCommand { name, at: at(second), lights };
    let commands = [
        mark("SetTimestamp", -140, lights(4, None)),
        mark("GetTelemetry", -115, lights(3, Some(End::Unknown))),
        mark("GetTelemetry", -85, lights(4, Some(End::Rejected))),
        mark("GetImageChunks", -52, lights(4, None)),
        mark("GetImageChunks", -6, Lights { is_radiating: true, ..lights(2, None) }),
        mark("SetTle", 66, lights(1, None)),
    ];
    picture("plan-track", [720.0, 220.0], true, |ui| {
        plan_track_ui(ui, &steps, &commands, (at(-210), at(300)), now());
    });
}

fn heartbeat() -> (Vec<u8>, Vec<Field<'static>>) {
    let bytes = (0..58_u8)
        .map(|index| if index < 6 { b"PXSAT1"[index as usize] } else { index.wrapping_mul(37) })
        .collect();
    let field = |name, value, unit, start_bit, bits, depth| Field {
        name,
        value,
        unit,
        start_bit,
        bits,
        depth,
        level: None,
    };
    let fields = vec![
        field("Call sign", "PXSAT1", "", 0, 48, 0),
        field("Header", "", "", 48, 32, 0),
        field("Version", "2", "", 48, 3, 1),
        field("Type", "heartbeat", "", 51, 5, 1),
        field("Counter", "1842", "", 56, 24, 1),
        Field { level: Some(Level::Warning), ..field("Battery", "7.62", "V", 80, 16, 0) },
        field("Temperature", "−4.5", "°C", 96, 16, 0),
        field("Mode", "Nominal", "", 112, 8, 0),
        field("Uptime", "183 204", "s", 120, 32, 0),
        field("CRC-32", "1cdf4421", "", 432, 32, 0),
    ];
    (bytes, fields)
}

#[test]
fn inspector_looks_as_before() {
    let (bytes, fields) = heartbeat();
    let mut state = Inspector { selected: Some(4), ..Inspector::default() };
    picture("inspector", [860.0, 300.0], true, |ui| inspector_ui(ui, &mut state, &bytes, &fields));
    picture("inspector-narrow", [420.0, 500.0], false, |ui| inspector_ui(ui, &mut state, &bytes, &fields));
}

#[test]
fn pointing_at_a_field_and_clicking_it_chooses_it_and_its_value_can_be_copied() {
    let (bytes, fields) = heartbeat();
    let mut state = Inspector::default();
    let mut harness = harness(Mode::Dark, [860.0, 300.0], |ui| inspector_ui(ui, &mut state, &bytes, &fields));
    harness.run_steps(3);
    harness.get_by_label("Battery 7.62 V").hover();
    harness.run_steps(3);
    assert!(harness.query_by_label("58 bytes, Battery").is_some(), "the bytes of the field are lit");
    harness.get_by_label("Battery 7.62 V").click();
    harness.run_steps(3);
    harness.get_by_label("Copy value").click();
    let mut was_copied = false;
    for _ in 0..4 {
        harness.run_steps(1);
        was_copied |= harness
            .output()
            .platform_output
            .commands
            .iter()
            .any(|command| matches!(command, egui::OutputCommand::CopyText(text) if text == "7.62"));
    }
    assert!(was_copied);
    drop(harness);
    assert_eq!(state.selected, Some(5));
}

#[test]
fn bands_look_as_before() {
    let band = |name, unit, p5, p50, p95, scale, goal, decimals| Band {
        name,
        unit,
        p5,
        p50,
        p95,
        scale,
        goal,
        actual: None,
        decimals,
    };
    let bands = [
        band("Chunks of image 7", "", 61.0, 78.0, 92.0, (0.0, 113.0), Some(113.0), 0),
        Band { actual: Some(9.0), ..band("Commands answered", "", 7.0, 9.0, 9.0, (0.0, 9.0), Some(9.0), 0) },
        band("Battery at LOS", "V", 7.41, 7.58, 7.66, (6.4, 8.4), Some(7.2), 2),
        band("Time on the air", "s", 11.2, 14.0, 19.5, (0.0, 30.0), None, 1),
        band("Signal at TCA", "dB", f64::NAN, f64::NAN, f64::NAN, (-20.0, 10.0), None, 1),
    ];
    picture("bands", [620.0, 180.0], true, |ui| {
        bands_ui(ui, &bands);
    });
}

#[test]
fn attitude_looks_as_before() {
    let known = Attitude {
        body_to_reference: Some([0.8, 0.3, -0.35, 0.55]),
        sun: Some([0.6, 0.7, 0.35]),
        field: Some([-0.5, 0.6, 0.5]),
        nadir: Some([-0.2, -0.6, -0.75]),
        camera_body: [1.0, 0.0, 0.0],
        antenna_body: [0.0, 0.0, -1.0],
        is_eclipsed: false,
    };
    picture("attitude", [300.0, 320.0], true, |ui| {
        attitude_ui(ui, &known, &mut Standpoint::default(), vec2(276.0, 296.0));
    });
    let unknown = Attitude { body_to_reference: None, field: None, is_eclipsed: true, ..known };
    picture("attitude-unknown", [300.0, 320.0], false, |ui| {
        attitude_ui(ui, &unknown, &mut Standpoint::default(), vec2(276.0, 296.0));
    });
}

#[test]
fn mode_chart_looks_as_before() {
    let modes = ["Start", "Deploy", "Detumble", "Nominal", "Imaging", "Downlink", "Safe", "Low power"];
    let ways = [
        (0, 1, "separated"),
        (1, 2, "deployed"),
        (2, 3, "rates below 1 °/s"),
        (3, 4, "TakeImage"),
        (4, 3, "taken"),
        (3, 5, "pass begins"),
        (5, 3, "pass ends"),
        (3, 6, "fault"),
        (4, 6, "fault"),
        (6, 3, "SetMode"),
        (3, 7, "battery below 7.2 V"),
        (7, 3, "battery above 7.6 V"),
        (2, 6, "fault"),
    ];
    let transitions = ways.map(|(from, to, name)| Transition { from, to, name });
    let chart = ModeChart {
        modes: &modes,
        transitions: &transitions,
        current: Some(5),
        since: Some(before(140.0)),
        taken: &[(3, 5, before(140.0)), (4, 3, before(2_500.0)), (3, 4, before(2_530.0))],
    };
    let mut clicked = None;
    picture("mode-chart", [720.0, 220.0], true, |ui| {
        mode_chart_ui(ui, &chart, 196.0, now());
    });
    let mut harness = harness(Mode::Dark, [720.0, 220.0], |ui| {
        clicked = mode_chart_ui(ui, &chart, 196.0, now()).or(clicked)
    });
    harness.run_steps(3);
    assert!(harness.query_by_label("Mode Downlink, current").is_some());
    harness.get_by_label("Mode Safe").click();
    harness.run_steps(2);
    drop(harness);
    assert_eq!(clicked, Some(6));
}

#[test]
fn picture_grows_and_what_is_missing_is_hatched() {
    let (width, height) = (320_usize, 240_usize);
    let mut rgba = Vec::new();
    for index in 0..width * height {
        let (x, y) = (index % width, index / width);
        let is_here = y < 120 || (y < 128 && x < 208);
        let sea = [30 + (y / 4) as u8, 70 + (x / 8) as u8, 120, if is_here { 255 } else { 0 }];
        rgba.extend(sea);
    }
    let mut shown = Picture::default();
    shown.set_rgba([width, height], &rgba).expect("a picture");
    picture("picture", [400.0, 300.0], true, |ui| {
        // Each theme is drawn by a context of its own, so the pixels are handed over again.
        shown = Picture::default();
        shown.set_rgba([width, height], &rgba).expect("a picture");
        picture_ui(ui, &mut shown, "7", vec2(376.0, 276.0));
    });
    let mut harness = harness(Mode::Dark, [400.0, 300.0], |ui| {
        picture_ui(ui, &mut shown, "7", vec2(376.0, 276.0));
    });
    harness.run_steps(2);
    assert!(harness.query_by_label("Picture 7, 52 % there").is_some());
}
