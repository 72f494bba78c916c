//! Colours and sizes, from the one token file that feeds this crate and the web page alike (`ui/tokens.json`).
//!
//! Grey is the normal state; colour means something to know. Each level of an alarm has a shape and a word beside its
//! colour ([`crate::level`]), so nothing is told by colour alone.

use std::sync::LazyLock;

use egui::{Color32, CornerRadius, FontFamily, FontId, Margin, Stroke, TextStyle, Visuals};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

const TOKENS: &str = include_str!("../tokens.json");

static ALL: LazyLock<Tokens> = LazyLock::new(|| {
    #[expect(clippy::expect_used, reason = "the file is a part of the program, and a test reads it")]
    serde_json::from_str(TOKENS).expect("ui/tokens.json")
});

/// Dark for the night, light for daylight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Light on dark.
    #[default]
    Dark,
    /// Dark on light.
    Light,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Tokens {
    dark: Theme,
    light: Theme,
    size: Sizes,
    space: f32,
    radius: u8,
}

/// The colours of one mode.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Theme {
    /// Behind everything.
    #[serde(deserialize_with = "colour")]
    pub ground: Color32,
    /// A panel.
    #[serde(deserialize_with = "colour")]
    pub panel: Color32,
    /// Something on a panel: a button, a card, a row under the pointer.
    #[serde(deserialize_with = "colour")]
    pub raised: Color32,
    /// Lines between panels.
    #[serde(deserialize_with = "colour")]
    pub line: Color32,
    /// Values.
    #[serde(deserialize_with = "colour")]
    pub text: Color32,
    /// Labels and units.
    #[serde(deserialize_with = "colour")]
    pub dim: Color32,
    /// Grids, what is past.
    #[serde(deserialize_with = "colour")]
    pub faint: Color32,
    /// Selection, focus, our satellite, the coming path.
    #[serde(deserialize_with = "colour")]
    pub accent: Color32,
    /// Behind selected text and rows.
    #[serde(deserialize_with = "colour")]
    pub selection: Color32,
    /// Water on maps.
    #[serde(deserialize_with = "colour")]
    pub sea: Color32,
    /// Land on maps.
    #[serde(deserialize_with = "colour")]
    pub land: Color32,
    /// Laid over the night side of maps; translucent.
    #[serde(deserialize_with = "colour")]
    pub night: Color32,
    /// Alarm level 1 of 5.
    #[serde(deserialize_with = "colour")]
    pub watch: Color32,
    /// Alarm level 2 of 5.
    #[serde(deserialize_with = "colour")]
    pub warning: Color32,
    /// Alarm level 3 of 5.
    #[serde(deserialize_with = "colour")]
    pub distress: Color32,
    /// Alarm level 4 of 5.
    #[serde(deserialize_with = "colour")]
    pub critical: Color32,
    /// Alarm level 5 of 5.
    #[serde(deserialize_with = "colour")]
    pub severe: Color32,
    /// The transmitter can do nothing: an outline.
    #[serde(deserialize_with = "colour")]
    pub safe: Color32,
    /// The transmitter may go on the air: an outline.
    #[serde(deserialize_with = "colour")]
    pub armed: Color32,
    /// The transmitter is on the air: filled.
    #[serde(deserialize_with = "colour")]
    pub on_air: Color32,
    /// The word on `on_air`.
    #[serde(deserialize_with = "colour")]
    pub on_air_text: Color32,
    /// Lines of plots, told apart also by those who do not see all colours.
    #[serde(deserialize_with = "colours")]
    pub series: Vec<Color32>,
}

/// Heights of type in points.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sizes {
    /// Labels in plots and tables.
    pub small: f32,
    /// Nearly everything.
    pub body: f32,
    /// Headings.
    pub title: f32,
    /// The countdown.
    pub large: f32,
}

impl Theme {
    /// The colours of this mode.
    #[must_use]
    pub fn of(mode: Mode) -> &'static Self {
        match mode {
            Mode::Dark => &ALL.dark,
            Mode::Light => &ALL.light,
        }
    }

    /// The colours that this interface is drawn in ([`apply`] chose them).
    #[must_use]
    pub fn current(ui: &egui::Ui) -> &'static Self {
        Self::of(if ui.visuals().dark_mode { Mode::Dark } else { Mode::Light })
    }

    /// The colour of the series with this index; they come round again after the last.
    #[must_use]
    pub fn series(&self, index: usize) -> Color32 {
        self.series.get(index % self.series.len().max(1)).copied().unwrap_or(self.text)
    }
}

/// Heights of type.
#[must_use]
pub fn sizes() -> Sizes {
    ALL.size
}

