//! The sender: one draft open, its form, its gate, its bytes, and the button that sends it.

use std::time::{Duration, Instant};

use api::telecommand::DEFINITIONS;
use egui::{CollapsingHeader, ComboBox, RichText, TextEdit, Ui};
use protocol::{HEADER_LEN, UP_PLAINTEXT_LEN};
use ui::Theme;
use ui::hold::{Hold, TypedWord, hold_button, typed_word};

use super::super::{Scene, may};
use super::check::Checked;
use super::form;
use super::send::Sender;
use crate::desk::{Draft, KEPT_MAX, Template};

/// What is armed disarms itself after this long.
const ARMED: Duration = Duration::from_secs(30);

/// What the sender keeps between frames.
#[derive(Default)]
pub(super) struct State {
    checked: Checked,
    armed: Option<Armed>,
    hold: Hold,
    typed: TypedWord,
    template: String,
    find: String,
}

/// What may be fired: this very draft, to this satellite, until then.
struct Armed {
    draft: Draft,
    target: String,
    until: Instant,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State, sender: &mut Sender) {
    if scene.desk.commands.drafts.is_empty() {
        scene.desk.commands.open(Draft::of("Ping"));
    }
    let last = scene.desk.commands.drafts.len().saturating_sub(1);
    scene.desk.commands.open = scene.desk.commands.open.min(last);
    choose(ui, scene, state);
    let at = scene.desk.commands.open;
    let Some(mut draft) = scene.desk.commands.drafts.get(at).cloned() else { return };
    state.checked.look(&draft);
    let mut errors = state.checked.errors.clone();
    if let Some(told) = sender.told.back().filter(|told| !told.is_good) {
        for (field, message) in &told.fields {
            errors.entry(field.clone()).or_insert_with(|| message.clone());
        }
    }
    let now = scene.timestamp();
    ui.add_enabled_ui(draft.asked.is_none(), |ui| {
        form::show(ui, &mut draft, &errors, now);
        gate(ui, &mut draft, &errors, scene);
    });
    bytes(ui, &state.checked);
    ui.add_space(4.0);
    fire(ui, scene, state, sender, &mut draft);
    if let Some(kept) = scene.desk.commands.drafts.get_mut(at) {
        *kept = draft;
    }
    if let Some(told) = sender.told.back() {
        let theme = Theme::current(ui);
        let colour = if told.is_good { theme.text } else { theme.critical };
        ui.add(egui::Label::new(RichText::new(&told.words).color(colour)).wrap());
    }
}

/// Which draft, which command, which template.
fn choose(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State) {
    let desk = &mut scene.desk.commands;
    ui.horizontal_wrapped(|ui| {
        let mut wanted = None;
        let shown = desk.drafts.get(desk.open).map_or("", |draft| draft.command.as_str()).to_owned();
        let combo = ComboBox::from_id_salt("new command").selected_text(&shown).width(170.0).height(360.0);
        let combo = combo.show_ui(ui, |ui| {
            let edit = TextEdit::singleline(&mut state.find).hint_text("type to find");
            ui.add(edit).accessible_name("Find a command");
            let find = state.find.to_lowercase();
            for definition in DEFINITIONS.iter().filter(|one| one.name.to_lowercase().contains(&find)) {
                if ui.selectable_label(definition.name == shown, definition.name).clicked() {
                    wanted = Some(Draft::of(definition.name));
                }
            }
        });
        combo.response.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::ComboBox, true, format!("Command {shown}"))
        });
        if !desk.templates.is_empty() {
            ui.menu_button("Templates", |ui| {
                let mut gone = None;
                for (index, template) in desk.templates.iter().enumerate() {
                    ui.horizontal(|ui| {
                        let label = format!("{} ({})", template.name, template.draft.command);
                        if ui.button(label).clicked() {
                            wanted = Some(template.draft.clone());
                            ui.close();
                        }
                        if ui.small_button("Forget").clicked() {
                            gone = Some(index);
                        }
                    });
                }
                if let Some(index) = gone {
                    desk.templates.remove(index);
                }
            });
        }
        ui.menu_button("Keep as template", |ui| {
            let edit = TextEdit::singleline(&mut state.template).hint_text("name");
            ui.add(edit).accessible_name("Name of the template");
            let is_named = !state.template.trim().is_empty() && desk.templates.len() < KEPT_MAX;
            if ui.add_enabled(is_named, egui::Button::new("Keep")).clicked()
                && let Some(draft) = desk.drafts.get(desk.open)
            {
                let draft = Draft { asked: None, ..draft.clone() };
                let name = std::mem::take(&mut state.template).trim().to_owned();
                desk.templates.retain(|template| template.name != name);
                desk.templates.push(Template { name, draft });
                ui.close();
            }
        });
        if desk.drafts.len() > 1 {
            ui.menu_button(format!("Drafts ({})", desk.drafts.len()), |ui| {
                for (index, draft) in desk.drafts.iter().enumerate() {
                    let arguments = super::one_line(&draft.arguments());
                    let open = if draft.asked.is_some() { ", no answer yet" } else { "" };
                    let text = format!("{} {arguments}{open}", draft.command);
                    if ui.selectable_label(index == desk.open, text).clicked() {
                        desk.open = index;
                        ui.close();
                    }
                }
            });
            let is_free = desk.drafts.get(desk.open).is_some_and(|draft| draft.asked.is_none());
            if ui.add_enabled(is_free, egui::Button::new("Discard draft")).clicked() {
                desk.drafts.remove(desk.open);
                desk.open = desk.open.saturating_sub(1);
            }
        }
        if let Some(draft) = wanted {
            state.find.clear();
            state.armed = None;
            desk.open(draft);
        }
    });
}

