//! What a frame costs with twenty plots of 100,000 samples while samples go on arriving, against the same samples
//! drawn singly. Layout, shapes and triangles are counted; the graphics card is not.

use divan::{Bencher, black_box};
use egui::{Context, RawInput, Rect, pos2, vec2};
use egui_plot::{Line, Plot, PlotPoint, PlotPoints};
use jiff::{SignedDuration, Timestamp};
use ui::Mode;
use ui::chunk_grid::{Cell, ChunkGrid, chunk_grid_ui};
use ui::plot::{Curve, Series, View, plot_ui};

const PLOTS: usize = 20;
const SAMPLES: i64 = 100_000;
/// Samples that arrive for each plot in a frame at 60 frames a second: 300 a second.
const ARRIVING: i64 = 5;
const STEP_MS: i64 = 3;

fn main() {
    divan::main();
}

fn at(index: i64) -> Timestamp {
    Timestamp::UNIX_EPOCH + SignedDuration::from_millis(1_795_000_000_000 + index * STEP_MS)
}

fn value(index: i64) -> f64 {
    let x = index as f64;
    7.8 + 0.3 * (x / 9_000.0).sin() + 0.05 * ((x * 12.9898).sin() * 43_758.545).fract()
}

fn context() -> Context {
    let context = Context::default();
    ui::install(&context, Mode::Dark);
    context
}

/// One frame of an interface of 1280 × 800 points, with its triangles.
fn frame(context: &Context, draw: &mut dyn FnMut(&mut egui::Ui)) -> usize {
    let input = RawInput {
        screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), vec2(1280.0, 800.0))),
        ..RawInput::default()
    };
    let mut output = context.run_ui(input, |ui| draw(ui));
    output.textures_delta.clear();
    context.tessellate(output.shapes, output.pixels_per_point).len()
}

/// Four columns of five plots.
fn wall(ui: &mut egui::Ui, mut one: impl FnMut(&mut egui::Ui, usize)) {
    ui.columns(4, |columns| {
        for (column, ui) in columns.iter_mut().enumerate() {
            for row in 0..PLOTS / 4 {
                one(ui, column * PLOTS / 4 + row);
            }
        }
    });
}

/// Twenty plots that follow the clock, all samples in sight.
#[divan::bench(sample_count = 60)]
fn twenty_plots(bencher: Bencher<'_, '_>) {
    let context = context();
    let mut series: Vec<Series> = (0..PLOTS)
        .map(|_| {
            let mut series = Series::new(Some(SignedDuration::from_secs(1)));
            series.extend((0..SAMPLES).map(|index| (at(index), Some(value(index)))));
            series
        })
        .collect();
    let mut view = View::following(SignedDuration::from_millis(SAMPLES * STEP_MS), at(SAMPLES));
    let mut next = SAMPLES;
    bencher.bench_local(|| {
        for series in &mut series {
            series.extend((next..next + ARRIVING).map(|index| (at(index), Some(value(index)))));
            series.trim_before(at(next - SAMPLES));
        }
        next += ARRIVING;
        black_box(frame(&context, &mut |ui| {
            wall(ui, |ui, plot| {
                let curve =
                    Curve { name: "Battery", unit: "V", series: &series[plot], limits: &[], colour: None };
                plot_ui(ui, plot, &[curve], &mut view, at(next), 150.0);
            });
        }))
    });
}

/// The same with every sample handed to the plot.
#[divan::bench(sample_count = 10)]
fn twenty_plots_unthinned(bencher: Bencher<'_, '_>) {
    let context = context();
    let points: Vec<PlotPoint> =
        (0..SAMPLES).map(|index| PlotPoint::new((index * STEP_MS) as f64 / 1e3, value(index))).collect();
    bencher.bench_local(|| {
        black_box(frame(&context, &mut |ui| {
            wall(ui, |ui, plot| {
                Plot::new(plot).height(150.0).show(ui, |ui| {
                    ui.line(Line::new("Battery", PlotPoints::Borrowed(&points)).width(1.5).allow_band(false));
                });
            });
        }))
    });
}

/// A picture of 65,536 chunks, of which one changes in each frame.
#[divan::bench(sample_count = 60)]
fn largest_grid(bencher: Bencher<'_, '_>) {
    let context = context();
    let mut grid = ChunkGrid::new(65_536);
    let mut next = 0;
    bencher.bench_local(|| {
        grid.set(next, Cell::Own);
        next = (next + 1) % 65_536;
        black_box(frame(&context, &mut |ui| {
            chunk_grid_ui(ui, &mut grid, 500.0, |_| String::new());
        }))
    });
}
