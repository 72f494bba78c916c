//! An answer that comes later.

use std::sync::{Arc, Mutex, PoisonError};

use api::client::ClientError;

/// An answer that comes later: looked at in each frame, never waited for.
#[derive(Debug)]
pub struct Pending<T>(Slot<T>);

#[derive(Debug)]
pub(super) struct Slot<T>(Arc<Mutex<Option<Result<T, ClientError>>>>);

impl<T> Pending<T> {
    pub(super) fn new() -> Self {
        Self(Slot(Arc::new(Mutex::new(None))))
    }

    pub(super) fn slot(&self) -> Slot<T> {
        Slot(Arc::clone(&self.0.0))
    }

    /// The answer, once.
    #[must_use]
    pub fn take(&self) -> Option<Result<T, ClientError>> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl<T> Slot<T> {
    pub(super) fn put(&self, answer: Result<T, ClientError>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(answer);
    }
}
