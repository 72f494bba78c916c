//! Above: satellite and station, time, link, transmitter, alarms, who we are, and the way to silence.

use api::LinkView;
use egui::{Align, Layout as Place, RichText, Ui};
use jiff::{SignedDuration, Timestamp};
use ui::lamps::{self, Link, PassTimes, Transmitter};
use ui::{Level, Theme};

use crate::desk::Layout;
use crate::panes::{self, Pane, Scene, may};

/// Narrower than this, what stands at the right end goes to the next line.
const WIDE: f32 = 1220.0;

pub(crate) fn top(ui: &mut Ui, scene: &mut Scene<'_>) {
    let is_simulated = scene.model.status.as_ref().is_some_and(|(status, _)| status.simulated);
    if is_simulated {
        lamps::simulated_hatch(ui.painter(), ui.max_rect().expand(8.0), Theme::current(ui));
    }
    let is_wide = ui.available_width() >= WIDE;
    let row = |ui: &mut Ui, scene: &mut Scene<'_>| {
        satellites(ui, scene);
        let now = scene.timestamp();
        if scene.now_us.is_some() {
            lamps::utc_clock(ui, now, &mut scene.desk.day_of_year);
        }
        lamps::countdown(ui, now, pass(scene, now));
        for (name, link, heard) in links(scene, now) {
            lamps::link_lamp(ui, &name, link, heard);
        }
        if is_wide {
            ui.with_layout(Place::right_to_left(Align::Center), |ui| {
                cease(ui, scene);
                lamps::transmitter_lamp(ui, transmitter(scene));
            });
        } else {
            lamps::transmitter_lamp(ui, transmitter(scene));
            cease(ui, scene);
        }
    };
    if is_wide {
        ui.horizontal(|ui| row(ui, scene));
    } else {
        ui.horizontal_wrapped(|ui| row(ui, scene));
    }
    ui.horizontal_wrapped(|ui| {
        layouts(ui, scene);
        if is_simulated {
            lamps::simulated_word(ui);
        }
        let counts = alarms(scene);
        ui.scope(|ui| {
            if lamps::alarm_counts(ui, counts).is_some() {
                scene.open(Pane::Alarms);
            }
        });
        who(ui, scene);
        if scene.kept.paused {
            let text = RichText::new("HELD STILL, Space goes on").color(Theme::current(ui).distress);
            ui.label(text).on_hover_text("Lists and plots stay as they are. Nothing is lost meanwhile");
        }
    });
}

fn satellites(ui: &mut Ui, scene: &mut Scene<'_>) {
    let Some((status, _)) = &scene.model.status else {
        ui.weak("no satellite yet");
        return;
    };
    let chosen =
        scene.satellite().map_or("no satellite", |satellite| satellite.satellite.as_str()).to_owned();
    let station = &status.station;
    if status.satellites.len() < 2 {
        ui.strong(chosen);
    } else {
        let names = status.satellites.iter().map(|satellite| satellite.satellite.clone());
        let names: Vec<String> = names.collect();
        let box_ = egui::ComboBox::from_id_salt("satellite").selected_text(RichText::new(&chosen).strong());
        let shown = box_.show_ui(ui, |ui| {
            for name in names {
                if ui.selectable_label(name == chosen, &name).clicked() {
                    scene.desk.satellite = Some(name);
                }
            }
        });
        shown.response.on_hover_text("The satellite that is looked at");
    }
    ui.weak(station);
}

fn pass(scene: &Scene<'_>, now: Timestamp) -> Option<PassTimes> {
    let at = |time: api::Time| Timestamp::from_microsecond(time.unix_us()).ok();
    let all = &scene.satellite()?.next_passes;
    let mut all = all.iter().filter_map(|pass| Some(PassTimes { aos: at(pass.aos)?, los: at(pass.los?)? }));
    all.find(|pass| pass.los > now)
}

