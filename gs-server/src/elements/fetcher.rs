//! A round of sources: who may be asked is asked once, what it gave is kept on the disk, then taken up.

use std::path::Path;
use std::sync::Arc;

use api::{ElementsAdded, ElementsSource, FetchReport, FetchWord, SourceFetched, SourceWord, Time};
use mission::UtcUs;
use tle::formats::{Checksums, SourceError};

use super::client::{self, Answer};
use super::door::{Adder, Door, report};
use super::memory::{Memory, State};
use super::policy::Rules;
use super::sets::{SetsOfText, Wanted, sets_of};
use crate::clock::{BusyToken, Timer};
use crate::config::{Config, FetchSource};

/// Fewer than 30 requests a minute where one logs in: two requests for each source, and this pause between sources.
const LOGIN_PAUSE_US: u64 = 10_000_000;
/// Who adds what was fetched.
const PRINCIPAL: &str = "fetch";

/// Who wants it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asker {
    /// The server by itself: sources that are due.
    Machine,
    /// An operator: every source that is not too young, and those that refused.
    Operator,
}

/// Asks sources, and keeps what they say.
pub struct Fetcher {
    memory: Memory,
    rules: Rules,
    sources: Vec<FetchSource>,
    wanted: Vec<Wanted>,
    door: Door,
    timer: Arc<dyn Timer>,
}

impl Fetcher {
    /// A fetcher for the sources of a configuration that was checked.
    ///
    /// # Errors
    /// When the folder of its memory cannot be made: without memory nobody is asked.
    pub fn new(config: &Config, data: &Path, door: Door, timer: Arc<dyn Timer>) -> std::io::Result<Self> {
        Ok(Self {
            memory: Memory::open(data)?,
            rules: Rules::of(&config.elements),
            sources: config.elements.fetch.clone(),
            wanted: Wanted::of(config),
            door,
            timer,
        })
    }

    fn now(&self) -> UtcUs {
        self.timer.now().utc
    }

    /// How it stands with each source.
    pub fn sources(&self) -> Vec<ElementsSource> {
        view(&self.memory, self.rules, &self.sources, self.now())
    }

    /// When the first of them is due; `None` when all wait for an operator.
    pub fn next_due(&self) -> Option<UtcUs> {
        let now = self.now();
        let next = |source: &FetchSource| {
            self.rules.next(&self.memory.state(&source.url, now), source.credentials_file.is_some())
        };
        self.sources.iter().filter_map(next).min()
    }

    /// Takes up what lies on the disk: a kill may have come between a download and its elements, or a satellite may have
    /// got its number since.
    pub async fn take_up(&self) {
        for source in &self.sources {
            let (memory, url) = (self.memory.clone(), source.url.clone());
            let read = off_the_loop(move || {
                let body = memory.body(&url).map_err(|error| error.to_string())?;
                body.map(|body| SetsOfText::read(&body, Checksums::Strict).map_err(|error| error.to_string()))
                    .transpose()
            });
            match read.await {
                Ok(Ok(Some(text))) => match self.add(source, &text).await {
                    Ok((added, _)) => {
                        for added in added.iter().filter(|added| added.added > 0) {
                            tracing::info!(
                                satellite = %added.satellite,
                                sets = added.added,
                                "{} sets of elements for {} from the last download of {} were taken up",
                                added.added, added.satellite, source.url
                            );
                        }
                    }
                    Err(why) => {
                        tracing::warn!("the last download of {} cannot be taken up: {why}", source.url)
                    }
                },
                Ok(Ok(None)) => {}
                Ok(Err(why)) | Err(why) => {
                    tracing::warn!("the last download of {} cannot be read: {why}", source.url);
                }
            }
        }
    }

    /// Asks each source that may be asked; one after the other.
    pub async fn round(&self, asker: Asker, awake: &mut BusyToken) -> FetchReport {
        let mut sources = Vec::new();
        let mut logged_in = false;
        for source in &self.sources {
            let logs_in = source.credentials_file.is_some();
            if let Some(waits) = self.too_early(source, asker) {
                // What is not due is nothing to tell, except to who asked.
                if asker == Asker::Operator {
                    sources.push(waits);
                }
                continue;
            }
            if logs_in && logged_in {
                let sleep = self.timer.sleep_until(self.timer.now().mono.plus(LOGIN_PAUSE_US));
                *awake = BusyToken::idle();
                *awake = sleep.await;
            }
            logged_in |= logs_in;
            let fetched = self.fetch(source).await;
            tell(&fetched);
            sources.push(fetched);
        }
        FetchReport { sources }
    }

