//! The HTTP API of TinyGS and the database of SatNOGS, asked from time to time.
//!
//! Politely: a budget of requests in any hour that restarts keep to, seldom far from passes, a pause that doubles when
//! something is wrong, as long a one as the other side asks for, and no request at all after a refusal. Every look overlaps
//! the one before, and what is known is left out: an old list, a repeated page or a crash in between lose nothing.
//!
//! | file | idea |
//! |---|---|
//! | `ask` | one bounded request |
//! | `memory` | what is remembered across restarts |
//! | `rhythm` | when to ask: pure functions of what is remembered |
//! | `near` | whether the satellite is over somebody who hears it |
//! | `tinygs`, `satnogs` | what to ask for |

mod ask;
mod memory;
mod near;
mod rhythm;
mod satnogs;
mod tinygs;

use std::sync::Arc;

use mission::reception::Ear;
use mission::{SatelliteId, UtcUs};
use reqwest::Url;
use reqwest::header::{AUTHORIZATION, HeaderMap, HeaderName, HeaderValue};
use sha2::{Digest as _, Sha256};
use tokio_util::sync::CancellationToken;

use super::secret;
use super::status::Way;
use crate::clock::{BusyToken, Timer};
use crate::config::{Config, EarKind, EarSection};
use crate::ingest::formats::{self, Context, Read};
use crate::ingest::{Aliases, Ears, Outcome};
use crate::run::RunError;
use crate::storage::Store;

use ask::Answer;
use memory::{Memory, State};
use near::Near;
use rhythm::Rhythm;

/// Who refused is asked again after so long, or when token or address have changed: microseconds.
const FORGIVEN_US: i64 = 24 * 3_600_000_000;
/// Whether they have changed is looked at this often.
const LOOK_US: i64 = 600_000_000;
/// Tries while storage does not keep up, a second apart.
const TRIES: u32 = 30;

/// What a poller needs.
pub(super) struct PollerParts<'a> {
    pub(super) section: EarSection,
    pub(super) satellite: SatelliteId,
    pub(super) config: &'a Config,
    pub(super) ears: Ears,
    pub(super) aliases: Aliases,
    pub(super) store: Store,
    pub(super) timer: Arc<dyn Timer>,
    pub(super) way: Arc<Way>,
}

/// Asks one source.
pub(super) struct Poller {
    section: EarSection,
    satellite: SatelliteId,
    base: Url,
    /// What is asked for: names at TinyGS, a number at SatNOGS.
    names: Vec<String>,
    ears: Ears,
    aliases: Aliases,
    timer: Arc<dyn Timer>,
    way: Arc<Way>,
    memory: Memory,
    rhythm: Rhythm,
    near: Near,
    state: State,
    /// Holds a stepped clock while something is under way.
    awake: BusyToken,
}

/// Why a look ended before its end.
enum Broken {
    /// The budget of this hour is used up; the rest comes later.
    NoBudget,
    /// Something is wrong; after a pause it may not be.
    Failed(String),
    /// The source wants a pause, of so many seconds if it said so.
    Busy(Option<u64>, String),
    /// The source does not want us.
    Refused(String),
}

impl Poller {
    /// A poller of a configuration that was checked.
    ///
    /// # Errors
    /// [`RunError`] when its memory cannot be made: without memory nobody is asked.
    pub(super) fn new(parts: PollerParts<'_>) -> Result<Self, RunError> {
        let PollerParts { section, satellite, config, ears, aliases, store, timer, way } = parts;
        let wrong = |words: String| RunError::Ear { name: section.name.clone(), words };
        let base = Url::parse(section.url()).map_err(|error| wrong(error.to_string()))?;
        let memory = Memory::open(store.folder(), &section.name).map_err(|error| {
            wrong(format!("the folder 'ears' in the data folder cannot be made: {error}"))
        })?;
        let state = memory.read(timer.now().utc);
        let known = config.satellites.iter().find(|known| known.name == satellite.as_str());
        let names = match (section.kind, known) {
            (EarKind::SatnogsDb, known) => {
                let number = section.norad.or_else(|| known?.norad_cat_id);
                number.iter().map(u32::to_string).collect()
            }
            _ if !section.names.is_empty() => section.names.clone(),
            (_, Some(known)) if !known.aliases.is_empty() => {
                // A number is no name there.
                let is_name = |alias: &&String| !alias.bytes().all(|byte| byte.is_ascii_digit());
                known.aliases.iter().filter(is_name).cloned().collect()
            }
            _ => vec![satellite.to_string()],
        };
        let awake = timer.busy("ear");
        let rhythm = Rhythm::of(&section);
        let near = Near::new(store, satellite.clone(), config.station.site().ok().flatten());
        Ok(Self {
            section,
            satellite,
            base,
            names,
            ears,
            aliases,
            timer,
            way,
            memory,
            rhythm,
            near,
            state,
            awake,
        })
    }

