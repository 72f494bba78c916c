//! A webhook as <https://www.standardwebhooks.com> has it: JSON, its number and time in headers, signed.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use hmac::{Hmac, KeyInit as _, Mac as _};
use reqwest::{Method, Url};
use serde_json::json;
use sha2::Sha256;

use super::{Letter, SendError, request};

pub(super) async fn send(url: &Url, letter: &Letter, secret: &str) -> Result<(), SendError> {
    let body = json!({
        "type": letter.kind,
        "id": letter.message_id,
        "timestamp": api::Time::from_unix_us(letter.made_at_us),
        "title": letter.title,
        "text": letter.text,
        "data": letter.data,
    });
    let body = body.to_string().into_bytes();
    // The time of the message, not of the attempt: a repeated one is the same, byte for byte.
    let seconds = (letter.made_at_us / 1_000_000).to_string();
    let signature = sign(secret, &letter.message_id, &seconds, &body)?;
    let request = request::json(Method::POST, url.clone(), body)?
        .header("webhook-id", &letter.message_id)
        .header("webhook-timestamp", &seconds)
        .header("webhook-signature", signature);
    request::send(request).await
}

/// `v1,` and the HMAC-SHA256 of `id.timestamp.body` in base64. A secret that begins with `whsec_` is base64 itself.
pub(crate) fn sign(secret: &str, id: &str, seconds: &str, body: &[u8]) -> Result<String, SendError> {
    let key = match secret.strip_prefix("whsec_") {
        Some(encoded) => STANDARD.decode(encoded).map_err(|_| {
            SendError::Secret("the secret begins with whsec_ and is not base64 after it".into())
        })?,
        None => secret.as_bytes().to_vec(),
    };
    let key = zeroize::Zeroizing::new(key);
    let mut mac = Hmac::<Sha256>::new_from_slice(&key)
        .map_err(|_| SendError::Secret("the secret cannot be a key".into()))?;
    for part in [id.as_bytes(), b".", seconds.as_bytes(), b".", body] {
        mac.update(part);
    }
    Ok(format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the standard's own libraries.
    #[test]
    fn the_signature_is_that_of_the_standard() {
        let signature = sign(
            "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw",
            "msg_p5jXN8AQM9LWM0D4loKWxJek",
            "1614265330",
            br#"{"test": 2432232314}"#,
        );
        assert_eq!(signature.unwrap(), "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
        assert!(sign("whsec_?", "a", "1", b"").is_err());
    }
}
