//! When the satellite is to send chunks blind: slots on the ground track, and who would hear each of them. What comes of
//! it is a draft, or a step of the chosen plan; nothing is sent from here.

use api::{StepText, Time};
use egui::{DragValue, Ui};
use ui::geo::Place;
use ui::map::{Satellite, TrackPoint, World, WorldMap};

use super::{Pane, Scene, map};
use crate::desk::{Draft, PlanDraft, SlotDraft};
use crate::orbit::{self, Orbit};

/// As the satellite takes them.
const SLOTS_MAX: usize = 8;
const CHUNKS_MAX: u16 = 64;
/// A chunk on the air with the heartbeats in between shared out, microseconds.
const CHUNK_US: i64 = 1_240_000;
const MINUTE_US: i64 = 60_000_000;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    map: Option<WorldMap>,
    said: Option<String>,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let (Some(now_us), Some(satellite)) =
        (scene.now_us, scene.satellite().map(|view| view.satellite.clone()))
    else {
        return super::blank::show(ui, scene);
    };
    let mut state = std::mem::take(&mut scene.kept.downlink_map);
    let mut slots = std::mem::take(&mut scene.desk.plans.slots);
    scene.kept.orbits.renew(scene.model);
    match scene.kept.orbits.of(scene.model, &satellite).cloned() {
        Ok(orbit) => {
            buttons(ui, scene, &mut state, &mut slots, now_us);
            rows(ui, scene, &orbit, &mut slots, now_us);
            world(ui, scene, &mut state, (&satellite, &orbit), &slots, now_us);
        }
        Err(why) => {
            ui.weak(why.to_string());
        }
    }
    scene.desk.plans.slots = slots;
    scene.kept.downlink_map = state;
}

fn buttons(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State, slots: &mut Vec<SlotDraft>, now_us: i64) {
    ui.horizontal_wrapped(|ui| {
        if ui.add_enabled(slots.len() < SLOTS_MAX, egui::Button::new("Add slot")).clicked() {
            let last = slots.last();
            let at_us = last.map_or(now_us + 30 * MINUTE_US, |slot| slot.at_us + 30 * MINUTE_US);
            let first = last.map_or(0, |slot| slot.first.saturating_add(slot.count));
            slots.push(SlotDraft { at_us, first, count: 32 });
        }
        if ui.add_enabled(!slots.is_empty(), egui::Button::new("Clear slots")).clicked() {
            slots.clear();
        }
        let some = !slots.is_empty();
        if ui.add_enabled(some, egui::Button::new("Draft a command")).on_hover_text("Sends nothing").clicked()
        {
            super::open_draft(scene, draft(slots));
        }
        let plan = scene.desk.plans.chosen.clone();
        let button = egui::Button::new("Into the chosen plan");
        if ui.add_enabled(some && plan.is_some(), button).clicked()
            && let Some(name) = plan
            && let Some(text) = super::plan_editor::draft_or_plan(scene, &name)
        {
            let base =
                scene.model.plans.value().and_then(|page| page.items.iter().find(|view| view.name == name));
            let mut draft = scene.desk.plans.drafts.remove(&name).unwrap_or(PlanDraft {
                base: base.map(|view| view.id),
                plan: text,
                unread: None,
            });
            draft.plan.steps.push(step(slots));
            scene.desk.plans.drafts.insert(name.clone(), draft);
            state.said = Some(format!("A step was added to {name}"));
            scene.open(Pane::PlanEditor);
        }
        if let Some(said) = &state.said {
            ui.weak(said);
        }
    });
}

fn rows(ui: &mut Ui, scene: &Scene<'_>, orbit: &Orbit, slots: &mut Vec<SlotDraft>, now_us: i64) {
    let mut away = None;
    for (index, slot) in slots.iter_mut().enumerate() {
        ui.horizontal_wrapped(|ui| {
            ui.monospace(ui::format::utc(orbit::timestamp(slot.at_us)));
            let mut minutes = (slot.at_us - now_us) as f64 / MINUTE_US as f64;
            let label = ui.weak("in");
            let drag =
                DragValue::new(&mut minutes).suffix(" min").speed(0.5).range(0.0..=20_000.0).max_decimals(1);
            if ui.add(drag).labelled_by(label.id).changed() {
                slot.at_us = now_us + (minutes * MINUTE_US as f64) as i64;
                slot.at_us -= slot.at_us.rem_euclid(1_000_000);
            }
            let label = ui.weak("first");
            ui.add(DragValue::new(&mut slot.first)).labelled_by(label.id);
            let label = ui.weak("chunks");
            ui.add(DragValue::new(&mut slot.count).range(1..=CHUNKS_MAX)).labelled_by(label.id);
            let heard = hearers(scene, orbit, slot);
            let words = match heard.len() {
                0 => "nobody known hears it".to_owned(),
                count => format!("in view of {count}: {}", heard[..count.min(3)].join(", ")),
            };
            ui.label(words).on_hover_text(heard.join("\n"));
            if slot.at_us <= now_us {
                let theme = ui::Theme::current(ui);
                ui.colored_label(theme.distress, "in the past");
            }
            if ui.button("Remove slot").clicked() {
                away = Some(index);
            }
        });
    }
    if let Some(index) = away {
        slots.remove(index);
    }
    slots.sort_by_key(|slot| slot.at_us);
}

