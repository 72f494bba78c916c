//! Targets repeat what they were asked in their answers ("Cannot POST /services/T0/B0/…"): nothing of a secret stays in
//! what is told of an attempt.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::SendError;

/// So many letters of a secret in a row are no accident.
const IN_A_ROW: usize = 8;
const INSTEAD: &str = "[secret]";

/// The same error without a piece of the secret, nor of the login that it is part of.
pub(super) fn hide(error: SendError, secret: &str, user: Option<&str>) -> SendError {
    let login = |user: &str| STANDARD.encode(format!("\0{user}\0{secret}"));
    let without = |text: String| {
        let text = without(&text, secret);
        user.map(login).map_or(text.clone(), |login| mask(&text, &login))
    };
    match error {
        SendError::Unreached(text) => SendError::Unreached(without(text)),
        SendError::Refused(text) => SendError::Refused(without(text)),
        SendError::Secret(text) => SendError::Secret(without(text)),
    }
}

/// The text without a piece of the secret, plain or in base64.
pub(crate) fn without(text: &str, secret: &str) -> String {
    mask(&mask(text, secret), &STANDARD.encode(secret))
}

/// Every stretch of the text that stands in the secret as well is left out.
fn mask(text: &str, secret: &str) -> String {
    let (text, secret): (Vec<char>, Vec<char>) = (text.chars().collect(), secret.chars().collect());
    let row = IN_A_ROW.min(secret.len());
    if row == 0 || text.len() < row {
        return text.into_iter().collect();
    }
    let mut hidden = vec![false; text.len()];
    for (at, piece) in text.windows(row).enumerate() {
        if secret.windows(row).any(|known| known == piece) {
            hidden[at..at + row].fill(true);
        }
    }
    let mut told = String::new();
    for (at, letter) in text.into_iter().enumerate() {
        match (hidden[at], at > 0 && hidden[at - 1]) {
            (false, _) => told.push(letter),
            (true, false) => told.push_str(INSTEAD),
            (true, true) => {}
        }
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secret_is_left_out_whole_in_part_and_as_a_login() {
        let secret = "https://hooks.example/services/T0/B0/uNlIkElY";
        let told = mask("it answered 404, 'Cannot POST /services/T0/B0/uNlIkElY': look", secret);
        assert_eq!(told, "it answered 404, 'Cannot POST [secret]': look");
        assert_eq!(mask("cut: /services/T0/B0/uNl", secret), "cut: [secret]");
        assert_eq!(mask("nothing of it", secret), "nothing of it");
        assert_eq!(mask("pin 4711 or 471", "4711"), "pin [secret] or 471");
        assert_eq!(mask("anything", ""), "anything");
        let login = STANDARD.encode("\0ground\0a long password");
        let error = SendError::Refused(format!("535 AUTH PLAIN {login} is wrong, as is a long password"));
        let SendError::Refused(told) = hide(error, "a long password", Some("ground")) else { panic!() };
        assert_eq!(told, "535 AUTH PLAIN [secret] is wrong, as is [secret]");
    }
}
