//! The plan that runs, as a track with its commands; between passes what comes next.

use std::time::{Duration, Instant};

use api::{CommandView, PlanText, RunReport, RunView};
use egui::Ui;
use jiff::Timestamp;
use ui::command::{End, Lights};
use ui::format;
use ui::plan_track::{Step, StepState, TrackCommand, plan_track_ui};

use super::{Scene, plan_words};
use crate::link::Pending;
use crate::orbit::timestamp;

/// A run that goes on is asked for so often.
const ASK: Duration = Duration::from_secs(1);

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    report: Option<RunReport>,
    asking: Option<Pending<RunReport>>,
    asked_at: Option<Instant>,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let (Some(now_us), Some(satellite)) =
        (scene.now_us, scene.satellite().map(|view| view.satellite.clone()))
    else {
        return super::blank::show(ui, scene);
    };
    let mut state = std::mem::take(&mut scene.kept.pass_plan);
    let run = current(scene, &satellite);
    state.follow(scene, run.as_ref());
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        if let Some(run) = &run {
            head(ui, run);
            if let Some(report) = state.report.as_ref().filter(|report| report.run.id == run.id) {
                track(ui, report, timestamp(now_us));
            }
        }
        if run.as_ref().is_none_or(|run| !is_under_way(run)) {
            ahead(ui, scene, &satellite, now_us);
        }
    });
    scene.kept.pass_plan = state;
}

fn is_under_way(run: &RunView) -> bool {
    matches!(run.state.as_str(), "waiting" | "running" | "held")
}

/// The run that goes on, else the one that was changed last and began at all.
fn current(scene: &Scene<'_>, satellite: &str) -> Option<RunView> {
    let listed = scene.model.runs.value().map_or(&[][..], |page| &page.items);
    let listed = listed.iter().filter(|run| !scene.model.live_runs.contains_key(&run.id));
    let all = scene.model.live_runs.values().chain(listed).filter(|run| run.satellite == satellite);
    let begun = all.filter(|run| run.started_at.is_some() || is_under_way(run));
    begun.max_by_key(|run| (is_under_way(run), run.aos, run.id)).cloned()
}

impl State {
    fn follow(&mut self, scene: &Scene<'_>, run: Option<&RunView>) {
        if let Some(Ok(report)) = self.asking.as_ref().and_then(Pending::take) {
            self.report = Some(report);
            self.asking = None;
        }
        let Some(run) = run else { return };
        let has_newest =
            self.report.as_ref().is_some_and(|held| held.run.id == run.id && held.run.at == run.at);
        let due = self.asked_at.is_none_or(|at| scene.now.saturating_duration_since(at) >= ASK);
        if due && (!has_newest || is_under_way(run)) && scene.model.connection.is_live() {
            let id = run.id;
            self.asked_at = Some(scene.now);
            self.asking = Some(scene.courier.ask(move |client| async move { client.run(id).await }));
        }
    }
}

fn head(ui: &mut Ui, run: &RunView) {
    ui.horizontal_wrapped(|ui| {
        ui.strong(&run.name);
        ui.label(run.outcome.as_deref().unwrap_or(&run.state));
        ui.weak(format!("pass of {}", format::utc(timestamp(run.aos.unix_us()))));
        if let Some(why) = run.outcome_why.as_deref().or(run.why.as_deref()) {
            ui.weak(why);
        }
    });
}

fn track(ui: &mut Ui, report: &RunReport, now: Timestamp) {
    let (aos, los) = (timestamp(report.run.aos.unix_us()), timestamp(report.run.los.unix_us()));
    let is_over = !is_under_way(&report.run);
    let mut names = Vec::new();
    let mut spans = Vec::new();
    for step in &report.steps {
        let text = report.plan.steps.iter().find(|text| Some(&text.what) == step.what.as_ref());
        let exact = index(&step.step).and_then(|index| report.plan.steps.get(index));
        names.push(exact.or(text).map_or_else(|| step.step.clone(), plan_words::step));
        let state = match step.end.as_str() {
            "done" => StepState::Done,
            "skipped" => StepState::Skipped,
            _ => StepState::Failed,
        };
        spans.push((timestamp(step.entered_at.unix_us()), timestamp(step.ended_at.unix_us()), state));
    }
    let notes: Vec<&str> = report.steps.iter().map(|step| step.why.as_deref().unwrap_or("")).collect();
    if !is_over {
        rest(&report.plan, report, (aos, los), &mut names, &mut spans);
    }
    let steps: Vec<Step<'_>> = names
        .iter()
        .zip(&spans)
        .enumerate()
        .map(|(index, (name, (from, to, state)))| Step {
            name,
            from: *from,
            to: *to,
            state: *state,
            note: notes.get(index).copied().unwrap_or(""),
        })
        .collect();
    let commands: Vec<TrackCommand<'_>> = report
        .commands
        .iter()
        .map(|command| TrackCommand {
            name: &command.command,
            at: went_out(command),
            lights: lights(command),
        })
        .collect();
    plan_track_ui(ui, &steps, &commands, (aos, los), now);
    ui.weak(format!("{} frames heard, {} new chunks", report.frames_heard, report.chunks_gained));
}