/// Our station and those who heard the satellite before, above whose horizon it is in the middle of the slot.
fn hearers(scene: &Scene<'_>, orbit: &Orbit, slot: &SlotDraft) -> Vec<String> {
    let middle_us = slot.at_us + i64::from(slot.count) * CHUNK_US / 2;
    let sees = |station: &tle::Station| {
        orbit.look(station, middle_us).is_some_and(|look| station.sees(&look) && look.elevation_deg > 0.0)
    };
    let mut names = Vec::new();
    if scene.kept.orbits.station().is_some_and(sees) {
        names.push("our own station, which should command then".to_owned());
    }
    let receivers = scene.model.receivers.value().map_or(&[][..], |page| &page.items);
    for receiver in receivers {
        let (Some(latitude), Some(longitude)) = (receiver.latitude_deg, receiver.longitude_deg) else {
            continue;
        };
        if tle::Station::new(latitude, longitude, 0.0).is_ok_and(|station| sees(&station)) {
            names.push(receiver.name.clone().unwrap_or_else(|| receiver.id.clone()));
        }
    }
    names
}

fn world(
    ui: &mut Ui,
    scene: &Scene<'_>,
    state: &mut State,
    (name, orbit): (&str, &Orbit),
    slots: &[SlotDraft],
    now_us: i64,
) {
    let Some((status, _)) = &scene.model.status else { return };
    let tracks: Vec<(Vec<TrackPoint>, Vec<Place>, String)> = slots
        .iter()
        .map(|slot| {
            let until_us = slot.at_us + i64::from(slot.count) * CHUNK_US;
            let label = format!("{}–{}", slot.first, slot.first.saturating_add(slot.count - 1));
            (
                orbit.track(slot.at_us, until_us, 10_000_000),
                orbit.footprint((slot.at_us + until_us) / 2),
                label,
            )
        })
        .collect();
    let mut satellites: Vec<Satellite<'_>> = tracks
        .iter()
        .map(|(track, footprint, label)| Satellite {
            name: label,
            place: track.first().map(|point| point.place),
            track,
            footprint,
            is_ours: true,
        })
        .collect();
    let here = orbit.below(now_us).map(|(place, _)| place);
    satellites.push(Satellite { name, place: here, track: &[], footprint: &[], is_ours: false });
    let heard = map::receivers(scene.model.receivers.value().map_or(&[][..], |page| &page.items));
    let world = World {
        now: orbit::timestamp(now_us),
        subsolar: Some(orbit::subsolar(now_us)),
        satellites: &satellites,
        stations: &map::station(&scene.kept.orbits, &status.station),
        receivers: &heard,
    };
    let map = state.map.get_or_insert_with(|| WorldMap::new(ui::map_base::View::default()));
    map.show(ui, ui.available_height().max(80.0), &world);
}

/// The telecommand as a draft for the sender.
fn draft(slots: &[SlotDraft]) -> Draft {
    let mut draft = Draft::of("SetDownlinkSchedule");
    draft.entries.insert("slots".to_owned(), slots.len());
    for (index, slot) in slots.iter().enumerate() {
        for (field, value) in [
            ("time", Time::from_unix_us(slot.at_us).to_string()),
            ("first", slot.first.to_string()),
            ("count", slot.count.to_string()),
        ] {
            draft.fields.insert(format!("slots[{index}].{field}"), value);
        }
    }
    draft
}

/// The same as a step of a plan.
fn step(slots: &[SlotDraft]) -> StepText {
    let slot = |slot: &SlotDraft| {
        let time = Time::from_unix_us(slot.at_us).to_string();
        serde_json::json!({ "time": time, "first": slot.first, "count": slot.count })
    };
    StepText {
        what: "upload-schedule".to_owned(),
        slots: Some(slots.iter().map(slot).collect()),
        ..StepText::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_are_the_same_in_a_command_and_in_a_plan() {
        let slots = [SlotDraft { at_us: 1_795_324_765_000_000, first: 5, count: 10 }];
        let draft = draft(&slots);
        assert_eq!(draft.fields["slots[0].first"], "5");
        let step = step(&slots);
        let written = &step.slots.unwrap()[0];
        assert_eq!(written["time"], draft.fields["slots[0].time"]);
        assert_eq!((written["first"].as_u64(), written["count"].as_u64()), (Some(5), Some(10)));
    }
}
