//! Passes and looks for people: aligned columns, UTC.

use api::{LookView, PassEndWord, PassView};
use tle::UtcInstant;

use super::instant;

/// Characters of a name in a column.
const NAME_MAX: usize = 24;

/// `2026-11-22`.
pub(super) fn day(at: UtcInstant) -> String {
    at.to_string().chars().take(10).collect()
}

/// `05:19:25`, the seconds cut.
pub(super) fn clock(at: UtcInstant) -> String {
    at.to_string().chars().skip(11).take(8).collect()
}

/// One line a pass, under a header. A mark after a time says that the pass is cut there: `<` and `>` by the window, `!` by
/// the elements.
#[must_use]
pub fn pass_table(passes: &[PassView]) -> String {
    let mut rows = vec![
        ["satellite", "station", "AOS (UTC)", "az", "TCA (UTC)", "az", "el", "LOS (UTC)", "az", "lasts", ""]
            .map(str::to_owned)
            .to_vec(),
    ];
    let has_frequency = passes.iter().any(|pass| pass.frequency_hz.is_some());
    if has_frequency {
        rows[0].insert(10, "Doppler kHz".to_owned());
    }
    for pass in passes {
        let [aos, tca, los] = [pass.aos, pass.tca, pass.los].map(instant);
        let cut = |cause: PassEndWord, by_window: char| match cause {
            PassEndWord::Horizon => ' ',
            PassEndWord::Window => by_window,
            PassEndWord::NoState => '!',
        };
        let degrees = |value: f64| format!("{value:.0}°");
        let mut row = vec![
            short(&pass.satellite),
            short(&pass.station),
            format!("{} {}Z{}", day(aos), clock(aos), cut(pass.aos_cause, '<')),
            degrees(pass.aos_azimuth_deg),
            format!("{}Z", clock(tca)),
            degrees(pass.tca_azimuth_deg),
            format!("{:.1}°", pass.max_elevation_deg),
            format!("{}Z{}", clock(los), cut(pass.los_cause, '>')),
            degrees(pass.los_azimuth_deg),
            lasting(pass.duration_s),
        ];
        if has_frequency {
            let khz = |hz: Option<f64>| hz.map_or("-".to_owned(), |hz| format!("{:+.2}", hz / 1000.0));
            row.push(format!("{} to {}", khz(pass.aos_doppler_hz), khz(pass.los_doppler_hz)));
        }
        row.push(if pass.optically_visible { "visible" } else { "" }.to_owned());
        rows.push(row);
    }
    aligned(&rows, &[0, 1, 2, 4, 7])
}

/// One line a look, under a header.
#[must_use]
pub fn look_table(looks: &[LookView]) -> String {
    let mut rows = vec![
        [
            "satellite",
            "station",
            "time (UTC)",
            "azimuth",
            "elevation",
            "range km",
            "rate km/s",
            "Doppler Hz",
            "send Hz",
            "below",
            "height km",
            "Sun",
            "elements' age",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for look in looks {
        let number = |value: Option<f64>, digits: usize| {
            value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
        };
        let below = match (look.latitude_deg, look.longitude_deg) {
            (Some(latitude), Some(longitude)) => format!("{latitude:.3},{longitude:.3}"),
            _ => "-".to_owned(),
        };
        let sun = match (&look.eclipse, look.sun_fraction) {
            (Some(word), Some(part)) if part > 0.0 && part < 1.0 => format!("{word} {:.0} %", part * 100.0),
            (Some(word), _) => word.clone(),
            (None, _) => look.error.clone().unwrap_or_default(),
        };
        rows.push(vec![
            short(&look.satellite),
            short(&look.station),
            look.at.to_string(),
            number(look.azimuth_deg, 3),
            number(look.elevation_deg, 3),
            number(look.range_km, 3),
            number(look.range_rate_km_s, 4),
            look.doppler_hz.map_or("-".to_owned(), |hz| format!("{hz:+.1}")),
            number(look.uplink_hz, 1),
            below,
            number(look.height_km, 1),
            sun,
            format!("{:.1} d", look.age_days),
        ]);
    }
    aligned(&rows, &[0, 1, 2, 11])
}

fn lasting(seconds: f64) -> String {
    let seconds = seconds.round() as i64;
    if seconds >= 86_400 {
        format!("{}d{:02}h", seconds / 86_400, seconds / 3600 % 24)
    } else if seconds >= 3600 {
        format!("{}h{:02}m", seconds / 3600, seconds / 60 % 60)
    } else {
        format!("{}m{:02}s", seconds / 60, seconds % 60)
    }
}

fn short(name: &str) -> String {
    let printable = |c: char| if c.is_control() { ' ' } else { c };
    if name.chars().count() <= NAME_MAX {
        name.chars().map(printable).collect()
    } else {
        name.chars().take(NAME_MAX - 1).map(printable).chain(['…']).collect()
    }
}

/// Columns two blanks apart; those of `left` begin at the left.
fn aligned(rows: &[Vec<String>], left: &[usize]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cell = |row: &Vec<String>, column: usize| row.get(column).map_or(0, |cell| cell.chars().count());
    let widths: Vec<usize> =
        (0..columns).map(|column| rows.iter().map(|row| cell(row, column)).max().unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (column, (cell, &width)) in row.iter().zip(&widths).enumerate() {
            let padding = " ".repeat(width.saturating_sub(cell.chars().count()));
            if column > 0 {
                line.push_str("  ");
            }
            if left.contains(&column) {
                line.push_str(cell);
                line.push_str(&padding);
            } else {
                line.push_str(&padding);
                line.push_str(cell);
            }
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}
