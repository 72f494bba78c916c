//! One polite request: who asks is said, no redirect is followed, nothing is asked twice, time and size are bounded.

use std::error::Error as _;
use std::time::Duration;

use reqwest::header::{CONTENT_TYPE, COOKIE, HeaderMap, HeaderValue, LOCATION, SET_COOKIE};
use reqwest::{Client, Response, StatusCode, Url, redirect};

use super::credentials::Credentials;
use super::memory::BODY_MAX;
use crate::config::{FetchSource, is_loopback};

/// No answer takes longer.
pub(super) const PATIENCE: Duration = Duration::from_secs(30);
/// What a refusal is read of.
const WORDS_MAX: usize = 4096;
const USER_AGENT: &str = concat!("gs-server/", env!("CARGO_PKG_VERSION"), " (PixelSat Ground)");

/// What a source said.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// 200, and this.
    Body(Vec<u8>),
    /// Nothing was asked: no network, no such host, no credentials.
    Unreached(String),
    /// Asked, and no whole answer came.
    Lost(String),
    /// Nothing newer than what we have.
    NotUpdated(String),
    /// Anything else: not to be asked again until somebody has looked.
    Refused(String),
}

/// A client for this address that follows nothing, repeats nothing and gives up after `patience`.
pub(crate) fn http_client(url: &Url, patience: Duration) -> Result<Client, String> {
    // The whole process shares one provider; whoever installed another first has chosen.
    if rustls::crypto::CryptoProvider::get_default().is_none() {
        let _ = rustls::crypto::ring::default_provider().install_default();
    }
    let builder = Client::builder()
        .user_agent(USER_AGENT)
        .redirect(redirect::Policy::none())
        .retry(reqwest::retry::never())
        // A connection that is used again may have died, and the request would go out once more.
        .pool_max_idle_per_host(0)
        .connect_timeout(patience / 3)
        .timeout(patience);
    // A proxy is for the world outside.
    let builder = if is_loopback(url) { builder.no_proxy() } else { builder };
    // Without TLS no certificates are needed: our own server is reached on a machine that has none.
    let plain = url.scheme() == "http";
    let builder = if plain { builder.tls_certs_only(std::iter::empty()) } else { builder };
    let remedy = if plain { "" } else { ": install the certificates of this system (ca-certificates)" };
    builder.build().map_err(|error| format!("no secure connection can be made: {}{remedy}", chain(&error)))
}

/// The error and its reasons; the address is left out, it is said elsewhere.
pub(crate) fn chain(error: &reqwest::Error) -> String {
    let mut text = String::new();
    let mut reason = error.source();
    while let Some(inner) = reason {
        if !text.is_empty() {
            text.push_str(": ");
        }
        text.push_str(&inner.to_string());
        reason = inner.source();
    }
    if text.is_empty() {
        text = if error.is_timeout() { "it took too long".into() } else { "the request failed".into() };
    }
    text
}

/// Asks a source once.
pub(super) async fn ask(source: &FetchSource, url: &Url, patience: Duration) -> Answer {
    match try_ask(source, url, patience).await {
        Ok(body) => Answer::Body(body),
        Err(answer) => answer,
    }
}

async fn try_ask(source: &FetchSource, url: &Url, patience: Duration) -> Result<Vec<u8>, Answer> {
    let client = http_client(url, patience).map_err(Answer::Unreached)?;
    let mut headers = HeaderMap::new();
    if let Some(file) = &source.credentials_file {
        let credentials = Credentials::load(file).map_err(|error| Answer::Unreached(error.to_string()))?;
        headers.insert(COOKIE, log_in(&client, url, credentials).await?);
    }
    let response = client.get(url.clone()).headers(headers).send().await.map_err(|error| lost(&error))?;
    match response.status() {
        StatusCode::OK => read(response, BODY_MAX).await,
        status => Err(refusal(status, response).await),
    }
}

