//! A drawing in the dark or the light colours.
//!
//! Plots are drawn with the dark tokens. Those of the light theme stand under the same names further down in the one
//! file of tokens, so a drawing changes its theme by the exchange of its colours.

use serde::Deserialize;

use super::svg::TOKENS;

/// Which colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Theme {
    /// Light on dark.
    #[default]
    Dark,
    /// Dark on light.
    Light,
}

impl Theme {
    /// A drawing that was made with the dark tokens, in the colours of this theme.
    #[must_use]
    pub fn paint(self, svg: &str) -> String {
        match self {
            Self::Dark => svg.to_owned(),
            Self::Light => exchange(svg),
        }
    }
}

/// Colours of the tokens under each theme, by name.
fn pairs() -> Vec<(&'static str, &'static str)> {
    let (dark, light) = TOKENS.split_once("prefers-color-scheme: light").unwrap_or((TOKENS, ""));
    let light: Vec<_> = colours(light).collect();
    colours(dark)
        .filter_map(|(name, dark)| {
            light.iter().find(|(other, _)| *other == name).map(|(_, light)| (dark, *light))
        })
        .collect()
}

fn colours(css: &'static str) -> impl Iterator<Item = (&'static str, &'static str)> {
    css.lines().filter_map(|line| {
        let (name, value) = line.trim().strip_prefix("--")?.split_once(':')?;
        let colour = value.trim().strip_suffix(';')?;
        (colour.len() == 7 && colour.starts_with('#')).then_some((name, colour))
    })
}

/// A drawing that was made with the dark tokens, in whatever colours the page around it gives to the tokens: for drawings
/// that stand in a page, which change with its theme.
#[must_use]
pub fn with_tokens(svg: &str) -> String {
    let dark = TOKENS.split_once("prefers-color-scheme: light").map_or(TOKENS, |(dark, _)| dark);
    let tokens: Vec<_> =
        colours(dark).map(|(name, colour)| (colour, format!("var(--{name}, {colour})"))).collect();
    replace(svg, &tokens)
}

fn exchange(svg: &str) -> String {
    let pairs: Vec<_> = pairs().into_iter().map(|(dark, light)| (dark, light.to_owned())).collect();
    replace(svg, &pairs)
}

/// In one walk, so that no colour is exchanged twice.
fn replace(svg: &str, pairs: &[(&str, String)]) -> String {
    let mut out = String::with_capacity(svg.len());
    let mut rest = svg;
    while let Some(at) = rest.find("=\"#") {
        let (before, colour) = rest.split_at(at + 2);
        out.push_str(before);
        let Some(found) = colour.get(..7) else {
            rest = colour;
            continue;
        };
        let other = pairs.iter().find(|(known, _)| known.eq_ignore_ascii_case(found));
        out.push_str(other.map_or(found, |(_, other)| other));
        rest = &colour[7..];
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_colour_has_a_light_one_and_texts_stay() {
        let dark = TOKENS.split_once("prefers-color-scheme: light").unwrap().0;
        assert_eq!(pairs().len(), colours(dark).count());
        let svg = "<g fill=\"#0E1116\" stroke=\"#d7dee7\">#0E1116 =\"#12\" =\"#é</g>";
        let light = Theme::Light.paint(svg);
        assert!(!light.contains("\"#0E1116\"") && !light.contains("d7dee7"), "{light}");
        assert!(light.ends_with("#0E1116 =\"#12\" =\"#é</g>"), "{light}");
        assert_eq!(Theme::Dark.paint(svg), svg);
    }
}