    fn now(&self) -> UtcUs {
        self.timer.now().utc
    }

    /// Asks until `stop`; a request under way is broken off then.
    pub(super) async fn run(self, stop: CancellationToken) {
        let stopped = stop.clone();
        tokio::select! {
            () = self.work() => {}
            () = stopped.cancelled() => {}
        }
    }

    async fn work(mut self) {
        loop {
            let until = self.turn().await;
            let wait_us = until.0.saturating_sub(self.now().0).clamp(1_000_000, 1_800_000_000);
            self.wait(wait_us.unsigned_abs()).await;
        }
    }

    /// Lets so many microseconds go by.
    async fn wait(&mut self, us: u64) {
        let sleep = self.timer.sleep_until(self.timer.now().mono.plus(us));
        self.awake = BusyToken::idle();
        self.awake = sleep.await;
    }

    /// Does what is due; gives when to look again.
    async fn turn(&mut self) -> UtcUs {
        let now = self.now();
        if let Some((at_us, fingerprint)) = &self.state.refused {
            let is_same = *fingerprint == self.fingerprint().await;
            if is_same && now.0 - at_us < FORGIVEN_US {
                let words = self.state.detail.clone().unwrap_or_default();
                self.way.refuses(&words);
                return now.plus(LOOK_US);
            }
            self.state.refused = None;
        }
        let over = self.near.look(now).await;
        let due = self.rhythm.next(&self.state, over, now);
        if due > now {
            let detail = self.detail_due(now);
            self.way.waits_until(Some(due));
            if detail.is_some_and(|at| at <= now) {
                let done = self.one_detail().await;
                self.judge(done).await;
                return self.now();
            }
            // Passes begin in between: looked at again in a few minutes.
            return due.min(now.plus(self.rhythm.near_us)).min(detail.unwrap_or(due));
        }
        let done = match self.section.kind {
            EarKind::SatnogsDb => self.look_at_satnogs().await,
            _ => self.look_at_tinygs().await,
        };
        if done.is_ok() || matches!(done, Err(Broken::NoBudget)) {
            self.state.looked_at_us = Some(self.now().0);
        }
        self.judge(done).await;
        self.now()
    }

    /// Goes on after a look that ended well, or not.
    async fn judge(&mut self, done: Result<(), Broken>) {
        let now = self.now();
        match done {
            Ok(()) => (self.state.failures, self.state.wait_until_us, self.state.detail) = (0, None, None),
            Err(Broken::NoBudget) => {
                let per_hour = self.rhythm.per_hour;
                self.way.notes(Some(format!(
                    "the budget of {per_hour} requests an hour is used up; the rest comes later"
                )));
            }
            Err(Broken::Failed(why)) => self.pause(now, None, why),
            Err(Broken::Busy(after_s, why)) => self.pause(now, after_s, why),
            Err(Broken::Refused(why)) => {
                self.way.refuses(&why);
                self.state.refused = Some((now.0, self.fingerprint().await));
                self.state.detail = Some(why);
            }
        }
        self.keep();
    }

    fn pause(&mut self, now: UtcUs, after_s: Option<u64>, why: String) {
        self.state.failures = self.state.failures.saturating_add(1);
        self.state.wait_until_us = Some(self.rhythm.after_failure(&self.state, after_s, now).0);
        self.way.fails(&why);
        self.state.detail = Some(why);
    }

