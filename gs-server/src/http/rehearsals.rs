//! `/api/v1/rehearsals`: a plan through its coming pass in simulation, as `gs-server rehearse` does it.
//!
//! A rehearsal takes seconds, so it is a job: asked for, looked at while it goes on, read when it is done. Jobs are kept in
//! memory only, a bounded number of them; one computes at a time, beside the event loop and not on all cores, because
//! the station may be in a pass. A job that nobody looks at any more is given up, and all are when the server stops.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use api::{Nothing, Page, PlanText, ProblemKind, RehearsalAnswer, RehearsalRequest, RehearsalView, Time};
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use mission::plan::{CheckContext, Plan, Severity};
use mission::{Clock as _, PlanName, UtcUs};
use rehearsal::rehearse::{
    AHEAD_US, Rehearsal, RehearsalError, Summary, Uncertainty, coming_pass, refusals, rehearse, warnings,
};
use tokio::sync::Semaphore;

use super::App;
use super::extract::{Id, Query, Within, satellite, time, whole};
use super::problem::Failure;
use super::sky::{bad, compute, known, site};
use super::write::{IDEMPOTENCY_REPLAYED, Write};
use crate::clock::SystemClock;
use crate::plan::{Form, check_words, place_findings};
use crate::rehearsed::answer;
use crate::storage::StoreError;

/// Runs of one job.
const RUNS_MAX: u32 = 1000;
/// Jobs that are remembered; the oldest that are over go first.
const KEPT: usize = 32;
/// Jobs that wait or run at once; more are refused.
const UNDER_WAY_MAX: usize = 4;
/// A job that nobody has looked at for so long is given up, microseconds of the machine's time.
const LOOKED_US: u64 = 60_000_000;

/// All jobs.
pub(super) struct Rehearsals {
    jobs: Mutex<Jobs>,
    /// One computes at a time.
    turn: Arc<Semaphore>,
    /// Who looks at a job does so in the machine's time, whatever the station's is.
    clock: SystemClock,
}

#[derive(Default)]
struct Jobs {
    newest: u64,
    list: VecDeque<Arc<Job>>,
}

struct Job {
    id: u64,
    what: Arc<Rehearsal>,
    text: String,
    who: String,
    key: String,
    digest: [u8; 32],
    asked_at: Time,
    runs: u32,
    seed: u64,
    done: AtomicU32,
    looked_us: AtomicU64,
    is_cancelled: AtomicBool,
    state: Mutex<JobState>,
}

enum JobState {
    Waiting,
    Running,
    Done(Box<RehearsalAnswer>),
    Cancelled(String),
    Failed(String),
}

impl Default for Rehearsals {
    fn default() -> Self {
        Self { jobs: Mutex::default(), turn: Arc::new(Semaphore::new(1)), clock: SystemClock::new() }
    }
}

impl Rehearsals {
    fn with<T>(&self, act: impl FnOnce(&mut Jobs) -> T) -> T {
        act(&mut self.jobs.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn now_us(&self) -> u64 {
        self.clock.now().mono.0
    }

    fn find(&self, id: u64) -> Result<Arc<Job>, Failure> {
        let found = self.with(|jobs| jobs.list.iter().find(|job| job.id == id).cloned());
        let job = found.ok_or_else(|| {
            Failure::new(
                ProblemKind::NotFound,
                format!("There is no rehearsal {id}. The newest {KEPT} are kept, and none over a restart."),
            )
        })?;
        job.looked_us.store(self.now_us(), Ordering::Relaxed);
        Ok(job)
    }
}

impl Job {
    fn set(&self, state: JobState) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = state;
    }

    fn is_under_way(&self) -> bool {
        matches!(
            *self.state.lock().unwrap_or_else(PoisonError::into_inner),
            JobState::Waiting | JobState::Running
        )
    }

    fn view(&self, whole: bool) -> RehearsalView {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (word, why, answer) = match &*state {
            JobState::Waiting => ("waiting", None, None),
            JobState::Running => ("running", None, None),
            JobState::Done(answer) => ("done", None, whole.then(|| (**answer).clone())),
            JobState::Cancelled(why) => ("cancelled", Some(why.clone()), None),
            JobState::Failed(why) => ("failed", Some(why.clone()), None),
        };
        RehearsalView {
            id: self.id,
            plan: self.what.plan.name.to_string(),
            satellite: self.what.plan.satellite.to_string(),
            who: self.who.clone(),
            asked_at: self.asked_at,
            aos: time(self.what.pass.aos_at.0),
            state: word.to_owned(),
            why,
            runs: self.runs,
            runs_done: self.done.load(Ordering::Relaxed),
            answer,
        }
    }
}

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Within>,
) -> Result<Json<Page<RehearsalView>>, Failure> {
    let during = asked.during()?;
    let jobs: Vec<Arc<Job>> = app.rehearsals.with(|jobs| jobs.list.iter().rev().cloned().collect());
    let within = jobs.iter().filter(|job| during.holds(job.asked_at.unix_us()));
    Ok(Json(whole(within.map(|job| job.view(false)).collect())))
}

