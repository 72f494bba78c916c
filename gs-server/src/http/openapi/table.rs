//! What the document says about each route, in the order of the table of routes. A test holds the two together, and the
//! parameters to those that the handlers take.

use api::ProblemKind as K;
use api::{
    AntennaView, AttachRequest, AuditView, ChunkMap, CommandRequest, CommandView, CounterConfirmation,
    DownloadRequest, DownloadView, EarView, ElementsAdded, ElementsRequest, ElementsSource, EventView,
    FetchReport, FrameView, HandoverReport, Health, HeldElements, ImageView, ImportReport, ImportRequest,
    LatestValue, LimitView, LookList, MonthReport, Nothing, Outcome, OutsideView, ParameterView, PassKept,
    PassList, PassReport, PlanText, PlanView, ReceiverView, RunReport, RunView, ScheduleView, StationView,
    StreamMessage, StreamRequest, TelemetryPage, Version, WayView,
};

use super::operation::{Doc, Kind, Param, delete, get, param, post, required};

const SATELLITE: Param = param("satellite", Kind::Text, "Only of this satellite.");
const THE_SATELLITE: Param =
    param("satellite", Kind::Text, "The satellite; may be left out where there is one.");
const STATION: Param = param("station", Kind::Text, "Only of this station.");
const LINK: Param = param("link", Kind::Text, "Only of this link.");
const KEY: Param = param("key", Kind::Text, "Only with this key id.");
pub(super) const AFTER: Param =
    param("after", Kind::Whole(i64::MIN, i64::MAX), "Upwards from here: what follows this number.");
pub(super) const BEFORE: Param =
    param("before", Kind::Whole(i64::MIN, i64::MAX), "Downwards from here: what precedes this number.");
pub(super) const LIMIT: Param = param("limit", Kind::Whole(1, 1000), "Entries of a page; 100 when left out.");
pub(super) const FROM: Param = param("start", Kind::Time, "Not before this.");
pub(super) const UNTIL: Param = param("stop", Kind::Time, "Before this.");
pub(super) const LIST: [Param; 8] = [SATELLITE, STATION, LINK, FROM, UNTIL, AFTER, BEFORE, LIMIT];
const START: Param = param("start", Kind::Time, "Begin of the window; now when left out.");
const STOP: Param =
    param("stop", Kind::Time, "End of the window; two days after its begin when left out, 31 at most.");
const MIN_ELEVATION: Param = param(
    "min_elevation",
    Kind::Number(-90.0, 90.0),
    "Degrees; that of the station when left out. Where the horizon mask is higher, the mask counts.",
);
const FREQUENCY: Param = param("frequency", Kind::Number(1e5, 1e12), "For Doppler shifts, Hz.");
const FORM: Param = param("form", Kind::OneOf(&["full", "compact"]), "With or without what surrounds it.");
const THEME: Param = param("theme", Kind::OneOf(&["dark", "light"]), "Colours; `dark` when left out.");

const SINCE: Param = param("since", Kind::Time, "Since when; the last eight hours when left out.");

pub(super) const INTENT: [K; 3] = [K::StorageFailing, K::Overloaded, K::Stopping];
const SKY: [K; 4] = [K::NoPlace, K::NoElements, K::UnknownSatellite, K::NotFound];
const PLANS: [K; 3] = [K::UnknownPlan, K::PassRefused, K::BadParameter];

/// Every operation.
pub(in crate::http) fn table() -> Vec<Doc> {
    let mut rows = server();
    rows.extend(archive());
    rows.extend(uplink());
    rows.extend(sky());
    rows.extend(plans());
    rows.extend(super::alerts::alerts());
    rows.extend(super::forwards::forwards());
    rows.extend(super::people::rehearsals());
    rows.extend(super::people::people());
    rows
}

fn server() -> Vec<Doc> {
    vec![
        get("/api/v1/openapi.json", "server", "openapi", "This document")
            .json::<serde_json::Value>()
            .tagged(),
        get("/api/v1/health", "server", "health", "Whether the server lives and can do its work")
            .json::<Health>()
            .also(503, "It lives, and cannot do its work: the reasons are told."),
        get("/api/v1/version", "server", "version", "Who is there and what it can").json::<Version>(),
        get("/api/v1/station", "station", "station", "Links, satellites, sealing, storage: right now")
            .json::<StationView>(),
        get("/api/v1/antenna", "station", "antenna", "Rotator and rig, and what the radio bears")
            .json::<AntennaView>(),
        post("/api/v1/links/{id}/arm", "station", "arm_link", "The link may transmit")
            .body::<Nothing>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&[K::UnknownLink]),
        post("/api/v1/links/{id}/disarm", "station", "disarm_link", "The link must not transmit any more")
            .body::<Nothing>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&[K::UnknownLink]),
        post("/api/v1/clock/vouch", "station", "vouch_clock", "I have looked: this machine's clock is right")
            .body::<Nothing>()
            .json::<Outcome>()
            .problems(&INTENT),
        post(
            "/api/v1/keys/{id}/confirm-counter",
            "station",
            "confirm_counter",
            "I know why counter and witness disagree",
        )
        .body::<CounterConfirmation>()
        .json::<Outcome>()
        .problems(&INTENT)
        .problems(&[K::UnknownKey, K::NotLocked, K::ClockNotVouched, K::FloorNeeded, K::BadArgument]),
    ]
}