/// When it may leave.
fn gate(
    ui: &mut Ui,
    draft: &mut Draft,
    errors: &std::collections::BTreeMap<String, String>,
    scene: &Scene<'_>,
) {
    let gate = &mut draft.gate;
    let mut words = vec![if gate.blind { "blind".to_owned() } else { "when heard".to_owned() }];
    if !gate.elevation_deg.trim().is_empty() {
        words.push(format!("elevation at least {} deg", gate.elevation_deg.trim()));
    }
    if !gate.heard_within_s.trim().is_empty() {
        words.push(format!("heard within {} s", gate.heard_within_s.trim()));
    }
    if !gate.expires_min.trim().is_empty() {
        words.push(format!("given up after {} min", gate.expires_min.trim()));
    }
    if gate.priority != 0 {
        words.push(format!("priority {}", gate.priority));
    }
    let is_wrong = errors.keys().any(|field| field.starts_with("gate."));
    let header = CollapsingHeader::new(format!("Leaves: {}", words.join(", ")))
        .id_salt("gate")
        .open(is_wrong.then_some(true));
    header.show(ui, |ui| {
        let status = scene.model.status.as_ref().map(|(status, _)| status);
        let satellites = status.map(|status| &status.satellites[..]).unwrap_or_default();
        let names: Vec<&str> = satellites.iter().map(|one| one.satellite.as_str()).collect();
        row(ui, "to", "empty: the satellite that is looked at", |ui| {
            form::choice(ui, "satellite", &mut gate.satellite, &names);
        });
        row(ui, "over", "link; empty: the satellite's only one", |ui| {
            ui.add(TextEdit::singleline(&mut gate.link).desired_width(110.0)).accessible_name("link");
        });
        row(ui, "also unheard", "blind: for a satellite that may be silent", |ui| {
            ui.checkbox(&mut gate.blind, "blind");
        });
        let fields: [(&str, &str, &mut String, &str); 4] = [
            ("elevation", "deg at least; empty: no matter", &mut gate.elevation_deg, "elevation_deg"),
            ("heard within", "s; empty: as the station has it", &mut gate.heard_within_s, "heard_within_s"),
            ("given up after", "min; empty: never", &mut gate.expires_min, "expires_min"),
            ("attempts", "at most; empty: as the station has it", &mut gate.attempts, "attempts"),
        ];
        for (name, says, text, field) in fields {
            row(ui, name, says, |ui| {
                ui.add(TextEdit::singleline(text).desired_width(70.0)).accessible_name(name);
            });
            form::under(ui, &format!("gate.{field}"), errors);
        }
        row(ui, "priority", "higher goes first; 0 is usual", |ui| {
            ui.add(egui::DragValue::new(&mut gate.priority)).accessible_name("priority");
        });
    });
}

fn row(ui: &mut Ui, name: &str, says: &str, field: impl FnOnce(&mut Ui)) {
    let theme = Theme::current(ui);
    ui.horizontal(|ui| {
        ui.allocate_ui_with_layout(
            [110.0, 20.0].into(),
            egui::Layout::left_to_right(egui::Align::Center),
            |ui| {
                ui.set_min_width(110.0);
                ui.label(RichText::new(name).color(theme.dim));
            },
        );
        field(ui);
        ui.label(RichText::new(says).small().color(theme.dim));
    });
}

/// The bytes as they will be sealed: the header's type and length, the payload. Key, nonce and padding are the server's.
fn bytes(ui: &mut Ui, checked: &Checked) {
    let Some(telecommand) = &checked.telecommand else { return };
    let length = checked.payload.len();
    let text = format!("Bytes: type 0x{:02X}, {length} of payload", telecommand.packet_type());
    CollapsingHeader::new(text).id_salt("bytes").show(ui, |ui| {
        let dim = Theme::current(ui).dim;
        let header =
            format!("{:02x} ?? {:02x} {:02x}", telecommand.packet_type(), length >> 8, length & 0xff);
        let payload = if length == 0 { "(none)".to_owned() } else { hex(&checked.payload) };
        let padding = UP_PLAINTEXT_LEN - HEADER_LEN - length;
        for (name, bytes) in [
            ("plaintext: header", format!("{header}   type, tag (the station's), length")),
            ("plaintext: payload", payload),
            ("plaintext: padding", format!("{padding} random bytes")),
            ("sealed frame, 240", "8 DESTINY_ | 4 crc32 | 12 nonce | 200 ciphertext | 16 tag".to_owned()),
        ] {
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new(name).small().color(dim));
                ui.monospace(bytes);
            });
        }
    });
}

pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

/// The button. What is critical is armed first, and fired by a hold or a typed word.
fn fire(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State, sender: &mut Sender, draft: &mut Draft) {
    let name = draft.command.clone();
    let mut can = scene.may("command");
    let is_critical = state.checked.is_critical();
    if is_critical {
        can = can.and_then(|()| scene.may("critical"));
    }
    if let Some(asked) = draft.asked.clone() {
        unanswered(ui, scene, sender, draft, &asked, &can);
        return;
    }
    if !state.checked.is_right() {
        can = can.and(Err("the fields above are not right yet".to_owned()));
    }
    let now = scene.now;
    let target = target(scene, draft);
    if let Err(why) = &target {
        can = can.and(Err(why.clone()));
    }
    let target = target.unwrap_or_default();
    let is_same = |armed: &Armed| armed.draft == *draft && armed.target == target && armed.until > now;
    let escaped = ui.input(|input| input.key_pressed(egui::Key::Escape));
    state.armed.take_if(|armed| !is_same(armed) || escaped || can.is_err());
    let mut go = false;
    if !is_critical {
        ui.horizontal(|ui| {
            go = may::button(ui, format!("Send {name}"), &can);
            why(ui, &can);
        });
    } else if let Some(armed) = &state.armed {
        let left = armed.until.saturating_duration_since(now).as_secs();
        let theme = Theme::current(ui);
        let two = if scene.needs_two() {
            " It asks a second person; nothing leaves before they approve."
        } else {
            ""
        };
        ui.label(
            RichText::new(format!("{name} to {target} is armed for {left} s. Esc disarms.{two}"))
                .color(theme.armed),
        );
        go |= hold_button(ui, &mut state.hold, &format!("Fire {name}"), theme.critical);
        go |= typed_word(ui, &mut state.typed, &name, &format!("Fire {name} by word"));
        if ui.button("Disarm").clicked() {
            state.armed = None;
        }
    } else {
        ui.horizontal(|ui| {
            if may::button(ui, format!("Arm {name}"), &can) {
                state.armed =
                    Some(Armed { draft: draft.clone(), target: target.clone(), until: now + ARMED });
                (state.hold, state.typed) = (Hold::default(), TypedWord::default());
            }
            why(ui, &can);
        });
    }
    if go {
        state.armed = None;
        if let Some(request) = state.checked.request(Some(&target), scene.now_us) {
            draft.ask(request, &scene.model.address);
            if let Some(asked) = draft.asked.clone() {
                sender.ask(scene.desk, asked);
                scene.courier.wake();
            }
        }
    }
}

/// To whom it goes: the satellite of the draft, else the one that is looked at. Never another one because that is not there.
fn target(scene: &Scene<'_>, draft: &Draft) -> Result<String, String> {
    if !draft.gate.satellite.is_empty() {
        return Ok(draft.gate.satellite.clone());
    }
    let found = scene.satellite().map(|satellite| satellite.satellite.clone());
    match (found, &scene.desk.satellite) {
        (Some(found), Some(chosen)) if found != *chosen => {
            Err(format!("this server has no satellite '{chosen}': choose one above"))
        }
        (Some(found), _) => Ok(found),
        (None, _) => Err("the server has not said yet which satellites it has".to_owned()),
    }
}

/// What was asked for has no answer yet.
fn unanswered(
    ui: &mut Ui,
    scene: &mut Scene<'_>,
    sender: &mut Sender,
    draft: &mut Draft,
    asked: &crate::desk::Asked,
    can: &Result<(), String>,
) {
    let name = &draft.command;
    if sender.is_asking(&asked.key) {
        ui.label(format!("{name}: asked, waiting for the server"));
        return;
    }
    let text = format!(
        "{name} was asked for, and no answer came: it may be queued, or not. Asking again uses the same key, so that it \
         stays one command."
    );
    ui.add(egui::Label::new(RichText::new(text).color(Theme::current(ui).distress)).wrap());
    let elsewhere = asked.server != scene.model.address;
    let can = if elsewhere {
        &Err(format!("it was asked of the server at {}: ask there again, or let it be", asked.server))
    } else {
        can
    };
    ui.horizontal_wrapped(|ui| {
        if may::button(ui, "Ask again", can) {
            sender.ask(scene.desk, asked.clone());
            scene.courier.wake();
        }
        why(ui, can);
        if ui.button("Let it be").on_hover_text("Look into the queue whether it is there").clicked() {
            draft.asked = None;
        }
    });
}

pub(super) fn why(ui: &mut Ui, can: &Result<(), String>) {
    if let Err(why) = can {
        ui.add(egui::Label::new(RichText::new(why).small().color(Theme::current(ui).dim)).wrap());
    }
}