fn links(scene: &Scene<'_>, now: Timestamp) -> Vec<(String, Link, Option<SignedDuration>)> {
    let (Some((status, _)), Some(satellite)) = (&scene.model.status, scene.satellite()) else {
        return Vec::new();
    };
    let heard = satellite.heard_at.and_then(|at| Timestamp::from_microsecond(at.unix_us()).ok());
    let heard = heard.map(|at| now.duration_since(at));
    let out_of_view = satellite.in_view == Some(false);
    let is_old = scene.model.old_for(scene.now).is_some();
    let state = |link: &LinkView| match link.state.as_str() {
        _ if is_old => Link::Unavailable,
        "ok" if out_of_view => Link::Quiet,
        "ok" => Link::Ok,
        "disabled" => Link::Disabled,
        "failed" => Link::Failed,
        _ => Link::Unavailable,
    };
    let of = status.links.iter().filter(|link| link.satellite == satellite.satellite);
    of.take(3).map(|link| (link.link.clone(), state(link), heard)).collect()
}

fn transmitter(scene: &Scene<'_>) -> Transmitter {
    match &scene.model.status {
        Some((status, _)) if scene.model.old_for(scene.now).is_none() => {
            match (status.links.iter().any(|link| link.on_air), status.links.iter().any(|link| link.armed)) {
                (true, _) => Transmitter::OnAir,
                (false, true) => Transmitter::Armed,
                (false, false) => Transmitter::Safe,
            }
        }
        _ => Transmitter::Unknown,
    }
}

fn cease(ui: &mut Ui, scene: &mut Scene<'_>) {
    let can = scene.may("command");
    let theme = Theme::current(ui);
    let text =
        RichText::new("Cease transmission").color(if can.is_ok() { theme.critical } else { theme.faint });
    if may::button(ui, text, &can) {
        panes::cease(scene);
    }
}

/// Open alarms by level, watch first: those that hold and those that nobody has seen.
fn alarms(scene: &Scene<'_>) -> [usize; 5] {
    let mut counts = [0; 5];
    for alert in scene.model.alerts.value().iter().flat_map(|page| &page.items) {
        let level = Level::ALL.into_iter().find(|level| level.word() == alert.level);
        if let Some(level) = level.filter(|_| !matches!(alert.state.as_str(), "closed" | "shelved")) {
            counts[level.index()] += 1;
        }
    }
    counts
}

fn who(ui: &mut Ui, scene: &Scene<'_>) {
    let Some(session) = scene.model.session.value() else { return };
    let name = session.name.as_deref().unwrap_or("nobody logged in");
    let role = session.role.as_deref().map(|role| format!(", {role}")).unwrap_or_default();
    let only = if session.rights.iter().any(|right| right == "command") { "" } else { ", only looking" };
    let rights = session.rights.join(", ");
    ui.weak(format!("{name}{role}{only}")).on_hover_text(format!("May: {rights}"));
}

fn layouts(ui: &mut Ui, scene: &mut Scene<'_>) {
    for layout in Layout::ALL {
        let is_shown = scene.desk.layout == layout && scene.desk.shown.is_none();
        if ui.selectable_label(is_shown, layout.name()).clicked() {
            scene.desk.show_layout(layout);
        }
    }
    let menu = scene.desk.shown.clone().unwrap_or_else(|| "Layout".to_owned());
    ui.menu_button(format!("{menu} ▼"), |ui| {
        let mut to_forget = None;
        for name in scene.desk.saved.keys().cloned().collect::<Vec<_>>() {
            ui.horizontal(|ui| {
                if ui.button(&name).clicked() {
                    scene.desk.show_saved(&name);
                }
                if ui.small_button("forget").clicked() {
                    to_forget = Some(name);
                }
            });
        }
        if let Some(name) = to_forget {
            scene.desk.forget(&name);
        }
        ui.horizontal(|ui| {
            let name = &mut scene.kept.layout_name;
            ui.add(egui::TextEdit::singleline(name).hint_text("Name").desired_width(120.0))
                .accessible_name("Name of the layout");
            let name = name.trim().to_owned();
            if ui.add_enabled(!name.is_empty(), egui::Button::new("Save as")).clicked() {
                scene.desk.save_as(&name);
                scene.kept.layout_name.clear();
                ui.close();
            }
        });
        if ui.button("As it was at first").clicked() {
            scene.desk.reset_layout();
            ui.close();
        }
        ui.menu_button("Add a pane", |ui| {
            for pane in Pane::ALL {
                if ui.button(pane.name()).clicked() {
                    scene.desk.add_pane(pane);
                    ui.close();
                }
            }
        });
    });
}
