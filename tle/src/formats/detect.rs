//! Which form a text has; and the answers of a source that are no elements at all.

use super::{Form, SourceError, excerpt, lines, numbered_lines};

pub(super) fn form(text: &str) -> Result<Form, SourceError> {
    let Some((_, first)) =
        numbered_lines(text).find(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
    else {
        return Err(SourceError::Empty);
    };
    let first = first.trim_start();
    let card = numbered_lines(text).find(|(_, line)| lines::tle_line(line).is_some());
    match first.as_bytes().first() {
        // A name may begin like markup or JSON.
        Some(b'<') if card.is_none() || is_page(text) => return markup(text),
        Some(b'[' | b'{') if card.is_none() => return json(text),
        _ => {}
    }
    if first.starts_with("CCSDS_OMM_VERS") {
        return Ok(Form::OmmKvn);
    }
    if first.contains(',') && first.contains("EPOCH") && first.contains("INCLINATION") {
        return Ok(Form::OmmCsv);
    }
    if let Some((_, card)) = card {
        return Ok(if card.trim_start() == first { Form::TwoLine } else { Form::ThreeLine });
    }
    if let Some(refusal) = refusal(first) {
        return Err(refusal);
    }
    // KVN whose first line was lost.
    let key = |line: &str, wanted: &str| {
        line.split_once('=').is_some_and(|(key, _)| key.trim().eq_ignore_ascii_case(wanted))
    };
    if numbered_lines(text).any(|(_, line)| key(line, "EPOCH")) {
        return Ok(Form::OmmKvn);
    }
    Err(SourceError::NotElements { begins: excerpt(first) })
}

/// Sentences that sources answer instead of data.
fn refusal(first: &str) -> Option<SourceError> {
    let said = first.to_ascii_lowercase();
    if said.starts_with("no gp data found") || said.starts_with("no results returned") {
        return Some(SourceError::NoData { said: excerpt(first) });
    }
    if said.contains("not updated since your last") || said.contains("not been updated since your last") {
        return Some(SourceError::NotUpdated { said: excerpt(first) });
    }
    let message = ["invalid query", "error", "you must be logged in", "forbidden", "access denied", "http/"];
    message.iter().any(|word| said.starts_with(word)).then(|| SourceError::Message { said: excerpt(first) })
}

fn is_page(text: &str) -> bool {
    let begins = excerpt(text).to_ascii_lowercase();
    ["<!doctype", "<html", "<?xml", "<ndm", "<omm"].iter().any(|tag| begins.contains(tag))
}

fn markup(text: &str) -> Result<Form, SourceError> {
    if text.contains("<omm") || text.contains("<ndm") {
        return Ok(Form::OmmXml);
    }
    let lower = text.to_ascii_lowercase();
    let title = lower.find("<title>").and_then(|start| {
        let rest = text.get(start + 7..)?;
        let end = lower.get(start + 7..)?.find("</title>")?;
        rest.get(..end).map(excerpt)
    });
    Err(SourceError::Html { title })
}

fn json(text: &str) -> Result<Form, SourceError> {
    if text.contains("\"EPOCH\"") || text.contains("\"MEAN_MOTION\"") {
        return Ok(Form::OmmJson);
    }
    let said = excerpt(text);
    let bare: String = said.chars().filter(|c| !c.is_whitespace()).collect();
    if bare == "[]" || bare == "{}" {
        return Err(SourceError::NoData { said });
    }
    Err(refusal(&said).unwrap_or(SourceError::Message { said }))
}
