//! What the twin makes of the chosen plan: asked of the server, followed while it computes, shown beside the plan.

mod answer;

use std::time::{Duration, Instant};

use api::{PlanText, RehearsalRequest, RehearsalView};
use egui::{DragValue, Ui};

use super::deed::Deed;
use super::{Scene, plan_editor, plan_words};
use crate::link::Pending;

/// How often a rehearsal that goes on is looked at.
const LOOK: Duration = Duration::from_millis(500);
/// Runs that are asked for at first, and at most.
const RUNS: u32 = 100;
const RUNS_MAX: u32 = 1000;

/// What this pane keeps between frames.
pub(super) struct State {
    runs: u32,
    asked: Option<(PlanText, Deed<RehearsalView>)>,
    job: Option<Job>,
}

impl Default for State {
    fn default() -> Self {
        Self { runs: RUNS, asked: None, job: None }
    }
}

/// The rehearsal that is shown.
struct Job {
    /// What was rehearsed; `None` for one that was begun elsewhere.
    plan: Option<PlanText>,
    view: RehearsalView,
    looking: Option<Pending<RehearsalView>>,
    looked_at: Instant,
    fault: Option<String>,
}

impl Job {
    fn new(plan: Option<PlanText>, view: RehearsalView, now: Instant) -> Self {
        Self { plan, view, looking: None, looked_at: now, fault: None }
    }

    fn is_under_way(&self) -> bool {
        matches!(self.view.state.as_str(), "waiting" | "running")
    }

    /// Asks how far it is, at most once at a time.
    fn follow(&mut self, scene: &Scene<'_>) {
        if let Some(answer) = self.looking.as_ref().and_then(Pending::take) {
            self.looking = None;
            match answer {
                Ok(view) => (self.view, self.fault) = (view, None),
                Err(error) => self.fault = Some(error.to_string()),
            }
        }
        let wants = self.is_under_way() || (self.view.state == "done" && self.view.answer.is_none());
        let due = scene.now.saturating_duration_since(self.looked_at) >= LOOK;
        if wants && due && self.looking.is_none() && scene.model.connection.is_live() {
            let id = self.view.id;
            self.looking = Some(scene.courier.ask(move |client| async move { client.rehearsal(id).await }));
            self.looked_at = scene.now;
        }
    }
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let mut state = std::mem::take(&mut scene.kept.rehearsal);
    state.show(ui, scene);
    scene.kept.rehearsal = state;
}

impl State {
    fn show(&mut self, ui: &mut Ui, scene: &mut Scene<'_>) {
        let Some(name) = scene.desk.plans.chosen.clone() else {
            ui.weak("Choose a plan to rehearse it");
            return;
        };
        let Some(plan) = plan_editor::draft_or_plan(scene, &name) else {
            ui.weak("Choose a plan to rehearse it");
            return;
        };
        self.ask(ui, scene, &plan);
        if let Some((asked, deed)) = &mut self.asked {
            if let Some(view) = deed.answer() {
                self.job = Some(Job::new(Some(asked.clone()), view, scene.now));
                self.asked = None;
            } else if deed.show(ui, scene.courier) {
                self.asked = None;
            }
        }
        let Some(job) = &mut self.job else {
            ui.weak("Nothing is radiated: station and satellite are computed through the coming pass");
            return;
        };
        job.follow(scene);
        let mut give_up = false;
        ui.horizontal_wrapped(|ui| give_up = progress(ui, scene, job));
        if give_up {
            let id = job.view.id;
            let key = api::client::IdempotencyKey::fresh();
            let asked =
                scene.courier.ask(move |client| async move { client.cancel_rehearsal(id, &key).await });
            job.looking = Some(asked);
        }
        if job.plan.as_ref().is_some_and(|rehearsed| *rehearsed != plan) {
            let theme = ui::Theme::current(ui);
            ui.colored_label(
                theme.distress,
                "The plan was changed since, or another is chosen: rehearse it again",
            );
        }
        if let Some(found) = &job.view.answer {
            egui::ScrollArea::vertical().id_salt("answer").auto_shrink(false).show(ui, |ui| {
                answer::show(ui, found, job.plan.as_ref());
            });
        }
    }

    fn ask(&mut self, ui: &mut Ui, scene: &Scene<'_>, plan: &PlanText) {
        let busy = self.asked.as_ref().is_some_and(|(_, deed)| deed.is_under_way())
            || self.job.as_ref().is_some_and(Job::is_under_way);
        let why = if busy { Some("One is under way".to_owned()) } else { plan_words::hindrance(scene) };
        ui.horizontal_wrapped(|ui| {
            let words = format!("Rehearse {}", plan.name);
            let button = ui.add_enabled(why.is_none(), egui::Button::new(words));
            let clicked = button.clicked();
            if let Some(why) = why {
                button.on_disabled_hover_text(why);
            }
            let label = ui.label("runs");
            ui.add(DragValue::new(&mut self.runs).range(1..=RUNS_MAX)).labelled_by(label.id);
            if clicked {
                let request = RehearsalRequest {
                    plan: Some(plan.clone()),
                    name: None,
                    at: None,
                    runs: self.runs,
                    seed: 1,
                    image_bytes: None,
                };
                let deed =
                    Deed::begin(scene.courier, format!("Rehearsing {}", plan.name), move |courier, key| {
                        let request = request.clone();
                        courier.ask(move |client| async move { client.rehearse(&request, &key).await })
                    });
                self.asked = Some((plan.clone(), deed));
            }
        });
    }
}

/// How far it is; returns whether it is to be given up.
fn progress(ui: &mut Ui, scene: &Scene<'_>, job: &Job) -> bool {
    let view = &job.view;
    let aos = crate::orbit::timestamp(view.aos.unix_us());
    let now = scene.now_us.map_or(aos, crate::orbit::timestamp);
    ui.label(format!("{} in the pass of {}", view.plan, ui::format::near(aos, now)));
    match view.state.as_str() {
        "done" => {
            ui.weak(format!("{} runs", view.runs));
        }
        "failed" | "cancelled" => {
            let theme = ui::Theme::current(ui);
            let why = view.why.as_deref().unwrap_or("");
            ui.colored_label(theme.distress, format!("{}: {why}", view.state));
        }
        _ => {
            let part = f64::from(view.runs_done) / f64::from(view.runs.max(1));
            let bar = egui::ProgressBar::new(part as f32).desired_width(160.0);
            ui.add(bar.text(format!("{} of {} runs", view.runs_done, view.runs)));
            return ui.button("Give up").clicked();
        }
    }
    if let Some(fault) = &job.fault {
        ui.weak(fault);
    }
    false
}
