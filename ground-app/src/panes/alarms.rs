//! Alarms: what should not be. Acknowledged with name and note, put aside until a time, given to somebody.

use api::client::{Client, ClientError, IdempotencyKey};
use api::{AlertNote, AlertView, AssignRequest, ShelveRequest, Time};
use egui::{Key, Modifiers, RichText, TextEdit, Ui};
use ui::Theme;
use ui::alarms::{Alarm, AlarmList, Deed, State as Stand};
use ui::level::Level;

use super::{Scene, may};
use crate::link::Pending;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    list: AlarmList,
    alarms: Vec<Alarm>,
    made_for: u64,
    /// Counts what the list is made of.
    revision: u64,
    deed: Option<(Deed, u64)>,
    note: String,
    hours: String,
    person: String,
    asking: Option<(&'static str, Pending<AlertView>)>,
    told: String,
    /// As the server answered, newer than what was listed.
    answered: Option<AlertView>,
    is_fresh: bool,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let mut state = std::mem::take(&mut scene.kept.alarms);
    answers(&mut state);
    derive(scene, &mut state);
    keys(ui, &mut state);
    if let Some(failure) = scene.model.alerts.failure() {
        ui.label(RichText::new(format!("not asked anew: {failure}")).color(Theme::current(ui).dim));
    }
    form(ui, scene, &mut state);
    let now = scene.timestamp();
    let asked = state.list.show(ui, &state.alarms, state.revision, now);
    if let Some((index, deed)) = asked
        && let Some(id) = state.alarms.get(index).and_then(|alarm| alarm.id.parse().ok())
    {
        begin(&mut state, deed, id);
    }
    scene.kept.alarms = state;
}

fn begin(state: &mut State, deed: Deed, id: u64) {
    if deed != Deed::Select || state.deed.is_some_and(|(_, chosen)| chosen != id) {
        state.note.clear();
        state.deed = Some((deed, id));
        state.is_fresh = deed != Deed::Select;
    } else if state.deed.is_none() {
        state.deed = Some((Deed::Select, id));
    }
    if state.hours.is_empty() {
        state.hours = "1".to_owned();
    }
}

/// The rows, made anew when the list is.
fn derive(scene: &Scene<'_>, state: &mut State) {
    let alerts = &scene.model.alerts;
    if state.made_for == alerts.revision() && state.answered.is_none() && state.revision > 0 {
        return;
    }
    let is_newer = state.made_for != alerts.revision();
    let held = alerts.value().map_or(&[][..], |page| &page.items);
    let answered = state.answered.take().filter(|_| !is_newer);
    let now_one = |alert: &AlertView| answered.as_ref().filter(|one| one.id == alert.id).cloned();
    let rows = held.iter().map(|alert| now_one(alert).unwrap_or_else(|| alert.clone()));
    state.alarms = rows.filter_map(|alert| alarm(&alert)).collect();
    state.made_for = alerts.revision();
    state.revision += 1;
}

fn alarm(alert: &AlertView) -> Option<Alarm> {
    let level = Level::ALL.into_iter().find(|level| level.word() == alert.level)?;
    let stand = match alert.state.as_str() {
        "unacknowledged" => Stand::New,
        "returned" => Stand::Returned,
        "acknowledged" => Stand::Acknowledged,
        "shelved" => Stand::Shelved,
        _ => Stand::Cleared,
    };
    let person = alert.assignee.as_ref().or(alert.shelved_by.as_ref()).or(alert.acknowledged_by.as_ref());
    Some(Alarm {
        id: alert.id.to_string(),
        level,
        name: match &alert.satellite {
            Some(satellite) => format!("{} {satellite}", alert.subject),
            None => alert.subject.clone(),
        },
        text: alert.message.clone(),
        since: jiff::Timestamp::from_microsecond(alert.raised_at.unix_us()).ok()?,
        state: stand,
        person: person.cloned(),
    })
}

