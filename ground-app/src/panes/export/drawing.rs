//! A plot as a picture for papers and reports: PNG or SVG, dark on white.

use std::io::Cursor;
use std::sync::LazyLock;

use jiff::Timestamp;
use plotters::backend::{BitMapBackend, SVGBackend};
use plotters::chart::ChartBuilder;
use plotters::drawing::IntoDrawingArea as _;
use plotters::element::{Circle, PathElement};
use plotters::prelude::DrawingBackend;
use plotters::series::LineSeries;
use plotters::style::{BLACK, Color as _, FontStyle, RGBColor, WHITE};
use ui::{Mode, Theme};

use super::table::Column;

const SIZE: (u32, u32) = (1600, 900);
/// A line is drawn with so many points at most: two for each column of pixels.
const POINTS_MAX: usize = 3200;

/// Which form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::panes) enum Form {
    /// Pixels.
    Png,
    /// Lines.
    Svg,
}

/// The curves from `from_us` until `to_us`.
pub(in crate::panes) fn draw(
    columns: &[Column],
    from_us: i64,
    to_us: i64,
    form: Form,
) -> Result<Vec<u8>, String> {
    fonts()?;
    match form {
        Form::Svg => {
            let mut text = String::new();
            paint(SVGBackend::with_string(&mut text, SIZE), columns, from_us, to_us)?;
            Ok(text.into_bytes())
        }
        Form::Png => {
            let mut pixels = vec![0; (SIZE.0 * SIZE.1 * 3) as usize];
            paint(BitMapBackend::with_buffer(&mut pixels, SIZE), columns, from_us, to_us)?;
            let picture = image::RgbImage::from_raw(SIZE.0, SIZE.1, pixels).ok_or("no picture")?;
            let mut bytes = Cursor::new(Vec::new());
            picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(|error| error.to_string())?;
            Ok(bytes.into_inner())
        }
    }
}

/// Gives pictures the face of the screen.
fn fonts() -> Result<(), String> {
    static READY: LazyLock<bool> = LazyLock::new(|| {
        let face = epaint_default_fonts::UBUNTU_LIGHT;
        plotters::style::register_font("sans-serif", FontStyle::Normal, face).is_ok()
    });
    if *READY { Ok(()) } else { Err("the font of pictures cannot be read".to_owned()) }
}

fn paint<B: DrawingBackend>(backend: B, columns: &[Column], from_us: i64, to_us: i64) -> Result<(), String> {
    let told = |error: &dyn std::fmt::Display| error.to_string();
    let area = backend.into_drawing_area();
    area.fill(&WHITE).map_err(|error| told(&error))?;
    let (low, high) = range(columns);
    let title = columns.first().map_or(String::new(), |column| {
        let [from, to] = [from_us, to_us].map(|us| ui::format::utc(super::super::history::at(us)));
        format!("{}   {from} to {to}", column.satellite)
    });
    let mut units: Vec<&str> = columns.iter().map(|column| column.unit.as_str()).collect();
    units.dedup();
    let mut chart = ChartBuilder::on(&area)
        .margin(24)
        .margin_right(64)
        .caption(title, ("sans-serif", 26))
        .x_label_area_size(48)
        .y_label_area_size(96)
        .build_cartesian_2d(from_us..to_us.max(from_us + 1), low..high)
        .map_err(|error| told(&error))?;
    let days = to_us - from_us > 36 * 3_600_000_000;
    chart
        .configure_mesh()
        .label_style(("sans-serif", 18))
        .x_labels(8)
        .y_desc(units.join(", "))
        .x_label_formatter(&|us| label(*us, days))
        .light_line_style(WHITE)
        .draw()
        .map_err(|error| told(&error))?;
    let theme = Theme::of(Mode::Light);
    for (index, column) in columns.iter().enumerate() {
        let colour = theme.series(index);
        let colour = RGBColor(colour.r(), colour.g(), colour.b());
        let runs = runs(column);
        for run in runs.iter().filter(|run| run.len() == 1) {
            let dots = run.iter().map(|point| Circle::new(*point, 3, colour.filled()));
            chart.draw_series(dots).map_err(|error| told(&error))?;
        }
        let name = format!("{} {}", column.parameter, column.unit);
        let mut named = false;
        for run in runs {
            let line = LineSeries::new(run, colour.stroke_width(2));
            let line = chart.draw_series(line).map_err(|error| told(&error))?;
            if !named {
                line.label(name.as_str())
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], colour.stroke_width(2)));
                named = true;
            }
        }
    }
    chart
        .configure_series_labels()
        .label_font(("sans-serif", 18))
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .draw()
        .map_err(|error| told(&error))?;
    area.present().map_err(|error| told(&error))
}

