//! How the cells of a grid are laid out in rows, and what each kind of cell looks like.

use egui::{Color32, ColorImage};

use crate::theme::Theme;

/// What is known of one chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cell {
    /// Not here, and not asked for.
    #[default]
    Missing,
    /// Not here, asked for.
    Asked,
    /// Here, heard by our own radio.
    Own,
    /// Here, heard by strangers' receivers.
    Strangers,
    /// Here, heard by another station of ours.
    Station,
    /// Here in versions that differ.
    Conflict,
    /// Here, and asked for again as a bridge between two gaps, because that is cheaper on the air.
    Bridge,
}

impl Cell {
    /// All kinds, in the order of the legend.
    pub const ALL: [Self; 7] =
        [Self::Own, Self::Station, Self::Strangers, Self::Conflict, Self::Bridge, Self::Asked, Self::Missing];

    /// The words for it.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Asked => "asked",
            Self::Own => "own radio",
            Self::Strangers => "strangers",
            Self::Station => "other station",
            Self::Conflict => "conflict",
            Self::Bridge => "bridge",
        }
    }

    /// Whether bytes of it are here.
    #[must_use]
    pub const fn is_here(self) -> bool {
        !matches!(self, Self::Missing | Self::Asked)
    }

    /// Its colour.
    #[must_use]
    pub fn colour(self, theme: &Theme) -> Color32 {
        match self {
            Self::Missing => theme.line,
            Self::Asked | Self::Own => theme.accent,
            Self::Strangers => theme.series(2),
            Self::Station => theme.series(3),
            Self::Conflict => theme.critical,
            Self::Bridge => theme.dim,
        }
    }

    /// Paints it into a picture with its upper left corner at `x`, `y`, so many pixels wide and high. The last column
    /// and row of pixels stay free where there is room. Each kind has a form besides its colour.
    pub(super) fn paint(self, image: &mut ColorImage, x: usize, y: usize, size: usize, theme: &Theme) {
        let side = if size >= 4 { size - 1 } else { size };
        let colour = self.colour(theme);
        let thick = (side / 9).max(1);
        for row in 0..side {
            for column in 0..side {
                let edge = row.min(column).min(side - 1 - row).min(side - 1 - column);
                let is_cross =
                    row.abs_diff(column) <= thick / 2 || (row + column).abs_diff(side - 1) <= thick / 2;
                let is_inner = edge * 10 >= side * 3;
                let pixel = match self {
                    Self::Asked if side >= 4 && edge >= thick => theme.line,
                    Self::Conflict if side >= 5 && is_cross && edge > 0 => theme.ground,
                    Self::Bridge if side >= 6 && edge >= thick && !is_inner => theme.panel,
                    Self::Strangers if side >= 6 && edge >= thick && row > column => {
                        colour.gamma_multiply(0.55)
                    }
                    Self::Station if side >= 6 && is_inner => theme.panel,
                    _ => colour,
                };
                image[(x + column, y + row)] = pixel;
            }
        }
    }
}

/// Where cells lie: in rows from left to right, like text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Number of cells.
    pub(super) cells: usize,
    /// Cells in a row.
    pub(super) columns: usize,
    /// Pixels of a cell across and down.
    pub(super) side: usize,
}

impl Layout {
    /// The largest cells (up to `largest` pixels) that fit into a width and height, both in pixels; where none does,
    /// the smallest (3 pixels), and the grid is higher. No side of it is over `limit`.
    pub(super) fn fit(cells: usize, width: usize, height: usize, largest: usize, limit: usize) -> Self {
        let width = width.clamp(3, limit.max(3));
        let of = |side: usize| {
            let most = (width / side).max(1);
            // Rows of tens can be counted.
            let columns = if most >= 10 { most / 10 * 10 } else { most };
            Self { cells, columns: columns.min(cells.max(1)), side }
        };
        (3..=largest.max(3))
            .rev()
            .map(of)
            .find(|layout| layout.size()[1] <= height.min(limit))
            .unwrap_or_else(|| of(3))
    }

    pub(super) fn rows(&self) -> usize {
        self.cells.div_ceil(self.columns)
    }

    /// Pixels of the whole.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.columns * self.side, self.rows() * self.side]
    }

    /// The upper left pixel of a cell.
    pub(super) fn corner(&self, cell: usize) -> [usize; 2] {
        [cell % self.columns * self.side, cell / self.columns * self.side]
    }

    /// The cell at a place in pixels.
    pub(super) fn cell_at(&self, x: f32, y: f32) -> Option<usize> {
        if x < 0.0 || y < 0.0 {
            return None;
        }
        let (column, row) = (x as usize / self.side, y as usize / self.side);
        let cell = row.checked_mul(self.columns)?.checked_add(column)?;
        (column < self.columns && cell < self.cells).then_some(cell)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::theme::Mode;

    proptest! {
        #[test]
        fn the_cell_under_the_pointer_is_the_one_painted_there(
            cells in 1_usize..70_000, width in 3_usize..2_000, height in 3_usize..900, largest in 3_usize..20,
            which in 0.0..1.0_f32, inside in (0.0..0.999_f32, 0.0..0.999_f32),
        ) {
            let layout = Layout::fit(cells, width, height, largest, 4_096);
            let [wide, _] = layout.size();
            prop_assert!(wide <= width.max(3) );
            let cell = ((cells as f32 * which) as usize).min(cells - 1);
            let [x, y] = layout.corner(cell);
            let side = layout.side as f32;
            prop_assert_eq!(layout.cell_at(x as f32 + inside.0 * side, y as f32 + inside.1 * side), Some(cell));
        }

        #[test]
        fn beside_the_grid_there_is_no_cell(cells in 1_usize..3_000, width in 3_usize..400) {
            let layout = Layout::fit(cells, width, 300, 14, 4_096);
            let [wide, high] = layout.size();
            prop_assert_eq!(layout.cell_at(wide as f32, 0.0), None);
            prop_assert_eq!(layout.cell_at(0.0, high as f32), None);
            prop_assert_eq!(layout.cell_at(-0.1, 0.0), None);
            prop_assert_eq!(layout.cell_at(f32::NAN, 0.0).filter(|&cell| cell > 0), None);
        }
    }

    #[test]
    fn kinds_differ_in_form_as_well_as_in_colour() {
        let theme = Theme::of(Mode::Dark);
        let drawn = |cell: Cell| {
            let mut image = ColorImage::filled([12, 12], theme.panel);
            cell.paint(&mut image, 0, 0, 12, theme);
            let own = cell.colour(theme);
            image.pixels.iter().map(|&pixel| pixel == own).collect::<Vec<bool>>()
        };
        for (index, &one) in Cell::ALL.iter().enumerate() {
            for &other in &Cell::ALL[index + 1..] {
                // Missing is told from our own by being hardly there at all.
                if [one, other] != [Cell::Own, Cell::Missing] {
                    assert_ne!(drawn(one), drawn(other), "{one:?} {other:?}");
                }
            }
        }
    }
}
