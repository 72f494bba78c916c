//! The answer of a rehearsal: what to expect, step by step.

use api::{Percentiles, PlanText, RehearsalAnswer, RehearsedStep, StepText};
use egui::{Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use ui::{fonts, format};

use crate::panes::plan_words;

/// Where the next run lies with a chance of 80 %.
struct Figure<'a> {
    name: &'a str,
    unit: &'a str,
    of: Percentiles,
    decimals: usize,
}

pub(super) fn show(ui: &mut Ui, answer: &RehearsalAnswer, plan: Option<&PlanText>) {
    let theme = ui::Theme::current(ui);
    let pass = &answer.pass;
    ui.weak(format!(
        "up to {}, {}, elements {} d old at AOS",
        format::degrees(Some(pass.max_elevation_deg)),
        pass.duration_s
            .map_or_else(|| "no end".to_owned(), |s| format!("{} min", format::number(s / 60.0, 1))),
        format::number(pass.age_days, 1)
    ));
    if answer.runs_outside > 0 {
        ui.colored_label(
            theme.critical,
            format!(
                "In {} of {} runs something was on the air outside of the pass",
                answer.runs_outside, answer.runs
            ),
        );
    }
    for finding in &answer.findings {
        let colour = if finding.severity == "error" { theme.critical } else { theme.distress };
        let place = if finding.place.is_empty() { String::new() } else { format!(" at {}", finding.place) };
        ui.colored_label(
            colour,
            format!("{}{place}: {}. {}", finding.severity, finding.problem, finding.remedy),
        );
    }
    ui.add_space(ui::theme::space());
    figures(ui, answer);
    ui.add_space(2.0 * ui::theme::space());
    steps(ui, answer, plan);
    ui.add_space(2.0 * ui::theme::space());
    ui.horizontal_wrapped(|ui| {
        for end in &answer.ends {
            let row = ui.label(format!("{} of {} {}", end.runs, answer.runs, end.end));
            if let Some(why) = &end.why {
                row.on_hover_text(why);
            }
        }
    });
}

fn figures(ui: &mut Ui, answer: &RehearsalAnswer) {
    let of = &answer.figures;
    let mut rows = vec![
        Figure { name: "telecommands answered", unit: "", of: of.commands_answered, decimals: 0 },
        Figure { name: "of those asked for", unit: "", of: of.commands_asked, decimals: 0 },
        Figure { name: "outcome unknown", unit: "", of: of.commands_unknown, decimals: 0 },
        Figure { name: "failed", unit: "", of: of.commands_failed, decimals: 0 },
        Figure { name: "chunks home", unit: "", of: of.chunks_home, decimals: 0 },
        Figure { name: "steps undone at LOS", unit: "", of: of.steps_undone, decimals: 0 },
        Figure { name: "on the air, up", unit: "s", of: of.airtime_up_s, decimals: 1 },
        Figure { name: "on the air, down", unit: "s", of: of.airtime_down_s, decimals: 1 },
    ];
    if let Some(of) = of.chunks_of {
        rows.insert(5, Figure { name: "chunks of the image", unit: "", of, decimals: 0 });
    }
    egui::Grid::new("figures").num_columns(5).striped(false).show(ui, |ui| {
        ui.weak("");
        ui.weak("10 %");
        ui.weak("half");
        ui.weak("90 %");
        ui.weak("");
        ui.end_row();
        for row in &rows {
            ui.weak(row.name);
            for value in [row.of.p10, row.of.p50, row.of.p90] {
                ui.monospace(format::Quantity::of(Some(value), row.decimals, row.unit).to_string());
            }
            band(ui, row);
            ui.end_row();
        }
    });
}

