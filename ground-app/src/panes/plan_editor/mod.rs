//! Plans: the list of those in use and in writing, the steps of one as rows and as text, and what is done with it.
//!
//! | file | idea |
//! | --- | --- |
//! | `head` | name, satellite, passes that it takes |
//! | `steps` | the steps as rows |
//! | `fields` | numbers that may be left out, conditions |
//! | `text` | the same as TOML or JSON |
//! | `deeds` | hand over, arm, disarm, withdraw; nothing is overwritten unseen |

mod deeds;
mod fields;
mod head;
mod steps;
mod text;

use api::{FieldError, PlanText, PlanView, StepText};

use super::Scene;
use crate::desk::PlanDraft;

/// How the chosen plan is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Form {
    #[default]
    Steps,
    Toml,
    Json,
}

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    form: Form,
    rows: steps::Rows,
    text: text::Page,
    deeds: deeds::Deeds,
}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    if scene.model.plans.value().is_none() {
        let words = scene.model.plans.failure().unwrap_or("Waiting for the plans");
        ui.weak(words);
        return;
    }
    let names = names(scene);
    choose(scene, &names);
    ui.horizontal_wrapped(|ui| list(ui, scene, &names));
    ui.separator();
    let Some(name) = scene.desk.plans.chosen.clone() else {
        ui.weak("No plan yet. Begin one with New plan.");
        return;
    };
    let theirs = view(scene, &name);
    let mut draft = match scene.desk.plans.drafts.get(&name) {
        Some(draft) => draft.clone(),
        None => match &theirs {
            Some(view) => PlanDraft::of(view),
            None => return,
        },
    };
    let before = draft.clone();
    let mut state = std::mem::take(&mut scene.kept.plan_editor);
    state.deeds.show(ui, scene, &name, &mut draft, theirs.as_ref());
    let errors = state.deeds.errors().to_vec();
    ui.horizontal(|ui| {
        for (form, word) in [(Form::Steps, "Steps"), (Form::Toml, "TOML"), (Form::Json, "JSON")] {
            ui.selectable_value(&mut state.form, form, word);
        }
    });
    egui::ScrollArea::vertical().id_salt("plan").auto_shrink(false).show(ui, |ui| match state.form {
        Form::Steps => {
            if draft.unread.is_some() {
                let theme = ui::Theme::current(ui);
                ui.colored_label(
                    theme.distress,
                    "The text is no plan yet: mend it, or drop what was written there",
                );
                if ui.button("Drop the text").clicked() {
                    draft.unread = None;
                }
                ui.disable();
            }
            head::show(ui, &mut draft.plan, &satellites(scene), &errors);
            state.rows.show(ui, &mut draft.plan.steps, &errors);
        }
        Form::Toml => state.text.show(ui, &mut draft, text::Words::Toml, &errors),
        Form::Json => state.text.show(ui, &mut draft, text::Words::Json, &errors),
    });
    scene.kept.plan_editor = state;
    keep(scene, &name, &before, draft, theirs.as_ref());
}

/// Keeps what was changed on the desk; what is as the server has it is no draft.
fn keep(scene: &mut Scene<'_>, name: &str, before: &PlanDraft, draft: PlanDraft, theirs: Option<&PlanView>) {
    if draft == *before {
        return;
    }
    let desk = &mut scene.desk.plans;
    let same = theirs.is_some_and(|view| view.plan == draft.plan) && draft.unread.is_none();
    desk.drafts.remove(name);
    let renamed = draft.plan.name.clone();
    if same {
        return;
    }
    if renamed != name && desk.chosen.as_deref() == Some(name) {
        // Never onto another draft: that one would be gone.
        let free = !desk.drafts.contains_key(&renamed);
        let key = if free { renamed } else { name.to_owned() };
        desk.chosen = Some(key.clone());
        desk.drafts.insert(key, PlanDraft { base: None, ..draft });
    } else {
        desk.drafts.insert(name.to_owned(), draft);
    }
}

fn names(scene: &Scene<'_>) -> Vec<String> {
    let plans = scene.model.plans.value().map_or(&[][..], |page| &page.items);
    let mut names: Vec<String> = plans.iter().map(|plan| plan.name.clone()).collect();
    names.extend(scene.desk.plans.drafts.keys().cloned());
    names.sort_unstable();
    names.dedup();
    names
}

fn choose(scene: &mut Scene<'_>, names: &[String]) {
    let desk = &mut scene.desk.plans;
    if desk.chosen.as_ref().is_none_or(|name| !names.contains(name)) {
        desk.chosen = names.first().cloned();
    }
}