fn archive() -> Vec<Doc> {
    vec![
        get("/api/v1/frames", "archive", "list_frames", "Raw frames, with who heard them")
            .query(&LIST)
            .query(&[param("packet_type", Kind::Whole(0, 255), "Only packets of this type.")])
            .page::<FrameView>(),
        get("/api/v1/frames/{id}", "archive", "get_frame", "One frame, decoded field by field")
            .json::<FrameView>()
            .problems(&[K::NotFound]),
        get("/api/v1/receptions", "archive", "list_receptions", "What others heard: TinyGS, SatNOGS, files")
            .query(&[
                SATELLITE,
                param(
                    "source",
                    Kind::OneOf(&["own-mqtt", "tinygs-api", "satnogs", "console", "file"]),
                    "Only through this ear.",
                ),
                param(
                    "kind",
                    Kind::OneOf(&["frame", "repairable", "damaged", "detection"]),
                    "Only of this kind.",
                ),
                param("original", Kind::OneOf(&["true", "false"]), "With each report as it came."),
                FROM,
                UNTIL,
                AFTER,
                BEFORE,
                LIMIT,
            ])
            .page::<OutsideView>(),
        post("/api/v1/receptions", "archive", "import_receptions", "Hand in what somebody heard")
            .more("The same reports again change nothing. What is refused is counted by its reason under /ears.")
            .body::<ImportRequest>()
            .json::<ImportReport>()
            .problems(&INTENT)
            .problems(&[K::BadArgument, K::UnknownSatellite]),
        get("/api/v1/ears", "archive", "ears", "What came in by each ear, and what was refused of it")
            .page::<EarView>(),
        get("/api/v1/ears/ways", "archive", "ways", "Ways in over the network: how each works")
            .page::<WayView>(),
        get("/api/v1/receivers", "archive", "receivers", "Who hears the satellite, and how one's own boards are")
            .query(&[
                SATELLITE,
                param("start", Kind::Time, "Begin of the range; 30 days ago when both are left out."),
                param("stop", Kind::Time, "End of the range, not included."),
            ])
            .page::<ReceiverView>(),
        get("/api/v1/telemetry", "archive", "telemetry", "One parameter over time, thinned where there is much")
            .query(&[
                required("parameter", Kind::Text, "Which, e.g. `heartbeat.temp`."),
                THE_SATELLITE,
                param("start", Kind::Time, "Begin of the range."),
                param("stop", Kind::Time, "End of the range, not included."),
                param("max_points", Kind::Whole(1, 10_000), "Values or buckets at most; 1000 when left out."),
            ])
            .json::<TelemetryPage>()
            .problems(&[K::NotFound, K::UnknownSatellite]),
        get("/api/v1/telemetry/latest", "archive", "latest", "The newest value of each parameter")
            .query(&[THE_SATELLITE])
            .page::<LatestValue>()
            .tagged()
            .problems(&[K::UnknownSatellite]),
        get("/api/v1/parameters", "archive", "list_parameters", "Which values there are")
            .page::<ParameterView>(),
        get("/api/v1/images", "archive", "list_images", "Images that were declared")
            .query(&LIST)
            .page::<ImageView>(),
        get("/api/v1/images/{id}", "archive", "get_image", "One image")
            .json::<ImageView>()
            .problems(&[K::NotFound]),
        get("/api/v1/images/{id}/chunks", "archive", "image_chunks", "Which chunks are held, and who brought them")
            .json::<ChunkMap>()
            .tagged()
            .problems(&[K::NotFound]),
        get("/api/v1/images/{id}/file", "archive", "image_file", "The JPEG as far as it is held; the rest is zero")
            .media("image/jpeg")
            .tagged()
            .header("x-image-complete", "`true` when every chunk is held.")
            .header("x-image-contiguous-bytes", "How many bytes from the beginning are held.")
            .problems(&[K::NotFound]),
        get("/api/v1/events", "archive", "list_events", "What happened")
            .query(&LIST)
            .query(&[
                KEY,
                param("kind", Kind::Text, "Only of these kinds, with commas between."),
                param(
                    "level",
                    Kind::OneOf(&["normal", "watch", "warning", "distress", "critical", "severe"]),
                    "At least this level.",
                ),
            ])
            .page::<EventView>(),
        get("/api/v1/limits", "archive", "list_limits", "Values that have been judged by their limits")
            .query(&[FROM, UNTIL])
            .page::<LimitView>(),
        get("/api/v1/audit", "archive", "list_audit", "Who did what, when")
            .query(&[FROM, UNTIL, AFTER, BEFORE, LIMIT])
            .page::<AuditView>(),
        get("/api/v1/stream", "archive", "stream", "Events, values, status as they come, over a WebSocket")
            .more(
                "A WebSocket. The server sends `StreamMessage`, the client may send `StreamRequest`; docs/api.md tells \
                 the rest.",
            )
            .query(&[
                param("after", Kind::Whole(i64::MIN, i64::MAX), "Begin after this event; at the end when left out."),
                param("topics", Kind::Text, "`events`, `status`, `frames`, `telemetry`, `commands`, `runs`, with commas; `events,status` when left out."),
                param("satellite", Kind::Text, "Only of these satellites, with commas; the station's own besides."),
            ])
            .upgrades()
            .beside::<StreamMessage>()
            .beside::<StreamRequest>()
            .problems(&[K::OriginRefused, K::UpgradeRequired, K::TooManyStreams, K::UnknownSatellite]),
    ]
}

