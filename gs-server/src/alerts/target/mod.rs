//! Where messages go: one file per form. Each makes one attempt, in bounded time, and says what became of it.
//!
//! What it does **not** do: try again (the outbox does), keep anything, or show a secret in any text.

mod chat;
mod email;
pub(crate) mod hide;
mod matrix;
mod request;
pub(crate) mod secret;
pub(crate) mod webhook;

use std::fmt;
use std::time::Duration;

use serde_json::Value;

use crate::config::{ConfigError, TargetKind, TargetSection};
use secret::SecretSource;
pub(crate) use secret::secret_of_file;

/// No attempt takes longer.
const PATIENCE: Duration = Duration::from_secs(20);

/// One message, as every form needs it.
#[derive(Debug, Clone)]
pub(crate) struct Letter {
    /// The same in each attempt.
    pub(crate) message_id: String,
    /// `alert.raised`, `alert.digest`, …
    pub(crate) kind: String,
    /// One line.
    pub(crate) title: String,
    /// The whole text.
    pub(crate) text: String,
    /// When it was made, microseconds since 1970.
    pub(crate) made_at_us: i64,
    /// What programs read: the station, the alert.
    pub(crate) data: Value,
}

/// Why an attempt failed. No secrets.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum SendError {
    /// It was not reached, or did not answer in time: others would fare no better.
    #[error("{0}")]
    Unreached(String),
    /// It was reached and did not take this.
    #[error("{0}")]
    Refused(String),
    /// It could not even be tried: a secret cannot be read.
    #[error("{0}")]
    Secret(String),
}

/// A target, ready to be sent to. Secrets are read at each attempt and not kept.
pub(crate) struct Target {
    pub(crate) name: String,
    pub(crate) kind: TargetKind,
    pub(crate) shown: String,
    way: Way,
    secret: Option<SecretSource>,
}

enum Way {
    Email(email::Email),
    Webhook(reqwest::Url),
    Matrix(matrix::Matrix),
    Slack,
    Discord,
}

impl fmt::Debug for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Target").field("name", &self.name).field("kind", &self.kind).finish_non_exhaustive()
    }
}

impl Target {
    /// A target of a configuration that was checked.
    pub(crate) fn new(section: &TargetSection, key: &str, station: &str) -> Result<Self, ConfigError> {
        let wrong = |problem: String, remedy| ConfigError::value(format!("{key}.url"), problem, remedy);
        let url = || {
            crate::config::target_url(section.url.as_deref().unwrap_or_default())
                .map_err(|(problem, remedy)| wrong(problem, remedy))
        };
        let way = match section.kind {
            TargetKind::Email => Way::Email(email::Email::new(section, key, station)?),
            TargetKind::Webhook => Way::Webhook(url()?),
            TargetKind::Matrix => Way::Matrix(matrix::Matrix {
                homeserver: url()?,
                room: section.room.clone().unwrap_or_default(),
            }),
            TargetKind::Slack => Way::Slack,
            TargetKind::Discord => Way::Discord,
        };
        Ok(Self {
            name: section.name.clone(),
            kind: section.kind,
            shown: section.shown(),
            way,
            secret: SecretSource::of(section.secret_file.as_ref(), section.secret_env.as_ref()),
        })
    }

    /// One attempt.
    pub(crate) async fn send(&self, letter: &Letter) -> Result<(), SendError> {
        let attempt = self.attempt(letter);
        match crate::clock::within(PATIENCE, attempt).await {
            Some(result) => result,
            None => Err(SendError::Unreached(format!("no answer within {} s", PATIENCE.as_secs()))),
        }
    }

    async fn attempt(&self, letter: &Letter) -> Result<(), SendError> {
        let secret = match &self.secret {
            Some(source) => Some(source.load().await.map_err(|error| SendError::Secret(error.to_string()))?),
            None => None,
        };
        let needed = || {
            secret
                .as_deref()
                .map(String::as_str)
                .ok_or_else(|| SendError::Secret("it has no secret".to_owned()))
        };
        let sent = match &self.way {
            Way::Email(email) => email.send(letter, secret.as_deref().map(String::as_str)).await,
            Way::Webhook(url) => webhook::send(url, letter, needed()?).await,
            Way::Matrix(matrix) => matrix.send(letter, needed()?).await,
            Way::Slack => chat::slack(letter, needed()?).await,
            Way::Discord => chat::discord(letter, needed()?).await,
        };
        let user = match &self.way {
            Way::Email(email) => email.user(),
            _ => None,
        };
        match &secret {
            Some(secret) => sent.map_err(|error| hide::hide(error, secret, user)),
            None => sent,
        }
    }
}
