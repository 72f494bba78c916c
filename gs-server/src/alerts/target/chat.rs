//! Slack and Discord: a POST to an address that is the secret itself.

use reqwest::{Method, Url};
use serde_json::json;

use super::{Letter, SendError, request};
use crate::config::target_url;

/// Characters that Discord takes.
const DISCORD_MAX: usize = 2000;

pub(super) async fn slack(letter: &Letter, address: &str) -> Result<(), SendError> {
    // Three letters mean something to Slack: nobody is to be called by a value's name.
    let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let text = format!("*{}*\n{}", escaped(&letter.title), escaped(&letter.text));
    post(address, &json!({ "text": text })).await
}

pub(super) async fn discord(letter: &Letter, address: &str) -> Result<(), SendError> {
    let text = format!("**{}**\n{}", letter.title, letter.text);
    let text: String = text.chars().take(DISCORD_MAX).collect();
    // Nobody is called by @everyone in a value's name.
    post(address, &json!({ "content": text, "allowed_mentions": { "parse": [] } })).await
}

async fn post(address: &str, body: &serde_json::Value) -> Result<(), SendError> {
    let url: Url = target_url(address).map_err(|(_, remedy)| {
        SendError::Secret(format!("the secret is no address of a webhook. {remedy}"))
    })?;
    request::send(request::json(Method::POST, url, body.to_string().into_bytes())?).await
}
