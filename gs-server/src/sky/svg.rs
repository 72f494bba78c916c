//! A canvas for plots: plotters' SVG backend with pixels in fractions, the console's tokens for colours, and names that
//! come from strangers' files.

use std::cell::Cell;

use plotters::coord::Shift;
use plotters::element::{Circle, Drawable, PathElement, Polygon, Rectangle};
use plotters::prelude::{DrawingArea, IntoDrawingArea as _, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontDesc, FontFamily, FontStyle, RGBAColor, ShapeStyle, TextStyle};

/// The one file that has colours.
pub(crate) const TOKENS: &str = include_str!("../http/page/tokens.css");
/// The backend knows whole numbers only; so many of them make a pixel.
const UNITS_PER_PX: f64 = 16.0;
/// The backend writes a font as so much smaller than it was asked for.
const FONT_FACTOR: f64 = 1.24;
/// Characters of a text that are drawn.
const TEXT_MAX: usize = 120;

/// A point, in pixels from the upper left.
pub(crate) type Px = (f64, f64);

/// A token's colour in the dark theme; the text colour for one that is not there.
pub(crate) fn token(name: &str) -> RGBAColor {
    let value = |name: &str| {
        TOKENS.lines().find_map(|line| {
            let value = line.trim().strip_prefix("--")?.strip_prefix(name)?.strip_prefix(':')?;
            let hex = value.trim().strip_prefix('#')?.get(..6)?;
            u32::from_str_radix(hex, 16).ok()
        })
    };
    let rgb = value(name).or_else(|| value("text")).unwrap_or(0x00d7_dee7);
    let [_, red, green, blue] = rgb.to_be_bytes();
    RGBAColor(red, green, blue, 1.0)
}

/// Which point of a text lies at its place.
#[derive(Clone, Copy)]
pub(crate) enum Anchor {
    Left,
    Middle,
    Right,
}

/// What is drawn on.
pub(crate) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
    is_whole: Cell<bool>,
    /// How much larger texts are than they say.
    text_scale: f64,
}

/// What shows of a picture; of one that is shown small, a part with larger texts.
pub(crate) struct Part {
    /// The whole picture.
    pub(crate) size_px: (u32, u32),
    /// Upper left corner of the part.
    pub(crate) corner_px: (u32, u32),
    /// Size of the part.
    pub(crate) part_px: (u32, u32),
    /// How much larger texts are.
    pub(crate) text_scale: f64,
}

impl Part {
    /// All of a picture of so many pixels.
    pub(crate) fn whole(size_px: (u32, u32)) -> Self {
        Self { size_px, corner_px: (0, 0), part_px: size_px, text_scale: 1.0 }
    }
}

