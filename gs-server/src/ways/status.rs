//! How each way stands: what the API, the page and the metrics show, and when the alerts are told.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use api::{BoardView, Time, WayState, WayView};
use mission::alert::{AlertKind, Condition};
use mission::{Level, SatelliteId, UtcUs};

use super::Tell;
use super::boards::Boards;
use crate::clock::Timer;
use crate::config::EarSection;

/// Characters of an error that are kept.
const WORDS_MAX: usize = 300;

/// One way and how it stands.
pub(crate) struct Way {
    pub(super) name: String,
    kind: &'static str,
    satellite: SatelliteId,
    address: String,
    pub(super) timer: Arc<dyn Timer>,
    tell: Tell,
    now: Mutex<Now>,
}

struct Now {
    state: WayState,
    since: UtcUs,
    last_ok_at: Option<UtcUs>,
    last_new_at: Option<UtcUs>,
    next_at: Option<UtcUs>,
    error: Option<(UtcUs, String)>,
    note: Option<String>,
    connected: Option<u64>,
    counts: BTreeMap<&'static str, u64>,
}

impl Way {
    pub(super) fn new(
        section: &EarSection,
        satellite: &SatelliteId,
        timer: Arc<dyn Timer>,
        tell: Tell,
    ) -> Self {
        let now = Now {
            state: WayState::Starting,
            since: timer.now().utc,
            last_ok_at: None,
            last_new_at: None,
            next_at: None,
            error: None,
            note: None,
            connected: None,
            counts: BTreeMap::new(),
        };
        Self {
            name: section.name.clone(),
            kind: section.kind.name(),
            satellite: satellite.clone(),
            address: section.shown(),
            timer,
            tell,
            now: Mutex::new(now),
        }
    }

    fn change<T>(&self, change: impl FnOnce(&mut Now, UtcUs) -> T) -> T {
        let at = self.timer.now().utc;
        change(&mut self.now.lock().unwrap_or_else(PoisonError::into_inner), at)
    }

    fn be(&self, state: WayState) -> bool {
        self.change(|now, at| {
            let differs = now.state != state;
            if differs {
                (now.state, now.since) = (state, at);
            }
            differs
        })
    }

    /// It answered, or a message came.
    pub(super) fn works(&self) {
        self.change(|now, at| now.last_ok_at = Some(at));
        if self.be(WayState::Working) {
            tracing::info!(ear = %self.name, "ear {}: {} works", self.name, self.address);
            (self.tell)(&self.reporter(), None);
        }
    }

    /// It answered, and what it says is old.
    pub(super) fn is_stale(&self, note: String) {
        self.change(|now, at| {
            now.last_ok_at = Some(at);
            now.note = Some(note.clone());
        });
        if self.be(WayState::Stale) {
            tracing::warn!(ear = %self.name, "ear {}: {note}", self.name);
        }
    }

    /// It does not answer as it should, and is tried again.
    pub(super) fn fails(&self, why: &str) {
        let why: String = why.chars().take(WORDS_MAX).collect();
        self.change(|now, at| now.error = Some((at, why.clone())));
        if self.be(WayState::Failing) {
            tracing::warn!(ear = %self.name, "ear {}: {why}; it is tried again", self.name);
        }
    }

    /// It refused us: nobody asks again until somebody has looked.
    pub(super) fn refuses(&self, why: &str) {
        let why: String = why.chars().take(WORDS_MAX).collect();
        self.change(|now, at| {
            now.error = Some((at, why.clone()));
            now.next_at = None;
        });
        if self.be(WayState::Refused) {
            tracing::error!(ear = %self.name, "ear {}: {why}", self.name);
        }
        let message = format!("Ear {} is not asked any more: {why}", self.name);
        let condition = Condition::new(AlertKind::Ear, &self.name, Level::Warning, message);
        (self.tell)(&self.reporter(), Some(condition));
    }

    fn reporter(&self) -> String {
        format!("ear {}", self.name)
    }

    /// Something new came.
    pub(super) fn brought(&self, something_new: bool) {
        if something_new {
            self.change(|now, at| now.last_new_at = Some(at));
        }
    }

    /// When it is asked next.
    pub(super) fn waits_until(&self, next: Option<UtcUs>) {
        self.change(|now, _| now.next_at = next);
    }

    /// Worth knowing; `None`: nothing.
    pub(super) fn notes(&self, note: Option<String>) {
        self.change(|now, _| now.note = note);
    }

    /// So many boards are connected.
    pub(super) fn connected(&self, count: usize) {
        self.change(|now, _| now.connected = Some(count as u64));
    }

    /// Counts something.
    pub(super) fn count(&self, what: &'static str) {
        self.change(|now, _| *now.counts.entry(what).or_default() += 1);
    }

    pub(super) fn view(&self) -> WayView {
        let time = |at: UtcUs| Time::from_unix_us(at.0);
        self.change(|now, at| WayView {
            name: self.name.clone(),
            kind: self.kind.to_owned(),
            satellite: self.satellite.to_string(),
            address: self.address.clone(),
            state: now.state,
            since: time(now.since),
            last_ok_at: now.last_ok_at.map(time),
            age_s: now.last_ok_at.map(|ok| (at.0 - ok.0).max(0) as f64 / 1e6),
            last_new_at: now.last_new_at.map(time),
            next_at: now.next_at.map(time),
            error: now.error.as_ref().map(|(_, words)| words.clone()),
            error_at: now.error.as_ref().map(|(at, _)| time(*at)),
            note: now.note.clone(),
            connected: now.connected,
            counts: now.counts.iter().map(|(what, count)| ((*what).to_owned(), *count)).collect(),
        })
    }
}

/// All ways, for whoever looks. Cheap to clone.
#[derive(Clone)]
pub struct WaysHandle {
    ways: Arc<[Arc<Way>]>,
    boards: Boards,
    timer: Arc<dyn Timer>,
}

impl WaysHandle {
    pub(super) fn new(ways: Vec<Arc<Way>>, boards: Boards, timer: Arc<dyn Timer>) -> Self {
        Self { ways: ways.into(), boards, timer }
    }

    /// For a server without any.
    pub fn none(timer: Arc<dyn Timer>) -> Self {
        Self::new(Vec::new(), Boards::default(), timer)
    }

    /// How each stands.
    pub fn views(&self) -> Vec<WayView> {
        self.ways.iter().map(|way| way.view()).collect()
    }

    /// What boards of one's own say of themselves, by `user/station`.
    pub fn boards(&self) -> Vec<(String, BoardPlace, BoardView)> {
        self.boards.views(self.timer.now().utc)
    }
}

/// Where a board says that it stands, and what it is called.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BoardPlace {
    /// What its owner calls it.
    pub station: String,
    /// Latitude and longitude, degrees.
    pub place: Option<(f64, f64)>,
}
