//! What was asked for, with its age.

use std::time::{Duration, Instant};

use api::client::ClientError;

/// What was asked for: the last answer, when it came, and why a newer one did not.
#[derive(Debug)]
pub struct Fetched<T> {
    held: Option<(T, Instant)>,
    failure: Option<String>,
    /// Counts answers: whoever derives something from the value sees by it that there is a new one.
    revision: u64,
}

impl<T> Default for Fetched<T> {
    fn default() -> Self {
        Self { held: None, failure: None, revision: 0 }
    }
}

impl<T> Fetched<T> {
    /// The last answer.
    #[must_use]
    pub fn value(&self) -> Option<&T> {
        self.held.as_ref().map(|(value, _)| value)
    }

    /// How long ago it came.
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        self.held.as_ref().map(|(_, at)| now.saturating_duration_since(*at))
    }

    /// Why the last attempt brought nothing; `None` when it did.
    #[must_use]
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Rises with each answer.
    #[must_use]
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Takes an answer. An old value stays when no new one came: it has its age.
    pub fn settle(&mut self, answer: Result<T, ClientError>, now: Instant) {
        match answer {
            Ok(value) => {
                self.held = Some((value, now));
                self.failure = None;
                self.revision += 1;
            }
            Err(error) => self.failure = Some(error.to_string()),
        }
    }
}