    /// Why this source is not asked now, if it is not.
    fn too_early(&self, source: &FetchSource, asker: Asker) -> Option<SourceFetched> {
        let now = self.now();
        let state = self.memory.state(&source.url, now);
        let until = match asker {
            Asker::Operator => self.rules.operator_may(&state, now).err()?,
            Asker::Machine => match self.rules.next(&state, source.credentials_file.is_some()) {
                Some(at) if at <= now => return None,
                Some(at) => at,
                None => now,
            },
        };
        let ago = state.asked_at_us.map_or(0, |asked| now.0.saturating_sub(asked) / 60_000_000);
        Some(SourceFetched {
            url: source.url.clone(),
            outcome: FetchWord::TooEarly,
            detail: format!(
                "asked {ago} min ago: sources block who asks more often; it may be asked again at {}",
                Time::from_unix_us(until.0)
            ),
            added: Vec::new(),
            unmatched: Vec::new(),
        })
    }

    async fn fetch(&self, source: &FetchSource) -> SourceFetched {
        let before = self.memory.state(&source.url, self.now());
        let fetched = |outcome, detail: String| SourceFetched {
            url: source.url.clone(),
            outcome,
            detail,
            added: Vec::new(),
            unmatched: Vec::new(),
        };
        let url = match source.parsed() {
            Ok(url) => url,
            Err((problem, remedy)) => return fetched(FetchWord::Failed, format!("{problem}. {remedy}")),
        };
        let asked_at = self.now().0;
        let mut state = State { asked_at_us: Some(asked_at), ..before.clone() };
        // First written down, then asked: whoever kills us in between has had the request counted.
        if let Err(why) = self.keep(&state).await {
            let detail = format!("not asked: what is known of it cannot be written down ({why})");
            return fetched(FetchWord::Failed, detail);
        }
        let answer = client::ask(source, &url, client::PATIENCE).await;
        let mut word = match &answer {
            Answer::Body(_) => FetchWord::Downloaded,
            Answer::NotUpdated(_) => FetchWord::NotUpdated,
            Answer::Refused(_) => FetchWord::Stopped,
            Answer::Unreached(_) | Answer::Lost(_) => FetchWord::Failed,
        };
        if matches!(answer, Answer::Unreached(_)) {
            state.asked_at_us = before.asked_at_us;
        }
        let mut text = None;
        let mut detail = match answer {
            Answer::Unreached(why) | Answer::Lost(why) | Answer::Refused(why) => why,
            Answer::NotUpdated(said) => nothing_newer(&said),
            Answer::Body(body) => match self.take(&source.url, body).await {
                Ok(read) => {
                    let (sets, refused) = (read.sets.len(), read.refused.len());
                    let broken =
                        if refused > 0 { format!(", {refused} broken ones left out") } else { String::new() };
                    let detail = format!("{sets} sets ({}){broken}", read.form.name());
                    text = Some(read);
                    detail
                }
                Err((failed, why)) => {
                    word = failed;
                    why
                }
            },
        };
        match word {
            FetchWord::Downloaded => {
                state.downloaded_at_us = Some(asked_at);
                (state.failed_at_us, state.failures, state.stopped) = (None, 0, false);
            }
            FetchWord::NotUpdated => (state.failed_at_us, state.failures, state.stopped) = (None, 0, false),
            FetchWord::Stopped | FetchWord::Failed | FetchWord::TooEarly => {
                state.failed_at_us = Some(self.now().0.max(asked_at.saturating_add(1)));
                state.failures = state.failures.saturating_add(1);
                state.stopped = word == FetchWord::Stopped || (state.stopped && text.is_none());
            }
        }
        state.detail = Some(detail.clone());
        if let Err(why) = self.keep(&state).await {
            tracing::warn!("what {} said cannot be written down: {why}", source.url);
        }
        let (mut added, mut unmatched) = (Vec::new(), Vec::new());
        if let Some(text) = &text {
            match self.add(source, text).await {
                Ok(both) => (added, unmatched) = both,
                Err(why) => detail = format!("{detail}; not added yet, taken up at the next start: {why}"),
            }
        }
        SourceFetched { url: source.url.clone(), outcome: word, detail, added, unmatched }
    }

