//! Commands: the sender, the queue with stages as they happen, approvals, stacks.

mod approvals;
mod check;
mod draft;
mod form;
mod queue;
mod send;
mod stacks;

use api::telecommand::{DEFINITIONS, Definition};
use egui::{ScrollArea, Ui};
use serde_json::{Map, Value};

use super::{Scene, may};
use crate::desk::Draft;
use crate::palette::Entry;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    tab: Tab,
    draft: draft::State,
    sender: send::Sender,
    queue: queue::State,
    approvals: approvals::State,
    stacks: stacks::State,
}

/// The pane's own tabs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Tab {
    #[default]
    Send,
    Queue,
    Stacks,
    Approvals,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let mut state = std::mem::take(&mut scene.kept.commands);
    let waiting = queue::waiting(scene);
    let open = approvals::open(scene);
    ui.horizontal_wrapped(|ui| {
        for (tab, name) in [
            (Tab::Send, "Send".to_owned()),
            (Tab::Queue, format!("Queue and history ({waiting})")),
            (Tab::Stacks, "Stacks".to_owned()),
            (Tab::Approvals, format!("Approvals ({open})")),
        ] {
            if ui.selectable_label(state.tab == tab, name).clicked() {
                state.tab = tab;
            }
        }
        let can = scene.may("command");
        if may::button(ui, "Satellite: transmitter off", &can) {
            state.sender.cease(scene);
            scene.courier.wake();
        }
    });
    ui.separator();
    match state.tab {
        Tab::Send => {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                draft::show(ui, scene, &mut state.draft, &mut state.sender);
                ui.separator();
                queue::newest(ui, scene, &mut state.queue, &mut state.sender);
            });
        }
        Tab::Queue => queue::show(ui, scene, &mut state.queue, &mut state.sender),
        Tab::Stacks => stacks::show(ui, scene, &mut state.stacks),
        Tab::Approvals => approvals::show(ui, scene, &mut state.approvals),
    }
    if let Some(draft) = state.queue.take_draft() {
        scene.desk.commands.open(draft);
        state.tab = Tab::Send;
    }
    scene.kept.commands = state;
}

/// What goes on whether or not the pane is on the screen: questions leave, answers come. Once a frame.
pub(super) fn step(scene: &mut Scene<'_>) {
    let mut sender = std::mem::take(&mut scene.kept.commands.sender);
    sender.step(scene);
    scene.kept.commands.sender = sender;
}

/// Silence: the satellite's transmitter off, by one click from anywhere.
pub(super) fn cease(scene: &mut Scene<'_>) {
    let mut sender = std::mem::take(&mut scene.kept.commands.sender);
    sender.cease(scene);
    scene.kept.commands.sender = sender;
    scene.courier.wake();
}

/// Opens a draft in the sender. Sends nothing.
pub(super) fn open(scene: &mut Scene<'_>, draft: Draft) {
    scene.desk.commands.open(draft);
    scene.kept.commands.tab = Tab::Send;
}

/// Each command as an entry of the palette: it opens the form, filled with the words behind the name.
pub(super) fn entries(typed: &str) -> Vec<Entry> {
    let mut words = typed.split_whitespace();
    let name = words.next().unwrap_or("").to_lowercase();
    let words: Vec<String> = words.map(ToOwned::to_owned).collect();
    let entry = |definition: &'static Definition| {
        let is_named = !words.is_empty() && definition.name.to_lowercase().starts_with(&name);
        let words = if is_named { words.clone() } else { Vec::new() };
        let title = [vec![definition.name.to_owned()], words.clone()].concat().join(" ");
        Entry::call(title, "command: opens its form", move |scene| {
            let draft = Draft::with_words(definition.name, words.iter().map(String::as_str));
            super::open_draft(scene, draft);
        })
    };
    DEFINITIONS.iter().map(entry).collect()
}

/// Arguments on one line, as people write them.
fn one_line(arguments: &Map<String, Value>) -> String {
    let mut words = Vec::new();
    for (name, value) in arguments {
        match value {
            Value::Array(list) => words.push(format!("{name} ×{}", list.len())),
            Value::String(text) => words.push(format!("{name} {text}")),
            other => words.push(format!("{name} {other}")),
        }
    }
    words.join(", ")
}