/// The step of all distances in points.
#[must_use]
pub fn space() -> f32 {
    ALL.space
}

/// Gives the context our colours, sizes and distances.
pub fn apply(context: &egui::Context, mode: Mode) {
    context.set_theme(match mode {
        Mode::Dark => egui::Theme::Dark,
        Mode::Light => egui::Theme::Light,
    });
    for mode in [Mode::Dark, Mode::Light] {
        let which = if mode == Mode::Dark { egui::Theme::Dark } else { egui::Theme::Light };
        context.style_mut_of(which, |style| {
            style.visuals = visuals(mode);
            let sizes = sizes();
            style.text_styles = [
                (TextStyle::Small, FontId::new(sizes.small, FontFamily::Proportional)),
                (TextStyle::Body, FontId::new(sizes.body, FontFamily::Proportional)),
                (TextStyle::Button, FontId::new(sizes.body, FontFamily::Proportional)),
                (TextStyle::Heading, FontId::new(sizes.title, FontFamily::Proportional)),
                (TextStyle::Monospace, FontId::new(sizes.body, FontFamily::Monospace)),
            ]
            .into();
            let step = space();
            style.spacing.item_spacing = egui::vec2(2.0 * step, step);
            style.spacing.button_padding = egui::vec2(2.0 * step, step);
            style.spacing.window_margin = Margin::same(12);
            style.spacing.interact_size.y = 6.0 * step;
            style.animation_time = 0.08;
        });
    }
}

fn visuals(mode: Mode) -> Visuals {
    let theme = Theme::of(mode);
    let mut visuals = if mode == Mode::Dark { Visuals::dark() } else { Visuals::light() };
    visuals.panel_fill = theme.panel;
    visuals.window_fill = theme.panel;
    visuals.extreme_bg_color = theme.ground;
    visuals.faint_bg_color = theme.raised;
    visuals.window_stroke = Stroke::new(1.0, theme.line);
    visuals.hyperlink_color = theme.accent;
    visuals.selection.bg_fill = theme.selection;
    visuals.selection.stroke = Stroke::new(1.0, theme.accent);
    visuals.warn_fg_color = theme.distress;
    visuals.error_fg_color = theme.critical;
    let radius = CornerRadius::same(ALL.radius);
    visuals.window_corner_radius = radius;
    visuals.menu_corner_radius = radius;
    let widgets = &mut visuals.widgets;
    for widget in [
        &mut widgets.noninteractive,
        &mut widgets.inactive,
        &mut widgets.hovered,
        &mut widgets.active,
        &mut widgets.open,
    ] {
        widget.corner_radius = radius;
        widget.fg_stroke.color = theme.text;
        widget.bg_stroke = Stroke::new(1.0, theme.line);
        widget.bg_fill = theme.raised;
        widget.weak_bg_fill = theme.raised;
    }
    widgets.noninteractive.bg_fill = theme.panel;
    widgets.noninteractive.weak_bg_fill = theme.panel;
    widgets.hovered.bg_stroke = Stroke::new(1.0, theme.faint);
    widgets.active.bg_stroke = Stroke::new(1.0, theme.accent);
    visuals
}

fn colour<'de, D: Deserializer<'de>>(from: D) -> Result<Color32, D::Error> {
    let text = String::deserialize(from)?;
    Color32::from_hex(&text).map_err(|_| D::Error::custom(format!("'{text}' is no colour like #RRGGBB")))
}

fn colours<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Color32>, D::Error> {
    let texts = Vec::<String>::deserialize(from)?;
    if texts.is_empty() {
        return Err(D::Error::custom("no colour"));
    }
    let read = |text: String| Color32::from_hex(&text).map_err(|_| D::Error::custom(format!("'{text}'")));
    texts.into_iter().map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// WCAG 2.2: the ratio of two relative luminances.
    fn contrast(a: Color32, b: Color32) -> f32 {
        let luminance = |colour: Color32| {
            let [r, g, b, _] = egui::Rgba::from(colour).to_array();
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn what_is_read_can_be_read_in_both_modes() {
        for mode in [Mode::Dark, Mode::Light] {
            let theme = Theme::of(mode);
            for ground in [theme.ground, theme.panel, theme.raised] {
                assert!(contrast(theme.text, ground) >= 7.0, "{mode:?} text on {ground:?}");
                assert!(contrast(theme.dim, ground) >= 4.5, "{mode:?} dim on {ground:?}");
            }
            for level in
                [theme.watch, theme.warning, theme.distress, theme.critical, theme.severe, theme.accent]
            {
                let ratio = contrast(level, theme.panel);
                assert!(ratio >= 3.0, "{mode:?} {level:?} on the panel: {ratio}");
            }
        }
    }
}
