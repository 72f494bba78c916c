//! Several commands in a row, with waits and conditions. A stack becomes a plan that the server owns and runs: nothing
//! depends on this window once it was handed over.

use api::client::IdempotencyKey;
use api::{ApprovalText, OnFailureWord, Outcome, PlanText, StepText};
use egui::{RichText, ScrollArea, TextEdit, Ui};
use ui::Theme;

use super::super::{Scene, may};
use super::check::Checked;
use super::draft::why;
use super::one_line;
use crate::desk::{KEPT_MAX, Stack, StackStep};
use crate::link::Pending;

/// What this part keeps between frames.
#[derive(Default)]
pub(super) struct State {
    /// In the next frame: it is on the disk then.
    hand_over: Option<(String, PlanText)>,
    handing: Option<(String, Pending<Outcome>)>,
    told: String,
    errors: Vec<(String, String)>,
    checked: Vec<Checked>,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State) {
    step(scene, state);
    let theme = Theme::current(ui);
    let desk = &mut scene.desk.commands;
    ui.horizontal_wrapped(|ui| {
        for (index, stack) in desk.stacks.iter().enumerate() {
            if ui.selectable_label(index == desk.open_stack, &stack.name).clicked() {
                desk.open_stack = index;
            }
        }
        let is_room = desk.stacks.len() < KEPT_MAX;
        if ui.add_enabled(is_room, egui::Button::new("New stack")).clicked() {
            let name = format!("stack-{}", desk.stacks.len() + 1);
            desk.stacks.push(Stack { name, ..Stack::default() });
            desk.open_stack = desk.stacks.len() - 1;
        }
    });
    let at = desk.open_stack;
    let Some(mut stack) = desk.stacks.get(at).cloned() else {
        ui.label(
            RichText::new("A stack is several commands in a row. The server runs it as a plan.")
                .color(theme.dim),
        );
        return;
    };
    let open = desk.drafts.get(desk.open).cloned();
    let mut is_gone = false;
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("name").color(theme.dim));
            ui.add(TextEdit::singleline(&mut stack.name).desired_width(150.0))
                .accessible_name("Name of the stack");
            is_gone = ui.button("Discard stack").clicked();
        });
        steps(ui, &mut stack, state);
        if let Some(draft) = open {
            let text = format!("Add {} {}", draft.command, one_line(&draft.arguments()));
            let add =
                ui.button(text.trim_end()).on_hover_text("The draft that is open under Send, with its gate");
            if add.clicked() {
                let draft = crate::desk::Draft { asked: None, ..draft };
                stack.steps.push(StackStep { draft, ..StackStep::default() });
            }
        }
        ui.add_space(4.0);
        hand_over(ui, scene, state, &mut stack);
    });
    let desk = &mut scene.desk.commands;
    if is_gone {
        desk.stacks.remove(at);
        desk.open_stack = desk.open_stack.min(desk.stacks.len().saturating_sub(1));
    } else if let Some(kept) = desk.stacks.get_mut(at) {
        *kept = stack;
    }
}

fn steps(ui: &mut Ui, stack: &mut Stack, state: &mut State) {
    let theme = Theme::current(ui);
    state.checked.resize_with(stack.steps.len(), Checked::default);
    let (mut up, mut gone) = (None, None);
    for (index, (step, checked)) in stack.steps.iter_mut().zip(&mut state.checked).enumerate() {
        checked.look(&step.draft);
        ui.horizontal_wrapped(|ui| {
            ui.monospace(format!("{}", index + 1));
            ui.label(RichText::new("after").color(theme.dim));
            let wait = TextEdit::singleline(&mut step.wait_s).desired_width(40.0).hint_text("0");
            ui.add(wait).accessible_name(format!("Wait before step {}", index + 1));
            ui.label(RichText::new("s").color(theme.dim));
            ui.label(&step.draft.command);
            ui.label(RichText::new(one_line(&step.draft.arguments())).small().color(theme.dim));
            ui.checkbox(&mut step.go_on, "go on when it fails");
            if ui.add_enabled(index > 0, egui::Button::new("Up").small()).clicked() {
                up = Some(index);
            }
            let remove = ui.small_button("Remove");
            remove.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Remove step {}", index + 1))
            });
            if remove.clicked() {
                gone = Some(index);
            }
        });
        for (field, error) in &checked.errors {
            super::form::wrong(ui, &format!("{field}: {error}"));
        }
    }
    if let Some(index) = up {
        stack.steps.swap(index - 1, index);
    }
    if let Some(index) = gone {
        stack.steps.remove(index);
    }
}