pub(super) async fn get(State(app): State<App>, id: Id) -> Result<Json<RehearsalView>, Failure> {
    Ok(Json(app.rehearsals.find(id.0)?.view(true)))
}

/// Gives it up; one that is over stays as it is.
pub(super) async fn cancel(
    State(app): State<App>,
    id: Id,
    write: Write<Nothing>,
) -> Result<Json<RehearsalView>, Failure> {
    let job = app.rehearsals.find(id.0)?;
    if job.is_under_way() {
        job.set(JobState::Cancelled(format!("{} cancelled it", write.who().0)));
        job.is_cancelled.store(true, Ordering::Relaxed);
    }
    Ok(Json(job.view(true)))
}

pub(super) async fn begin(
    State(app): State<App>,
    write: Write<RehearsalRequest>,
) -> Result<Response, Failure> {
    let (who, key, digest) = write.who();
    if let Some(before) = app.rehearsals.with(|jobs| jobs.list.iter().find(|job| job.key == key).cloned()) {
        if before.digest != digest {
            return Err(Failure::new(
                ProblemKind::IdempotencyKeyReused,
                "This Idempotency-Key was used for another rehearsal. Send a new one.",
            ));
        }
        return Ok(created(&before, true));
    }
    let asked = &write.body;
    if !(1..=RUNS_MAX).contains(&asked.runs) {
        return Err(argument("runs", format!("must lie from 1 to {RUNS_MAX}, found {}", asked.runs)));
    }
    if asked.seed.checked_add(u64::from(asked.runs)).is_none() {
        return Err(argument(
            "seed",
            format!("{} and {} runs are beyond the greatest seed", asked.seed, asked.runs),
        ));
    }
    let sizes = asked.image_sizes().map_err(|why| argument("image_bytes", why))?;
    let words = words(&app, asked).await?;
    let text = serde_json::to_string_pretty(&words).map_err(|error| {
        tracing::error!(%error, "A plan that was read cannot be written.");
        Failure::new(ProblemKind::Internal, "The plan cannot be written.")
    })?;
    let what = Arc::new(prepare(&app, &words, &text, asked.at, sizes).await?);
    let job = app.rehearsals.with(|jobs| {
        let under_way = jobs.list.iter().filter(|job| job.is_under_way()).count();
        if under_way >= UNDER_WAY_MAX {
            let why =
                format!("{under_way} rehearsals wait or run already. Ask again when one of them is done.");
            return Err(Failure::new(ProblemKind::Overloaded, why));
        }
        jobs.newest += 1;
        let job = Arc::new(Job {
            id: jobs.newest,
            what,
            text,
            who: who.to_string(),
            key,
            digest,
            asked_at: time(app.state.timer.now().utc.0),
            runs: asked.runs,
            seed: asked.seed,
            done: AtomicU32::new(0),
            looked_us: AtomicU64::new(app.rehearsals.now_us()),
            is_cancelled: AtomicBool::new(false),
            state: Mutex::new(JobState::Waiting),
        });
        jobs.list.push_back(Arc::clone(&job));
        while jobs.list.len() > KEPT {
            let Some(over) = jobs.list.iter().position(|job| !job.is_under_way()) else { break };
            jobs.list.remove(over);
        }
        Ok(job)
    })?;
    tokio::spawn(wait_and_run(app.clone(), Arc::clone(&job)));
    Ok(created(&job, false))
}

