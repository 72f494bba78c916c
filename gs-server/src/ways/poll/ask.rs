//! One request: time and size bounded, no redirect followed, nothing asked twice.

use std::time::Duration;

use reqwest::header::{ACCEPT, HeaderMap, HeaderValue, LINK, RETRY_AFTER};
use reqwest::{Response, StatusCode, Url};

use crate::elements::{chain, http_client};
use crate::ingest::formats::MESSAGE_MAX;

/// No answer takes longer.
#[cfg(not(test))]
const PATIENCE: Duration = Duration::from_secs(30);
#[cfg(test)]
const PATIENCE: Duration = Duration::from_secs(2);
/// What is shown of an answer.
const WORDS_MAX: usize = 120;

/// What came with 200.
pub(super) struct Body {
    pub(super) bytes: Vec<u8>,
    /// Where the next page is, as the header says.
    pub(super) next: Option<String>,
}

/// What a source said.
pub(super) enum Answer {
    /// 200.
    Body(Body),
    /// 404: there is no such thing, or nothing yet.
    NotFound,
    /// 429 or 503: later, after so many seconds.
    Busy(Option<u64>, String),
    /// 401 or 403.
    Refused(String),
    /// Anything else.
    Failed(String),
}

/// Asks once. `silence` is what it may mean when no answer comes, and what to do then.
pub(super) async fn ask(url: &Url, mut headers: HeaderMap, silence: &str) -> Answer {
    headers.entry(ACCEPT).or_insert(HeaderValue::from_static("application/json"));
    let client = match http_client(url, PATIENCE) {
        Ok(client) => client,
        Err(why) => return Answer::Failed(why),
    };
    let response = match client.get(url.clone()).headers(headers).send().await {
        Ok(response) => response,
        Err(error) if error.is_timeout() => {
            return Answer::Failed(format!(
                "{} gave no answer within {} s; {silence}",
                url.host_str().unwrap_or_default(),
                PATIENCE.as_secs()
            ));
        }
        Err(error) => return Answer::Failed(format!("no answer: {}", chain(&error))),
    };
    let status = response.status();
    match status {
        StatusCode::OK => match read(response).await {
            Ok(body) => Answer::Body(body),
            Err(why) => Answer::Failed(why),
        },
        StatusCode::NOT_FOUND => Answer::NotFound,
        StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN => Answer::Refused(format!(
            "it answered {status}: it is not asked again until token_file, headers or url change, or for a day. Ask its operators for \
             leave; files can be imported meanwhile"
        )),
        StatusCode::TOO_MANY_REQUESTS | StatusCode::SERVICE_UNAVAILABLE => {
            let after = response.headers().get(RETRY_AFTER).and_then(|value| value.to_str().ok());
            let after_s = after.and_then(|text| text.trim().parse().ok());
            Answer::Busy(after_s, format!("it answered {status}: it is asked later, and less often"))
        }
        status if status.is_redirection() => {
            Answer::Failed(format!("it has moved ({status}): look where to, and write that into url"))
        }
        status => Answer::Failed(format!("it answered {status}")),
    }
}

async fn read(mut response: Response) -> Result<Body, String> {
    let too_long = || format!("the answer is longer than {} KiB and was not read", MESSAGE_MAX >> 10);
    if response.content_length().is_some_and(|length| length > MESSAGE_MAX as u64) {
        return Err(too_long());
    }
    let next =
        response.headers().get_all(LINK).iter().filter_map(|value| next_of(value.to_str().ok()?)).next();
    let mut bytes = Vec::new();
    loop {
        match response.chunk().await {
            Ok(Some(chunk)) if bytes.len() + chunk.len() > MESSAGE_MAX => return Err(too_long()),
            Ok(Some(chunk)) => bytes.extend_from_slice(&chunk),
            Ok(None) => break,
            Err(error) => return Err(format!("the answer broke off: {}", chain(&error))),
        }
    }
    let begin = bytes.trim_ascii_start();
    if !matches!(begin.first(), Some(b'{' | b'[')) {
        let words = String::from_utf8_lossy(begin.get(..WORDS_MAX.min(begin.len())).unwrap_or_default());
        let words: String = words.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        return Err(format!("the answer is no JSON but '{words}'"));
    }
    Ok(Body { bytes, next })
}

/// The address of the next page in a header `Link: <…>; rel="next"`.
fn next_of(header: &str) -> Option<String> {
    header.split(',').find_map(|part| {
        let (address, rest) = part.trim().strip_prefix('<')?.split_once('>')?;
        let is_next = rest.split(';').any(|word| matches!(word.trim(), "rel=\"next\"" | "rel=next"));
        is_next.then(|| address.to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::next_of;

    #[test]
    fn the_next_page_is_found_among_links() {
        let header = "<https://x.org/?page=1>; rel=\"prev\", <https://x.org/?page=3>; rel=\"next\"";
        assert_eq!(next_of(header).as_deref(), Some("https://x.org/?page=3"));
        assert_eq!(next_of("<https://x.org/>; rel=\"last\""), None);
        assert_eq!(next_of("nonsense"), None);
    }
}
