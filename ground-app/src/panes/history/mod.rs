//! Values from now back to years, for plots and for the small courses beside values: asked of the archive as finely as
//! they are looked at, joined with what comes live, and kept as long as somebody looks.

mod answer;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use api::client::Filter;
use api::{TelemetryPage, Time};
use ui::plot::Series;

pub(super) use answer::at;
use answer::{Answer, Span};

use crate::link::{Courier, Pending};
use crate::model::Model;

/// Values or buckets in one answer.
const POINTS: u32 = 2000;
/// Answers that are kept for one parameter.
const ANSWERS_MAX: usize = 4;
/// Parameters that are kept.
const PARAMETERS_MAX: usize = 256;
/// Questions on their way at once.
const ASKING_MAX: usize = 6;
/// A view that moves is asked for when it has stood still for so long,
const STILL: Duration = Duration::from_millis(120);
/// or has moved for so long.
const MOVED: Duration = Duration::from_millis(500);
/// After a failure, and for what is asked again only to be sure.
const PATIENCE: Duration = Duration::from_secs(5);
/// A view that ends so near to now is one until now.
const NOW_US: i64 = 30_000_000;

/// Values over time, by satellite and parameter.
#[derive(Default)]
pub(super) struct Histories {
    held: BTreeMap<(String, String), History>,
    world: u64,
    turn: u64,
}

#[derive(Default)]
struct History {
    /// The one used last stands last.
    answers: Vec<Answer>,
    asking: Option<(Span, Pending<TelemetryPage>)>,
    needed: Option<Need>,
    asked_at: Option<Instant>,
    failure: Option<String>,
    used: u64,
}

struct Need {
    from_us: i64,
    to_us: i64,
    since: Instant,
    still_since: Instant,
}

/// A stretch of a parameter that somebody looks at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look<'a> {
    pub(super) satellite: &'a str,
    pub(super) parameter: &'a str,
    pub(super) from_us: i64,
    pub(super) to_us: i64,
}

impl Histories {
    /// Once a frame: takes answers, and forgets what nobody looks at any more.
    pub(super) fn turn(&mut self, model: &Model, now: Instant) {
        if self.world != model.world {
            *self = Self { world: model.world, ..Self::default() };
        }
        self.turn += 1;
        for ((satellite, parameter), history) in &mut self.held {
            history.settle(model, satellite, parameter, now);
        }
        while self.held.len() > PARAMETERS_MAX {
            let oldest = self.held.iter().min_by_key(|(_, history)| history.used);
            let Some(oldest) = oldest.map(|(key, _)| key.clone()) else { break };
            self.held.remove(&oldest);
        }
    }

    /// Says that somebody looks: what is not held as finely is asked for.
    pub(super) fn want(&mut self, look: Look<'_>, model: &Model, courier: &Courier, now: Instant) {
        let asking = self.held.values().filter(|history| history.asking.is_some()).count();
        let key = (look.satellite.to_owned(), look.parameter.to_owned());
        let history = self.held.entry(key).or_default();
        history.used = self.turn;
        for answer in &mut history.answers {
            answer.catch_up(&model.values, look.satellite, look.parameter);
        }
        // The stream must have begun before the archive is asked: then nothing falls between the two.
        let Some(now_us) = model.clock.now_us(now).filter(|_| model.connection.is_live()) else { return };
        if history.needs(look, now) && asking < ASKING_MAX && history.asking.is_none() {
            history.ask(look, now_us, courier, now);
        }
    }

    /// The best that is held of a stretch; `None` when nothing is.
    pub(super) fn series(&self, look: Look<'_>) -> Option<&Series> {
        let key = (look.satellite.to_owned(), look.parameter.to_owned());
        let answers = &self.held.get(&key)?.answers;
        let length_us = look.to_us - look.from_us;
        let fine = answers
            .iter()
            .rev()
            .find(|answer| answer.span.covers(look.from_us, look.to_us) && answer.is_fine_for(length_us));
        let most = || {
            answers.iter().max_by_key(|answer| {
                (answer.span.overlap(look.from_us, look.to_us), -answer.width_us.unwrap_or(0))
            })
        };
        fine.or_else(most).map(|answer| &answer.series)
    }

