//! One HTTP request and what its answer means.

use reqwest::{Method, RequestBuilder, Url};

use super::{PATIENCE, SendError};
use crate::elements::{chain, http_client};

/// What an answer is read of.
const WORDS_MAX: usize = 1024;

/// A request with a body of JSON. The address may be a secret: no error names it.
pub(super) fn json(method: Method, url: Url, body: Vec<u8>) -> Result<RequestBuilder, SendError> {
    let client = http_client(&url, PATIENCE).map_err(SendError::Unreached)?;
    Ok(client.request(method, url).header(reqwest::header::CONTENT_TYPE, "application/json").body(body))
}

/// Sends it once. Whatever is not 2xx is a refusal.
pub(super) async fn send(request: RequestBuilder) -> Result<(), SendError> {
    let mut response = request.send().await.map_err(|error| SendError::Unreached(chain(&error)))?;
    let status = response.status();
    if status.is_success() {
        return Ok(());
    }
    let mut body = Vec::new();
    while let Ok(Some(chunk)) = response.chunk().await {
        body.extend_from_slice(&chunk);
        if body.len() >= WORDS_MAX {
            body.truncate(WORDS_MAX);
            break;
        }
    }
    let said: String = String::from_utf8_lossy(&body)
        .trim()
        .chars()
        .take(160)
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    let said = if said.is_empty() { String::new() } else { format!(", '{said}'") };
    let remedy = match status.as_u16() {
        300..=399 => ": it has moved; give its new address",
        401 | 403 => ": look at the secret",
        404 | 410 => ": look at the address",
        429 => ": it is told too much at once",
        _ => "",
    };
    let text = format!("it answered {status}{said}{remedy}");
    // Of these the next message would fare the same.
    match status.as_u16() {
        400 | 413 | 422 => Err(SendError::Refused(text)),
        _ => Err(SendError::Unreached(text)),
    }
}