    /// Reads an answer and, when it holds elements, keeps it.
    async fn take(&self, url: &str, body: Vec<u8>) -> Result<SetsOfText, (FetchWord, String)> {
        let (memory, url) = (self.memory.clone(), url.to_owned());
        let taken = off_the_loop(move || {
            let text = SetsOfText::read(&body, Checksums::Strict).map_err(|error| match error {
                SourceError::NotUpdated { said } => (FetchWord::NotUpdated, nothing_newer(&said)),
                other => (FetchWord::Failed, other.to_string()),
            })?;
            if text.sets.is_empty() {
                let first = text.refused.first().map(ToString::to_string).unwrap_or_default();
                return Err((FetchWord::Failed, format!("not one set can be used: {first}")));
            }
            memory
                .write_body(&url, &body)
                .map_err(|error| (FetchWord::Failed, format!("the answer cannot be kept ({error})")))?;
            Ok(text)
        });
        taken.await.map_err(|why| (FetchWord::Failed, why))?
    }

    async fn keep(&self, state: &State) -> Result<(), String> {
        let (memory, state) = (self.memory.clone(), state.clone());
        off_the_loop(move || memory.write_state(&state)).await?.map_err(|error| error.to_string())
    }

    /// The sets of each of our satellites into the engine.
    async fn add(
        &self,
        source: &FetchSource,
        text: &SetsOfText,
    ) -> Result<(Vec<ElementsAdded>, Vec<String>), String> {
        let (mut added, mut unmatched) = (Vec::new(), Vec::new());
        for wanted in &self.wanted {
            match sets_of(wanted, &text.sets, false) {
                Ok(sets) => {
                    let adder = Adder::of(PRINCIPAL, &wanted.satellite, &sets);
                    let done = self.door.add(&wanted.satellite, &sets, &source.url, &adder).await;
                    let (done, _) = done.map_err(|error| error.to_string())?;
                    added.push(report(done, text, sets.len(), &source.url));
                }
                Err(why) => unmatched.push(format!("{}: {why}", wanted.satellite)),
            }
        }
        Ok((added, unmatched))
    }
}

/// How it stands with each source of a configuration, without asking or adding anything.
///
/// # Errors
/// When the folder of the memory cannot be made.
pub fn sources_of(config: &Config, data: &Path, now: UtcUs) -> std::io::Result<Vec<ElementsSource>> {
    if config.elements.fetch.is_empty() {
        return Ok(Vec::new());
    }
    Ok(view(&Memory::open(data)?, Rules::of(&config.elements), &config.elements.fetch, now))
}

fn view(memory: &Memory, rules: Rules, sources: &[FetchSource], now: UtcUs) -> Vec<ElementsSource> {
    let view = |source: &FetchSource| {
        let state = memory.state(&source.url, now);
        let time = |at: Option<i64>| at.map(Time::from_unix_us);
        let next = rules.next(&state, source.credentials_file.is_some());
        ElementsSource {
            url: source.url.clone(),
            state: match (state.asked_at_us, state.failed_at_us) {
                _ if state.stopped => SourceWord::Stopped,
                (_, Some(_)) => SourceWord::Failed,
                (None, None) => SourceWord::New,
                (Some(_), None) => SourceWord::Good,
            },
            asked_at: time(state.asked_at_us),
            downloaded_at: time(state.downloaded_at_us),
            next_at: time(next.map(|at| at.max(now).0)),
            detail: state.detail,
        }
    };
    sources.iter().map(view).collect()
}

fn nothing_newer(said: &str) -> String {
    format!("nothing newer than the last download, which stays in use ('{said}')")
}

/// One line in the log for each source.
fn tell(fetched: &SourceFetched) {
    let SourceFetched { url, outcome, detail, added, unmatched } = fetched;
    match outcome {
        FetchWord::Downloaded | FetchWord::NotUpdated | FetchWord::TooEarly => {
            let new: u64 = added.iter().map(|added| added.added).sum();
            tracing::info!(%url, new, "elements from {url}: {detail}; {new} new for our satellites");
        }
        FetchWord::Failed => {
            tracing::warn!(%url, "elements from {url}: {detail}. What we have stays in use");
        }
        FetchWord::Stopped => tracing::warn!(
            %url,
            "elements from {url}: {detail}. It is not asked again by itself; what we have stays in use"
        ),
    }
    for why in unmatched {
        tracing::warn!(%url, "elements from {url}: {why}");
    }
}

async fn off_the_loop<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, String> {
    tokio::task::spawn_blocking(work).await.map_err(|error| format!("a thread died: {error}"))
}
