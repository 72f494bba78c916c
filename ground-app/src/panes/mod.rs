//! What can be docked. A pane is a function of what is known and of what the operator does; it never waits.

mod alarms;
mod album;
mod attitude;
mod blank;
mod chunks;
mod commands;
mod deed;
mod downlink_map;
mod elements;
mod export;
mod frame;
mod gallery;
mod history;
mod log;
mod map;
pub(crate) mod may;
mod notes;
mod pass_curves;
mod pass_plan;
mod picture;
mod plan_editor;
mod plan_words;
mod plots;
mod receivers;
mod rehearsal;
mod reports;
mod search;
mod sky;
mod station;
mod timeline;
mod values;
mod words;

use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::desk::Desk;
use crate::link::Courier;
use crate::model::Model;
use crate::palette::Entry;

/// What can be docked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pane {
    /// Where the satellite stands in the sky.
    Sky,
    /// Doppler, range, signal over the pass.
    PassCurves,
    /// The plan that runs, as a track.
    PassPlan,
    /// Commands with their stages; the sender.
    Commands,
    /// The picture as it grows.
    Picture,
    /// Its chunks.
    Chunks,
    /// Values with limits and ages.
    Values,
    /// Alarms.
    Alarms,
    /// Frames and events, newest first.
    Log,
    /// Passes, plans, contacts over days.
    Timeline,
    /// The steps of a plan.
    PlanEditor,
    /// What the twin made of it.
    Rehearsal,
    /// Where chunks are to be sent, on the map.
    DownlinkMap,
    /// The body in space.
    Attitude,
    /// The world.
    Map,
    /// Values over time.
    Plots,
    /// All images.
    Gallery,
    /// What was: by words, times, kinds.
    Search,
    /// One frame, byte by byte.
    Frame,
    /// Links, queues, storage, clock.
    Station,
    /// Elements and their age.
    Elements,
    /// Who hears the satellite.
    Receivers,
    /// The operators' log.
    Notes,
    /// Reports.
    Reports,
}

impl Pane {
    /// All.
    pub const ALL: [Self; 24] = [
        Self::Sky,
        Self::PassCurves,
        Self::PassPlan,
        Self::Commands,
        Self::Picture,
        Self::Chunks,
        Self::Values,
        Self::Alarms,
        Self::Log,
        Self::Timeline,
        Self::PlanEditor,
        Self::Rehearsal,
        Self::DownlinkMap,
        Self::Attitude,
        Self::Map,
        Self::Plots,
        Self::Gallery,
        Self::Search,
        Self::Frame,
        Self::Station,
        Self::Elements,
        Self::Receivers,
        Self::Notes,
        Self::Reports,
    ];

    /// Its name on the screen.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sky => "Sky",
            Self::PassCurves => "Doppler and signal",
            Self::PassPlan => "Plan",
            Self::Commands => "Commands",
            Self::Picture => "Picture",
            Self::Chunks => "Chunks",
            Self::Values => "Values",
            Self::Alarms => "Alarms",
            Self::Log => "Frames and events",
            Self::Timeline => "Timeline",
            Self::PlanEditor => "Plan editor",
            Self::Rehearsal => "Rehearsal",
            Self::DownlinkMap => "Downlink schedule",
            Self::Attitude => "Attitude",
            Self::Map => "Map",
            Self::Plots => "Plots",
            Self::Gallery => "Images",
            Self::Search => "Search",
            Self::Frame => "Frame",
            Self::Station => "Station",
            Self::Elements => "Elements",
            Self::Receivers => "Who hears us",
            Self::Notes => "Operators' log",
            Self::Reports => "Reports",
        }
    }
}

/// What a pane is given.
pub struct Scene<'a> {
    /// What is known.
    pub model: &'a Model,
    /// What is arranged.
    pub desk: &'a mut Desk,
    /// Takes questions.
    pub courier: &'a Courier,
    /// What panes keep between frames.
    pub kept: &'a mut Kept,
    /// Now, on this machine.
    pub now: Instant,
    /// Now, at the server: UTC in microseconds since 1970; `None` before its first word.
    pub now_us: Option<i64>,
}

impl Scene<'_> {
    /// The satellite that is looked at, as the station told of it last.
    #[must_use]
    pub fn satellite(&self) -> Option<&api::SatelliteView> {
        let (status, _) = self.model.status.as_ref()?;
        let chosen = self.desk.satellite.as_deref();
        let named = |view: &&api::SatelliteView| chosen.is_none_or(|name| view.satellite == name);
        status.satellites.iter().find(named).or(status.satellites.first())
    }

    /// Brings a pane to the front, in this layout or in the one that has it, and gives it the keyboard.
    pub fn open(&mut self, pane: Pane) {
        self.kept.to_open = Some(pane);
    }

    /// Whether this pane was opened just now and should take the keyboard; true once.
    pub fn takes_keyboard(&mut self, pane: Pane) -> bool {
        self.kept.keyboard_for.take_if(|wanted| *wanted == pane).is_some()
    }
}