fn created(job: &Job, replayed: bool) -> Response {
    let status = if replayed { StatusCode::OK } else { StatusCode::CREATED };
    let mut response = (status, Json(job.view(true))).into_response();
    if let Ok(location) = HeaderValue::try_from(format!("/api/v1/rehearsals/{}", job.id)) {
        response.headers_mut().insert(header::LOCATION, location);
    }
    if replayed {
        response.headers_mut().insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
    }
    response
}

fn argument(field: &str, message: impl Into<String>) -> Failure {
    Failure::field(ProblemKind::BadArgument, field, message)
}

/// The plan that is meant: the one in the request, or the one in use under this name.
async fn words(app: &App, asked: &RehearsalRequest) -> Result<PlanText, Failure> {
    match (&asked.plan, &asked.name) {
        (Some(plan), None) => Ok(plan.clone()),
        (None, Some(name)) => {
            let unknown = |why: String| Failure::field(ProblemKind::UnknownPlan, "name", why);
            let name = PlanName::new(name).map_err(|error| unknown(error.to_string()))?;
            let status = app.state.engine.status();
            let held = status.plans.iter().find(|held| held.plan.name == name);
            let held = held.ok_or_else(|| unknown(format!("there is no plan '{name}' in use")))?;
            let id = held.id.0;
            let row = app.state.store.plan(i64::try_from(id).unwrap_or(i64::MAX)).await?;
            let row = row
                .ok_or_else(|| StoreError::damaged(format!("plan {id} is in use and not in the archive")))?;
            Ok(row.text()?)
        }
        _ => Err(argument("plan", "give either a plan, or the name of a plan in use")),
    }
}

/// Everything that the runs need, or what is wrong with it.
async fn prepare(
    app: &App,
    words: &PlanText,
    text: &str,
    at: Option<Time>,
    sizes: Option<std::ops::RangeInclusive<u32>>,
) -> Result<Rehearsal, Failure> {
    let id = satellite(app, Some(&words.satellite))?;
    let identity = &app.state.identity;
    let satellite = identity.satellites.iter().find(|known| known.id == id);
    let (profile, timing) = satellite.map(|known| (known.profile, known.timing)).unwrap_or_default();
    let context = CheckContext { timing, profile: Some(profile), pass: None, now: None };
    let (plan, mut findings) = check_words(words, &context);
    findings.retain(|finding| finding.severity == Severity::Error);
    let plan: Plan = match plan {
        Some(plan) if findings.is_empty() => plan,
        _ => return Err(Failure::findings(ProblemKind::PlanRefused, &findings)),
    };
    let site = site(app)?;
    let from = at.map_or(app.state.timer.now().utc, |at| UtcUs(at.unix_us()));
    let window = (mission::sky::instant(from), mission::sky::instant(from.plus(AHEAD_US)));
    super::sky::check_calendar("at", window.0)?;
    let found = known(app, Some(id.as_str()), window).await?;
    let Some(object) = found.objects.into_iter().next() else {
        return Err(bad("satellite", "there are no elements of it"));
    };
    let (times, text) = (identity.times.clone(), Arc::<str>::from(text));
    compute(app, move || {
        let elements = object.set_for(window.0).clone();
        let pass = coming_pass(&plan, &elements, &site, from)
            .map_err(|error| Failure::new(ProblemKind::PassRefused, sentence(&error)))?;
        let uncertainty =
            Uncertainty { image_bytes: sizes.unwrap_or(15_000..=45_000), ..Uncertainty::default() };
        let plan = Arc::new(plan);
        let what = Rehearsal { plan, text, elements, site, pass, profile, timing, times, uncertainty };
        let refused = refusals(&what);
        match refused.is_empty() {
            true => Ok(what),
            false => Err(Failure::findings(ProblemKind::PlanRefused, &refused)),
        }
    })
    .await
}

