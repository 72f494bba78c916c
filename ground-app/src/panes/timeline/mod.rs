//! What comes and what was, from days to seconds: passes, the schedule with its reasons, runs, commands, alarms. A plan
//! that is dropped on a pass is attached to it, after a question.

mod lanes;
mod table;

use api::{Outcome, Time};
use egui::Ui;
use ui::lane::Lane;
use ui::timeline::{Dragged, Timeline};

use super::deed::Deed;
use super::{Scene, plan_words};
use crate::orbit;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    timeline: Timeline,
    of: Option<lanes::Revisions>,
    lanes: Vec<Lane>,
    asked: Option<Choice>,
    deed: Option<Deed<Outcome>>,
    said: Option<String>,
    table: table::Table,
}

/// A plan is to get a pass, or no more.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Choice {
    plan: String,
    /// Any instant of the pass: its TCA.
    at_us: i64,
    attach: bool,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let Some(now_us) = scene.now_us else { return super::blank::show(ui, scene) };
    let mut state = std::mem::take(&mut scene.kept.timeline);
    state.show(ui, scene, now_us);
    scene.kept.timeline = state;
}

impl State {
    fn show(&mut self, ui: &mut Ui, scene: &mut Scene<'_>, now_us: i64) {
        let of = lanes::Revisions::of(scene.model);
        if self.of != Some(of) {
            self.lanes = lanes::all(scene.model);
            self.of = Some(of);
        }
        self.plans(ui, scene);
        self.question(ui, scene);
        egui::ScrollArea::vertical().id_salt("timeline").auto_shrink(false).show(ui, |ui| {
            let touched = self.timeline.show(ui, &self.lanes, orbit::timestamp(now_us));
            if let Some((plan, item)) = touched.dropped
                && let Some(at_us) = lanes::pass_at(&item.id)
            {
                self.asked = Some(Choice { plan, at_us, attach: true });
            }
            reasons(ui, scene);
            let chosen = scene.desk.plans.chosen.clone();
            if let Some(choice) = self.table.show(ui, scene.model, now_us, chosen.as_deref()) {
                self.asked = Some(choice);
            }
        });
    }

    /// The plans in use, to be dragged onto a pass.
    fn plans(&mut self, ui: &mut Ui, scene: &mut Scene<'_>) {
        let Some(page) = scene.model.plans.value() else { return };
        if page.items.is_empty() {
            return;
        }
        ui.horizontal_wrapped(|ui| {
            ui.weak("Drag a plan onto a pass:");
            for plan in &page.items {
                let id = egui::Id::unique(("plan to drag", &plan.name));
                ui.dnd_drag_source(id, Dragged(plan.name.clone()), |ui| {
                    let word = if plan.armed { "armed" } else { "not armed" };
                    ui.label(format!("{} ({word})", plan.name));
                });
            }
        });
    }

    /// What is to happen is asked once more; what happened is said.
    fn question(&mut self, ui: &mut Ui, scene: &Scene<'_>) {
        if let Some(deed) = &mut self.deed {
            if deed.answer().is_some() {
                self.said = Some("Done; the schedule says what came of it".to_owned());
                self.deed = None;
            } else if deed.show(ui, scene.courier) {
                self.deed = None;
            }
        }
        if let Some(said) = &self.said {
            ui.weak(said);
        }
        let Some(choice) = self.asked.clone() else { return };
        let why = plan_words::hindrance(scene);
        ui.horizontal_wrapped(|ui| {
            let at = ui::format::utc(orbit::timestamp(choice.at_us));
            let (question, yes) = if choice.attach {
                (format!("Give the pass of {at} to {}?", choice.plan), "Yes, attach")
            } else {
                (format!("Take the pass of {at} back from {}?", choice.plan), "Yes, detach")
            };
            ui.label(question);
            let button = ui.add_enabled(why.is_none(), egui::Button::new(yes));
            let (by_enter, by_esc) =
                ui.input(|input| (input.key_pressed(egui::Key::Enter), input.key_pressed(egui::Key::Escape)));
            if button.clicked() && !by_enter {
                self.asked = None;
                self.said = None;
                self.deed = Some(begin(scene, choice));
            } else if ui.button("Back").clicked() || by_esc {
                self.asked = None;
            }
            if let Some(why) = why {
                ui.weak(why);
            }
        });
    }
}

fn begin(scene: &Scene<'_>, choice: Choice) -> Deed<Outcome> {
    let words = format!("{} {}", if choice.attach { "Attaching" } else { "Detaching" }, choice.plan);
    Deed::begin(scene.courier, words, move |courier, key| {
        let choice = choice.clone();
        courier.ask(move |client| async move {
            let at = Time::from_unix_us(choice.at_us);
            if choice.attach {
                client.attach_plan(&choice.plan, at, &key).await
            } else {
                client.detach_plan(&choice.plan, at, &key).await
            }
        })
    })
}

/// Passes that a plan wanted and does not get, with why.
fn reasons(ui: &mut Ui, scene: &Scene<'_>) {
    let Some(schedule) = scene.model.schedule.value() else { return };
    let theme = ui::Theme::current(ui);
    for refused in schedule.refused.iter().take(5) {
        let at = ui::format::utc(orbit::timestamp(refused.aos.unix_us()));
        let plan = refused.plan.as_deref().unwrap_or("a plan");
        ui.colored_label(theme.distress, format!("{plan} does not get the pass of {at}: {}", refused.why));
    }
    if schedule.refused.len() > 5 {
        ui.weak(format!("and {} more; the timeline shows them hatched", schedule.refused.len() - 5));
    }
}