/// The steps that have not ended, laid out evenly over what is left of the pass.
fn rest(
    plan: &PlanText,
    report: &RunReport,
    (aos, los): (Timestamp, Timestamp),
    names: &mut Vec<String>,
    spans: &mut Vec<(Timestamp, Timestamp, StepState)>,
) {
    let ended = report.steps.iter().filter_map(|step| index(&step.step)).max().map_or(0, |index| index + 1);
    let left = plan.steps.get(ended..).unwrap_or(&[]);
    let from = spans.iter().map(|(_, to, _)| *to).max().unwrap_or(aos).clamp(aos, los.max(aos));
    let each = los.duration_since(from) / i32::try_from(left.len().max(1)).unwrap_or(i32::MAX);
    for (index, step) in left.iter().enumerate() {
        let begin = from + each * i32::try_from(index).unwrap_or(i32::MAX);
        let running = index == 0 && report.run.state == "running";
        names.push(plan_words::step(step));
        spans.push((begin, begin + each, if running { StepState::Running } else { StepState::Ahead }));
    }
}

/// The step of the plan itself in which a place such as `steps[3].steps[0]` lies.
fn index(place: &str) -> Option<usize> {
    place.strip_prefix("steps[")?.split_once(']')?.0.parse().ok()
}

fn reached(command: &CommandView, name: &str) -> Option<Timestamp> {
    let stages = command.stages.as_deref().unwrap_or(&[]);
    stages.iter().rfind(|stage| stage.stage == name).map(|stage| timestamp(stage.at.unix_us()))
}

fn went_out(command: &CommandView) -> Timestamp {
    let at = reached(command, "radiated").or_else(|| reached(command, "radiating"));
    at.unwrap_or_else(|| timestamp(command.created_at.unix_us()))
}

fn lights(command: &CommandView) -> Lights {
    let queued = reached(command, "queued").unwrap_or_else(|| timestamp(command.created_at.unix_us()));
    let end = match command.stage.as_str() {
        "rejected" => Some(End::Rejected),
        "failed" => Some(End::Failed),
        "unknown" => Some(End::Unknown),
        "expired" => Some(End::Expired),
        "cancelled" => Some(End::Cancelled),
        _ => None,
    };
    Lights {
        reached: [
            Some(queued),
            reached(command, "sealed"),
            reached(command, "radiated"),
            reached(command, "answered"),
        ],
        is_radiating: command.stage == "radiating",
        end: end.map(|end| (end, timestamp(command.stage_at.unix_us()))),
    }
}

/// What comes next: the next contact with a plan, its steps, whether it runs.
fn ahead(ui: &mut Ui, scene: &Scene<'_>, satellite: &str, now_us: i64) {
    let Some(schedule) = scene.model.schedule.value() else {
        ui.weak(scene.model.schedule.failure().unwrap_or("Waiting for the schedule"));
        return;
    };
    let next = schedule.contacts.iter().find(|contact| {
        contact.satellite == satellite && contact.plan.is_some() && contact.stop.unix_us() > now_us
    });
    let Some(contact) = next else {
        ui.weak("No plan for the coming passes. Attach one on the layout Plan.");
        return;
    };
    let name = contact.plan.as_deref().unwrap_or_default();
    let (at, now) = (timestamp(contact.start.unix_us()), timestamp(now_us));
    ui.horizontal_wrapped(|ui| {
        ui.label(format!("Next: {name} at {}", format::near(at, now)));
        ui.monospace(format::countdown(at, now));
        if contact.armed {
            let theme = ui::Theme::current(ui);
            ui.colored_label(theme.armed, "ARMED");
        } else {
            ui.label("not armed: nothing will happen");
        }
    });
    let plans = scene.model.plans.value().map_or(&[][..], |page| &page.items);
    if let Some(plan) = plans.iter().find(|plan| plan.name == name) {
        for (index, step) in plan.plan.steps.iter().enumerate() {
            ui.weak(format!("{:>2}  {}", index + 1, plan_words::step(step)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_belongs_to_its_repeat() {
        assert_eq!(index("steps[3].steps[0]"), Some(3));
        assert_eq!(index("steps[12]"), Some(12));
        assert_eq!(index(""), None);
    }
}
