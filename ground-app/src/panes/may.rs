//! Whether something may be done now, and why not.

use super::Scene;
use crate::model::Connection;

impl Scene<'_> {
    /// Whether who sits here may do what needs this right, now; else why not, in words for the greyed button.
    pub(crate) fn may(&self, right: &str) -> Result<(), String> {
        match self.model.connection {
            Connection::Live { .. } => {}
            Connection::CatchingUp { .. } => return Err("the window is still catching up".to_owned()),
            Connection::Connecting | Connection::Lost { .. } => {
                return Err("the server is away: nothing can be asked of it".to_owned());
            }
        }
        if let Some(silent) = self.model.old_for(self.now) {
            return Err(format!("no word from the server for {} s", silent.as_secs()));
        }
        if let Some(version) = self.model.version.value().filter(|version| version.api != api::API_VERSION) {
            let ours = api::API_VERSION;
            return Err(format!("the server speaks version {} of the API, this window {ours}", version.api));
        }
        if self.model.status.is_none() || self.now_us.is_none() {
            return Err("the server has not said yet how the station is".to_owned());
        }
        let Some(session) = self.model.session.value() else {
            return Err("the server has not said yet what you may do".to_owned());
        };
        if session.rights.iter().any(|held| held == right) {
            return Ok(());
        }
        let who = session.name.as_deref().unwrap_or("nobody is logged in here, who");
        Err(format!("this needs the right '{right}', which {who} does not have"))
    }

    /// Whether a second person has to approve what is critical.
    pub(crate) fn needs_two(&self) -> bool {
        self.model.session.value().is_some_and(|session| session.two_person == "critical")
    }

    /// The server's time, for widgets that count; the beginning of time before its first word.
    pub(crate) fn timestamp(&self) -> jiff::Timestamp {
        self.now_us
            .and_then(|us| jiff::Timestamp::from_microsecond(us).ok())
            .unwrap_or(jiff::Timestamp::UNIX_EPOCH)
    }
}

/// A button that Enter does not press: by the mouse or the space bar only. Greyed with its reason where `may` says no.
pub(crate) fn button(ui: &mut egui::Ui, text: impl Into<egui::WidgetText>, may: &Result<(), String>) -> bool {
    let response = ui.add_enabled(may.is_ok(), egui::Button::new(text));
    let by_enter = ui.input(|input| input.key_pressed(egui::Key::Enter));
    let clicked = response.clicked() && !by_enter;
    if let Err(why) = may {
        response.on_disabled_hover_text(why);
    }
    clicked
}
