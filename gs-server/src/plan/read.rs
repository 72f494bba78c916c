//! Text to the words of the API.

use api::{PlanFinding, PlanText};
use mission::plan::Severity;
use mission::plan::check::nearest;

use super::place::line_and_column;

/// Longest text that is looked at, bytes.
const TEXT_MAX: usize = 256 * 1024;

/// How a plan is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// TOML.
    Toml,
    /// JSON.
    Json,
}

impl Form {
    /// By the first character: JSON begins with a brace, no TOML does.
    pub fn of(text: &str) -> Self {
        if text.trim_start_matches('\u{feff}').trim_start().starts_with('{') {
            Self::Json
        } else {
            Self::Toml
        }
    }
}

/// The words of a plan.
///
/// # Errors
/// The first mistake of shape: no TOML or JSON, a field that is unknown, missing, there twice or of the wrong type.
pub fn read(text: &str, form: Form) -> Result<PlanText, Box<PlanFinding>> {
    if text.len() > TEXT_MAX {
        let problem = format!("{} bytes of text", text.len());
        return Err(finding("", None, problem, format!("A plan has {TEXT_MAX} bytes at most.")));
    }
    match form {
        Form::Toml => read_toml(text),
        Form::Json => read_json(text),
    }
}

fn read_toml(text: &str) -> Result<PlanText, Box<PlanFinding>> {
    let place = |error: &toml::de::Error| error.span().map(|span| line_and_column(text, span.start));
    let reader = toml::Deserializer::parse(text).map_err(|error| {
        let problem = format!("no TOML: {}", error.message());
        finding("", place(&error), problem, "Mend the line; see docs/plans.md for an example.")
    })?;
    serde_path_to_error::deserialize(reader).map_err(|error| {
        let at = place(error.inner());
        shape(&error.path().to_string(), at, error.inner().message())
    })
}

fn read_json(text: &str) -> Result<PlanText, Box<PlanFinding>> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let words = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        let inner = error.inner();
        let at = (inner.line() > 0).then(|| (inner.line(), inner.column().max(1)));
        // The place is told in its own field.
        let message = inner.to_string();
        let message = message.split(" at line ").next().unwrap_or_default();
        if inner.is_data() {
            shape(&error.path().to_string(), at, message)
        } else {
            finding("", at, format!("no JSON: {message}"), "Mend the line; see docs/plans.md for an example.")
        }
    })?;
    reader.end().map_err(|error| {
        let at = Some((error.line(), error.column().max(1)));
        finding("", at, "something follows the end of the plan".to_owned(), "Take it out.")
    })?;
    Ok(words)
}

/// A mistake of shape; serde puts the words it knows between backquotes.
fn shape(path: &str, at: Option<(usize, usize)>, message: &str) -> Box<PlanFinding> {
    let path = if path == "." { "" } else { path };
    let message = message.trim_end();
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = message.starts_with("unknown ").then(|| quoted.next()).flatten();
    let near = unknown.and_then(|unknown| nearest(unknown, quoted));
    let remedy = match (near, message) {
        (Some(near), _) => format!("Did you mean '{near}'?"),
        (None, message) if message.starts_with("missing field") => "Add it; see docs/plans.md.".to_owned(),
        (None, message) if message.starts_with("unknown ") => "Take one of those.".to_owned(),
        _ => "See docs/plans.md for what stands here.".to_owned(),
    };
    finding(path, at, message.to_owned(), remedy)
}

fn finding(
    place: &str,
    at: Option<(usize, usize)>,
    problem: String,
    remedy: impl Into<String>,
) -> Box<PlanFinding> {
    Box::new(PlanFinding {
        severity: Severity::Error.name().to_owned(),
        place: place.to_owned(),
        line: at.map(|(line, _)| line),
        column: at.map(|(_, column)| column),
        problem,
        remedy: remedy.into(),
    })
}
