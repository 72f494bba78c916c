//! `ETag` and `If-None-Match`: who asks again for what has not changed gets 304 and no body.

use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::problem::Failure;

/// The tag of a body. Weak, since the same body also goes out compressed.
pub(super) fn tag_of(content: &[u8]) -> String {
    format!("W/\"{}\"", hex::encode(&Sha256::digest(content)[..16]))
}

/// Whether the client holds what has this tag (RFC 9110, weak comparison; `*` is anything).
pub(super) fn is_known(headers: &HeaderMap, tag: &str) -> bool {
    let opaque = |tag: &str| tag.trim().trim_start_matches("W/").to_owned();
    let tag = opaque(tag);
    let lists = headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok());
    lists.flat_map(|list| list.split(',')).any(|known| known.trim() == "*" || opaque(known) == tag)
}

/// The body, or 304 when the client holds it already.
pub(super) fn answer(
    media_type: &'static str,
    content: impl Into<Body> + AsRef<[u8]>,
    headers: &HeaderMap,
) -> Response {
    let tag = tag_of(content.as_ref());
    tagged(media_type, content, &tag, headers)
}

/// The same under a tag that was made otherwise.
pub(super) fn tagged(
    media_type: &'static str,
    content: impl Into<Body>,
    tag: &str,
    headers: &HeaderMap,
) -> Response {
    let mut response = match is_known(headers, tag) {
        true => StatusCode::NOT_MODIFIED.into_response(),
        false => Response::new(content.into()),
    };
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(media_type));
    // Kept, but asked for each time.
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if let Ok(tag) = HeaderValue::try_from(tag) {
        headers.insert(header::ETAG, tag);
    }
    response
}

/// JSON, or 304.
pub(super) fn json(value: &impl Serialize, headers: &HeaderMap) -> Result<Response, Failure> {
    let body = serde_json::to_vec(value).map_err(|error| {
        tracing::error!(%error, "An answer could not be written.");
        Failure::new(api::ProblemKind::Internal, "The answer cannot be written.")
    })?;
    Ok(answer("application/json", body, headers))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asks(value: &'static str) -> HeaderMap {
        HeaderMap::from_iter([(header::IF_NONE_MATCH, HeaderValue::from_static(value))])
    }

    #[test]
    fn tags_are_compared_weakly_and_in_lists() {
        for known in ["W/\"a\"", "\"a\"", "\"b\", W/\"a\"", "*"] {
            assert!(is_known(&asks(known), "W/\"a\""), "{known}");
        }
        for other in ["\"b\"", "a", "", "W/\"ab\""] {
            assert!(!is_known(&asks(other), "W/\"a\""), "{other}");
        }
        assert!(!is_known(&HeaderMap::new(), "\"a\""));
    }
}
