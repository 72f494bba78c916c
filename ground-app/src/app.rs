//! The window.

use std::time::Duration;

use egui_tiles::{Behavior, SimplificationOptions, TileId, Tiles, UiResponse};

use crate::desk::{Desk, DeskFile};
use crate::keys::{self, Deed};
use crate::link::Link;
use crate::palette::{Act, Palette};
use crate::panes::{self, Kept, Pane, Scene};
use crate::{bars, clock, help};

/// The window is drawn again after this long although nothing came: times go on.
const TICK: Duration = Duration::from_millis(250);
/// Everything is between so many times its own size.
const ZOOM: std::ops::RangeInclusive<f32> = 0.5..=3.0;

/// The window on one server.
pub struct App {
    link: Link,
    desk: Desk,
    file: Option<DeskFile>,
    kept: Kept,
    palette: Palette,
    help: bool,
    drawn_theme: Option<ui::Mode>,
}

impl App {
    /// A window. Without a file the desk is forgotten at the end.
    #[must_use]
    pub fn new(link: Link, desk: Desk, file: Option<DeskFile>) -> Self {
        let (kept, palette) = (Kept::default(), Palette::default());
        Self { link, desk, file, kept, palette, help: false, drawn_theme: None }
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
        let (now, context) = (clock::instant(), ui.ctx().clone());
        self.dress(&context);
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
            let mut acts: Vec<Act> = keys::pressed(&context).into_iter().map(Act::Deed).collect();
            acts.extend(self.palette.show(&context, &scene));
            help::show(&context, &mut self.help);
            for act in acts {
                match act {
                    Act::Deed(Deed::Palette) => self.palette.open(),
                    Act::Deed(Deed::Help) => self.help = !self.help,
                    act => perform(act, &context, &mut scene),
                }
            }
            if let Some(pane) = scene.kept.to_open.take() {
                scene.desk.show_pane(pane);
                scene.kept.keyboard_for = Some(pane);
            }
            egui::Panel::top("top").show(ui, |ui| bars::top(ui, &mut scene));
            egui::Panel::bottom("bottom").show(ui, |ui| bars::bottom(ui, &mut scene));
            let (place, mut tree) = (scene.desk.place(), scene.desk.take_tree());
            let shown =
                egui::CentralPanel::no_frame().show(ui, |ui| tree.ui(&mut Docked { scene: &mut scene }, ui));
            scene.desk.put_tree(place, tree);
            bars::old(&context, shown.response.rect, &scene);
        }
        if let Some(file) = &mut self.file {
            let is_urgent = std::mem::take(&mut self.desk.is_urgent);
            file.keep(&self.desk, now, is_urgent);
        }
        context.request_repaint_after(TICK);
    }

    fn dress(&mut self, context: &egui::Context) {
        if self.drawn_theme != Some(self.desk.theme) {
            if self.drawn_theme.is_none() {
                // Ours, since it is to be remembered
                context.options_mut(|options| options.zoom_with_keyboard = false);
            }
            ui::theme::apply(context, self.desk.theme);
            self.drawn_theme = Some(self.desk.theme);
        }
        let zoom = self.desk.zoom.clamp(*ZOOM.start(), *ZOOM.end());
        if (context.zoom_factor() - zoom).abs() > 1e-3 {
            context.set_zoom_factor(zoom);
        }
    }

    /// Writes the desk down at once.
    pub fn keep(&mut self) {
        if let Some(file) = &mut self.file {
            file.keep(&self.desk, clock::instant(), true);
        }
    }
}

fn perform(act: Act, context: &egui::Context, scene: &mut Scene<'_>) {
    let deed = match act {
        Act::Deed(deed) => deed,
        Act::Pane(pane) => return scene.open(pane),
        Act::Satellite(name) => return scene.desk.satellite = Some(name),
        Act::Saved(name) => return scene.desk.show_saved(&name),
        Act::Call(call) => return call(scene),
    };
    let zoomed = |zoom: f32| ((zoom * 10.0).round() / 10.0).clamp(*ZOOM.start(), *ZOOM.end());
    match deed {
        Deed::Layout(layout) => scene.desk.show_layout(layout),
        Deed::Alarms => scene.open(Pane::Alarms),
        Deed::Search => scene.open(Pane::Search),
        Deed::Pause => scene.kept.paused = !scene.kept.paused,
        Deed::Theme => {
            scene.desk.theme = match scene.desk.theme {
                ui::Mode::Dark => ui::Mode::Light,
                ui::Mode::Light => ui::Mode::Dark,
            };
        }
        Deed::Larger => scene.desk.zoom = zoomed(scene.desk.zoom + 0.1),
        Deed::Smaller => scene.desk.zoom = zoomed(scene.desk.zoom - 0.1),
        Deed::AsItWas => scene.desk.zoom = 1.0,
        Deed::FullScreen => {
            let full = context.input(|input| input.viewport().fullscreen.unwrap_or(false));
            context.send_viewport_cmd(egui::ViewportCommand::Fullscreen(!full));
        }
        // The window has done these
        Deed::Palette | Deed::Help => {}
    }
    context.request_repaint();
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

    fn is_tab_closable(&self, _tiles: &Tiles<Pane>, _tile: TileId) -> bool {
        true
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }
}
