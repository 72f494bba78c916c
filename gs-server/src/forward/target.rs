//! One attempt, and what its answer means for what was sent.

use std::time::Duration;

use mission::UtcUs;
use reqwest::header::{AUTHORIZATION, CONTENT_TYPE, RETRY_AFTER};
use reqwest::{Method, Response, StatusCode, Url};

use super::form::{Form, Sender};
use crate::alerts::target::hide;
use crate::alerts::target::secret::SecretSource;
use crate::alerts::target::webhook::sign;
use crate::config::{ForwardKind, ForwardSection};
use crate::elements::{chain, http_client};
use crate::storage::ForwardRow;

/// No attempt takes longer.
const PATIENCE: Duration = Duration::from_secs(30);
/// What is read of an answer that is no success.
const WORDS_MAX: usize = 1024;
/// A far end may ask for no longer pause than this, seconds.
const PAUSE_MAX_S: u64 = 86_400;

/// What an attempt came to. No secrets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Fate {
    /// The far end has it.
    Taken,
    /// The far end does not want this one, now or ever.
    Unwanted(String),
    /// The far end surely does not have it, and may take it later: the pause that it asks for, seconds.
    NotNow(String, Option<u64>),
    /// Nobody knows whether it arrived.
    Unsure(String),
}

impl Fate {
    /// The same without a piece of the secret: far ends repeat what they were asked.
    fn without(self, secret: &str) -> Self {
        match self {
            Self::Taken => Self::Taken,
            Self::Unwanted(why) => Self::Unwanted(hide::without(&why, secret)),
            Self::NotNow(why, pause_s) => Self::NotNow(hide::without(&why, secret), pause_s),
            Self::Unsure(why) => Self::Unsure(hide::without(&why, secret)),
        }
    }
}

/// A target, ready to be sent to. Secrets are read at each attempt and not kept.
pub(super) struct Target {
    pub(super) name: String,
    pub(super) sender: Sender,
    url: Url,
    secret: Option<SecretSource>,
}

impl Target {
    pub(super) fn new(section: &ForwardSection, url: Url, sender: Sender) -> Self {
        let secret = SecretSource::of(section.secret_file.as_ref(), section.secret_env.as_ref());
        Self { name: section.name.clone(), sender, url, secret }
    }

    /// What was sent may come again: the far end knows its number.
    pub(super) const fn knows_repetition(&self) -> bool {
        matches!(self.sender.kind, ForwardKind::Webhook)
    }

    /// One attempt.
    pub(super) async fn send(&self, row: &ForwardRow, form: &Form, now: UtcUs) -> Fate {
        match crate::clock::within(PATIENCE, self.attempt(row, form, now)).await {
            Some(fate) => fate,
            None => Fate::Unsure(format!("no answer within {} s", PATIENCE.as_secs())),
        }
    }

    async fn attempt(&self, row: &ForwardRow, form: &Form, now: UtcUs) -> Fate {
        let secret = match &self.secret {
            None => None,
            Some(source) => match source.load().await {
                Ok(secret) => Some(secret),
                Err(error) => return Fate::NotNow(error.to_string(), None),
            },
        };
        let client = match http_client(&self.url, PATIENCE) {
            Ok(client) => client,
            Err(why) => return Fate::NotNow(why, None),
        };
        let mut request =
            client.request(Method::POST, self.url.clone()).header(CONTENT_TYPE, form.content_type);
        match (self.sender.kind, &secret) {
            (ForwardKind::Sids, Some(token)) => {
                let token = zeroize::Zeroizing::new(format!("Token {}", token.as_str()));
                let Ok(mut value) = reqwest::header::HeaderValue::from_str(&token) else {
                    return Fate::NotNow("the token has characters that no header takes".into(), None);
                };
                value.set_sensitive(true);
                request = request.header(AUTHORIZATION, value);
            }
            (ForwardKind::Sids, None) => {}
            (ForwardKind::Webhook, secret) => {
                // Of the attempt: who checks signatures takes none that is minutes old.
                let seconds = (now.0 / 1_000_000).to_string();
                let secret = secret.as_deref().map_or("", String::as_str);
                let signature = match sign(secret, &row.message_id, &seconds, form.body.as_bytes()) {
                    Ok(signature) => signature,
                    Err(why) => return Fate::NotNow(why.to_string(), None),
                };
                request = request
                    .header("webhook-id", &row.message_id)
                    .header("webhook-timestamp", seconds)
                    .header("webhook-signature", signature);
            }
        }
        let fate = match request.body(form.body.clone()).send().await {
            Ok(response) => fate(response).await,
            // Nothing has left yet.
            Err(error) if error.is_connect() || error.is_builder() => Fate::NotNow(chain(&error), None),
            Err(error) => Fate::Unsure(chain(&error)),
        };
        match &secret {
            Some(secret) => fate.without(secret),
            None => fate,
        }
    }
}

/// What an answer means.
async fn fate(response: Response) -> Fate {
    let status = response.status();
    if status.is_success() {
        return Fate::Taken;
    }
    let pause =
        response.headers().get(RETRY_AFTER).and_then(|value| value.to_str().ok()?.trim().parse().ok());
    let pause = pause.map(|seconds: u64| seconds.min(PAUSE_MAX_S));
    let why = format!("it answered {status}{}{}", words(response).await, remedy(status));
    match status.as_u16() {
        400 | 409 | 413 | 422 => Fate::Unwanted(why),
        429 => Fate::NotNow(why, pause),
        503 if pause.is_some() => Fate::NotNow(why, pause),
        // Whoever stands in front may have passed it on, and the far end may have kept it before it failed.
        500..=599 => Fate::Unsure(why),
        _ => Fate::NotNow(why, pause),
    }
}

const fn remedy(status: StatusCode) -> &'static str {
    match status.as_u16() {
        300..=399 => ": it has moved; give its new address",
        401 | 403 => ": look at the secret",
        404 | 405 | 410 => ": look at the address",
        429 => ": it is told too much at once; look at per_minute",
        _ => "",
    }
}

async fn words(mut response: Response) -> String {
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
    if said.is_empty() { said } else { format!(", '{said}'") }
}