fn uplink() -> Vec<Doc> {
    vec![
        get("/api/v1/commands", "uplink", "list_commands", "Telecommands with their last stage")
            .query(&LIST)
            .query(&[
                KEY,
                param(
                    "stage",
                    Kind::OneOf(&[
                        "queued",
                        "sealed",
                        "radiating",
                        "radiated",
                        "answered",
                        "failed",
                        "rejected",
                        "expired",
                        "cancelled",
                        "unknown",
                    ]),
                    "Only those at this stage.",
                ),
            ])
            .page::<CommandView>(),
        post("/api/v1/commands", "uplink", "create_command", "Have a telecommand sent")
            .body::<CommandRequest>()
            .json::<Outcome>()
            .creates()
            .problems(&INTENT)
            .problems(&[
                K::BadArgument,
                K::UnknownSatellite,
                K::UnknownLink,
                K::NoKey,
                K::NotInProfile,
                K::NeedsConfirmation,
                K::AlreadyExpired,
                K::QueueFull,
            ]),
        get(
            "/api/v1/commands/{id}",
            "uplink",
            "get_command",
            "One, with all its stages and what proves them",
        )
        .json::<CommandView>()
        .problems(&[K::NotFound]),
        post("/api/v1/commands/{id}/cancel", "uplink", "cancel_command", "Withdraw it before it is radiated")
            .body::<Nothing>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&[K::UnknownCommand, K::TooLate]),
        get("/api/v1/downloads", "uplink", "list_downloads", "Standing orders for images")
            .query(&LIST)
            .page::<DownloadView>(),
        post(
            "/api/v1/downloads",
            "uplink",
            "create_download",
            "Bring the image home, over as many passes as it takes",
        )
        .body::<DownloadRequest>()
        .json::<Outcome>()
        .creates()
        .problems(&INTENT)
        .problems(&[K::UnknownSatellite, K::UnknownLink, K::NoKey, K::NotInProfile, K::QueueFull]),
        get("/api/v1/downloads/{id}", "uplink", "get_download", "One")
            .json::<DownloadView>()
            .problems(&[K::NotFound]),
        post("/api/v1/downloads/{id}/cancel", "uplink", "cancel_download", "Ask for no more of it")
            .body::<Nothing>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&[K::UnknownDownload, K::TooLate]),
    ]
}

