//! One cell for each chunk of a picture: missing, asked, here and from whom, in conflict.
//!
//! The cells are painted once into a texture and only those that change are painted again, so that 65,536 of them cost
//! no more than a few.

mod cells;

use std::ops::RangeInclusive;

use egui::{
    Color32, ColorImage, Key, Pos2, Rect, Response, RichText, Role, Sense, Stroke, StrokeKind, TextureHandle,
    TextureOptions, Ui, WidgetInfo, pos2, vec2,
};

pub use cells::Cell;
use cells::Layout;

use crate::chip::chip;
use crate::fonts;
use crate::theme::{self, Mode, Theme};

/// More changed cells than this at once, and all are painted anew.
const SINGLY: usize = 256;

/// The cells of a grid and what was painted of them.
#[derive(Default)]
pub struct ChunkGrid {
    cells: Vec<Cell>,
    counts: [usize; Cell::ALL.len()],
    changed: Vec<usize>,
    painted: Option<Painted>,
    /// Chunk at which a selection began, and the one it reaches to.
    selection: Option<(usize, usize)>,
}

struct Painted {
    texture: TextureHandle,
    layout: Layout,
    is_dark: bool,
}

/// What happened to a grid.
#[derive(Debug)]
pub struct GridResponse {
    /// The grid as a widget.
    pub response: Response,
    /// The chunk under the pointer.
    pub hovered: Option<usize>,
    /// The chunk that was clicked just now.
    pub clicked: Option<usize>,
    /// The chunks chosen by dragging, or by Shift and the arrow keys.
    pub selected: Option<RangeInclusive<usize>>,
}

impl ChunkGrid {
    /// A grid of so many chunks, all missing.
    #[must_use]
    pub fn new(chunks: usize) -> Self {
        let mut grid = Self::default();
        grid.resize(chunks);
        grid
    }

    /// Number of chunks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there is no chunk.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Makes it so many chunks; new ones are missing.
    pub fn resize(&mut self, chunks: usize) {
        if chunks != self.cells.len() {
            self.cells.resize(chunks, Cell::Missing);
            self.counts = Cell::ALL.map(|kind| self.cells.iter().filter(|&&cell| cell == kind).count());
            self.painted = None;
            self.selection = None;
        }
    }

    /// What is known of a chunk.
    #[must_use]
    pub fn get(&self, chunk: usize) -> Option<Cell> {
        self.cells.get(chunk).copied()
    }

    /// Tells what is known of a chunk; one that does not exist is passed over. Costs nothing where nothing changes.
    pub fn set(&mut self, chunk: usize, cell: Cell) {
        let Some(place) = self.cells.get_mut(chunk) else { return };
        let before = std::mem::replace(place, cell);
        if before != cell {
            for (kind, count) in Cell::ALL.iter().zip(&mut self.counts) {
                *count = *count + usize::from(*kind == cell) - usize::from(*kind == before);
            }
            if self.changed.len() <= SINGLY {
                self.changed.push(chunk);
            }
        }
    }

    /// How many chunks are of this kind.
    #[must_use]
    pub fn count(&self, cell: Cell) -> usize {
        Cell::ALL.iter().zip(self.counts).find(|(kind, _)| **kind == cell).map_or(0, |(_, count)| count)
    }

    /// How many chunks are here, those in conflict included.
    #[must_use]
    pub fn here(&self) -> usize {
        Cell::ALL.iter().zip(self.counts).filter(|(kind, _)| kind.is_here()).map(|(_, count)| count).sum()
    }

    /// The chunks chosen.
    #[must_use]
    pub fn selected(&self) -> Option<RangeInclusive<usize>> {
        self.selection.map(|(from, to)| from.min(to)..=from.max(to))
    }

    /// Chooses nothing.
    pub fn clear_selection(&mut self) {
        self.selection = None;
    }

    /// The texture for this layout, painted as little as possible.
    fn texture(&mut self, ui: &Ui, layout: Layout) -> egui::TextureId {
        let is_dark = ui.visuals().dark_mode;
        let theme = Theme::of(if is_dark { Mode::Dark } else { Mode::Light });
        if let Some(painted) = &mut self.painted
            && painted.layout == layout
            && painted.is_dark == is_dark
            && self.changed.len() <= SINGLY
        {
            for chunk in self.changed.drain(..) {
                let mut image = ColorImage::filled([layout.side; 2], Color32::TRANSPARENT);
                self.cells[chunk].paint(&mut image, 0, 0, layout.side, theme);
                painted.texture.set_partial(layout.corner(chunk), image, TextureOptions::NEAREST);
            }
            return painted.texture.id();
        }
        self.changed.clear();
        let mut image = ColorImage::filled(layout.size(), Color32::TRANSPARENT);
        for (chunk, cell) in self.cells.iter().enumerate() {
            let [x, y] = layout.corner(chunk);
            cell.paint(&mut image, x, y, layout.side, theme);
        }
        let texture = ui.ctx().load_texture("chunk grid", image, TextureOptions::NEAREST);
        let id = texture.id();
        self.painted = Some(Painted { texture, layout, is_dark });
        id
    }
}