/// The error with its reasons.
fn sentence(error: &RehearsalError) -> String {
    format!("{error}.")
}

/// Waits for its turn, computes, and keeps what came of it.
async fn wait_and_run(app: App, job: Arc<Job>) {
    let stop = app.state.stop.clone();
    let turn = tokio::select! {
        turn = Arc::clone(&app.rehearsals.turn).acquire_owned() => turn.ok(),
        () = stop.cancelled() => None,
    };
    let Some(turn) = turn else {
        return job.set(JobState::Cancelled("the server stopped".to_owned()));
    };
    // Whoever computes passes waits for the same turns; one stays taken meanwhile.
    let Ok(computing) = Arc::clone(&app.computing).acquire_owned().await else { return };
    let (state, running) = (app.clone(), Arc::clone(&job));
    let done = tokio::task::spawn_blocking(move || {
        let end = run(&state, &running);
        drop((turn, computing));
        end
    });
    match done.await {
        Ok(Some(end)) => job.set(end),
        Ok(None) => {}
        Err(error) => {
            tracing::error!(%error, "A rehearsal died.");
            job.set(JobState::Failed("the computation ended; the server's log says more".to_owned()));
        }
    }
}

/// `None`: it was cancelled, and that is told already.
fn run(app: &App, job: &Job) -> Option<JobState> {
    if job.is_cancelled.load(Ordering::Relaxed) {
        return None;
    }
    job.set(JobState::Running);
    // The engine keeps a core for itself where there are two.
    let threads =
        std::thread::available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1));
    let pool = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool,
        Err(error) => return Some(JobState::Failed(format!("no threads for it: {error}"))),
    };
    let seeds: Vec<u64> = (job.seed..job.seed.saturating_add(u64::from(job.runs))).collect();
    let is_forgotten =
        || app.rehearsals.now_us().saturating_sub(job.looked_us.load(Ordering::Relaxed)) > LOOKED_US;
    let goes_on = |done: usize| {
        job.done.fetch_max(u32::try_from(done).unwrap_or(u32::MAX), Ordering::Relaxed);
        let ends =
            job.is_cancelled.load(Ordering::Relaxed) || app.state.stop.is_cancelled() || is_forgotten();
        if ends { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let outcomes = match pool.install(|| rehearse(&job.what, &seeds, goes_on)) {
        Ok(outcomes) => outcomes,
        Err(RehearsalError::Stopped(_)) if job.is_cancelled.load(Ordering::Relaxed) => return None,
        Err(RehearsalError::Stopped(_)) if app.state.stop.is_cancelled() => {
            return Some(JobState::Cancelled("the server stopped".to_owned()));
        }
        Err(RehearsalError::Stopped(_)) => {
            return Some(JobState::Cancelled("nobody looked at it for a minute".to_owned()));
        }
        Err(error) => return Some(JobState::Failed(error.to_string())),
    };
    if job.is_cancelled.load(Ordering::Relaxed) {
        return None;
    }
    let Some(summary) = Summary::of(&job.what.plan, &outcomes) else {
        return Some(JobState::Failed("no run came to its end".to_owned()));
    };
    let found = warnings(&job.what).into_iter().chain(summary.warnings());
    let mut findings = place_findings(&job.text, Form::Json, found);
    // The plan came as words: lines of our own writing of it mean nothing to anybody.
    for finding in &mut findings {
        (finding.line, finding.column) = (None, None);
    }
    Some(JobState::Done(Box::new(answer(&job.what, job.seed, &summary, &outcomes, findings))))
}