/// As Space-Track has it: `POST /ajaxauth/login` on the same host gives a cookie.
async fn log_in(client: &Client, url: &Url, credentials: Credentials) -> Result<HeaderValue, Answer> {
    let login = url.join("/ajaxauth/login").map_err(|error| Answer::Unreached(error.to_string()))?;
    let form = credentials.form();
    drop(credentials);
    let request = client
        .post(login)
        .header(CONTENT_TYPE, "application/x-www-form-urlencoded")
        .body(form.as_bytes().to_vec());
    let response = request.send().await.map_err(|error| lost(&error))?;
    let status = response.status();
    if status != StatusCode::OK {
        return Err(refusal(status, response).await);
    }
    let cookies: Vec<String> = response
        .headers()
        .get_all(SET_COOKIE)
        .iter()
        .filter_map(|cookie| cookie.to_str().ok()?.split(';').next().map(|pair| pair.trim().to_owned()))
        .filter(|pair| pair.contains('='))
        .collect();
    let said = read(response, WORDS_MAX).await.unwrap_or_default();
    if String::from_utf8_lossy(&said).contains("Failed") || cookies.is_empty() {
        return Err(Answer::Refused(
            "the login was refused: look at the two lines of the credentials file, and whether the account is still good"
                .into(),
        ));
    }
    let mut cookie = HeaderValue::try_from(cookies.join("; "))
        .map_err(|_| Answer::Refused("the login gave a cookie that cannot be sent back".into()))?;
    cookie.set_sensitive(true);
    Ok(cookie)
}

fn lost(error: &reqwest::Error) -> Answer {
    if error.is_connect() {
        Answer::Unreached(format!("it cannot be reached: {}", chain(error)))
    } else if error.is_timeout() {
        Answer::Lost("no whole answer in time".into())
    } else {
        Answer::Lost(format!("no whole answer: {}", chain(error)))
    }
}

async fn read(mut response: Response, most: usize) -> Result<Vec<u8>, Answer> {
    let too_long = || {
        Answer::Refused(format!(
            "the answer is longer than {} MB: ask for a group that holds your satellites, not for everything",
            BODY_MAX >> 20
        ))
    };
    if response.content_length().is_some_and(|length| length > most as u64) {
        return Err(too_long());
    }
    let mut body = Vec::new();
    while let Some(chunk) = response.chunk().await.map_err(|error| lost(&error))? {
        if body.len() + chunk.len() > most {
            return Err(too_long());
        }
        body.extend_from_slice(&chunk);
    }
    Ok(body)
}

/// What an answer means that is not 200.
async fn refusal(status: StatusCode, mut response: Response) -> Answer {
    let target = response.headers().get(LOCATION).map(|to| excerpt(&String::from_utf8_lossy(to.as_bytes())));
    if status.is_redirection() {
        return Answer::Refused(match target {
            Some(target) => format!(
                "it has moved ({status}) to '{target}': if you trust that, write it into elements.fetch, restart, and say \
                 `gs-server elements fetch`"
            ),
            None => format!("it has moved ({status}) and does not say where: look at the source's web page"),
        });
    }
    let mut body = Vec::new();
    while let Ok(Some(chunk)) = response.chunk().await {
        body.extend_from_slice(&chunk);
        if body.len() >= WORDS_MAX {
            body.truncate(WORDS_MAX);
            break;
        }
    }
    let words = String::from_utf8_lossy(&body).into_owned();
    if status == StatusCode::FORBIDDEN
        && let Err(tle::formats::SourceError::NotUpdated { said }) =
            tle::formats::sets(&words, tle::formats::Checksums::Strict)
    {
        return Answer::NotUpdated(said);
    }
    let said = excerpt(&words);
    let remedy = match status.as_u16() {
        401 => "look at the credentials",
        403 => "it may have blocked this address: read its usage policy, and wait before you ask again",
        404 => "look at the address",
        429 => "too many requests: wait before you ask again",
        500..=599 => "the source is in trouble: look at its web page, and wait before you ask again",
        _ => "look at the address and at the source's web page",
    };
    let said = if said.is_empty() { String::new() } else { format!(", '{said}'") };
    Answer::Refused(format!("it answered {status}{said}: {remedy}; then say `gs-server elements fetch`"))
}

/// One line, cut.
fn excerpt(text: &str) -> String {
    text.trim().chars().take(160).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