/// What panes offer in the palette for what was typed. Each opens, chooses or fills in; none may send anything by itself.
pub(crate) fn entries(_scene: &Scene<'_>, typed: &str) -> Vec<Entry> {
    commands::entries(typed)
}

/// What goes on whether or not its pane is on the screen. Once a frame, before anything is drawn.
pub(crate) fn step(scene: &mut Scene<'_>) {
    commands::step(scene);
}

/// Silence: the satellite's transmitter off, by one click from anywhere.
pub fn cease(scene: &mut Scene<'_>) {
    commands::cease(scene);
}

/// Opens a draft in the sender, as the palette does. Sends nothing.
pub fn open_draft(scene: &mut Scene<'_>, draft: crate::desk::Draft) {
    commands::open(scene, draft);
    scene.open(Pane::Commands);
}

/// What panes keep between frames; each its own, none of it worth a file.
#[derive(Default)]
#[expect(dead_code, reason = "not every pane keeps something")]
pub struct Kept {
    /// What is live is held still: lists and plots stay as they are. Nothing is lost by it.
    pub paused: bool,
    /// The name that is typed for a layout.
    pub(crate) layout_name: String,
    /// The frame that was chosen: the frame pane shows it.
    pub chosen_frame: Option<u64>,
    /// A pane that is to be brought to the front.
    pub(crate) to_open: Option<Pane>,
    /// A pane that is to take the keyboard.
    pub(crate) keyboard_for: Option<Pane>,
    orbits: crate::orbit::Orbits,
    sky: sky::State,
    pass_curves: pass_curves::State,
    pass_plan: pass_plan::State,
    commands: commands::State,
    picture: picture::State,
    chunks: chunks::State,
    values: values::State,
    alarms: alarms::State,
    log: log::State,
    timeline: timeline::State,
    plan_editor: plan_editor::State,
    rehearsal: rehearsal::State,
    downlink_map: downlink_map::State,
    attitude: attitude::State,
    map: map::State,
    plots: plots::State,
    gallery: gallery::State,
    search: search::State,
    frame: frame::State,
    station: station::State,
    elements: elements::State,
    receivers: receivers::State,
    notes: notes::State,
    reports: reports::State,
    history: history::Histories,
    album: album::Album,
    exports: export::Exports,
    /// The frame that is looked at.
    opened_frame: Option<u64>,
    /// Plots point at this time next.
    point_at: Option<i64>,
}

impl Kept {
    /// Once a frame, before the panes: answers that came are taken.
    pub(crate) fn turn(&mut self, model: &Model, now: Instant) {
        self.history.turn(model, now);
    }

    /// Shows this frame in its pane.
    pub(crate) fn open_frame(&mut self, frame: u64) {
        self.opened_frame = Some(frame);
    }
}

/// Draws a pane.
pub fn show(pane: Pane, ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    match pane {
        Pane::Sky => sky::show(ui, scene),
        Pane::PassCurves => pass_curves::show(ui, scene),
        Pane::PassPlan => pass_plan::show(ui, scene),
        Pane::Commands => commands::show(ui, scene),
        Pane::Picture => picture::show(ui, scene),
        Pane::Chunks => chunks::show(ui, scene),
        Pane::Values => values::show(ui, scene),
        Pane::Alarms => alarms::show(ui, scene),
        Pane::Log => log::show(ui, scene),
        Pane::Timeline => timeline::show(ui, scene),
        Pane::PlanEditor => plan_editor::show(ui, scene),
        Pane::Rehearsal => rehearsal::show(ui, scene),
        Pane::DownlinkMap => downlink_map::show(ui, scene),
        Pane::Attitude => attitude::show(ui, scene),
        Pane::Map => map::show(ui, scene),
        Pane::Plots => plots::show(ui, scene),
        Pane::Gallery => gallery::show(ui, scene),
        Pane::Search => search::show(ui, scene),
        Pane::Frame => frame::show(ui, scene),
        Pane::Station => station::show(ui, scene),
        Pane::Elements => elements::show(ui, scene),
        Pane::Receivers => receivers::show(ui, scene),
        Pane::Notes => notes::show(ui, scene),
        Pane::Reports => reports::show(ui, scene),
    }
}
