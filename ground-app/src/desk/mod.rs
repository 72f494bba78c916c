//! What the operator has arranged: kept in one file, so that a window that is closed, or killed, comes back as it was.

mod commands;
mod layout;
mod plans;
mod plots;
mod store;

use std::collections::BTreeMap;

use egui_tiles::{Container, Tile, Tree};
use serde::{Deserialize, Serialize};

pub use commands::{Asked, CommandDesk, Draft, Gate, KEPT_MAX, Stack, StackStep, Template};
pub use layout::Layout;
pub use plans::{PlanDesk, PlanDraft, SlotDraft};
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
    pub trees: BTreeMap<Layout, Tree<Pane>>,
    /// Arrangements that were saved under a name.
    pub saved: BTreeMap<String, Tree<Pane>>,
    /// Which of them is shown; `None`: the layout.
    pub shown: Option<String>,
    /// The satellite that is looked at; `None`: the first.
    pub satellite: Option<String>,
    /// Sound at AOS and for critical alarms.
    pub sound: bool,
    /// What is prepared to be sent.
    pub commands: CommandDesk,
    /// Where reports are saved; empty: at home.
    pub report_folder: String,
    /// What must be on the disk before the next frame: an idempotency key before it is used.
    #[serde(skip)]
    pub is_urgent: bool,
    /// The plots.
    pub plots: PlotsDesk,
    /// Plans being written.
    pub plans: PlanDesk,
}

impl Default for Desk {
    fn default() -> Self {
        Self {
            theme: ui::Mode::Dark,
            zoom: 1.0,
            day_of_year: false,
            layout: Layout::Pass,
            trees: BTreeMap::new(),
            saved: BTreeMap::new(),
            shown: None,
            satellite: None,
            sound: false,
            commands: CommandDesk::default(),
            report_folder: String::new(),
            is_urgent: false,
            plots: PlotsDesk::default(),
            plans: PlanDesk::default(),
        }
    }
}

impl Desk {
    /// The tree that is shown, taken out while it is drawn.
    pub fn take_tree(&mut self) -> Tree<Pane> {
        let saved = self.shown.as_ref().and_then(|name| self.saved.remove(name));
        saved.unwrap_or_else(|| self.trees.remove(&self.layout).unwrap_or_else(|| self.layout.tree()))
    }

    /// Puts it back where [`Self::place`] said it was taken from.
    pub fn put_tree(&mut self, place: Place, tree: Tree<Pane>) {
        match place {
            Place::Layout(layout) => {
                self.trees.insert(layout, tree);
            }
            Place::Saved(name) => {
                self.saved.insert(name, tree);
            }
        }
    }

    /// Which tree is shown.
    #[must_use]
    pub fn place(&self) -> Place {
        match &self.shown {
            Some(name) if self.saved.contains_key(name) => Place::Saved(name.clone()),
            _ => Place::Layout(self.layout),
        }
    }

    /// Shows a layout.
    pub fn show_layout(&mut self, layout: Layout) {
        (self.layout, self.shown) = (layout, None);
    }

    /// Shows what was saved under this name.
    pub fn show_saved(&mut self, name: &str) {
        self.shown = self.saved.contains_key(name).then(|| name.to_owned());
    }

    /// The layout that is shown, as it was at first.
    pub fn reset_layout(&mut self) {
        self.shown = None;
        self.trees.remove(&self.layout);
    }

    /// Keeps what is shown under a name, and shows that. A name that is taken is taken over.
    pub fn save_as(&mut self, name: &str) {
        let place = self.place();
        let mut tree = self.take_tree();
        self.put_tree(place, tree.clone());
        tree = renamed(tree, name);
        self.saved.insert(name.to_owned(), tree);
        self.shown = Some(name.to_owned());
    }

    /// Forgets what was saved under a name.
    pub fn forget(&mut self, name: &str) {
        self.saved.remove(name);
        self.shown.take_if(|shown| shown == name);
    }

    /// Brings a pane to the front: where it is on the screen, in the layout that has it, or added to what is shown.
    pub fn show_pane(&mut self, pane: Pane) {
        let is_it =
            |_: egui_tiles::TileId, tile: &Tile<Pane>| matches!(tile, Tile::Pane(one) if *one == pane);
        let has = |tree: &Tree<Pane>| tree.tiles.find_pane(&pane).is_some();
        let place = self.place();
        let mut tree = self.take_tree();
        if tree.make_active(is_it) {
            return self.put_tree(place, tree);
        }
        self.put_tree(place, tree);
        let layouts =
            [Layout::Pass, Layout::Health, Layout::Archive, Layout::Satellite, Layout::Images, Layout::Plan];
        let tree_of = |layout: &Layout| self.trees.get(layout).cloned().unwrap_or_else(|| layout.tree());
        if let Some(layout) = layouts.into_iter().find(|layout| has(&tree_of(layout))) {
            self.show_layout(layout);
            let mut tree = self.take_tree();
            tree.make_active(is_it);
            return self.put_tree(Place::Layout(layout), tree);
        }
        self.add_pane(pane);
    }

    /// Adds a pane to what is shown, as a tab beside the first one, and brings it to the front.
    pub fn add_pane(&mut self, pane: Pane) {
        let place = self.place();
        let mut tree = self.take_tree();
        let new = tree.tiles.insert_pane(pane);
        let tabs = |(id, tile): (&egui_tiles::TileId, &Tile<Pane>)| {
            matches!(tile, Tile::Container(Container::Tabs(_))).then_some(*id)
        };
        match tree.tiles.iter().filter_map(tabs).min_by_key(|id| id.0) {
            Some(home) => tree.move_tile_to_container(new, home, usize::MAX, false),
            None => {
                let mut children: Vec<_> = tree.root().into_iter().collect();
                children.push(new);
                let root = tree.tiles.insert_horizontal_tile(children);
                tree.root = Some(root);
            }
        }
        tree.make_active(|id, _| id == new);
        self.put_tree(place, tree);
    }
}

/// Where a tree belongs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The layout of that name.
    Layout(Layout),
    /// What was saved under that name.
    Saved(String),
}

/// The same under another name: two trees of one name would share their widths.
fn renamed(tree: Tree<Pane>, name: &str) -> Tree<Pane> {
    match tree.root() {
        Some(root) => Tree::new(egui::Id::unique(("saved layout", name)), root, tree.tiles),
        None => tree,
    }
}
