//! JSON as text, in the order in which it is written.

use std::fmt::Write as _;

/// A value whose members keep their order.
#[derive(Clone)]
pub(crate) enum Json {
    /// Text without quotes or backslashes.
    Text(String),
    /// A number, a truth value or null, as it stands in the file.
    Plain(String),
    List(Vec<Json>),
    Object(Vec<(String, Json)>),
}

impl Json {
    pub(crate) fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    pub(crate) fn plain(value: impl ToString) -> Self {
        Self::Plain(value.to_string())
    }

    /// Text, or null.
    pub(crate) fn text_or_null(text: Option<String>) -> Self {
        text.map_or_else(|| Self::plain("null"), Self::Text)
    }

    /// Exactly this number; what JSON has no number for, as text.
    pub(crate) fn float(value: f32) -> Self {
        match value {
            v if v.is_nan() => Self::text("NaN"),
            f32::INFINITY => Self::text("Infinity"),
            f32::NEG_INFINITY => Self::text("-Infinity"),
            v => Self::Plain(format!("{:?}", f64::from(v))),
        }
    }

    /// The member of this name, made if it is not there.
    pub(crate) fn member(&mut self, name: &str, made: Self) -> &mut Self {
        let Self::Object(members) = self else { panic!("{name} wants an object") };
        let at = members.iter().position(|(held, _)| held == name).unwrap_or_else(|| {
            members.push((name.to_owned(), made));
            members.len() - 1
        });
        &mut members[at].1
    }

    /// With objects down to `depth` spread over lines.
    pub(crate) fn write(&self, depth: usize, indent: usize, out: &mut String) {
        let (open, close, length) = match self {
            Self::Text(text) => return write!(out, "\"{text}\"").unwrap(),
            Self::Plain(text) => return out.push_str(text),
            Self::List(items) => ('[', ']', items.len()),
            Self::Object(members) => ('{', '}', members.len()),
        };
        let spread = depth > 0 && length > 0;
        let gap = |out: &mut String, first: bool, indent: usize| match (spread, first) {
            (true, _) => write!(out, "\n{:1$}", "", indent).unwrap(),
            (false, true) => {}
            (false, false) => out.push(' '),
        };
        out.push(open);
        for index in 0..length {
            if index > 0 {
                out.push(',');
            }
            gap(out, index == 0, indent + 2);
            let value = match self {
                Self::Object(members) => {
                    write!(out, "\"{}\": ", members[index].0).unwrap();
                    &members[index].1
                }
                Self::List(items) => &items[index],
                _ => continue,
            };
            value.write(depth.saturating_sub(1), indent + 2, out);
        }
        gap(out, true, indent);
        out.push(close);
    }
}
