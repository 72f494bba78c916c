//! An operator who never loses track: each intent has its key, and is asked for again under it until it is answered.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use api::{DownloadView, Outcome, Page};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::Client;
use crate::wait::pause;

/// What was acknowledged: idempotency key, path, body, answer.
#[derive(Debug, Clone)]
pub struct Acknowledged {
    /// Where it was sent.
    pub path: &'static str,
    /// What was sent.
    pub body: String,
    /// What the server said.
    pub outcome: Outcome,
}

/// Commands now and then, and an image whenever the last one is home.
#[derive(Debug)]
pub struct Operator {
    client: Client,
    random: ChaCha8Rng,
    number: u64,
    /// Everything that was acknowledged, by its key.
    pub acknowledged: BTreeMap<String, Acknowledged>,
    /// Requests that nobody answered, and that were sent again.
    pub repeated: u64,
}

impl Operator {
    /// An operator with a seed.
    #[must_use]
    pub fn new(client: Client, seed: u64) -> Self {
        let random = ChaCha8Rng::seed_from_u64(seed);
        Self { client, random, number: 0, acknowledged: BTreeMap::new(), repeated: 0 }
    }

    /// Works until `done`, whatever becomes of the server meanwhile.
    #[must_use]
    pub fn work(mut self, done: &AtomicBool) -> Self {
        while !done.load(Ordering::Relaxed) {
            match self.newest_download() {
                Some(None) => self.intend("/api/v1/downloads", "{}", done),
                Some(Some(download)) if download.state != "active" => {
                    let picture = r#"{"command":"CaptureImage","arguments":{"resolution":"CIF","grey":true,"strong_compression":true}}"#;
                    self.intend("/api/v1/commands", picture, done);
                    self.intend("/api/v1/downloads", "{}", done);
                }
                _ => {}
            }
            let command = ["Ping", "GetAdcsInfo", "SetAdcsAuto"][self.random.random_range(0..3)];
            self.intend("/api/v1/commands", &format!("{{\"command\":\"{command}\"}}"), done);
            pause(Duration::from_millis(self.random.random_range(400..1_600)));
        }
        self
    }

    /// The newest download; outer `None` when nobody answers.
    fn newest_download(&self) -> Option<Option<DownloadView>> {
        let answer =
            self.client.get("/api/v1/downloads?limit=1").ok().filter(|answer| answer.status == 200)?;
        let page: Page<DownloadView> = answer.json();
        Some(page.items.into_iter().next())
    }

    fn intend(&mut self, path: &'static str, body: &str, done: &AtomicBool) {
        self.number += 1;
        let key = format!("intent-{}", self.number);
        loop {
            match self.client.post(path, &key, body) {
                Ok(answer) if answer.status == 200 || answer.status == 201 => {
                    let said = Acknowledged { path, body: body.to_owned(), outcome: answer.json() };
                    self.acknowledged.insert(key, said);
                    return;
                }
                // Too early, or too much: later.
                Ok(answer) if matches!(answer.status, 429 | 503) => {}
                Ok(answer) => panic!("{path} {body}: {} {}", answer.status, answer.text()),
                Err(_) => self.repeated += 1,
            }
            if done.load(Ordering::Relaxed) {
                return;
            }
            pause(Duration::from_millis(10));
        }
    }
}