/// Draws the grid as wide as there is room, with the largest cells that let it be no higher than `height` points, and
/// a legend with counts below. Where even the smallest cells need more height it is higher: put it into a scroll area.
///
/// `detail` is what more to tell of the chunk under the pointer: its time, its receiver.
pub fn chunk_grid_ui(
    ui: &mut Ui,
    grid: &mut ChunkGrid,
    height: f32,
    detail: impl Fn(usize) -> String,
) -> GridResponse {
    let theme = Theme::current(ui);
    let pixels = ui.pixels_per_point();
    let gutter = fonts_width(grid.len());
    let room = (ui.available_width() - gutter).max(3.0);
    let limit = ui.ctx().input(|input| input.max_texture_side);
    let to_pixels = |points: f32| (points * pixels) as usize;
    let layout = Layout::fit(
        grid.len(),
        to_pixels(room),
        to_pixels(height.max(24.0)),
        to_pixels(14.0),
        limit.max(256),
    );
    let [wide, high] = layout.size();
    let size = vec2(wide as f32, high as f32) / pixels;
    let (all, mut response) =
        ui.allocate_exact_size(size + vec2(gutter, 0.0), Sense::click_and_drag() | Sense::FOCUSABLE);
    let spoken =
        format!("Chunks: {} of {} here, {} in conflict", grid.here(), grid.len(), grid.count(Cell::Conflict));
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, spoken.as_str()));
    let corner = ((all.min + vec2(gutter, 0.0)) * pixels).round() / pixels;
    let rect = Rect::from_min_size(corner, size);
    let chunk_at = |at: Pos2| {
        let at = (at - corner) * pixels;
        layout.cell_at(at.x, at.y)
    };
    let hovered = response.hover_pos().and_then(chunk_at);
    let pressed = ui.input(|input| input.pointer.press_origin()).and_then(chunk_at);
    let clicked = hovered.filter(|_| response.clicked());
    choose(ui, grid, &response, (pressed, hovered), layout.columns);
    if ui.is_rect_visible(rect) {
        let texture = grid.texture(ui, layout);
        let painter = ui.painter();
        painter.image(texture, rect, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
        let cell = |chunk: usize| {
            let [x, y] = layout.corner(chunk);
            Rect::from_min_size(
                corner + vec2(x as f32, y as f32) / pixels,
                vec2(1.0, 1.0) * layout.side as f32 / pixels,
            )
        };
        // Numbers of the first chunk of rows, as many as there is room for.
        let every = (13.0 * pixels / layout.side as f32).ceil().max(1.0) as usize;
        for row in (0..layout.rows()).step_by(every).filter(|_| gutter > 0.0) {
            let at = pos2(corner.x - theme::space(), cell(row * layout.columns).center().y);
            let number = (row * layout.columns).to_string();
            painter.text(at, egui::Align2::RIGHT_CENTER, number, fonts::figures(11.0), theme.faint);
        }
        if let Some(selected) = grid.selected() {
            let (first, last) = (*selected.start(), *selected.end());
            for row in first / layout.columns..=last / layout.columns {
                let low = first.max(row * layout.columns);
                let high = last.min(row * layout.columns + layout.columns - 1);
                let bar = cell(low).union(cell(high));
                painter.rect_stroke(bar, 1.0, Stroke::new(1.5, theme.text), StrokeKind::Middle);
            }
        }
        if let Some(chunk) = hovered {
            painter.rect_stroke(
                cell(chunk).expand(1.0),
                1.0,
                Stroke::new(1.5, theme.text),
                StrokeKind::Middle,
            );
        }
        if response.has_focus() {
            painter.rect_stroke(rect.expand(2.0), 2.0, Stroke::new(1.0, theme.accent), StrokeKind::Outside);
        }
    }
    if let Some(chunk) = hovered {
        let kind = grid.get(chunk).unwrap_or_default();
        response = response.on_hover_ui_at_pointer(|ui| {
            ui.horizontal(|ui| {
                ui.label(RichText::new(format!("chunk {chunk}")).font(fonts::figures(theme::sizes().body)));
                ui.label(RichText::new(kind.words()).color(theme.dim));
            });
            let detail = detail(chunk);
            if !detail.is_empty() {
                ui.label(RichText::new(detail).size(theme::sizes().small).color(theme.dim));
            }
        });
    }
    legend(ui, grid, theme);
    GridResponse { response, hovered, clicked, selected: grid.selected() }
}