    fn keep(&self) {
        if let Err(error) = self.memory.write(&self.state) {
            tracing::warn!(ear = %self.section.name, %error, "ear {}: what is known of it cannot be written down: {error}", self.section.name);
        }
    }

    /// Token, headers and address, by which a refusal holds.
    async fn fingerprint(&self) -> String {
        let mut hasher = Sha256::new();
        hasher.update(self.section.url());
        for (name, value) in &self.section.headers {
            hasher.update(format!("{name}: {value}\n"));
        }
        if let Some(file) = &self.section.token_file
            && let Ok(token) = secret::load(file).await
        {
            hasher.update(token.as_bytes());
        }
        hex::encode(&hasher.finalize()[..8])
    }

    async fn headers(&self) -> Result<HeaderMap, Broken> {
        let mut headers = HeaderMap::new();
        let bad = |_| Broken::Failed("a header cannot be sent".into());
        for (name, value) in &self.section.headers {
            let name = HeaderName::try_from(name.as_str())
                .map_err(|_| Broken::Failed("a header cannot be sent".into()))?;
            headers.insert(name, HeaderValue::try_from(value.as_str()).map_err(bad)?);
        }
        if let Some(file) = &self.section.token_file {
            let token = secret::load(file).await.map_err(Broken::Failed)?;
            let word = if self.section.kind == EarKind::SatnogsDb { "Token" } else { "Bearer" };
            let text = zeroize::Zeroizing::new(format!("{word} {}", token.as_str()));
            let unfit = |_| Broken::Failed("the token holds what no header may".into());
            let mut value = HeaderValue::try_from(text.as_str()).map_err(unfit)?;
            value.set_sensitive(true);
            headers.insert(AUTHORIZATION, value);
        }
        Ok(headers)
    }

    /// One request within the budget; written down before it goes out. `None`: there is no such thing (404).
    async fn ask(&mut self, url: &Url, spare: u32) -> Result<Option<ask::Body>, Broken> {
        let now = self.now();
        if !self.rhythm.may_ask(&mut self.state, spare, now) {
            return Err(Broken::NoBudget);
        }
        self.state.asked_at_us.push(now.0);
        self.memory
            .write(&self.state)
            .map_err(|error| Broken::Failed(format!("not asked: it cannot be written down ({error})")))?;
        let headers = self.headers().await?;
        self.way.count("requests");
        let silence = match self.section.kind {
            EarKind::SatnogsDb => {
                "its database is slow at times: it is asked again, and files can be imported meanwhile"
            }
            _ => "TinyGS lets requests hang that it does not want: ask them for a token, or import files",
        };
        match ask::ask(url, headers, silence).await {
            Answer::Body(body) => Ok(Some(body)),
            Answer::NotFound => Ok(None),
            Answer::Failed(why) => {
                self.way.count("requests-failed");
                Err(Broken::Failed(why))
            }
            Answer::Busy(after_s, why) => {
                self.way.count("requests-put-off");
                Err(Broken::Busy(after_s, why))
            }
            Answer::Refused(why) => Err(Broken::Refused(why)),
        }
    }

    /// What an answer holds, into the archive. Gives the receptions' ids that are frames of ours, too.
    async fn take(&self, ear: Ear, body: &[u8]) -> Result<(Outcome, Vec<String>), Broken> {
        let admission = self.aliases.admission(&self.satellite, self.now());
        let found: Vec<Read> = formats::message(body, &Context::file(admission));
        let mut ids = Vec::new();
        for read in &found {
            match read {
                Ok(reception) => {
                    self.way.count("receptions");
                    if reception.frame().is_some() {
                        ids.push(reception.source_id.clone());
                    }
                }
                Err(refused) => self.way.count(refused.reason.name()),
            }
        }
        let taken = self.ears.take_patiently(&self.satellite, ear, found, TRIES).await;
        let outcome = taken.map_err(|error| Broken::Failed(format!("what came is not stored: {error}")))?;
        self.way.brought(outcome.frames + outcome.merged + outcome.without_frame > 0);
        Ok((outcome, ids))
    }
}