/// Arrows go from row to row, A takes the chosen one up, Esc puts the form away. None of them while text is typed.
fn keys(ui: &mut Ui, state: &mut State) {
    if ui.input_mut(|input| state.deed.is_some() && input.consume_key(Modifiers::NONE, Key::Escape)) {
        state.deed = None;
    }
    if ui.ctx().text_edit_focused() || state.alarms.is_empty() {
        return;
    }
    let hovered = ui.rect_contains_pointer(ui.max_rect());
    let is_here = hovered || state.list.selected.is_some();
    let pressed = |key| ui.input_mut(|input| is_here && input.consume_key(Modifiers::NONE, key));
    let step = i64::from(pressed(Key::ArrowDown)) - i64::from(pressed(Key::ArrowUp));
    // As the list shows them: the worst first
    let mut order: Vec<&Alarm> = state.alarms.iter().collect();
    if step != 0 {
        order.sort_by(|a, b| b.level.cmp(&a.level).then(b.since.cmp(&a.since)).then(a.id.cmp(&b.id)));
        let at = order.iter().position(|alarm| Some(&alarm.id) == state.list.selected.as_ref());
        let last = order.len() as i64 - 1;
        let to = at.map_or(0, |at| (at as i64 + step).clamp(0, last));
        let chosen = order.get(to as usize).map(|alarm| alarm.id.clone());
        state.deed = chosen.as_ref().and_then(|id| id.parse().ok()).map(|id| (Deed::Select, id));
        state.list.selected = chosen;
    }
    let chosen = state.list.selected.as_ref().and_then(|id| id.parse().ok());
    if let Some(id) = chosen.filter(|_| pressed(Key::A)) {
        begin(state, Deed::Acknowledge, id);
    }
}

/// The chosen alarm, and what is asked of the operator before it is done.
fn form(ui: &mut Ui, scene: &Scene<'_>, state: &mut State) {
    let theme = Theme::current(ui);
    if !state.told.is_empty() {
        ui.add(egui::Label::new(RichText::new(&state.told).color(theme.critical)).wrap());
    }
    let Some((deed, id)) = state.deed else { return };
    let held = scene.model.alerts.value().map_or(&[][..], |page| &page.items);
    let Some(alert) = held.iter().find(|alert| alert.id == id) else {
        state.deed = None;
        return;
    };
    egui::Frame::new().fill(theme.raised).inner_margin(8).corner_radius(4).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.add(egui::Label::new(RichText::new(&alert.message).color(theme.text)).wrap());
        ui.add(egui::Label::new(RichText::new(story(alert)).small().color(theme.dim)).wrap());
        if deed == Deed::Select {
            if alert.shelved_until.is_some() && may::button(ui, "Take off the shelf", &scene.may("command")) {
                let key = IdempotencyKey::fresh();
                ask(scene, state, "taken off the shelf", move |client| async move {
                    client.unshelve_alert(id, &AlertNote::default(), &key).await
                });
            }
            return;
        }
        ui.horizontal_wrapped(|ui| {
            let edit = TextEdit::singleline(&mut state.note).hint_text("note").desired_width(200.0);
            let field = ui.add(edit).accessible_name("Note to the alarm");
            if std::mem::take(&mut state.is_fresh) {
                field.request_focus();
            }
            match deed {
                Deed::Shelve => {
                    ui.label(RichText::new("for").color(theme.dim));
                    let hours = TextEdit::singleline(&mut state.hours).desired_width(36.0);
                    ui.add(hours).accessible_name("Hours on the shelf");
                    ui.label(RichText::new("hours").color(theme.dim));
                }
                Deed::Assign => {
                    ui.label(RichText::new("to").color(theme.dim));
                    let person =
                        TextEdit::singleline(&mut state.person).hint_text("nobody").desired_width(100.0);
                    ui.add(person).accessible_name("Whose alarm");
                }
                _ => {}
            }
            go(ui, scene, state, deed, id);
            if ui.button("Leave it").clicked() {
                state.deed = None;
            }
        });
    });
}

