//! The steps of a plan along time, with the commands that belong to it and a line that is now.

use egui::{Pos2, Rect, Response, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};
use jiff::Timestamp;

use crate::command::Lights;
use crate::command::lights::{SMALL, paint_small};
use crate::fonts;
use crate::format;
use crate::level::Level;
use crate::theme::{self, Theme};

const LANE: f32 = 28.0;
const RULER: f32 = 18.0;

/// How a step of a plan stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepState {
    /// Its time has not come.
    Ahead,
    /// It goes on.
    Running,
    /// It did what it was for.
    Done,
    /// It was left out, with a reason.
    Skipped,
    /// It did not do what it was for.
    Failed,
}

impl StepState {
    /// The word for it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Ahead => "ahead",
            Self::Running => "running",
            Self::Done => "done",
            Self::Skipped => "skipped",
            Self::Failed => "failed",
        }
    }
}

/// A step of a plan.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// What it does.
    pub name: &'a str,
    /// When it begins, or shall.
    pub from: Timestamp,
    /// When it ends, or shall at the latest.
    pub to: Timestamp,
    /// How it stands.
    pub state: StepState,
    /// What more to tell, for instance why it was skipped; may be empty.
    pub note: &'a str,
}

/// A command on the track.
#[derive(Debug, Clone, Copy)]
pub struct TrackCommand<'a> {
    /// Its name.
    pub name: &'a str,
    /// When it went out, or shall.
    pub at: Timestamp,
    /// How far it came.
    pub lights: Lights,
}

/// What was clicked, as an index into what was handed in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrackClick {
    /// A step.
    Step(usize),
    /// A command.
    Command(usize),
}

