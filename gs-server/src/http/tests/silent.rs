//! Whatever holds a secret does not show it: not in its `Debug` text, not in the text of a panic, not in an error about it.

use std::panic::{AssertUnwindSafe, catch_unwind};

use protocol::Key;

use super::super::Token;
use crate::keys::KeyFile;
use crate::storage::Postgres;

const SECRET: &str = "5eC0ffee5eC0ffee5eC0ffee5eC0ffee";

#[test]
fn a_panic_with_a_secret_in_hand_does_not_tell_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("password");
    std::fs::write(&file, format!("{SECRET}\n")).unwrap();
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o600);
    std::fs::set_permissions(&file, mode).unwrap();
    let bytes: [u8; 16] = hex::decode(SECRET).unwrap().try_into().unwrap();
    let key = KeyFile { path: "uplink.key".into(), key: Key::from_bytes(bytes), simulated: true };
    let database = Postgres::new("postgres://ground@localhost/ground").unwrap().with_password_file(&file);
    let secret = || SECRET.to_owned();
    let login = api::LoginRequest { name: secret(), password: secret() };
    let welcome = api::WelcomeRequest {
        code: secret(),
        name: None,
        password: secret(),
        call_sign: None,
        licence: None,
    };
    let change = api::PasswordRequest { old: secret(), new: secret() };
    let texts = [
        panicked(&key),
        panicked(&key.key),
        panicked(&Token::new(SECRET).unwrap()),
        panicked(&database.unwrap()),
        panicked(&login),
        panicked(&welcome),
        panicked(&change),
    ];
    for text in texts {
        assert!(text.starts_with("invariant broken by "), "{text}");
        for spelling in [
            SECRET.to_ascii_lowercase(),
            format!("{bytes:?}"),
            format!("{bytes:x?}"),
            "94, 192, 255".to_owned(),
        ] {
            assert!(!text.to_ascii_lowercase().contains(&spelling), "{text}");
        }
    }
}

/// What a panic says that shows all that it has, as a failed `assert_eq` would.
fn panicked(held: &impl std::fmt::Debug) -> String {
    let panic = catch_unwind(AssertUnwindSafe(|| panic!("invariant broken by {held:#?} {held:?}")));
    *panic.unwrap_err().downcast::<String>().unwrap()
}
