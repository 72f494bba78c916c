//! The bytes of a frame, and its fields beside them: pointing at one shows the other.

use std::ops::Range;

use egui::{Button, Rect, RichText, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};
use egui_material_icons::icons;

use crate::fonts;
use crate::level::{self, Level};
use crate::theme::{self, Theme};

const ROW: f32 = 18.0;
/// Room for the fields beside the bytes.
const FIELDS_WIDTH: f32 = 270.0;

/// Room for a row of sixteen bytes.
const DUMP_WIDTH: f32 = 530.0;

/// A field of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its value as it is shown.
    pub value: &'a str,
    /// Its unit; empty without one.
    pub unit: &'a str,
    /// Bits from the beginning of the frame to its own.
    pub start_bit: usize,
    /// How many bits it has; 0 for one that is derived from others.
    pub bits: usize,
    /// How deep it lies within others; 0 for outermost.
    pub depth: usize,
    /// The level of its alarm.
    pub level: Option<Level>,
}

impl Field<'_> {
    /// The bytes that hold at least one of its bits.
    #[must_use]
    pub fn bytes(&self) -> Range<usize> {
        if self.bits == 0 {
            return self.start_bit / 8..self.start_bit / 8;
        }
        self.start_bit / 8..self.start_bit.saturating_add(self.bits).div_ceil(8)
    }
}

/// The field that a byte belongs to: of several the narrowest, of those the first.
#[must_use]
pub fn field_at(fields: &[Field<'_>], byte: usize) -> Option<usize> {
    let holding = fields.iter().enumerate().filter(|(_, field)| field.bytes().contains(&byte));
    holding.min_by_key(|(_, field)| field.bits).map(|(index, _)| index)
}

/// What an inspector keeps between frames of the interface.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Inspector {
    /// The field that was clicked, as an index.
    pub selected: Option<usize>,
    /// The field under the pointer, be it on its bytes or in the list.
    pub hovered: Option<usize>,
}

/// Draws bytes and fields, beside each other where there is room.
pub fn inspector_ui(ui: &mut Ui, state: &mut Inspector, bytes: &[u8], fields: &[Field<'_>]) {
    let is_wide = ui.available_width() >= DUMP_WIDTH + FIELDS_WIDTH;
    let lit = state.hovered.or(state.selected).filter(|&index| index < fields.len());
    let mut hovered = None;
    let mut parts = |ui: &mut Ui| {
        hovered = hovered.or(dump(ui, state, bytes, fields, lit, is_wide));
        hovered = hovered.or(list(ui, state, bytes, fields, lit));
    };
    if is_wide {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = 6.0 * theme::space();
            parts(ui);
        });
    } else {
        parts(ui);
    }
    if hovered != state.hovered {
        state.hovered = hovered;
        ui.ctx().request_repaint();
    }
}

/// Where the parts of a dump lie.
struct Columns {
    count: usize,
    offset: f32,
    step: f32,
    text: f32,
    letter: f32,
}

impl Columns {
    fn new(ui: &Ui, room: f32) -> Self {
        let letter = ui.fonts_mut(|fonts| fonts.glyph_width(&fonts::figures(theme::sizes().small), '0'));
        let offset = 5.0 * letter;
        let step = 3.0 * letter;
        // Sixteen bytes with their letters need this much; narrower ones show eight.
        let needs = |count: f32| offset + count * (step + letter) + 5.0 * letter;
        let count = if room >= needs(16.0) { 16 } else { 8 };
        let text = offset + count as f32 * step + if count == 16 { 3.0 } else { 2.0 } * letter;
        Self { count, offset, step, text, letter }
    }

    fn width(&self) -> f32 {
        self.text + self.count as f32 * self.letter
    }

    /// From the left edge to a byte's figures; in the middle of sixteen is a space.
    fn x(&self, column: usize) -> f32 {
        let middle = if self.count == 16 && column >= 8 { self.letter } else { 0.0 };
        self.offset + column as f32 * self.step + middle
    }

    /// The byte at a place, be it on its figures or on its letter.
    fn byte_at(&self, x: f32, y: f32, length: usize) -> Option<usize> {
        if y < 0.0 {
            return None;
        }
        let column = if x >= self.text {
            ((x - self.text) / self.letter) as usize
        } else {
            let half = self.letter / 2.0;
            (0..self.count)
                .find(|&column| (x - self.x(column) + half) >= 0.0 && x - self.x(column) + half < self.step)?
        };
        let byte = (y / ROW) as usize * self.count + column;
        (column < self.count && byte < length).then_some(byte)
    }
}