fn view(scene: &Scene<'_>, name: &str) -> Option<PlanView> {
    let page = scene.model.plans.value()?;
    page.items.iter().find(|plan| plan.name == name).cloned()
}

fn satellites(scene: &Scene<'_>) -> Vec<String> {
    let status = scene.model.status.as_ref();
    let views = status.map_or(&[][..], |(status, _)| &status.satellites);
    views.iter().map(|view| view.satellite.clone()).collect()
}

fn list(ui: &mut egui::Ui, scene: &mut Scene<'_>, names: &[String]) {
    for name in names {
        let plan = view(scene, name);
        let word = match &plan {
            Some(plan) if plan.armed => "armed",
            Some(_) => "not armed",
            None => "draft",
        };
        let changed = plan.is_some() && scene.desk.plans.drafts.contains_key(name);
        let text = if changed { format!("{name} ({word}, changed)") } else { format!("{name} ({word})") };
        let chosen = scene.desk.plans.chosen.as_ref() == Some(name);
        if ui.selectable_label(chosen, text).clicked() {
            scene.desk.plans.chosen = Some(name.clone());
        }
    }
    if ui.button("New plan").clicked() {
        let name = free_name(names);
        let satellite = scene.satellite().map(|view| view.satellite.clone()).unwrap_or_default();
        scene.desk.plans.drafts.insert(name.clone(), PlanDraft::new(empty(&name, &satellite)));
        scene.desk.plans.chosen = Some(name);
    }
    let chosen = scene.desk.plans.chosen.clone();
    if let Some(plan) = chosen.and_then(|name| draft_or_plan(scene, &name))
        && ui.button("Copy").on_hover_text("A new plan with the same steps").clicked()
    {
        let name = free_name(names);
        let copy = PlanText { name: name.clone(), ..plan };
        scene.desk.plans.drafts.insert(name.clone(), PlanDraft::new(copy));
        scene.desk.plans.chosen = Some(name);
    }
}

/// The plan as it is being written, else as it is in use.
pub(super) fn draft_or_plan(scene: &Scene<'_>, name: &str) -> Option<PlanText> {
    let draft = scene.desk.plans.drafts.get(name).map(|draft| draft.plan.clone());
    draft.or_else(|| view(scene, name).map(|view| view.plan))
}

fn free_name(names: &[String]) -> String {
    let all = (1..).map(|number| format!("plan-{number}"));
    all.into_iter().find(|name| !names.contains(name)).unwrap_or_default()
}

/// What a new plan begins with: it hears the satellite, then asks how it is.
fn empty(name: &str, satellite: &str) -> PlanText {
    PlanText {
        name: name.to_owned(),
        satellite: satellite.to_owned(),
        priority: 0,
        worth: 1.0,
        transmit: true,
        at_los: api::AtLosWord::Stop,
        limit_s: None,
        min_pass: api::MinPassText::default(),
        attach: None,
        steps: vec![StepText {
            what: "command".to_owned(),
            command: Some("Ping".to_owned()),
            ..StepText::default()
        }],
    }
}

/// What was found wrong at this place or inside of it, but not in its own list of steps.
fn told_at<'a>(errors: &'a [FieldError], place: &'a str) -> impl Iterator<Item = &'a FieldError> {
    errors.iter().filter(move |error| {
        error
            .field
            .strip_prefix(place)
            .is_some_and(|rest| rest.is_empty() || (rest.starts_with('.') && !rest.starts_with(".steps[")))
    })
}

fn told_ui(ui: &mut egui::Ui, errors: &[FieldError], place: &str) {
    let theme = ui::Theme::current(ui);
    for error in told_at(errors, place) {
        let field = error.field.strip_prefix(place).unwrap_or_default().trim_start_matches('.');
        let words =
            if field.is_empty() { error.message.clone() } else { format!("{field}: {}", error.message) };
        ui.colored_label(theme.critical, words);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_stands_at_its_own_step() {
        let error = |field: &str| FieldError { field: field.to_owned(), message: "wrong".to_owned() };
        let errors = [error("steps[1]"), error("steps[1].steps[0].for_s"), error("steps[10].do")];
        let at = |place| told_at(&errors, place).map(|error| error.field.as_str()).collect::<Vec<_>>();
        assert_eq!(at("steps[1]"), ["steps[1]"]);
        assert_eq!(at("steps[1].steps[0]"), ["steps[1].steps[0].for_s"]);
        assert_eq!(at("steps[10]"), ["steps[10].do"]);
    }
}