/// Room for the numbers of rows.
fn fonts_width(chunks: usize) -> f32 {
    if chunks < 20 { 0.0 } else { 8.0 + 7.0 * chunks.to_string().len() as f32 }
}

/// Dragging and the arrow keys choose chunks; Esc chooses none.
fn choose(
    ui: &Ui,
    grid: &mut ChunkGrid,
    response: &Response,
    (pressed, hovered): (Option<usize>, Option<usize>),
    columns: usize,
) {
    if response.clicked() {
        response.request_focus();
        grid.selection = hovered.map(|chunk| (chunk, chunk));
    } else if response.drag_started() {
        // The pointer is already further on when it is known that this is no click.
        response.request_focus();
        grid.selection = pressed.map(|from| (from, hovered.unwrap_or(from)));
    } else if response.dragged()
        && let (Some(chunk), Some((_, to))) = (hovered, &mut grid.selection)
    {
        *to = chunk;
    }
    if !response.has_focus() || grid.is_empty() {
        return;
    }
    ui.memory_mut(|memory| {
        let arrows =
            egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
        memory.set_focus_lock_filter(response.id, arrows);
    });
    let (shift, steps) = ui.input(|input| {
        let pressed = |key| isize::from(input.key_pressed(key));
        let across = pressed(Key::ArrowRight) - pressed(Key::ArrowLeft);
        let down = pressed(Key::ArrowDown) - pressed(Key::ArrowUp);
        (input.modifiers.shift, across + down * columns as isize)
    });
    if steps != 0 {
        let (from, to) = grid.selection.unwrap_or((0, 0));
        let to = to.saturating_add_signed(steps).min(grid.len() - 1);
        grid.selection = Some((if shift { from } else { to }, to));
    }
    if ui.input(|input| input.key_pressed(Key::Escape)) {
        grid.selection = None;
    }
}

/// Kinds with their counts; those that do not occur are left out, but missing and own stay.
fn legend(ui: &mut Ui, grid: &ChunkGrid, theme: &Theme) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(3.0 * theme::space(), theme::space());
        for kind in Cell::ALL {
            let count = grid.count(kind);
            if count == 0 && !matches!(kind, Cell::Own | Cell::Missing) {
                continue;
            }
            let figures = fonts::figures(theme::sizes().small);
            let words = vec![
                (kind.words().to_owned(), fonts::small(), theme.dim),
                (count.to_string(), figures, theme.text),
            ];
            chip(ui, vec2(11.0, 11.0), words, |ui, rect| swatch(ui, kind, rect, theme));
        }
    });
}

/// The same form as in the grid, from few shapes.
fn swatch(ui: &Ui, kind: Cell, rect: Rect, theme: &Theme) {
    let painter = ui.painter();
    let colour = kind.colour(theme);
    let inner = rect.shrink(rect.width() * 0.3);
    match kind {
        Cell::Missing | Cell::Own => painter.rect_filled(rect, 0.0, colour),
        Cell::Asked => {
            painter.rect_filled(rect, 0.0, theme.line);
            painter.rect_stroke(rect, 0.0, Stroke::new(1.0, colour), StrokeKind::Inside)
        }
        Cell::Station => {
            painter.rect_filled(rect, 0.0, colour);
            painter.rect_filled(inner, 0.0, theme.panel)
        }
        Cell::Strangers => {
            painter.rect_filled(rect, 0.0, colour);
            let corners = vec![rect.left_top(), rect.right_bottom(), rect.left_bottom()];
            let half = theme.panel.gamma_multiply(0.45);
            painter.add(egui::Shape::convex_polygon(corners, half, Stroke::NONE))
        }
        Cell::Conflict => {
            painter.rect_filled(rect, 0.0, colour);
            let stroke = Stroke::new(1.2, theme.ground);
            let cross = rect.shrink(1.0);
            painter.line_segment([cross.left_top(), cross.right_bottom()], stroke);
            painter.line_segment([cross.left_bottom(), cross.right_top()], stroke)
        }
        Cell::Bridge => {
            painter.rect_stroke(rect, 0.0, Stroke::new(1.0, colour), StrokeKind::Inside);
            painter.rect_filled(inner, 0.0, colour)
        }
    };
}

impl std::fmt::Debug for ChunkGrid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ChunkGrid")
            .field("len", &self.len())
            .field("here", &self.here())
            .finish_non_exhaustive()
    }
}