fn go(ui: &mut Ui, scene: &Scene<'_>, state: &mut State, deed: Deed, id: u64) {
    let text = |text: &str| Some(text.trim()).filter(|text| !text.is_empty()).map(ToOwned::to_owned);
    let note = text(&state.note);
    let mut can = scene.may("command");
    let hours = state.hours.trim().parse::<f64>().ok().filter(|hours| (0.01..=168.0).contains(hours));
    if deed == Deed::Shelve && hours.is_none() {
        can = can.and(Err("hours: 0.01 to 168, which is seven days".to_owned()));
    }
    let me = scene.model.session.value().and_then(|session| session.name.clone()).unwrap_or_default();
    let name = match deed {
        Deed::Shelve => "Put aside".to_owned(),
        Deed::Assign => "Give".to_owned(),
        _ => format!("Acknowledge as {me}"),
    };
    let clicked = may::button(ui, &name, &can);
    if let Err(why) = &can {
        ui.label(RichText::new(why).small().color(Theme::current(ui).dim));
    }
    if !clicked || state.asking.is_some() {
        return;
    }
    let key = IdempotencyKey::fresh();
    match (deed, hours.zip(scene.now_us)) {
        (Deed::Shelve, Some((hours, now))) => {
            let until = Time::from_unix_us(now + (hours * 3600e6) as i64);
            ask(scene, state, "put aside", move |client| async move {
                client.shelve_alert(id, &ShelveRequest { until, note }, &key).await
            });
        }
        (Deed::Assign, _) => {
            let to = text(&state.person);
            ask(scene, state, "given", move |client| async move {
                client.assign_alert(id, &AssignRequest { to, note }, &key).await
            });
        }
        (Deed::Acknowledge, _) => ask(scene, state, "acknowledged", move |client| async move {
            client.acknowledge_alert(id, &AlertNote { note }, &key).await
        }),
        _ => {}
    }
}

fn ask<F>(scene: &Scene<'_>, state: &mut State, what: &'static str, question: impl FnOnce(Client) -> F)
where
    F: Future<Output = Result<AlertView, ClientError>> + Send + 'static,
{
    state.asking = Some((what, scene.courier.ask(question)));
    state.told.clear();
}

fn answers(state: &mut State) {
    let Some((what, answer)) = state.asking.as_ref().and_then(|(what, asked)| Some((*what, asked.take()?)))
    else {
        return;
    };
    state.asking = None;
    match answer {
        Ok(alert) => {
            state.deed = Some((Deed::Select, alert.id));
            state.answered = Some(alert);
        }
        Err(error) => state.told = format!("It is not {what}: {error}"),
    }
}

/// All about it: how often, since when, who, what was said. A latched one says so.
fn story(alert: &AlertView) -> String {
    let mut words = vec![format!("{}, rule {}, since {}", alert.state, alert.rule, alert.raised_at)];
    if alert.times > 1 {
        words.push(format!("{} times", alert.times));
    }
    if alert.worst != alert.level {
        words.push(format!("{} at worst", alert.worst));
    }
    if !alert.active && alert.acknowledged_by.is_none() {
        words.push("latched: it is over, and stays here until somebody acknowledges it".to_owned());
    }
    if let Some(who) = &alert.acknowledged_by {
        let at = alert.acknowledged_at.map_or_else(String::new, |at| format!(" at {at}"));
        words.push(format!("acknowledged by {who}{at}"));
    }
    if let Some(until) = alert.shelved_until {
        words.push(format!("put aside by {} until {until}", alert.shelved_by.as_deref().unwrap_or("–")));
    }
    if let Some(who) = &alert.assignee {
        words.push(format!("{who}'s"));
    }
    if let Some(note) = &alert.note {
        words.push(format!("\"{note}\""));
    }
    words.join(" · ")
}
