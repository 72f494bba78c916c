//! What one stream is to tell of.

use api::{ProblemKind, StreamRequest, Topic};

use super::super::App;
use super::super::extract;
use super::super::problem::Failure;

/// Satellites that one stream may name.
const SATELLITES_MAX: usize = 64;

/// Topics, and whose.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Wanted {
    topics: [bool; Topic::ALL.len()],
    /// Satellites; none: all of them.
    pub(super) satellites: Vec<String>,
}

impl Wanted {
    /// From the parameters of the request; events and status when no topics are named.
    pub(super) fn read(app: &App, topics: Option<&str>, satellites: Option<&str>) -> Result<Self, Failure> {
        let mut wanted = Self { topics: [false; Topic::ALL.len()], satellites: Vec::new() };
        for word in topics.unwrap_or("events,status").split(',').filter(|word| !word.is_empty()) {
            let topic = word.parse::<Topic>();
            let topic = topic
                .map_err(|error| Failure::field(ProblemKind::BadParameter, "topics", error.to_string()))?;
            wanted.set(topic, true);
        }
        if let Some(names) = satellites {
            let names: Vec<String> = names.split(',').map(str::to_owned).collect();
            wanted.satellites = known(app, names)?;
        }
        Ok(wanted)
    }

    /// As a request of the client says.
    ///
    /// # Errors
    /// Why not, in words for the client.
    pub(super) fn change(&mut self, app: &App, request: StreamRequest) -> Result<(), String> {
        let (topics, on) = match request {
            StreamRequest::Subscribe { topics, satellites } => {
                if let Some(names) = satellites {
                    self.satellites = known(app, names).map_err(|failure| failure.0.detail)?;
                }
                (topics, true)
            }
            StreamRequest::Unsubscribe { topics } => (topics, false),
        };
        for topic in topics {
            self.set(topic, on);
        }
        Ok(())
    }

    pub(super) fn has(&self, topic: Topic) -> bool {
        self.topics().any(|one| one == topic)
    }

    pub(super) fn topics(&self) -> impl Iterator<Item = Topic> {
        Topic::ALL.into_iter().zip(self.topics).filter(|(_, on)| *on).map(|(topic, _)| topic)
    }

    fn set(&mut self, topic: Topic, on: bool) {
        for (known, state) in Topic::ALL.into_iter().zip(&mut self.topics) {
            if known == topic {
                *state = on;
            }
        }
    }
}

/// The names, when there are such satellites.
fn known(app: &App, names: Vec<String>) -> Result<Vec<String>, Failure> {
    if names.len() > SATELLITES_MAX {
        let message = format!("{SATELLITES_MAX} satellites at most");
        return Err(Failure::field(ProblemKind::BadParameter, "satellite", message));
    }
    for name in &names {
        extract::satellite(app, Some(name))?;
    }
    Ok(names)
}