fn dump(
    ui: &mut Ui,
    state: &mut Inspector,
    bytes: &[u8],
    fields: &[Field<'_>],
    lit: Option<usize>,
    is_wide: bool,
) -> Option<usize> {
    let theme = Theme::current(ui);
    let room = ui.available_width() - if is_wide { FIELDS_WIDTH } else { 0.0 };
    let columns = Columns::new(ui, room);
    let rows = bytes.len().div_ceil(columns.count).max(1);
    let (rect, response) = ui.allocate_exact_size(vec2(columns.width(), rows as f32 * ROW), Sense::click());
    response.widget_info(|| {
        let field = lit.map_or("", |index| fields[index].name);
        WidgetInfo::labeled(
            Role::Image,
            true,
            format!("{} bytes, {field}", bytes.len()).trim_end_matches(", "),
        )
    });
    let pointed = response.hover_pos().and_then(|at| {
        let at = at - rect.min;
        columns.byte_at(at.x, at.y, bytes.len())
    });
    let hovered = pointed.and_then(|byte| field_at(fields, byte));
    if response.clicked() {
        state.selected = hovered.filter(|_| hovered != state.selected);
    }
    let painter = ui.painter_at(rect.expand(2.0));
    let font = fonts::figures(theme::sizes().small);
    let seen = ui.clip_rect().intersect(rect);
    let first = ((seen.top() - rect.top()) / ROW).max(0.0) as usize;
    let last = ((seen.bottom() - rect.top()) / ROW).ceil().max(0.0) as usize;
    let lit = lit.map_or(0..0, |index| fields[index].bytes());
    for row in first..last.min(rows) {
        let top = rect.top() + row as f32 * ROW;
        let start = row * columns.count;
        let end = (start + columns.count).min(bytes.len());
        let middle = top + ROW / 2.0;
        let write = |x: f32, text: String, colour| {
            painter.text(
                pos2(rect.left() + x, middle),
                egui::Align2::LEFT_CENTER,
                text,
                font.clone(),
                colour,
            );
        };
        write(0.0, format!("{start:04x}"), theme.faint);
        // One bar behind all that is lit in this row, on both sides.
        let (low, high) = (lit.start.max(start), lit.end.min(end));
        if low < high {
            let bar = |from: f32, to: f32| {
                let bar = Rect::from_min_max(
                    pos2(rect.left() + from, top + 1.0),
                    pos2(rect.left() + to, top + ROW - 1.0),
                );
                painter.rect_filled(bar, 3.0, theme.selection);
                painter.rect_stroke(bar, 3.0, Stroke::new(1.0, theme.accent), StrokeKind::Inside);
            };
            let edge = columns.letter * 0.35;
            bar(columns.x(low - start) - edge, columns.x(high - 1 - start) + 2.0 * columns.letter + edge);
            let letter = |index: usize| columns.text + index as f32 * columns.letter;
            bar(letter(low - start) - 1.0, letter(high - start) + 1.0);
        }
        for (column, &byte) in bytes[start..end].iter().enumerate() {
            let index = start + column;
            let colour = if Some(index) == pointed || lit.contains(&index) {
                theme.text
            } else if field_at(fields, index).is_some() {
                theme.text.gamma_multiply(0.85)
            } else {
                theme.dim
            };
            write(columns.x(column), format!("{byte:02x}"), colour);
            let is_plain = byte.is_ascii_graphic() || byte == b' ';
            let (letter, colour) = if is_plain { (char::from(byte), colour) } else { ('.', theme.faint) };
            write(columns.text + column as f32 * columns.letter, letter.to_string(), colour);
        }
    }
    if let Some(byte) = pointed {
        let field = hovered.map_or(String::new(), |index| {
            format!("\n{} {} {}", fields[index].name, fields[index].value, fields[index].unit)
        });
        let value = bytes[byte];
        response
            .on_hover_text_at_pointer(format!("byte {byte} (0x{byte:02x}): {value} = {value:#010b}{field}"));
    }
    hovered
}

fn list(
    ui: &mut Ui,
    state: &mut Inspector,
    bytes: &[u8],
    fields: &[Field<'_>],
    lit: Option<usize>,
) -> Option<usize> {
    let theme = Theme::current(ui);
    let mut hovered = None;
    ui.vertical(|ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        let width = ui.available_width().clamp(160.0, 460.0);
        for (index, field) in fields.iter().enumerate() {
            let (rect, response) = ui.allocate_exact_size(vec2(width, ROW + 4.0), Sense::click());
            let is_lit = lit == Some(index);
            if ui.is_rect_visible(rect) {
                row(ui, theme, rect, field, is_lit, response.has_focus());
            }
            response.widget_info(|| {
                let label = format!("{} {} {}", field.name, field.value, field.unit);
                WidgetInfo::selected(Role::Button, true, state.selected == Some(index), label.trim_end())
            });
            if response.hovered() {
                hovered = Some(index);
            }
            if response.clicked() {
                state.selected = (state.selected != Some(index)).then_some(index);
            }
        }
        ui.add_space(2.0 * theme::space());
        ui.horizontal(|ui| {
            let copy = |ui: &mut Ui, words: &str| {
                let text = RichText::new(format!("{} {words}", icons::ICON_CONTENT_COPY.codepoint));
                let button =
                    ui.add(Button::new(text.size(theme::sizes().small).color(theme.dim)).frame(false));
                button.widget_info(|| WidgetInfo::labeled(Role::Button, true, words));
                button.clicked()
            };
            if copy(ui, "Copy bytes") {
                ui.ctx().copy_text(hex(bytes));
            }
            if let Some(field) = state.selected.and_then(|index| fields.get(index))
                && copy(ui, "Copy value")
            {
                ui.ctx().copy_text(field.value.to_owned());
            }
        });
    });
    hovered
}

/// A field as a row: name, value and unit, and where its bits are.
fn row(ui: &Ui, theme: &Theme, rect: Rect, field: &Field<'_>, is_lit: bool, has_focus: bool) {
    let painter = ui.painter_at(rect);
    if is_lit {
        painter.rect_filled(rect, theme::space(), theme.selection);
    }
    if has_focus {
        painter.rect_stroke(rect, theme::space(), Stroke::new(1.0, theme.accent), StrokeKind::Inside);
    }
    let middle = rect.center().y;
    let small = fonts::small();
    let figures = fonts::figures(theme::sizes().small);
    let at = |x: f32| pos2(x, middle);
    let indent = 6.0 + 12.0 * field.depth as f32;
    let bits = if field.bits == 0 {
        String::new()
    } else if field.start_bit.is_multiple_of(8) && field.bits.is_multiple_of(8) {
        format!("{}", field.start_bit / 8)
    } else {
        format!("{}.{}", field.start_bit / 8, field.start_bit % 8)
    };
    painter.text(at(rect.right() - 6.0), egui::Align2::RIGHT_CENTER, bits, fonts::figures(11.0), theme.faint);
    let value_left = rect.left() + (rect.width() * 0.44).max(90.0);
    let clipped =
        painter.with_clip_rect(Rect::from_x_y_ranges(rect.left()..=value_left - 4.0, rect.y_range()));
    clipped.text(at(rect.left() + indent), egui::Align2::LEFT_CENTER, field.name, small.clone(), theme.dim);
    let mut left = value_left;
    if let Some(level) = field.level {
        level::paint_shape(&painter, at(left + 5.0), 11.0, level, level.colour(theme));
        left += 16.0;
    }
    let end = painter.text(at(left), egui::Align2::LEFT_CENTER, field.value, figures, theme.text);
    painter.text(at(end.right() + 5.0), egui::Align2::LEFT_CENTER, field.unit, small, theme.dim);
}

fn hex(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len() * 2);
    for byte in bytes {
        text.push_str(&format!("{byte:02x}"));
    }
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn field(start_bit: usize, bits: usize) -> Field<'static> {
        Field { name: "", value: "", unit: "", start_bit, bits, depth: 0, level: None }
    }

    proptest! {
        #[test]
        fn byte_and_field_find_each_other(
            fields in prop::collection::vec((0_usize..400, 0_usize..70), 0..30), byte in 0_usize..64,
        ) {
            let fields: Vec<Field<'_>> = fields.into_iter().map(|(start, bits)| field(start, bits)).collect();
            let holds = |field: &Field<'_>| {
                (field.start_bit..field.start_bit + field.bits).any(|bit| bit / 8 == byte)
            };
            match field_at(&fields, byte) {
                Some(found) => {
                    prop_assert!(holds(&fields[found]));
                    let narrowest = fields.iter().filter(|field| holds(field)).map(|field| field.bits).min();
                    prop_assert_eq!(Some(fields[found].bits), narrowest);
                }
                None => prop_assert!(!fields.iter().any(holds)),
            }
            for field in &fields {
                prop_assert_eq!(field.bytes().contains(&byte), holds(field));
            }
        }

        #[test]
        fn pointing_at_a_byte_or_its_letter_finds_it(byte in 0_usize..300, count in prop_oneof![Just(8_usize), Just(16)]) {
            let letter = 7.0;
            let columns = Columns { count, offset: 35.0, step: 21.0, text: 35.0 + 21.0 * count as f32 + 21.0, letter };
            let (row, column) = (byte / count, byte % count);
            let y = (row as f32 + 0.5) * ROW;
            let figures = columns.x(column) + letter;
            prop_assert_eq!(columns.byte_at(figures, y, 300), Some(byte));
            prop_assert_eq!(columns.byte_at(columns.text + (column as f32 + 0.5) * letter, y, 300), Some(byte));
            prop_assert_eq!(columns.byte_at(figures, y, byte), None);
        }
    }
}
