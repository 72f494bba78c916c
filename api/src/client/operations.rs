//! One method for each operation of reading, commanding, downloads, elements, plans and runs.

use super::operation::{Operation, operations};
use super::{
    ACCEPT, Client, ClientError, Duration, Filter, HeaderMap, HeaderValue, IF_NONE_MATCH, IdempotencyKey,
    Method, StatusCode, bytes,
};

use crate::{
    AntennaView, AttachRequest, AuditView, ChunkMap, CommandRequest, CommandView, CounterConfirmation,
    DownloadRequest, DownloadView, ElementsAdded, ElementsRequest, ElementsSource, EventView, FetchReport,
    FrameView, Health, HeldElements, ImageView, LatestValue, LimitView, LookList, Nothing, Outcome, Page,
    ParameterView, PassKept, PassList, PlanText, PlanView, RunReport, RunView, ScheduleView, StationView,
    TelemetryPage, Time, Version,
};

/// A fetch asks several sources one after the other.
const FETCH_PATIENCE: Duration = Duration::from_secs(900);

/// The file of an image as far as it is held: what is missing is zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageFile {
    /// The JPEG.
    pub bytes: Vec<u8>,
    /// Every chunk is held.
    pub complete: bool,
    /// How many bytes from the beginning are held.
    pub contiguous_bytes: u64,
    /// Names this very content: ask with it for what is newer.
    pub tag: Option<String>,
}

operations! { READ, read:
    /// The handshake: who is there and what it can.
    version -> Version = "version";
    /// How the station is right now.
    station -> StationView = "station";
    /// Rotator and rig, and what the radio bears.
    antenna -> AntennaView = "antenna";
    /// Which values there are.
    parameters -> Page<ParameterView> = "parameters";
    /// Values that have been judged by their limits.
    limits -> Page<LimitView> = "limits";
    /// The plans in use.
    plans -> Page<PlanView> = "plans";
    /// Which plan gets which pass of the coming two days, and why.
    schedule -> ScheduleView = "schedule";
    /// Where elements are fetched from, and how it stands with each.
    sources -> Page<ElementsSource> = "elements/sources";
}

operations! { LIST, list:
    /// Raw frames, newest first.
    frames -> Page<FrameView> = "frames";
    /// One parameter over time: `parameter`, `satellite`, `start`, `stop`, `max_points`.
    telemetry -> TelemetryPage = "telemetry";
    /// The newest value of each parameter.
    latest -> Page<LatestValue> = "telemetry/latest";
    /// Telecommands with their last stage; also `key`, `stage`.
    commands -> Page<CommandView> = "commands";
    /// Standing orders for images.
    downloads -> Page<DownloadView> = "downloads";
    /// Images that were declared.
    images -> Page<ImageView> = "images";
    /// What happened; also `kind`, `level`, `key`.
    events -> Page<EventView> = "events";
    /// Who did what.
    audit -> Page<AuditView> = "audit";
    /// Elements held.
    elements -> Page<HeldElements> = "elements";
    /// Passes of a window of time: `satellite`, `start`, `stop`, `min_elevation`, `frequency`.
    passes -> PassList = "passes";
    /// Passes that began.
    passes_history -> Page<PassKept> = "passes/history";
    /// Where satellites stand: `satellite`, `at`, `frequency`.
    look -> LookList = "look";
    /// What became of plans in passes.
    runs -> Page<RunView> = "runs";
}

operations! { ONE, one:
    /// One frame, decoded field by field.
    frame(u64) -> FrameView = "frames/{id}";
    /// One command with all its stages.
    command(u64) -> CommandView = "commands/{id}";
    /// One download.
    download(u64) -> DownloadView = "downloads/{id}";
    /// One image.
    image(u64) -> ImageView = "images/{id}";
    /// Which chunks of an image are held.
    image_chunks(u64) -> ChunkMap = "images/{id}/chunks";
    /// The report of one run.
    run(u64) -> RunReport = "runs/{id}";
}

operations! { ACT, act:
    /// Says that this machine's clock is right.
    vouch_clock -> Outcome = "clock/vouch";
}

operations! { VERB, verb:
    /// Withdraws a command that was not radiated.
    cancel_command(u64) -> Outcome = "commands/{id}/cancel";
    /// Asks for no more of an image.
    cancel_download(u64) -> Outcome = "downloads/{id}/cancel";
    /// The link may transmit.
    arm_link(&str) -> Outcome = "links/{id}/arm";
    /// The link must not transmit any more.
    disarm_link(&str) -> Outcome = "links/{id}/disarm";
    /// The plan may run.
    arm_plan(&str) -> Outcome = "plans/{name}/arm";
    /// The plan must not run any more.
    disarm_plan(&str) -> Outcome = "plans/{name}/disarm";
    /// Takes a satellite over from the plan that runs.
    hold(&str) -> Outcome = "satellites/{name}/hold";
    /// Gives it back.
    release(&str) -> Outcome = "satellites/{name}/release";
}

