//! What comes down and what goes up: plots, chunks, commands, plans, frames, forecasts.

use egui::Ui;
use ui::Level;
use ui::bands::{Band, bands_ui};
use ui::chunk_grid::{Cell, ChunkGrid, chunk_grid_ui};
use ui::command::{Command, End, Lights, command_card_ui};
use ui::inspector::{Field, Inspector, inspector_ui};
use ui::plan_track::{Step, StepState, TrackCommand, plan_track_ui};
use ui::plot::{Curve, Limit, Series, View, plot_ui};
use ui::sparkline::sparkline_ui;

use crate::desk::{now, seconds};

/// Ten minutes of a value that swings, with a gap of a minute and a half.
fn series(middle: f64, swing: f64, turn_s: f64) -> Series {
    let mut series = Series::new(Some(seconds(20)));
    for second in (0..600).filter(|second| !(330..420).contains(second)) {
        let at = now() - seconds(600 - second);
        series.push(at, Some(middle + swing * (second as f64 / turn_s).sin()));
    }
    series
}

pub(crate) fn plot(ui: &mut Ui) {
    let (battery, temperature) = (series(7.9, 0.3, 47.0), series(12.0, 9.0, 130.0));
    let limits = [Limit { level: Level::Warning, low: f64::NEG_INFINITY, high: 7.7 }];
    let curves = [
        Curve { name: "Battery", unit: "V", series: &battery, limits: &limits, colour: None },
        Curve { name: "Temperature", unit: "°C", series: &temperature, limits: &[], colour: None },
    ];
    let mut view = View::following(seconds(660), now());
    view.set_cursor(Some(now() - seconds(120)));
    plot_ui(ui, "gallery", &curves, &mut view, now(), 236.0);
    ui.horizontal(|ui| {
        ui.label("Sparkline");
        sparkline_ui(ui, "Battery", &battery, seconds(600), now(), egui::vec2(140.0, 22.0));
    });
}

pub(crate) fn chunk_grid(ui: &mut Ui) {
    let mut grid = ChunkGrid::new(113);
    for chunk in 0..90 {
        let cell = match chunk {
            7 => Cell::Conflict,
            31 | 32 => Cell::Missing,
            33 => Cell::Bridge,
            60..=65 => Cell::Station,
            72.. => Cell::Asked,
            _ if chunk % 19 < 4 => Cell::Strangers,
            _ => Cell::Own,
        };
        grid.set(chunk, cell);
    }
    chunk_grid_ui(ui, &mut grid, 120.0, |_| String::new());
}

fn lights(reached: usize, end: Option<End>) -> Lights {
    let at = |index: usize| (index < reached).then(|| now() - seconds(40 - 9 * index as i64));
    Lights {
        reached: [0, 1, 2, 3].map(at),
        is_radiating: false,
        end: end.map(|end| (end, now() - seconds(3))),
    }
}

pub(crate) fn commands(ui: &mut Ui) {
    for (name, arguments, lights, why) in [
        ("GetImageChunks", "image=7 first=34 count=18", Lights { is_radiating: true, ..lights(2, None) }, ""),
        ("Ping", "", lights(4, None), ""),
        ("TakeImage", "camera=1", lights(4, Some(End::Rejected)), "The satellite answered: battery low."),
        ("SetMode", "mode=Nominal", lights(3, Some(End::Unknown)), "No answer within 30 s."),
    ] {
        let command = Command {
            name,
            arguments,
            who: "ada",
            lights,
            proof: None,
            why,
            attempt: 1,
            attempts_allowed: 3,
            next_at: None,
            expires_at: None,
            may_cancel: !lights.is_over(),
            may_repeat: lights.is_over(),
            is_selected: false,
        };
        command_card_ui(ui, &command, now());
    }
}

pub(crate) fn plan_track(ui: &mut Ui) {
    let at = |second: i64| now() + seconds(second);
    let step = |name, from: i64, to: i64, state| Step { name, from: at(from), to: at(to), state, note: "" };
    let steps = [
        step("Listen for the beacon", -200, -150, StepState::Done),
        step("Ask for telemetry", -150, -60, StepState::Failed),
        step("Fetch image 7", -60, 220, StepState::Running),
        step("Upload elements", 60, 160, StepState::Ahead),
    ];
    let mark = |name, second: i64, lights| TrackCommand { name, at: at(second), lights };
    let commands = [
        mark("GetTelemetry", -115, lights(3, Some(End::Unknown))),
        mark("GetImageChunks", -6, Lights { is_radiating: true, ..lights(2, None) }),
        mark("SetTle", 66, lights(1, None)),
    ];
    plan_track_ui(ui, &steps, &commands, (at(-210), at(300)), now());
}

pub(crate) fn inspector(ui: &mut Ui) {
    let bytes: Vec<u8> = (0..40_u8).map(|index| index.wrapping_mul(37)).collect();
    let field = |name, value, unit, start_bit, bits, depth| Field {
        name,
        value,
        unit,
        start_bit,
        bits,
        depth,
        level: None,
    };
    let fields = [
        field("Header", "", "", 0, 32, 0),
        field("Type", "heartbeat", "", 3, 5, 1),
        field("Counter", "1842", "", 8, 24, 1),
        Field { level: Some(Level::Warning), ..field("Battery", "7.62", "V", 32, 16, 0) },
        field("CRC-32", "1cdf4421", "", 288, 32, 0),
    ];
    inspector_ui(ui, &mut Inspector { selected: Some(2), hovered: None }, &bytes, &fields);
}

pub(crate) fn bands(ui: &mut Ui) {
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
        band("Battery at LOS", "V", 7.41, 7.58, 7.66, (6.4, 8.4), Some(7.2), 2),
        band("Time on the air", "s", 11.2, 14.0, 19.5, (0.0, 30.0), None, 1),
    ];
    bands_ui(ui, &bands);
}
