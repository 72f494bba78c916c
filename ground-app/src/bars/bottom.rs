//! Below: the last event, and how the line is.

use egui::{Align, Layout, RichText, Ui};
use jiff::{SignedDuration, Timestamp};
use ui::{Theme, format, lamps};

use crate::model::Connection;
use crate::panes::Scene;

pub(crate) fn bottom(ui: &mut Ui, scene: &mut Scene<'_>) {
    ui.horizontal(|ui| {
        lamps::connection(ui, &connection(scene));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.weak("Ctrl+K palette   ? keys");
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                doubts(ui, scene);
                last_event(ui, scene);
            });
        });
    });
}

fn connection(scene: &Scene<'_>) -> lamps::Connection {
    let model = scene.model;
    let server = model.address.clone();
    let signed = |length: std::time::Duration| SignedDuration::try_from(length).ok();
    let person = model.session.value().and_then(|session| session.name.clone());
    let person = person.unwrap_or_else(|| "looking on".to_owned());
    match &model.connection {
        Connection::Connecting => lamps::Connection::Lost { server, since: None, next_try: None },
        Connection::Lost { why, since, again_at } => match why.strip_prefix("the server refuses: ") {
            Some(why) => lamps::Connection::Refused { server, why: why.to_owned() },
            None => lamps::Connection::Lost {
                server,
                since: signed(scene.now.saturating_duration_since(*since)),
                next_try: signed(again_at.saturating_duration_since(scene.now)),
            },
        },
        Connection::CatchingUp { .. } | Connection::Live { .. } => match model.old_for(scene.now) {
            Some(silent) => lamps::Connection::Lost { server, since: signed(silent), next_try: None },
            None => lamps::Connection::Live { server, person },
        },
    }
}

fn doubts(ui: &mut Ui, scene: &Scene<'_>) {
    let theme = Theme::current(ui);
    if let Some(doubt) = scene.model.clock.doubt() {
        let by = format::age(SignedDuration::from_micros(doubt.ahead_us.abs()));
        let side = if doubt.ahead_us > 0 { "ahead of" } else { "behind" };
        ui.label(RichText::new(format!("This machine's clock is {by} {side} the server's")).color(theme.distress))
            .on_hover_text("All times in this window are the server's. Set this machine's clock (NTP), or look at the server's");
    }
    if let Some(version) = scene.model.version.value().filter(|version| version.api != api::API_VERSION) {
        let text = format!(
            "The server speaks version {} of the API, this window {}: only reading. Use the window of the server's version",
            version.api,
            api::API_VERSION
        );
        ui.label(RichText::new(text).color(theme.distress));
    }
}

fn last_event(ui: &mut Ui, scene: &Scene<'_>) {
    let live = scene.model.live_events.back();
    let kept = scene.model.events.value().and_then(|page| page.items.first());
    if let Some(event) = live.or(kept) {
        let at = Timestamp::from_microsecond(event.at.unix_us()).unwrap_or_default();
        let text = format!("{}  {}", format::time(at), event.message);
        ui.add(egui::Label::new(RichText::new(text).weak()).truncate());
    }
}
