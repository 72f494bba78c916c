//! The header Accept: a path answers in one form, and says so (406) to who takes none of it.

use api::ProblemKind;
use axum::http::{HeaderMap, header};

use super::problem::Failure;

/// The form in which a path answers; `None` where it is no matter.
fn offered(path: &str) -> Option<(&'static str, &'static str)> {
    let path = path.strip_prefix("/api/v1/")?;
    Some(match path {
        // Upgraded, or refused.
        "stream" => return None,
        _ if path.ends_with(".svg") => ("image", "svg+xml"),
        _ if path.ends_with(".ics") => ("text", "calendar"),
        _ if path.starts_with("images/") && path.ends_with("/file") => ("image", "jpeg"),
        _ => ("application", "json"),
    })
}

/// Refuses a request that accepts nothing of what the path has. Errors come as `application/problem+json` in any case.
pub(super) fn check_accept(path: &str, headers: &HeaderMap) -> Result<(), Failure> {
    let Some((kind, form)) = offered(path) else { return Ok(()) };
    let mut given = headers.get_all(header::ACCEPT).iter().filter_map(|value| value.to_str().ok()).peekable();
    if given.peek().is_none() {
        return Ok(());
    }
    let mut ranges =
        given.flat_map(|list| list.split(',')).map(str::trim).filter(|range| !range.is_empty()).peekable();
    if ranges.peek().is_none() || ranges.any(|range| takes(range, kind, form)) {
        return Ok(());
    }
    Err(Failure::new(
        ProblemKind::NotAcceptable,
        format!("This path answers in {kind}/{form} only: name it in Accept, or leave Accept out."),
    ))
}

/// Whether one range of the header takes `kind/form` with a weight above 0.
fn takes(range: &str, kind: &str, form: &str) -> bool {
    let mut parts = range.split(';').map(str::trim);
    let (of, which) = parts.next().and_then(|name| name.split_once('/')).unwrap_or(("", ""));
    let fits = |wanted: &str, word: &str| wanted == "*" || wanted.eq_ignore_ascii_case(word);
    let refused = parts.any(|part| {
        let weight = part.strip_prefix("q=").or_else(|| part.strip_prefix("Q="));
        weight.and_then(|weight| weight.trim().parse::<f32>().ok()) == Some(0.0)
    });
    fits(of, kind) && fits(which, form) && !refused
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(path: &str, accept: &'static str) -> bool {
        let headers = HeaderMap::from_iter([(header::ACCEPT, axum::http::HeaderValue::from_static(accept))]);
        check_accept(path, &headers).is_ok()
    }

    #[test]
    fn a_path_answers_who_takes_its_form() {
        for accept in
            ["*/*", "application/*", "application/json", "text/html, */*;q=0.1", "", "Application/JSON; q=1"]
        {
            assert!(check("/api/v1/frames", accept), "{accept}");
        }
        for accept in ["text/html", "application/xml", "application/json;q=0", "json", "text/*"] {
            assert!(!check("/api/v1/frames", accept), "{accept}");
        }
        assert!(
            check("/api/v1/images/1/file", "image/*") && !check("/api/v1/images/1/file", "application/json")
        );
        assert!(
            check("/api/v1/passes.ics", "text/calendar") && check("/api/v1/passes/sky.svg", "image/svg+xml")
        );
        assert!(check("/", "text/html") && check("/api/v1/stream", "nonsense"));
        assert!(check_accept("/api/v1/frames", &HeaderMap::new()).is_ok());
    }
}
