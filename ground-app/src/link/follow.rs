//! Follows the server: the stream into the model, and, beside it, what the stream cannot tell by asking.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use api::Topic;
use api::client::{Client, Filter, StreamItem, StreamOptions};
use tokio::sync::Notify;

use super::Wake;
use crate::clock;
use crate::model::{Model, Resource};

/// A resource is not asked for more often.
const PAUSE: Duration = Duration::from_millis(500);
/// Nor seldomer.
const PERIOD: Duration = Duration::from_secs(60);
/// Entries of a list.
const PAGE: u32 = 500;

pub(super) struct Follower {
    client: Client,
    model: Arc<Mutex<Model>>,
    wake: Wake,
    /// When each resource is to be asked for next.
    due: Mutex<[Instant; Resource::ALL.len()]>,
    sooner: Notify,
}

impl Follower {
    pub(super) fn new(client: Client, model: Arc<Mutex<Model>>, wake: Wake) -> Self {
        let due = Mutex::new([clock::instant() + PERIOD; Resource::ALL.len()]);
        Self { client, model, wake, due, sooner: Notify::new() }
    }

    /// Never ends by itself.
    pub(super) async fn run(self) {
        tokio::select! {
            () = self.follow() => {}
            () = self.refresh() => {}
        }
    }

    async fn follow(&self) {
        let options = StreamOptions { topics: Topic::ALL.to_vec(), ..StreamOptions::default() };
        let mut stream = self.client.stream(options);
        loop {
            self.take(stream.next().await);
        }
    }

    fn take(&self, item: StreamItem) {
        let now = clock::instant();
        let connected = matches!(item, StreamItem::Connected { .. } | StreamItem::Gap { .. });
        let stale = self.with(|model| model.apply(item, now, clock::unix_us()));
        if !stale.is_empty() {
            let at = if connected { now } else { now + PAUSE };
            let mut due = self.due.lock().unwrap_or_else(PoisonError::into_inner);
            for resource in stale {
                due[resource as usize] = due[resource as usize].min(at);
            }
            drop(due);
            self.sooner.notify_one();
        }
        (self.wake)();
    }

    /// Asks for one resource after the other as they fall due. The stream goes on meanwhile.
    async fn refresh(&self) {
        loop {
            let (resource, at) = self.first_due();
            tokio::select! {
                () = self.sooner.notified() => continue,
                () = clock::sleep_until(at) => {}
            }
            self.due.lock().unwrap_or_else(PoisonError::into_inner)[resource as usize] =
                clock::instant() + PERIOD;
            self.fetch(resource).await;
            (self.wake)();
        }
    }

    fn first_due(&self) -> (Resource, Instant) {
        let due = *self.due.lock().unwrap_or_else(PoisonError::into_inner);
        let all = Resource::ALL.into_iter().map(|resource| (resource, due[resource as usize]));
        all.min_by_key(|(_, at)| *at).unwrap_or((Resource::Version, clock::instant() + PERIOD))
    }

    fn with<T>(&self, change: impl FnOnce(&mut Model) -> T) -> T {
        change(&mut self.model.lock().unwrap_or_else(PoisonError::into_inner))
    }

    async fn fetch(&self, resource: Resource) {
        let (client, newest) = (&self.client, Filter::new().limit(PAGE));
        macro_rules! fetch {
            ($field:ident, $question:expr) => {{
                let answer = $question.await;
                self.with(|model| model.$field.settle(answer, clock::instant()));
            }};
        }
        match resource {
            Resource::Version => fetch!(version, client.version()),
            Resource::Session => fetch!(session, client.session()),
            Resource::Passes => fetch!(passes, client.passes(&Filter::new())),
            Resource::Schedule => fetch!(schedule, client.schedule()),
            Resource::Plans => fetch!(plans, client.plans()),
            Resource::Runs => fetch!(runs, client.runs(&newest)),
            Resource::Rehearsals => fetch!(rehearsals, client.rehearsals(&Filter::new())),
            Resource::Alerts => fetch!(alerts, client.alerts(&newest)),
            Resource::Approvals => fetch!(approvals, client.approvals(&newest.with("open", true))),
            Resource::Limits => fetch!(limits, client.limits()),
            Resource::Latest => fetch!(latest, client.latest(&Filter::new())),
            Resource::Parameters => fetch!(parameters, client.parameters()),
            Resource::Commands => fetch!(commands, client.commands(&newest)),
            Resource::Downloads => fetch!(downloads, client.downloads(&newest)),
            Resource::Images => fetch!(images, client.images(&newest)),
            Resource::Frames => fetch!(frames, client.frames(&Filter::new().limit(200))),
            Resource::Events => fetch!(events, client.events(&newest)),
            Resource::Elements => fetch!(elements, client.elements(&Filter::new().limit(100))),
            Resource::Receivers => fetch!(receivers, client.receivers(&Filter::new())),
        }
    }
}
