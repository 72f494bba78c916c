//! Links, queues, sealing, storage, clock.

use api::client::{Client, IdempotencyKey};
use api::{LinkView, Outcome, StationView};
use egui::{Grid, RichText, ScrollArea, Ui};
use ui::hold::{Hold, hold_button};
use ui::{Theme, format};

use super::{Scene, blank, may};
use crate::link::Pending;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    /// The link that is about to be armed.
    to_arm: Option<String>,
    hold: Hold,
    asking: Option<Pending<Outcome>>,
    told: Option<String>,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let Some((status, _)) = &scene.model.status else { return blank::show(ui, scene) };
    let mut state = std::mem::take(&mut scene.kept.station);
    if let Some(answer) = state.asking.as_ref().and_then(Pending::take) {
        state.told = answer.err().map(|error| error.to_string());
        state.asking = None;
    }
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for link in &status.links {
            link_ui(ui, scene, &mut state, link);
        }
        if let Some(told) = &state.told {
            ui.label(RichText::new(told).color(Theme::current(ui).critical));
        }
        ui.separator();
        Grid::new("station").num_columns(2).spacing([16.0, 4.0]).show(ui, |ui| rest(ui, status));
    });
    scene.kept.station = state;
}

fn link_ui(ui: &mut Ui, scene: &Scene<'_>, state: &mut State, link: &LinkView) {
    let theme = Theme::current(ui);
    ui.horizontal_wrapped(|ui| {
        ui.strong(&link.link);
        ui.weak(format!("{}, {}", link.satellite, link.state));
        let lamp = match (link.on_air, link.armed) {
            (true, _) => RichText::new("on the air").color(theme.on_air),
            (false, true) => RichText::new("armed").color(theme.armed),
            (false, false) => RichText::new("safe").color(theme.dim),
        };
        ui.label(lamp);
        let can = scene.may("command");
        if link.armed {
            if may::button(ui, format!("Disarm {}", link.link), &can) {
                let name = link.link.clone();
                ask(scene, state, move |client, key| async move { client.disarm_link(&name, &key).await });
            }
        } else if state.to_arm.as_ref() == Some(&link.link) {
            if ui.button("Keep it safe").clicked() || ui.input(|input| input.key_pressed(egui::Key::Escape)) {
                state.to_arm = None;
            }
            let fired = ui.add_enabled_ui(can.is_ok(), |ui| {
                hold_button(ui, &mut state.hold, &format!("Let {} transmit", link.link), theme.armed)
            });
            if fired.inner {
                state.to_arm = None;
                let name = link.link.clone();
                ask(scene, state, move |client, key| async move { client.arm_link(&name, &key).await });
            }
        } else if may::button(ui, format!("Arm {}…", link.link), &can) {
            state.to_arm = Some(link.link.clone());
        }
    });
    if let Some(reason) = &link.reason {
        ui.label(RichText::new(reason).color(theme.distress));
    }
    ui.weak(format!(
        "heard {} frames, {} bad, {} skipped; radiated {} frames, {} on the air; newest {}",
        link.frames,
        link.bad,
        format::bytes(link.skipped_bytes),
        link.radiated,
        format::Quantity::of(Some(link.airtime_ms as f64 / 1000.0), 1, "s"),
        format::dbm(link.rssi_dbm.map(f64::from)),
    ));
}

fn ask<F>(scene: &Scene<'_>, state: &mut State, question: impl FnOnce(Client, IdempotencyKey) -> F)
where
    F: Future<Output = Result<Outcome, api::client::ClientError>> + Send + 'static,
{
    let key = IdempotencyKey::fresh();
    state.asking = Some(scene.courier.ask(move |client| question(client, key)));
}

fn rest(ui: &mut Ui, status: &StationView) {
    let theme = Theme::current(ui);
    let mut line = |name: &str, value: String, is_bad: bool| {
        ui.weak(name);
        let colour = if is_bad { theme.critical } else { theme.text };
        ui.add(egui::Label::new(RichText::new(value).color(colour)).wrap());
        ui.end_row();
    };
    for satellite in &status.satellites {
        line(&satellite.satellite, satellite.expectation.clone(), false);
        line("uplink", satellite.uplink.clone(), false);
        line("commands that wait", satellite.queued.to_string(), false);
    }
    for key in &status.sealing {
        let locked = key.locked.clone();
        line(
            &format!("sealing with {}", key.key),
            locked.clone().unwrap_or("ready".into()),
            locked.is_some(),
        );
    }
    let storage = &status.storage;
    let failing = storage.failing.clone();
    line("storage", failing.clone().unwrap_or("stores what is heard".into()), failing.is_some());
    line("records that wait for it", storage.waiting.to_string(), false);
    line("raw frames in reserve", storage.reserved.to_string(), storage.reserved > 0);
    line("raw frames lost", storage.frames_lost.to_string(), storage.frames_lost > 0);
    line("last event", status.last_sequence.to_string(), false);
    let time = if status.simulated { "simulated" } else { "the server's own" };
    line("clock", time.to_owned(), false);
}
