//! The layouts to begin with.

use egui_tiles::{Container, Linear, LinearDir, Tile, TileId, Tiles, Tree};
use serde::{Deserialize, Serialize};

use crate::panes::Pane;

/// A named arrangement of panes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// What one looks at while the satellite is in view.
    #[default]
    Pass,
    /// Coming passes, plans, rehearsals.
    Plan,
    /// How the satellite is.
    Satellite,
    /// What it brought home.
    Images,
    /// What was.
    Archive,
    /// How the station is.
    Health,
}

impl Layout {
    /// All, in the order of their keys 1 to 6.
    pub const ALL: [Self; 6] =
        [Self::Pass, Self::Plan, Self::Satellite, Self::Images, Self::Archive, Self::Health];

    /// Its name on the screen.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pass => "Pass",
            Self::Plan => "Plan",
            Self::Satellite => "Satellite",
            Self::Images => "Images",
            Self::Archive => "Archive",
            Self::Health => "Health",
        }
    }

    /// Its panes as they are at first.
    #[must_use]
    pub fn tree(self) -> Tree<Pane> {
        let mut tiles = Tiles::default();
        let root = match self {
            Self::Pass => {
                let left = column(&mut tiles, &[(&[Pane::Sky], 1.2), (&[Pane::PassCurves], 1.0)]);
                let middle = column(
                    &mut tiles,
                    &[(&[Pane::PassPlan, Pane::Commands], 1.0), (&[Pane::Picture, Pane::Chunks], 1.2)],
                );
                let right = column(&mut tiles, &[(&[Pane::Values], 1.3), (&[Pane::Alarms], 1.0)]);
                let top = row(&mut tiles, &[(left, 1.0), (middle, 1.5), (right, 1.0)]);
                let log = tabs(&mut tiles, &[Pane::Log]);
                stack(&mut tiles, &[(top, 4.0), (log, 1.0)])
            }
            Self::Plan => {
                let timeline = tabs(&mut tiles, &[Pane::Timeline]);
                let editor = column(&mut tiles, &[(&[Pane::PlanEditor], 1.0)]);
                let answer = column(&mut tiles, &[(&[Pane::Rehearsal], 1.0), (&[Pane::DownlinkMap], 1.0)]);
                let below = row(&mut tiles, &[(editor, 1.0), (answer, 1.0)]);
                stack(&mut tiles, &[(timeline, 1.0), (below, 1.6)])
            }
            Self::Satellite => {
                let left = column(&mut tiles, &[(&[Pane::Values], 1.0)]);
                let middle = column(&mut tiles, &[(&[Pane::Plots], 1.0)]);
                let right = column(&mut tiles, &[(&[Pane::Attitude], 1.0), (&[Pane::Map], 1.0)]);
                row(&mut tiles, &[(left, 1.0), (middle, 1.6), (right, 1.2)])
            }
            Self::Images => {
                let left = column(&mut tiles, &[(&[Pane::Gallery], 1.0)]);
                let right = column(&mut tiles, &[(&[Pane::Picture], 1.6), (&[Pane::Chunks], 1.0)]);
                row(&mut tiles, &[(left, 1.0), (right, 2.4)])
            }
            Self::Archive => {
                let left = column(&mut tiles, &[(&[Pane::Search], 1.0)]);
                let right = column(&mut tiles, &[(&[Pane::Plots], 1.2), (&[Pane::Frame], 1.0)]);
                row(&mut tiles, &[(left, 1.0), (right, 1.4)])
            }
            Self::Health => {
                let left = column(&mut tiles, &[(&[Pane::Station], 1.0), (&[Pane::Elements], 0.7)]);
                let right = column(&mut tiles, &[(&[Pane::Alarms], 1.0), (&[Pane::Notes], 0.8)]);
                let far = column(&mut tiles, &[(&[Pane::Receivers], 1.0), (&[Pane::Reports], 0.8)]);
                row(&mut tiles, &[(left, 1.0), (right, 1.0), (far, 1.0)])
            }
        };
        Tree::new(egui::Id::unique(("layout", self.name())), root, tiles)
    }
}

fn tabs(tiles: &mut Tiles<Pane>, panes: &[Pane]) -> TileId {
    let panes = panes.iter().map(|pane| tiles.insert_pane(*pane)).collect();
    tiles.insert_tab_tile(panes)
}

fn column(tiles: &mut Tiles<Pane>, cells: &[(&[Pane], f32)]) -> TileId {
    let cells: Vec<_> = cells.iter().map(|(panes, share)| (tabs(tiles, panes), *share)).collect();
    linear(tiles, LinearDir::Vertical, &cells)
}

fn stack(tiles: &mut Tiles<Pane>, cells: &[(TileId, f32)]) -> TileId {
    linear(tiles, LinearDir::Vertical, cells)
}

fn row(tiles: &mut Tiles<Pane>, cells: &[(TileId, f32)]) -> TileId {
    linear(tiles, LinearDir::Horizontal, cells)
}

fn linear(tiles: &mut Tiles<Pane>, dir: LinearDir, cells: &[(TileId, f32)]) -> TileId {
    let mut linear = Linear { children: cells.iter().map(|(id, _)| *id).collect(), dir, ..Linear::default() };
    for (id, share) in cells {
        linear.shares.set_share(*id, *share);
    }
    tiles.insert_new(Tile::Container(Container::Linear(linear)))
}