fn sky() -> Vec<Doc> {
    vec![
        get("/api/v1/elements", "sky", "list_elements", "Elements held: age, source, which are in use")
            .query(&LIST)
            .page::<HeldElements>()
            .tagged(),
        post("/api/v1/elements", "sky", "add_elements", "Add elements of one satellite, in any form")
            .body::<ElementsRequest>()
            .json::<ElementsAdded>()
            .problems(&INTENT)
            .problems(&[K::BadArgument, K::UnknownSatellite]),
        get(
            "/api/v1/elements/sources",
            "sky",
            "list_sources",
            "Where elements are fetched from, and how it stands",
        )
        .page::<ElementsSource>(),
        post("/api/v1/elements/fetch", "sky", "fetch_elements", "Ask the sources, as far as they allow")
            .body::<Nothing>()
            .json::<FetchReport>()
            .problems(&INTENT),
        get("/api/v1/passes", "sky", "list_passes", "Passes of a window of time, computed now")
            .query(&[SATELLITE, START, STOP, MIN_ELEVATION, FREQUENCY])
            .json::<PassList>()
            .problems(&SKY),
        get(
            "/api/v1/passes/history",
            "sky",
            "list_passes_kept",
            "Passes that began, with the elements they used",
        )
        .query(&LIST)
        .page::<PassKept>(),
        get("/api/v1/passes/sky.svg", "sky", "sky_plot", "Sky plot of the pass that lasts or comes next")
            .query(&[
                THE_SATELLITE,
                param("at", Kind::Time, "The instant; now when left out."),
                MIN_ELEVATION,
                FORM,
                THEME,
            ])
            .media("image/svg+xml")
            .problems(&SKY),
        get("/api/v1/passes/timeline.svg", "sky", "timeline_plot", "Passes of a window of time at a glance")
            .query(&[
                SATELLITE,
                START,
                STOP,
                MIN_ELEVATION,
                param("width", Kind::Whole(280, 4000), "Pixels; 1080 when left out."),
                FORM,
                THEME,
            ])
            .media("image/svg+xml")
            .problems(&SKY),
        get("/api/v1/passes.ics", "sky", "calendar", "The next two weeks as a calendar, to subscribe to")
            .query(&[SATELLITE, MIN_ELEVATION])
            .media("text/calendar; charset=utf-8")
            .problems(&SKY),
        get("/api/v1/look", "sky", "look", "Where the satellites stand at instants")
            .query(&[
                SATELLITE,
                param("at", Kind::Text, "Up to 1000 instants with commas between; now when left out."),
                FREQUENCY,
            ])
            .json::<LookList>()
            .problems(&SKY),
    ]
}

fn plans() -> Vec<Doc> {
    let on = |path, id, summary| {
        post(path, "plans", id, summary)
            .body::<Nothing>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&PLANS)
    };
    vec![
        get("/api/v1/plans", "plans", "list_plans", "The plans in use")
            .query(&[FROM, UNTIL])
            .page::<PlanView>(),
        post("/api/v1/plans", "plans", "add_plan", "Hand a plan over; it is not armed")
            .body::<PlanText>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&[K::PlanRefused, K::PlansFull, K::UnknownSatellite, K::BadArgument]),
        delete("/api/v1/plans/{name}", "plans", "withdraw_plan", "Take it out of use")
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&PLANS),
        on("/api/v1/plans/{name}/arm", "arm_plan", "It may run"),
        on("/api/v1/plans/{name}/disarm", "disarm_plan", "It must not run any more"),
        post(
            "/api/v1/plans/{name}/attach",
            "plans",
            "attach_plan",
            "Choose the pass in which this instant lies",
        )
        .body::<AttachRequest>()
        .json::<Outcome>()
        .problems(&INTENT)
        .problems(&PLANS),
        post("/api/v1/plans/{name}/detach", "plans", "detach_plan", "Take the choice back")
            .body::<AttachRequest>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&PLANS),
        get(
            "/api/v1/schedule",
            "plans",
            "schedule",
            "Which plan gets which pass of the coming two days, and why",
        )
        .json::<ScheduleView>(),
        get("/api/v1/runs", "plans", "list_runs", "What became of plans in passes")
            .query(&LIST)
            .page::<RunView>(),
        get("/api/v1/runs/{id}", "plans", "get_run", "The report of one run")
            .json::<RunReport>()
            .problems(&[K::NotFound]),
        get("/api/v1/reports/passes/{id}", "plans", "pass_report", "What a pass brought")
            .more("With `.html` behind the number as a page, with `.md` as Markdown.")
            .json::<PassReport>()
            .problems(&[K::NotFound]),
        get("/api/v1/reports/handover", "plans", "handover", "What the next shift must know")
            .query(&[SINCE])
            .json::<HandoverReport>(),
        get("/api/v1/reports/handover.html", "plans", "handover_page", "The same as a page")
            .query(&[SINCE])
            .media("text/html; charset=utf-8"),
        get("/api/v1/reports/handover.md", "plans", "handover_text", "The same as Markdown")
            .query(&[SINCE])
            .media("text/markdown; charset=utf-8"),
        get(
            "/api/v1/reports/months/{month}",
            "plans",
            "month_report",
            "What a month such as 2026-11 came to",
        )
        .more("With `.html` behind the month as a page, with `.md` as Markdown.")
        .json::<MonthReport>(),
        post("/api/v1/satellites/{name}/hold", "plans", "hold", "Take over from the plan that runs")
            .body::<Nothing>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&[K::UnknownSatellite, K::NothingRuns]),
        post("/api/v1/satellites/{name}/release", "plans", "release", "Give it back")
            .body::<Nothing>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&[K::UnknownSatellite, K::NothingRuns]),
    ]
}