/// Draws a picture on the console's ground. `title` is read aloud and shown where a pointer rests.
pub(crate) fn svg(part: &Part, title: &str, draw: impl FnOnce(&Canvas<'_>)) -> String {
    let units = |px: u32| px.saturating_mul(UNITS_PER_PX as u32);
    let (width, height) = (units(part.size_px.0), units(part.size_px.1));
    let mut text = String::new();
    let canvas = Canvas {
        area: SVGBackend::with_string(&mut text, (width, height)).into_drawing_area(),
        is_whole: Cell::new(true),
        text_scale: part.text_scale,
    };
    canvas.rectangle((0.0, 0.0), (f64::from(part.size_px.0), f64::from(part.size_px.1)), token("ground"));
    draw(&canvas);
    canvas.done(|| canvas.area.present());
    debug_assert!(canvas.is_whole.get(), "the backend writes into memory, which cannot fail");
    drop(canvas);
    let head = format!("<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\"");
    let wanted = format!(
        "<svg width=\"{}\" height=\"{}\" role=\"img\" viewBox=\"{} {} {} {}\"",
        part.part_px.0,
        part.part_px.1,
        units(part.corner_px.0),
        units(part.corner_px.1),
        units(part.part_px.0),
        units(part.part_px.1)
    );
    debug_assert!(text.starts_with(&head), "the backend's first line is another: {text:.80}");
    let text = text.replacen(&head, &wanted, 1);
    text.replacen(">\n", &format!(">\n<title>{}</title>\n", escaped(title)), 1)
}

/// Text as XML has it, without characters that XML does not know.
fn escaped(text: &str) -> String {
    printable(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}')).take(TEXT_MAX).collect()
}

impl Canvas<'_> {
    fn done<E>(&self, draw: impl FnOnce() -> Result<(), E>) {
        self.is_whole.set(draw().is_ok() && self.is_whole.get());
    }

    fn draw<'e, E>(&self, element: &'e E)
    where
        for<'x> &'x E: plotters::element::PointCollection<'x, (i32, i32)>,
        E: for<'x> Drawable<SVGBackend<'x>> + 'e,
    {
        self.done(|| self.area.draw(element));
    }

    pub(crate) fn line(&self, points: &[Px], colour: RGBAColor, width_px: f64) {
        if points.len() > 1 {
            self.draw(&PathElement::new(
                points.iter().map(units).collect::<Vec<_>>(),
                stroke(colour, width_px),
            ));
        }
    }

    pub(crate) fn polygon(&self, points: &[Px], colour: RGBAColor) {
        if points.len() > 2 {
            self.draw(&Polygon::new(points.iter().map(units).collect::<Vec<_>>(), colour.filled()));
        }
    }

    pub(crate) fn rectangle(&self, from: Px, to: Px, colour: RGBAColor) {
        self.draw(&Rectangle::new([units(&from), units(&to)], colour.filled()));
    }

    pub(crate) fn disc(&self, centre: Px, radius_px: f64, colour: RGBAColor) {
        self.draw(&Circle::new(units(&centre), unit(radius_px), colour.filled()));
    }

    pub(crate) fn ring(&self, centre: Px, radius_px: f64, colour: RGBAColor, width_px: f64) {
        self.draw(&Circle::new(units(&centre), unit(radius_px), stroke(colour, width_px)));
    }

    /// Text whose middle line lies at `at`.
    pub(crate) fn text(&self, text: &str, at: Px, anchor: Anchor, size_px: f64, colour: RGBAColor) {
        let font = FontDesc::new(
            FontFamily::SansSerif,
            size_px * self.text_scale * UNITS_PER_PX * FONT_FACTOR,
            FontStyle::Normal,
        );
        let across = match anchor {
            Anchor::Left => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::Right => HPos::Right,
        };
        let style = TextStyle::from(font).color(&colour).pos(Pos::new(across, VPos::Center));
        self.done(|| self.area.draw_text(&printable(text), &style, units(&at)));
    }
}

fn stroke(colour: RGBAColor, width_px: f64) -> ShapeStyle {
    colour.stroke_width(unit(width_px).max(1).unsigned_abs())
}

fn unit(px: f64) -> i32 {
    (px * UNITS_PER_PX).round() as i32
}

fn units(point: &Px) -> (i32, i32) {
    (unit(point.0), unit(point.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_strangers_stay_text() {
        let evil = "<script>alert(1)</script>\u{0}&\"";
        let drawn = svg(&Part::whole((100, 50)), evil, |canvas| {
            canvas.text(evil, (1.0, 2.0), Anchor::Left, 12.0, token("text"));
        });
        assert!(!drawn.contains("<script") && !drawn.contains('\u{0}'), "{drawn}");
        assert!(drawn.contains("<title>&lt;script&gt;") && drawn.trim_end().ends_with("</svg>"), "{drawn}");
        assert!(
            drawn.starts_with("<svg width=\"100\" height=\"50\" role=\"img\" viewBox=\"0 0 1600 800\""),
            "{drawn}"
        );
    }

    #[test]
    fn colours_come_from_the_one_token_file() {
        assert_eq!(token("ground"), RGBAColor(0x0E, 0x11, 0x16, 1.0));
        assert_eq!(token("accent"), RGBAColor(0x4F, 0xB3, 0xFF, 1.0));
        for name in ["text", "dim", "faint", "panel", "raised"] {
            assert!(TOKENS.contains(&format!("--{name}: #")), "{name}");
        }
    }
}
