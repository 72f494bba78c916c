//! The parameters of a request.

use std::fmt::Display;

use crate::{FineTime, Time};

/// The parameters of a request. Which of them a path takes the document of the API says; others are refused.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Filter(Vec<(&'static str, String)>);

impl Filter {
    /// None.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A parameter by its name.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl Display) -> Self {
        self.0.push((name, value.to_string()));
        self
    }

    /// Only of this satellite.
    #[must_use]
    pub fn satellite(self, name: &str) -> Self {
        self.with("satellite", name)
    }

    /// Only of this link.
    #[must_use]
    pub fn link(self, name: &str) -> Self {
        self.with("link", name)
    }

    /// Upwards from here: what follows this number.
    #[must_use]
    pub fn after(self, number: i64) -> Self {
        self.with("after", number)
    }

    /// Downwards from here: what precedes this number.
    #[must_use]
    pub fn before(self, number: i64) -> Self {
        self.with("before", number)
    }

    /// So many entries at most, 1 to 1000.
    #[must_use]
    pub fn limit(self, entries: u32) -> Self {
        self.with("limit", entries)
    }

    /// From this instant.
    #[must_use]
    pub fn start(self, at: Time) -> Self {
        self.with("start", at)
    }

    /// Until this instant.
    #[must_use]
    pub fn stop(self, at: Time) -> Self {
        self.with("stop", at)
    }

    /// At this instant.
    #[must_use]
    pub fn at(self, at: FineTime) -> Self {
        self.with("at", at)
    }

    pub(super) fn pairs(&self) -> &[(&'static str, String)] {
        &self.0
    }
}
