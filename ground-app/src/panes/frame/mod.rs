//! One frame, byte by byte: what it says, and who heard it.

mod fields;

use api::FrameView;
use egui::{Key, Role, WidgetInfo};
use ui::inspector::{Inspector, inspector_ui};

use super::{Scene, blank, words};
use crate::link::Pending;
use fields::{Dissected, Part, dissect};

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    wanted: Option<u64>,
    asked: Option<Pending<FrameView>>,
    step: Option<Pending<api::Page<FrameView>>>,
    held: Option<Held>,
    failure: Option<String>,
    inspector: Inspector,
}

struct Held {
    view: FrameView,
    bytes: Vec<u8>,
    told: Dissected,
}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    let mut state = std::mem::take(&mut scene.kept.frame);
    let newest = || scene.model.live_frames.back().or(scene.model.frames.value()?.items.first());
    let wanted = scene.kept.opened_frame.or_else(|| state.wanted.or_else(|| Some(newest()?.id)));
    let Some(wanted) = wanted else {
        scene.kept.frame = state;
        return blank::show(ui, scene);
    };
    if state.wanted != Some(wanted) {
        state.wanted = Some(wanted);
        state.asked = Some(scene.courier.ask(move |client| async move { client.frame(wanted).await }));
    }
    take(&mut state, scene);
    let mut by = 0;
    ui.horizontal_wrapped(|ui| {
        ui.label(format!("Frame {wanted}"));
        let step = |ui: &mut egui::Ui, words: &str| ui.add(egui::Button::new(words)).clicked();
        if step(ui, "Previous frame") {
            by = -1;
        }
        if step(ui, "Next frame") {
            by = 1;
        }
        if let Some(why) = &state.failure {
            ui.weak(why);
        }
    });
    let nobody_types = ui.ctx().memory(|memory| memory.focused()).is_none();
    let over = ui.rect_contains_pointer(ui.max_rect());
    if nobody_types && over {
        by += i64::from(ui.input(|input| input.key_pressed(Key::ArrowRight)));
        by -= i64::from(ui.input(|input| input.key_pressed(Key::ArrowLeft)));
    }
    if by != 0 && state.step.is_none() {
        let satellite = scene.satellite().map(|satellite| satellite.satellite.clone());
        state.step = Some(neighbour(scene, satellite, wanted, by));
    }
    if let Some(held) = &state.held {
        let inspector = &mut state.inspector;
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            facts(ui, scene, held);
            ui.add_space(8.0);
            let fields: Vec<_> = held.told.parts.iter().map(Part::field).collect();
            inspector_ui(ui, inspector, &held.bytes, &fields);
            ui.add_space(8.0);
            receptions(ui, &held.view);
        });
    } else if state.asked.is_some() {
        ui.weak("Waiting for the frame");
    }
    scene.kept.frame = state;
}

/// The next or the previous frame of the satellite.
fn neighbour(
    scene: &Scene<'_>,
    satellite: Option<String>,
    frame: u64,
    by: i64,
) -> Pending<api::Page<FrameView>> {
    let mut filter = api::client::Filter::new().limit(1);
    if let Some(satellite) = satellite {
        filter = filter.satellite(&satellite);
    }
    let frame = i64::try_from(frame).unwrap_or(i64::MAX);
    let filter = if by > 0 { filter.after(frame) } else { filter.before(frame) };
    scene.courier.ask(move |client| async move { client.frames(&filter).await })
}

fn take(state: &mut State, scene: &mut Scene<'_>) {
    if let Some(answer) = state.asked.as_ref().and_then(Pending::take) {
        state.asked = None;
        match answer {
            Ok(view) => {
                state.failure = None;
                let bytes = super::album::bytes_of(&view.hex).unwrap_or_default();
                state.inspector = Inspector::default();
                state.held = Some(Held { told: dissect(&bytes), bytes, view });
            }
            Err(error) => state.failure = Some(error.to_string()),
        }
    }
    if let Some(answer) = state.step.as_ref().and_then(Pending::take) {
        state.step = None;
        match answer {
            Ok(page) => match page.items.first() {
                Some(frame) => {
                    scene.kept.opened_frame = Some(frame.id);
                    state.failure = None;
                }
                None => state.failure = Some("There is no further one".to_owned()),
            },
            Err(error) => state.failure = Some(error.to_string()),
        }
    }
}

fn facts(ui: &mut egui::Ui, scene: &Scene<'_>, held: &Held) {
    let view = &held.view;
    let heard = ui::format::utc_ms(words::time(view.heard_at));
    let age = scene.now_us.map(|now_us| format!(", {} ago", words::age(view.heard_at.unix_us(), now_us)));
    let name = view.packet_name.as_deref().unwrap_or("unknown packet");
    ui.horizontal_wrapped(|ui| {
        ui.strong(name);
        ui.label(format!("{} form, {} bytes", view.form, view.length));
        // What the satellite sends is never sealed.
        ui.label("clear");
        ui.label(if held.told.crc { "CRC right" } else { "CRC wrong" });
        match view.tag {
            Some(tag) => ui.label(format!("answers request tag {tag}")),
            None => ui.weak("unsolicited"),
        };
        if view.nested {
            ui.label("lay inside another frame, and changed nothing");
        }
    });
    ui.weak(format!("heard {heard}{}", age.unwrap_or_default()));
    if let Some(fault) = held.told.fault.as_deref().or(view.undecoded.as_deref()) {
        ui.label(format!("not decoded: {fault}"));
    }
    let version = scene.model.version.value();
    let decoder = version.map_or(ui::format::UNKNOWN.to_owned(), |version| version.decoder.to_string());
    ui.weak(format!(
        "decoder {decoder}; to derive all values of the archive again: gs-server redecode --data FOLDER"
    ));
}

fn receptions(ui: &mut egui::Ui, view: &FrameView) {
    ui.strong("Who heard it");
    for reception in &view.receptions {
        let at = ui::format::utc_ms(words::time(reception.received_at));
        let level = ui::format::dbm(reception.rssi_dbm.map(f64::from));
        let words =
            format!("{} over {} ({}), {at}, {level}", reception.station, reception.link, reception.source);
        told(ui, &words, false);
    }
    for outside in &view.heard_elsewhere {
        let at = ui::format::utc_ms(words::time(outside.received_at));
        let who = outside.receiver_name.as_deref().or(outside.receiver.as_deref()).unwrap_or("somebody");
        let level = ui::format::dbm(outside.rssi_dbm);
        let snr = ui::format::db(outside.snr_db);
        told(ui, &format!("{who} by {}, {at}, {level}, SNR {snr}", outside.source), true);
    }
    if view.receptions.is_empty() && view.heard_elsewhere.is_empty() {
        ui.weak("nobody that is known");
    }
}

fn told(ui: &mut egui::Ui, words: &str, stranger: bool) {
    let words = if stranger { format!("stranger: {words}") } else { words.to_owned() };
    let label = ui.label(&words);
    label.widget_info(|| WidgetInfo::labeled(Role::Label, true, words.as_str()));
}