fn label(us: i64, days: bool) -> String {
    let at: Timestamp = super::super::history::at(us);
    match days {
        true => ui::format::date(at),
        false => ui::format::time(at),
    }
}

fn range(columns: &[Column]) -> (f64, f64) {
    let values = columns.iter().flat_map(|column| column.rows.iter().filter_map(|row| row.1));
    let (low, high) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    let room = if high > low { (high - low) * 0.05 } else { high.abs().max(1.0) * 0.05 };
    if low.is_finite() { (low - room, high + room) } else { (0.0, 1.0) }
}

/// The lines of a column: broken where a value is invalid or nothing was heard for long, thinned to extremes.
fn runs(column: &Column) -> Vec<Vec<(i64, f64)>> {
    let mut apart: Vec<i64> = column.rows.windows(2).map(|two| two[1].0 - two[0].0).collect();
    let middle = apart.len() / 2;
    let gap_us = if apart.is_empty() { 0 } else { 5 * *apart.select_nth_unstable(middle).1 };
    let mut runs: Vec<Vec<(i64, f64)>> = vec![Vec::new()];
    let mut last_us = i64::MIN;
    for (at_us, value, _) in &column.rows {
        let broken = value.is_none() || at_us.saturating_sub(last_us) > gap_us.max(1);
        if broken && runs.last().is_some_and(|run| !run.is_empty()) {
            runs.push(Vec::new());
        }
        if let (Some(value), Some(run)) = (value, runs.last_mut()) {
            run.push((*at_us, *value));
        }
        last_us = *at_us;
    }
    let total: usize = runs.iter().map(Vec::len).sum();
    let each = total.div_ceil(POINTS_MAX / 2).max(1);
    if each > 2 {
        for run in &mut runs {
            *run = run.chunks(each).flat_map(extremes).collect();
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// The least and the greatest of some points, in the order in which they stand.
fn extremes(points: &[(i64, f64)]) -> Vec<(i64, f64)> {
    let by_value = |one: &&(i64, f64), other: &&(i64, f64)| one.1.total_cmp(&other.1);
    let mut two: Vec<(i64, f64)> =
        points.iter().min_by(by_value).into_iter().chain(points.iter().max_by(by_value)).copied().collect();
    two.sort_unstable_by_key(|point| point.0);
    two.dedup();
    two
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column() -> Column {
        let value = |i: i64| (i != 50).then(|| (i as f64 / 9.0).sin() * 20.0 + 3.0);
        Column {
            satellite: "pixelsat-1".to_owned(),
            parameter: "heartbeat.temp".to_owned(),
            unit: "°C".to_owned(),
            rows: (0..200).map(|i| (i * 60_000_000, value(i), i as u64)).collect(),
        }
    }

    #[test]
    fn a_plot_becomes_a_picture_of_both_forms() {
        let columns = [column()];
        let svg = draw(&columns, 0, 12_000_000_000, Form::Svg).unwrap();
        let svg = String::from_utf8(svg).unwrap();
        assert!(svg.contains("heartbeat.temp °C") && svg.contains("00:00:00Z"), "{svg}");
        let png = draw(&columns, 0, 12_000_000_000, Form::Png).unwrap();
        let picture = image::load_from_memory(&png).unwrap().to_rgb8();
        assert_eq!(picture.dimensions(), SIZE);
        let inked = picture.pixels().filter(|pixel| pixel.0 != [255, 255, 255]).count();
        assert!(inked > 5000, "{inked} pixels");
        if let Some(folder) = std::env::var_os("SEE") {
            std::fs::write(std::path::Path::new(&folder).join("plot.png"), png).unwrap();
        }
    }

    #[test]
    fn an_invalid_value_breaks_the_line_and_thinning_keeps_extremes() {
        assert_eq!(runs(&column()).len(), 2);
        let many =
            Column { rows: (0..100_000).map(|i| (i, Some((i % 977) as f64), 0)).collect(), ..column() };
        let runs = runs(&many);
        let points: usize = runs.iter().map(Vec::len).sum();
        assert!(points <= POINTS_MAX + 2, "{points}");
        let most = runs.iter().flatten().map(|point| point.1).fold(0.0, f64::max);
        assert_eq!(most, 976.0);
    }

    #[test]
    fn nothing_to_draw_is_an_empty_picture_and_no_panic() {
        assert!(draw(&[], 5, 5, Form::Png).is_ok());
        let invalid = Column { rows: vec![(0, None, 0)], ..column() };
        assert!(draw(&[invalid], 0, 0, Form::Svg).is_ok());
    }
}
