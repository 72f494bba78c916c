//! A Matrix room, by the client-server API. The message's number is the transaction id: the homeserver takes it once.

use reqwest::header::{AUTHORIZATION, HeaderValue};
use reqwest::{Method, Url};
use serde_json::json;

use super::{Letter, SendError, request};

pub(super) struct Matrix {
    pub(super) homeserver: Url,
    pub(super) room: String,
}

impl Matrix {
    pub(super) async fn send(&self, letter: &Letter, token: &str) -> Result<(), SendError> {
        let mut url = self.homeserver.clone();
        url.path_segments_mut()
            .map_err(|()| SendError::Refused("the homeserver's address cannot have a path".into()))?
            .pop_if_empty()
            .extend(["_matrix", "client", "v3", "rooms"])
            .push(&self.room)
            .extend(["send", "m.room.message"])
            .push(&letter.message_id);
        let body = json!({ "msgtype": "m.text", "body": format!("{}\n\n{}", letter.title, letter.text) });
        let mut bearer = HeaderValue::try_from(format!("Bearer {token}"))
            .map_err(|_| SendError::Secret("the access token has letters that no token has".into()))?;
        bearer.set_sensitive(true);
        let request = request::json(Method::PUT, url, body.to_string().into_bytes())?;
        request::send(request.header(AUTHORIZATION, bearer)).await
    }
}
