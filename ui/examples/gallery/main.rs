//! Draws every widget in both themes as a picture: `cargo run -p ui --example gallery -- DIR [NAME...]`.
//!
//! The pictures are for eyes: they are looked at when a widget changes. Without a display it draws by software Vulkan
//! (scripts/setup.sh installs it).

mod data;
mod desk;
mod earth;
mod time;

use std::path::Path;
use std::process::ExitCode;

use egui_kittest::Harness;
use ui::Mode;

/// A widget in a picture: its name, the picture's size, and how it is drawn.
type Exhibit = (&'static str, [f32; 2], fn(&mut egui::Ui));

const EXHIBITS: &[Exhibit] = &[
    ("top-bar", [1280.0, 120.0], desk::top_bar),
    ("lamps", [760.0, 300.0], desk::lamps),
    ("hold", [520.0, 120.0], desk::hold),
    ("alarms", [760.0, 260.0], desk::alarms),
    ("sky", [440.0, 440.0], earth::sky),
    ("sky-north", [440.0, 440.0], earth::sky_over_north),
    ("map", [1000.0, 520.0], earth::map),
    ("values", [560.0, 240.0], desk::values),
    ("timeline-days", [1200.0, 220.0], time::days),
    ("timeline-pass", [1200.0, 220.0], time::one_pass),
    ("plot", [760.0, 300.0], data::plot),
    ("chunk-grid", [420.0, 200.0], data::chunk_grid),
    ("commands", [440.0, 500.0], data::commands),
    ("plan-track", [760.0, 200.0], data::plan_track),
    ("inspector", [860.0, 240.0], data::inspector),
    ("bands", [640.0, 140.0], data::bands),
    ("map-near", [1000.0, 520.0], earth::map_near),
];

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let Some(folder) = arguments.next() else {
        eprintln!(
            "gallery: name the folder for the pictures: cargo run -p ui --example gallery -- DIR [NAME...]"
        );
        return ExitCode::from(2);
    };
    let wanted: Vec<String> = arguments.collect();
    if let Err(error) = std::fs::create_dir_all(&folder) {
        eprintln!("gallery: {folder}: {error}");
        return ExitCode::FAILURE;
    }
    let mut failed = false;
    for (name, size, draw) in EXHIBITS {
        if !wanted.is_empty() && !wanted.iter().any(|wanted| wanted == name) {
            continue;
        }
        for mode in [Mode::Dark, Mode::Light] {
            let file = Path::new(&folder)
                .join(format!("{name}-{}.png", if mode == Mode::Dark { "dark" } else { "light" }));
            if let Err(error) = picture(*size, mode, *draw, &file) {
                eprintln!("gallery: {}: {error}", file.display());
                failed = true;
            }
        }
    }
    if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

fn picture(size: [f32; 2], mode: Mode, draw: fn(&mut egui::Ui), file: &Path) -> Result<(), String> {
    let mut installed = false;
    let mut harness =
        Harness::builder().with_size(size).with_pixels_per_point(1.5).wgpu().build_ui(move |ui| {
            if !installed {
                installed = true;
                ui::install(ui.ctx(), mode);
                return;
            }
            egui::Frame::new().fill(ui::Theme::current(ui).panel).inner_margin(12).show(ui, |ui| {
                ui.set_min_size(ui.available_size());
                draw(ui);
            });
        });
    harness.run_steps(5);
    harness.render()?.save(file).map_err(|error| error.to_string())
}
