//! Passwords: Argon2id on a pool of two, so that a flood of logins takes neither all memory nor all cores.

use std::sync::Arc;

use argon2::Argon2;
use argon2::password_hash::phc::PasswordHash;
use argon2::password_hash::{PasswordHasher as _, PasswordVerifier as _};
use tokio::sync::{OnceCell, Semaphore};
use zeroize::Zeroizing;

use super::PeopleError;
use super::secret::Secret;

/// Characters that a password has at least. There are no rules on which.
pub const PASSWORD_MIN: usize = 12;
/// And bytes at most.
pub const PASSWORD_MAX: usize = 256;

/// Passwords that are worked on at once; each takes 19 MiB and some tens of milliseconds.
const AT_ONCE: usize = 2;
/// And that may wait; more are sent away.
const WAITING: usize = 16;

/// The pool. Argon2id version 19 with m = 19 MiB, t = 2, p = 1, the least that OWASP recommends.
pub(super) struct Passwords {
    turns: Arc<Semaphore>,
    waiting: Arc<Semaphore>,
    /// Stands in for the hash of users who are not there, so that they take as long.
    nobody: OnceCell<String>,
}

impl Passwords {
    pub(super) fn new() -> Self {
        Self {
            turns: Arc::new(Semaphore::new(AT_ONCE)),
            waiting: Arc::new(Semaphore::new(AT_ONCE + WAITING)),
            nobody: OnceCell::new(),
        }
    }

    /// What is stored of a password, as a PHC string.
    pub(super) async fn hash(&self, password: &str) -> Result<String, PeopleError> {
        check(password)?;
        let password = Zeroizing::new(password.to_owned());
        self.work(move || {
            let hash = Argon2::default().hash_password(password.as_bytes());
            hash.map(|hash| hash.to_string()).map_err(|_| PeopleError::NoRandomness)
        })
        .await?
    }

    /// Whether the password is the one that `stored` was made of. Without a stored one it takes as long and is wrong.
    pub(super) async fn verify(&self, password: &str, stored: Option<&str>) -> Result<bool, PeopleError> {
        let is_somebody = stored.is_some();
        let stored = match stored {
            Some(stored) => stored.to_owned(),
            None => {
                let make = || async { self.hash(Secret::new("")?.reveal()).await };
                self.nobody.get_or_try_init(make).await?.clone()
            }
        };
        // Longer ones were never set.
        let password = Zeroizing::new(password.get(..PASSWORD_MAX).unwrap_or(password).to_owned());
        let is_right = self
            .work(move || match PasswordHash::new(&stored) {
                Ok(hash) => Argon2::default().verify_password(password.as_bytes(), &hash).is_ok(),
                Err(_) => false,
            })
            .await?;
        Ok(is_right && is_somebody)
    }

    async fn work<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, PeopleError> {
        let _place = Arc::clone(&self.waiting).try_acquire_owned().map_err(|_| PeopleError::Busy)?;
        let turn = Arc::clone(&self.turns).acquire_owned().await.map_err(|_| PeopleError::Busy)?;
        // The turn goes with the work: whoever hangs up does not make room for another one.
        let done = tokio::task::spawn_blocking(move || {
            let result = work();
            drop(turn);
            result
        });
        done.await.map_err(|_| PeopleError::Busy)
    }
}

/// Whether a password may be set.
pub(super) fn check(password: &str) -> Result<(), PeopleError> {
    let characters = password.chars().count();
    if characters < PASSWORD_MIN || password.len() > PASSWORD_MAX {
        return Err(PeopleError::BadPassword { characters });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_password_is_known_again_and_a_stranger_is_not() {
        let passwords = Passwords::new();
        let stored = passwords.hash("correct horse battery").await.unwrap();
        assert!(stored.starts_with("$argon2id$v=19$m=19456,t=2,p=1$"), "{stored}");
        assert!(passwords.verify("correct horse battery", Some(&stored)).await.unwrap());
        assert!(!passwords.verify("correct horse batterz", Some(&stored)).await.unwrap());
        assert!(!passwords.verify("correct horse battery", None).await.unwrap());
        assert!(!passwords.verify(&"x".repeat(5000), Some(&stored)).await.unwrap());
        assert_ne!(stored, passwords.hash("correct horse battery").await.unwrap(), "salted");
    }

    #[tokio::test]
    async fn short_and_endless_passwords_are_not_set() {
        let passwords = Passwords::new();
        for bad in ["", "elevenchars", &"x".repeat(257)] {
            assert!(matches!(passwords.hash(bad).await, Err(PeopleError::BadPassword { .. })), "{bad}");
        }
    }

    #[tokio::test]
    async fn a_flood_is_sent_away() {
        let passwords = Passwords::new();
        let floods = (0..40).map(|_| passwords.verify("a guess of somebody", None));
        let results = futures_util::future::join_all(floods).await;
        assert!(results.iter().any(|result| matches!(result, Err(PeopleError::Busy))));
        assert!(results.iter().filter(|result| matches!(result, Ok(false))).count() >= 2);
    }
}