fn hand_over(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State, stack: &mut Stack) {
    let mut can = scene.may("plan");
    let satellite = scene.satellite().map(|satellite| satellite.satellite.clone());
    let person = scene.model.session.value().and_then(|session| session.name.clone());
    let text = plan_text(stack, &state.checked, satellite.as_deref(), person.as_deref());
    if let Err(error) = &text {
        can = can.and(Err(error.clone()));
    }
    let taken =
        scene.model.plans.value().is_some_and(|page| page.items.iter().any(|plan| plan.name == stack.name));
    if taken && stack.key.is_none() {
        ui.label(
            RichText::new("The server has a plan of this name: it is replaced.")
                .color(Theme::current(ui).dim),
        );
    }
    if state.handing.is_some() || state.hand_over.is_some() {
        ui.label("Handed over, waiting for the server");
        return;
    }
    ui.horizontal_wrapped(|ui| {
        let name = if stack.key.is_some() { "Hand over again" } else { "Hand over as a plan" };
        if may::button(ui, name, &can)
            && let Ok(text) = text
        {
            let key = stack.key.get_or_insert_with(|| IdempotencyKey::fresh().as_str().to_owned()).clone();
            state.hand_over = Some((key, text));
            scene.desk.is_urgent = true;
            scene.courier.wake();
        }
        why(ui, &can);
    });
    ui.label(
        RichText::new("Handed over it is not armed: the plan editor attaches and arms it.")
            .color(Theme::current(ui).dim),
    );
    if !state.told.is_empty() {
        ui.add(egui::Label::new(&state.told).wrap());
    }
    for (place, message) in &state.errors {
        super::form::wrong(ui, &format!("{place}: {message}"));
    }
}

fn step(scene: &mut Scene<'_>, state: &mut State) {
    if let Some((key, text)) = state.hand_over.take()
        && let Some(idempotency) = IdempotencyKey::new(&key)
    {
        let asked =
            scene.courier.ask(move |client| async move { client.add_plan(&text, &idempotency).await });
        state.handing = Some((key, asked));
    }
    let Some((key, answer)) =
        state.handing.as_ref().and_then(|(key, asked)| Some((key.clone(), asked.take()?)))
    else {
        return;
    };
    state.handing = None;
    state.errors.clear();
    let is_known = match answer {
        Ok(_) => {
            state.told = "The server has it as a plan.".to_owned();
            true
        }
        Err(error) => {
            state.told = error.to_string();
            let problem = error.problem();
            state.errors = problem.map_or_else(Vec::new, |problem| {
                problem.errors.iter().map(|one| (one.field.clone(), one.message.clone())).collect()
            });
            problem.is_some()
        }
    };
    if is_known {
        let stacks = scene.desk.commands.stacks.iter_mut();
        stacks.filter(|stack| stack.key.as_ref() == Some(&key)).for_each(|stack| stack.key = None);
        scene.desk.is_urgent = true;
    }
}

/// The plan that a stack is.
fn plan_text(
    stack: &Stack,
    checked: &[Checked],
    satellite: Option<&str>,
    person: Option<&str>,
) -> Result<PlanText, String> {
    if stack.steps.is_empty() {
        return Err("the stack has no command yet".to_owned());
    }
    let satellite = satellite.ok_or("the server has not said yet which satellite there is")?;
    let mut steps = Vec::new();
    for (index, (step, checked)) in stack.steps.iter().zip(checked).enumerate() {
        let number = index + 1;
        if !checked.is_right() {
            return Err(format!("step {number} is not right yet"));
        }
        let wait = step.wait_s.trim();
        if !wait.is_empty() && wait != "0" {
            let seconds = wait.parse::<f64>().ok().filter(|seconds| (0.0..=3600.0).contains(seconds));
            let seconds = seconds
                .ok_or_else(|| format!("step {number}: the wait must be 0 to 3600 s, found {wait}"))?;
            steps.push(StepText { what: "listen".to_owned(), for_s: Some(seconds), ..StepText::default() });
        }
        let approved_by = checked.is_critical().then(|| ApprovalText {
            name: person.unwrap_or("operator").to_owned(),
            digest: None,
            expires_at: None,
        });
        steps.push(StepText {
            what: "command".to_owned(),
            when: checked.condition(),
            on_failure: step.go_on.then_some(OnFailureWord::Continue),
            command: Some(step.draft.command.clone()),
            arguments: Some(step.draft.arguments()),
            priority: (step.draft.gate.priority != 0).then_some(step.draft.gate.priority),
            attempts: checked.attempts(),
            gate: Some(step.draft.gate_word()),
            approved_by,
            ..StepText::default()
        });
    }
    let value = serde_json::json!({
        "name": stack.name.trim(), "satellite": satellite, "transmit": true, "steps": steps,
    });
    serde_json::from_value(value).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::desk::Draft;

    #[test]
    fn a_stack_becomes_a_plan_with_waits_and_conditions() {
        let mut chunk = Draft::with_words("GetImageChunk", "0 8".split(' '));
        chunk.gate.elevation_deg = "15".into();
        let steps = vec![
            StackStep { draft: Draft::of("Ping"), ..StackStep::default() },
            StackStep { draft: chunk, wait_s: "5".into(), go_on: true },
        ];
        let stack = Stack { name: "evening".into(), steps, key: None };
        let mut checked = vec![Checked::default(), Checked::default()];
        for (checked, step) in checked.iter_mut().zip(&stack.steps) {
            checked.look(&step.draft);
        }
        let plan = plan_text(&stack, &checked, Some("pixelsat-1"), None).unwrap();
        let words: Vec<&str> = plan.steps.iter().map(|step| step.what.as_str()).collect();
        assert_eq!(words, ["command", "listen", "command"]);
        assert_eq!(plan.steps[1].for_s, Some(5.0));
        assert_eq!(plan.steps[2].when.as_ref().unwrap().elevation_deg, Some(15.0));
        assert_eq!(plan.steps[2].on_failure, Some(OnFailureWord::Continue));
        assert!(plan.transmit);
        let empty = Stack { steps: Vec::new(), ..stack };
        assert_eq!(plan_text(&empty, &[], Some("s"), None).unwrap_err(), "the stack has no command yet");
    }
}