/// The same drawn: from nothing to a little more than the greatest.
fn band(ui: &mut Ui, row: &Figure<'_>) {
    let theme = ui::Theme::current(ui);
    let width = ui.available_width().clamp(60.0, 220.0);
    let (rect, response) = ui.allocate_exact_size(vec2(width, 14.0), Sense::hover());
    let most = (row.of.p90 * 1.15).max(1.0);
    let x = |value: f64| rect.left() + rect.width() * (value / most).clamp(0.0, 1.0) as f32;
    let painter = ui.painter();
    painter.rect_filled(rect.shrink2(vec2(0.0, 4.0)), 2.0, theme.raised);
    let (low, high) = (x(row.of.p10), x(row.of.p90));
    let bar = Rect::from_min_max(pos2(low, rect.top() + 3.0), pos2(high.max(low + 2.0), rect.bottom() - 3.0));
    painter.rect_filled(bar, 2.0, theme.accent.gamma_multiply(0.5));
    painter.vline(x(row.of.p50), rect.y_range(), egui::Stroke::new(2.0, theme.accent));
    let told = format!(
        "{}: {} to {}, half at {}",
        row.name,
        format::number(row.of.p10, row.decimals),
        format::number(row.of.p90, row.decimals),
        format::number(row.of.p50, row.decimals)
    );
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, told.clone()));
}

fn steps(ui: &mut Ui, answer: &RehearsalAnswer, plan: Option<&PlanText>) {
    for step in &answer.steps {
        ui.horizontal(|ui| {
            shares(ui, step, answer.runs);
            let text = plan.and_then(|plan| at(&plan.steps, &step.place));
            let words = text.map_or_else(|| step.action.clone(), plan_words::step);
            let row = ui.label(words).on_hover_text(&step.place);
            if let Some(why) = &step.why {
                row.on_hover_text(why);
            }
            ui.weak(told(step, answer.runs));
        });
    }
}

/// What became of a step, in words: only what happened at all.
fn told(step: &RehearsedStep, runs: usize) -> String {
    let parts = [
        (step.done, "done"),
        (step.partly, "partly"),
        (step.failed, "failed"),
        (step.unfinished, "cut off"),
        (step.not_reached, "not come to"),
    ];
    let told: Vec<String> =
        parts.iter().filter(|(count, _)| *count > 0).map(|(count, word)| format!("{count} {word}")).collect();
    format!("{} of {runs}", told.join(", "))
}

/// What became of it as a bar.
fn shares(ui: &mut Ui, step: &RehearsedStep, runs: usize) {
    let theme = ui::Theme::current(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(120.0, 12.0), Sense::hover());
    let mut left = rect.left();
    for (count, colour) in [
        (step.done, theme.accent),
        (step.partly, theme.accent.gamma_multiply(0.5)),
        (step.failed, theme.critical),
        (step.unfinished, theme.distress),
        (step.not_reached, theme.line),
    ] {
        let right = left + rect.width() * count as f32 / runs.max(1) as f32;
        let part = Rect::from_min_max(pos2(left, rect.top()), pos2(right, rect.bottom()));
        ui.painter().rect_filled(part, 0.0, colour);
        left = right;
    }
    let done = format!("{:.0} %", 100.0 * step.done as f64 / runs.max(1) as f64);
    ui.painter().text(rect.center(), egui::Align2::CENTER_CENTER, &done, fonts::text(10.0), theme.text);
    response.widget_info(|| {
        WidgetInfo::labeled(Role::Image, true, format!("{} {}: {done} done", step.place, step.action))
    });
}

/// The step at a place such as `steps[3].steps[0]`.
fn at<'a>(steps: &'a [StepText], place: &str) -> Option<&'a StepText> {
    let (first, rest) = place.strip_prefix("steps[")?.split_once(']')?;
    let step = steps.get(first.parse::<usize>().ok()?)?;
    match rest.strip_prefix('.') {
        Some(inner) => at(step.steps.as_deref()?, inner),
        None => Some(step),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_finds_its_step() {
        let read = |text: &str| serde_json::from_str::<StepText>(text).unwrap();
        let steps = [
            read(r#"{"do":"listen"}"#),
            read(r#"{"do":"repeat-until","steps":[{"do":"command"}],"at_most":2}"#),
        ];
        assert_eq!(at(&steps, "steps[0]").unwrap().what, "listen");
        assert_eq!(at(&steps, "steps[1].steps[0]").unwrap().what, "command");
        assert!(at(&steps, "steps[1].steps[1]").is_none() && at(&steps, "steps[2]").is_none());
    }
}
