//! What the operator has arranged: kept in one file, so that a window that is closed, or killed, comes back as it was.

mod commands;
mod layout;
mod plots;
mod store;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use commands::{Asked, CommandDesk, Draft, Gate, KEPT_MAX, Stack, StackStep, Template};
pub use layout::Layout;
pub use plots::{CURVES_MAX, PLOTS_MAX, PlotsDesk};
pub use store::{DeskFile, DeskFileError};

use crate::panes::Pane;

/// What the operator has arranged.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(default)]
pub struct Desk {
    /// Dark or light.
    pub theme: ui::Mode,
    /// Size of everything, 1.0 as it is.
    pub zoom: f32,
    /// Times with the day of the year.
    pub day_of_year: bool,
    /// Which layout is shown.
    pub layout: Layout,
    /// Layouts that were rearranged.
    pub trees: BTreeMap<Layout, egui_tiles::Tree<Pane>>,
    /// The satellite that is looked at; `None`: the first.
    pub satellite: Option<String>,
    /// Sound at AOS and for critical alarms.
    pub sound: bool,
    /// What is prepared to be sent.
    pub commands: CommandDesk,
    /// What must be on the disk before the next frame: an idempotency key before it is used.
    #[serde(skip)]
    pub is_urgent: bool,
    /// The plots.
    pub plots: PlotsDesk,
}

impl Default for Desk {
    fn default() -> Self {
        Self {
            theme: ui::Mode::Dark,
            zoom: 1.0,
            day_of_year: false,
            layout: Layout::Pass,
            trees: BTreeMap::new(),
            satellite: None,
            sound: false,
            commands: CommandDesk::default(),
            is_urgent: false,
            plots: PlotsDesk::default(),
        }
    }
}

impl Desk {
    /// The tree of the layout that is shown, taken out while it is drawn.
    pub fn take_tree(&mut self) -> egui_tiles::Tree<Pane> {
        self.trees.remove(&self.layout).unwrap_or_else(|| self.layout.tree())
    }

    /// Puts it back.
    pub fn put_tree(&mut self, tree: egui_tiles::Tree<Pane>) {
        self.trees.insert(self.layout, tree);
    }

    /// The layout that is shown, as it was at first.
    pub fn reset_layout(&mut self) {
        self.trees.remove(&self.layout);
    }
}
