//! The window.

use std::time::Duration;

use egui_tiles::{Behavior, SimplificationOptions, TileId, UiResponse};

use crate::desk::{Desk, DeskFile};
use crate::link::Link;
use crate::panes::{self, Kept, Pane, Scene};
use crate::{bars, clock};

/// The window is drawn again after this long although nothing came: times go on.
const TICK: Duration = Duration::from_millis(250);

/// The window on one server.
pub struct App {
    link: Link,
    desk: Desk,
    file: Option<DeskFile>,
    kept: Kept,
    drawn_theme: Option<ui::Mode>,
}

impl App {
    /// A window. Without a file the desk is forgotten at the end.
    #[must_use]
    pub fn new(link: Link, desk: Desk, file: Option<DeskFile>) -> Self {
        Self { link, desk, file, kept: Kept::default(), drawn_theme: None }
    }

    /// What is known, to look at.
    #[must_use]
    pub fn link(&self) -> &Link {
        &self.link
    }

    /// What is arranged.
    #[must_use]
    pub fn desk(&self) -> &Desk {
        &self.desk
    }

    /// Draws one frame.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        let now = clock::instant();
        if self.drawn_theme != Some(self.desk.theme) {
            ui::theme::apply(ui.ctx(), self.desk.theme);
            self.drawn_theme = Some(self.desk.theme);
        }
        let mut tree = self.desk.take_tree();
        let layout = self.desk.layout;
        {
            let model = self.link.model();
            let now_us = model.clock.now_us(now);
            self.kept.turn(&model, now);
            let mut scene = Scene {
                model: &model,
                desk: &mut self.desk,
                courier: self.link.courier(),
                kept: &mut self.kept,
                now,
                now_us,
            };
            panes::step(&mut scene);
            egui::Panel::top("top").show(ui, |ui| bars::top(ui, &mut scene));
            egui::Panel::bottom("bottom").show(ui, |ui| bars::bottom(ui, &mut scene));
            egui::CentralPanel::no_frame().show(ui, |ui| tree.ui(&mut Docked { scene: &mut scene }, ui));
        }
        self.desk.trees.insert(layout, tree);
        if let Some(file) = &mut self.file {
            let is_urgent = std::mem::take(&mut self.desk.is_urgent);
            file.keep(&self.desk, now, is_urgent);
        }
        ui.ctx().request_repaint_after(TICK);
    }

    /// Writes the desk down at once.
    pub fn keep(&mut self) {
        if let Some(file) = &mut self.file {
            file.keep(&self.desk, clock::instant(), true);
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.keep();
    }
}

struct Docked<'a, 'b> {
    scene: &'a mut Scene<'b>,
}

impl Behavior<Pane> for Docked<'_, '_> {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _tile: TileId, pane: &mut Pane) -> UiResponse {
        egui::Frame::new().fill(ui.visuals().panel_fill).inner_margin(8).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            ui.push_id(*pane, |ui| panes::show(*pane, ui, self.scene));
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> egui::WidgetText {
        pane.name().into()
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }
}
