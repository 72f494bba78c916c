//! What the server published, as somebody remembers it who saw it: later it must all still be there.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use api::{EventView, FrameView, Page, StreamMessage};

use crate::Client;
use crate::stream::{Follower, Look};
use crate::wait::pause;

/// Everything that was told by the stream and the API.
#[derive(Debug, Default)]
pub struct Published {
    /// Events by their place in the sequence.
    pub events: BTreeMap<i64, EventView>,
    /// Frames by id, in hex.
    pub frames: BTreeMap<u64, String>,
    /// What contradicts what was told before.
    pub contradictions: Vec<String>,
}

impl Published {
    fn event(&mut self, event: EventView) {
        let place = event.sequence;
        if let Some(before) = self.events.get(&place)
            && *before != event
        {
            self.contradictions.push(format!("event {place} was {before:?}, now it is {event:?}"));
        }
        self.events.insert(place, event);
    }

    fn frame(&mut self, frame: FrameView) {
        if let Some(before) = self.frames.insert(frame.id, frame.hex.clone())
            && before != frame.hex
        {
            self.contradictions.push(format!("frame {} was {before}, now it is {}", frame.id, frame.hex));
        }
    }
}

/// Follows a server through all its lives.
#[derive(Debug, Clone, Default)]
pub struct Watcher {
    published: Arc<Mutex<Published>>,
    /// Events that tell of a command's stage, counted as they come.
    pub stages: Arc<AtomicU64>,
    /// Set to end it.
    pub done: Arc<AtomicBool>,
}

impl Watcher {
    /// What was told so far.
    ///
    /// # Panics
    /// Never.
    pub fn published<T>(&self, look: impl FnOnce(&Published) -> T) -> T {
        look(&self.published.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn change(&self, change: impl FnOnce(&mut Published)) {
        change(&mut self.published.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Follows until [`Watcher::done`] is set: each event by the stream, resumed after the last one; the bytes of each
    /// frame by the API. `client` gives the server's address; a server that is down is asked again.
    pub fn follow(&self, client: &Client) {
        while !self.done.load(Ordering::Relaxed) {
            let last = self.published(|p| p.events.keys().next_back().copied().unwrap_or(0));
            match Follower::open(client, last) {
                Ok(stream) => self.listen(stream, client),
                Err(_) => pause(Duration::from_millis(5)),
            }
        }
    }

    fn listen(&self, mut stream: Follower, client: &Client) {
        while !self.done.load(Ordering::Relaxed) {
            match stream.look() {
                Look::Message(message) => self.take(*message, client),
                Look::Nothing => {}
                Look::Over => return,
            }
        }
    }

    fn take(&self, message: StreamMessage, client: &Client) {
        match message {
            StreamMessage::Hello { last_sequence, reset, .. } => self.change(|p| {
                let known = p.events.keys().next_back().copied().unwrap_or(0);
                if reset || last_sequence < known {
                    p.contradictions
                        .push(format!("event {known} was told; after a restart the last is {last_sequence}"));
                }
            }),
            StreamMessage::Event(event) => {
                if event.kind == "command-stage" {
                    self.stages.fetch_add(1, Ordering::Relaxed);
                }
                self.change(|p| p.event(event));
            }
            StreamMessage::Status(_) | StreamMessage::Live { .. } => self.frames(client),
            // Topics that it did not ask for.
            _ => {}
        }
    }

    fn frames(&self, client: &Client) {
        let last = self.published(|p| p.frames.keys().next_back().copied().unwrap_or(0));
        let Ok(answer) = client.get(&format!("/api/v1/frames?after={last}&limit=1000")) else { return };
        if answer.status == 200 {
            let page: Page<FrameView> = answer.json();
            self.change(|p| page.items.into_iter().for_each(|frame| p.frame(frame)));
        }
    }
}