    /// Why the last question brought nothing.
    pub(super) fn failure(&self, satellite: &str, parameter: &str) -> Option<&str> {
        self.held.get(&(satellite.to_owned(), parameter.to_owned()))?.failure.as_deref()
    }
}

#[cfg(test)]
impl Histories {
    /// As if the archive had said so.
    pub(super) fn said(&mut self, page: &TelemetryPage, from_us: i64, model: &Model) {
        let history = self.held.entry((page.satellite.clone(), page.parameter.clone())).or_default();
        history.answers.push(Answer::new(Span { from_us, to_us: None }, page, &model.values));
    }
}

impl History {
    fn settle(&mut self, model: &Model, satellite: &str, parameter: &str, now: Instant) {
        let Some((span, answer)) =
            self.asking.as_ref().and_then(|(span, asked)| Some((*span, asked.take()?)))
        else {
            return;
        };
        self.asking = None;
        self.asked_at = Some(now);
        match answer {
            Ok(page) => {
                self.failure = None;
                // The same stretch, or a part of it as fine: the newer one is enough.
                self.answers.retain(|held| !(held.stale || held.span == span));
                self.answers.push(Answer::new(span, &page, &model.values));
                if self.answers.len() > ANSWERS_MAX {
                    self.answers.remove(0);
                }
            }
            Err(error) => self.failure = Some(format!("{satellite} {parameter}: {error}")),
        }
    }

    /// Whether it is time to ask.
    fn needs(&mut self, look: Look<'_>, now: Instant) -> bool {
        let length_us = look.to_us - look.from_us;
        let fine = self
            .answers
            .iter()
            .position(|answer| answer.span.covers(look.from_us, look.to_us) && answer.is_fine_for(length_us));
        let waited = self.asked_at.is_none_or(|at| now.saturating_duration_since(at) > PATIENCE);
        if let Some(place) = fine {
            self.needed = None;
            let answer = self.answers.remove(place);
            let stale = answer.stale;
            self.answers.push(answer);
            return stale && waited;
        }
        if self.failure.is_some() && !waited {
            return false;
        }
        let fresh = Need { from_us: look.from_us, to_us: look.to_us, since: now, still_since: now };
        let need = self.needed.get_or_insert(fresh);
        if (need.from_us, need.to_us) != (look.from_us, look.to_us) {
            (need.from_us, need.to_us, need.still_since) = (look.from_us, look.to_us, now);
        }
        self.answers.is_empty()
            || now.saturating_duration_since(need.still_since) >= STILL
            || now.saturating_duration_since(need.since) >= MOVED
    }

    fn ask(&mut self, look: Look<'_>, now_us: i64, courier: &Courier, now: Instant) {
        let margin_us = (look.to_us - look.from_us) / 4;
        // The wire's times end at milliseconds.
        let from_us = look.from_us.saturating_sub(margin_us).div_euclid(1000) * 1000;
        let to_us = (look.to_us.saturating_add(margin_us).div_euclid(1000) + 1) * 1000;
        let to_us = (look.to_us < now_us - NOW_US).then_some(to_us);
        let mut filter = Filter::new()
            .satellite(look.satellite)
            .with("parameter", look.parameter)
            .with("max_points", POINTS)
            .start(Time::from_unix_us(from_us));
        if let Some(to_us) = to_us {
            filter = filter.stop(Time::from_unix_us(to_us));
        }
        self.asked_at = Some(now);
        self.needed = None;
        let pending = courier.ask(move |client| async move { client.telemetry(&filter).await });
        self.asking = Some((Span { from_us, to_us }, pending));
    }
}