operations! { GIVE, give:
    /// Has a telecommand sent.
    send_command(CommandRequest) -> Outcome = "commands";
    /// Has an image brought home.
    order_download(DownloadRequest) -> Outcome = "downloads";
    /// Adds elements of one satellite.
    add_elements(ElementsRequest) -> ElementsAdded = "elements";
    /// Hands a plan over; it is not armed.
    add_plan(PlanText) -> Outcome = "plans";
}

operations! { REMOVE, remove:
    /// Takes a plan out of use.
    withdraw_plan(&str) -> Outcome = "plans/{name}";
}

const CONFIRM: Operation = Operation::post("keys/{id}/confirm-counter");
const HEALTH: Operation = Operation::get("health");
const FETCH: Operation = Operation::post("elements/fetch");
const ATTACH: Operation = Operation::post("plans/{name}/attach");
const DETACH: Operation = Operation::post("plans/{name}/detach");
const IMAGE_FILE: Operation = Operation::get("images/{id}/file");

pub(super) const ALL: [&[Operation]; 8] =
    [READ, LIST, ONE, ACT, VERB, GIVE, REMOVE, &[CONFIRM, HEALTH, FETCH, ATTACH, DETACH, IMAGE_FILE]];

impl Client {
    /// I know why counter and witness of this key disagree; with `above`, sealing goes on above that counter.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn confirm_counter(
        &self,
        of: &str,
        above: Option<u64>,
        key: &IdempotencyKey,
    ) -> Result<Outcome, ClientError> {
        self.post(&CONFIRM.of(&of), &CounterConfirmation { above }, key).await
    }

    /// Whether the server can do its work; an answer also when it cannot.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn health(&self) -> Result<Health, ClientError> {
        let url = self.url(HEALTH.path, &Filter::new())?;
        let answer = super::timers::within(super::PATIENCE, self.http.get(url.clone()).send()).await;
        let no_answer = |why| ClientError::NoAnswer { url: url.to_string(), why };
        let response = answer
            .ok_or_else(|| no_answer("it takes too long".to_owned()))?
            .map_err(|error| no_answer(super::chain(error)))?;
        match response.status() {
            StatusCode::OK | StatusCode::SERVICE_UNAVAILABLE => super::read(response, &url).await,
            _ => Err(super::problem(response, &url).await),
        }
    }

    /// Has the sources of elements asked, as far as they allow; the answer comes after theirs.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn fetch_elements(&self, key: &IdempotencyKey) -> Result<FetchReport, ClientError> {
        self.write(Method::POST, FETCH.path, &Nothing {}, key, FETCH_PATIENCE).await
    }

    /// Chooses the pass in which this instant lies for a plan.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn attach_plan(
        &self,
        name: &str,
        at: Time,
        key: &IdempotencyKey,
    ) -> Result<Outcome, ClientError> {
        self.post(&ATTACH.of(&name), &AttachRequest { at }, key).await
    }

    /// Takes that choice back.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn detach_plan(
        &self,
        name: &str,
        at: Time,
        key: &IdempotencyKey,
    ) -> Result<Outcome, ClientError> {
        self.post(&DETACH.of(&name), &AttachRequest { at }, key).await
    }

    /// The file of an image; `None` when what carries the tag `known` is still the newest.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn image_file(&self, id: u64, known: Option<&str>) -> Result<Option<ImageFile>, ClientError> {
        let url = self.url(&IMAGE_FILE.of(&id), &Filter::new())?;
        let mut request = self.http.get(url.clone()).header(ACCEPT, "image/jpeg");
        if let Some(known) = known.and_then(|tag| HeaderValue::try_from(tag).ok()) {
            request = request.header(IF_NONE_MATCH, known);
        }
        let response = self.send(request, &url, super::PATIENCE).await?;
        if response.status() == StatusCode::NOT_MODIFIED {
            return Ok(None);
        }
        let headers = response.headers().clone();
        Ok(Some(ImageFile {
            bytes: bytes(response, &url).await?,
            complete: text(&headers, "x-image-complete") == Some("true"),
            contiguous_bytes: text(&headers, "x-image-contiguous-bytes")
                .and_then(|bytes| bytes.parse().ok())
                .unwrap_or(0),
            tag: text(&headers, "etag").map(str::to_owned),
        }))
    }
}

fn text<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}