/// Draws steps and commands from `from` to `to`, mostly a pass, as wide as there is room.
pub fn plan_track_ui(
    ui: &mut Ui,
    steps: &[Step<'_>],
    commands: &[TrackCommand<'_>],
    (from, to): (Timestamp, Timestamp),
    now: Timestamp,
) -> Option<TrackClick> {
    let theme = Theme::current(ui);
    let lanes = lanes(steps.iter().map(|step| (step.from, step.to)));
    let width = ui.available_width();
    let across = Across { from, span_s: to.duration_since(from).as_secs_f64().max(1.0), width };
    let marks: Vec<(f32, f32)> = commands
        .iter()
        .map(|command| {
            let wide = text_width(ui, command.name).max(SMALL.x) + 12.0;
            let x = (across.part(command.at) - 5.0).clamp(0.0, (width - wide).max(0.0));
            (x, x + wide)
        })
        .collect();
    let rows = rows(&marks);
    let lane_count = lanes.iter().max().map_or(0, |lane| lane + 1);
    let row_count = rows.iter().max().map_or(0, |row| row + 1);
    let height = RULER + lane_count as f32 * (LANE + 4.0) + row_count as f32 * 34.0 + 6.0;
    let (rect, _) = ui.allocate_exact_size(vec2(width, height), Sense::hover());
    let painter = ui.painter_at(rect.expand(1.0));
    ruler(&painter, theme, rect, &across, now);
    let mut click = None;
    let x = |at: Timestamp| rect.left() + across.part(at);
    let below = rect.top() + RULER + lane_count as f32 * (LANE + 4.0) + 4.0;
    if from <= now && now <= to {
        // Behind the steps: a running one shows by its filling how far it is.
        let line = [pos2(x(now), rect.top() + 2.0), pos2(x(now), below - 4.0)];
        painter.line_segment(line, Stroke::new(2.0, theme.accent));
    }
    for (index, (step, lane)) in steps.iter().zip(&lanes).enumerate() {
        let top = rect.top() + RULER + *lane as f32 * (LANE + 4.0);
        let (left, right) = (x(step.from).max(rect.left()), x(step.to).min(rect.right()));
        let block = Rect::from_min_max(pos2(left, top), pos2(right.max(left + 3.0), top + LANE));
        let response = ui.interact(block, ui.scope_id().with(("step", index)), Sense::click());
        paint_step(&painter, theme, block, x(now), step, response.hovered() || response.has_focus());
        response.widget_info(|| {
            WidgetInfo::labeled(Role::Button, true, format!("Step {}: {}", step.name, step.state.word()))
        });
        if response.clicked() {
            click = Some(TrackClick::Step(index));
        }
        tell(response, step.name, step.state.word(), step.from, step.note);
    }
    for (index, ((command, mark), row)) in commands.iter().zip(&marks).zip(&rows).enumerate() {
        let top = below + *row as f32 * 34.0;
        let at = x(command.at);
        let area =
            Rect::from_min_max(pos2(rect.left() + mark.0, top), pos2(rect.left() + mark.1 - 6.0, top + 30.0));
        let response = ui.interact(area, ui.scope_id().with(("command", index)), Sense::click());
        if response.hovered() || response.has_focus() {
            painter.rect_filled(area.expand2(vec2(3.0, 0.0)), theme::space(), theme.raised);
        }
        if (rect.left()..=rect.right()).contains(&at) {
            painter.line_segment([pos2(at, top - 4.0), pos2(at, top + 1.0)], Stroke::new(1.5, theme.dim));
        }
        let colour = command.lights.end.map_or(theme.text, |(end, _)| end.colour(theme));
        painter.text(
            area.left_top() + vec2(1.0, 1.0),
            egui::Align2::LEFT_TOP,
            command.name,
            fonts::small(),
            colour,
        );
        paint_small(&painter, theme, pos2(area.left(), area.bottom() - 7.0), &command.lights);
        response.widget_info(|| {
            let label = format!("Command {}: {}", command.name, command.lights.word());
            WidgetInfo::labeled(Role::Button, true, label)
        });
        if response.clicked() {
            click = Some(TrackClick::Command(index));
        }
        tell(response, command.name, command.lights.word(), command.at, "");
    }
    click
}

struct Across {
    from: Timestamp,
    span_s: f64,
    width: f32,
}

impl Across {
    /// Points from the left edge.
    fn part(&self, at: Timestamp) -> f32 {
        (at.duration_since(self.from).as_secs_f64() / self.span_s) as f32 * self.width
    }
}

fn text_width(ui: &Ui, text: &str) -> f32 {
    ui.painter().layout_no_wrap(text.to_owned(), fonts::small(), egui::Color32::WHITE).size().x
}

/// For each stretch of time the first lane in which nothing else goes on.
fn lanes(stretches: impl Iterator<Item = (Timestamp, Timestamp)>) -> Vec<usize> {
    let mut ends: Vec<Timestamp> = Vec::new();
    let place = |(from, to): (Timestamp, Timestamp)| {
        let lane = ends.iter().position(|&end| end <= from).unwrap_or(ends.len());
        if lane == ends.len() {
            ends.push(to);
        } else {
            ends[lane] = to;
        }
        lane
    };
    stretches.map(place).collect()
}

/// For each stretch of points a row in which it overlaps no other.
fn rows(stretches: &[(f32, f32)]) -> Vec<usize> {
    let mut taken: Vec<Vec<(f32, f32)>> = Vec::new();
    let place = |&(low, high): &(f32, f32)| {
        let is_free = |row: &Vec<(f32, f32)>| row.iter().all(|other| high <= other.0 || other.1 <= low);
        let row = taken.iter().position(is_free).unwrap_or(taken.len());
        if row == taken.len() {
            taken.push(Vec::new());
        }
        taken[row].push((low, high));
        row
    };
    stretches.iter().map(place).collect()
}

/// Times along the top, counted from the beginning; and now.
fn ruler(painter: &egui::Painter, theme: &Theme, rect: Rect, across: &Across, now: Timestamp) {
    let wanted_s = across.span_s / f64::from((across.width / 90.0).max(1.0));
    let steps_s = [5, 10, 15, 30, 60, 120, 300, 600, 900, 1_800, 3_600, 7_200, 21_600, 86_400];
    let step_s = steps_s.into_iter().find(|&step_s| f64::from(step_s) >= wanted_s).unwrap_or(86_400 * 7);
    let first_s = across.from.as_second().div_euclid(i64::from(step_s)) * i64::from(step_s);
    let now_x = rect.left() + across.part(now);
    let mut tick_s = first_s;
    while (tick_s - across.from.as_second()) as f64 <= across.span_s {
        if let Ok(at) = Timestamp::from_second(tick_s) {
            let x = rect.left() + across.part(at);
            if x >= rect.left() {
                let line = [pos2(x, rect.top() + RULER - 4.0), pos2(x, rect.bottom())];
                painter.line_segment(line, Stroke::new(1.0, theme.line));
            }
            let text = if step_s >= 60 { format::minute(at) } else { format::time(at) };
            let galley = painter.layout_no_wrap(text, fonts::figures(11.0), theme.dim);
            let left = x - galley.size().x / 2.0;
            let is_clear = (now_x - x).abs() > galley.size().x / 2.0 + 4.0;
            if left >= rect.left() && left + galley.size().x <= rect.right() && is_clear {
                painter.galley(pos2(left, rect.top()), galley, theme.dim);
            }
        }
        tick_s += i64::from(step_s);
    }
}

fn paint_step(
    painter: &egui::Painter,
    theme: &Theme,
    block: Rect,
    now_x: f32,
    step: &Step<'_>,
    is_lit: bool,
) {
    let radius = theme::space();
    let (fill, edge, text) = match step.state {
        StepState::Ahead => (theme.raised, theme.faint, theme.text),
        StepState::Running => (theme.raised, theme.accent, theme.text),
        StepState::Done => (theme.raised, theme.raised, theme.dim),
        StepState::Skipped => (theme.panel, theme.faint, theme.dim),
        StepState::Failed => (theme.raised, theme.critical, theme.text),
    };
    painter.rect_filled(block, radius, fill);
    if step.state == StepState::Running && now_x > block.left() {
        let done = block.intersect(Rect::everything_left_of(now_x));
        painter.rect_filled(done, radius, theme.selection);
    }
    let edge = if is_lit { theme.text } else { edge };
    painter.rect_stroke(block, radius, Stroke::new(1.0, edge), StrokeKind::Inside);
    let mark = match step.state {
        StepState::Done | StepState::Failed | StepState::Skipped if block.width() > 30.0 => 16.0,
        _ => 0.0,
    };
    if mark > 0.0 {
        paint_mark(painter, theme, block.left_center() + vec2(12.0, 0.0), step.state);
    }
    let room = block.width() - mark - 12.0;
    if room > 14.0 {
        let mut job = egui::text::LayoutJob::simple_singleline(step.name.to_owned(), fonts::small(), text);
        job.wrap = egui::text::TextWrapping::truncate_at_width(room);
        let galley = painter.layout_job(job);
        let at = block.left_center() + vec2(7.0 + mark, -galley.size().y / 2.0);
        painter.galley(at, galley, text);
    }
}

/// A tick, the shape of a failure, or a bar.
fn paint_mark(painter: &egui::Painter, theme: &Theme, at: Pos2, state: StepState) {
    match state {
        StepState::Done => {
            let tick = [vec2(-4.0, 0.0), vec2(-1.0, 3.0), vec2(4.0, -3.5)].map(|part| at + part);
            painter.line(tick.to_vec(), Stroke::new(1.5, theme.dim));
        }
        StepState::Failed => crate::level::paint_shape(painter, at, 11.0, Level::Critical, theme.critical),
        _ => {
            painter.line_segment([at - vec2(4.0, 0.0), at + vec2(4.0, 0.0)], Stroke::new(1.5, theme.faint));
        }
    }
}

fn tell(response: Response, name: &str, state: &str, at: Timestamp, note: &str) {
    let gap = if note.is_empty() { "" } else { "\n" };
    response.on_hover_text(format!("{name}: {state}\n{}{gap}{note}", format::utc(at)));
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn neither_lanes_nor_rows_hold_two_things_at_once(
            stretches in prop::collection::vec((0_i64..1_000, 1_i64..200), 0..40),
        ) {
            let at = |second: i64| Timestamp::from_second(second).unwrap();
            let mut stretches = stretches;
            stretches.sort_unstable();
            let lanes = lanes(stretches.iter().map(|&(from, length)| (at(from), at(from + length))));
            let spans: Vec<(f32, f32)> =
                stretches.iter().map(|&(from, length)| (from as f32, (from + length) as f32)).collect();
            let rows = rows(&spans);
            for one in 0..spans.len() {
                for other in 0..one {
                    let overlap = spans[one].0 < spans[other].1 && spans[other].0 < spans[one].1;
                    prop_assert!(!(overlap && lanes[one] == lanes[other]));
                    prop_assert!(!(overlap && rows[one] == rows[other]));
                }
            }
        }
    }
}
