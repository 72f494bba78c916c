//! The sky over the station: passes, plots, looks, computed when they are asked for from the elements that the archive
//! holds.
//!
//! | file | paths |
//! |---|---|
//! | `passes` | `/passes`, `/passes/history`, `/passes.ics` |
//! | `plots` | `/passes/sky.svg`, `/passes/timeline.svg` |
//! | `look` | `/look` |
//!
//! Computing never happens on the event loop, and at most a few requests compute at once; the others wait their turn.

mod look;
mod passes;
mod plots;

use api::{FineTime, ProblemKind};
use mission::{SatelliteId, Site};
use tle::UtcInstant;
use tle::passes::{PassSearch, SearchError};

use super::App;
use super::extract::satellite;
use super::problem::Failure;
use crate::sky::{Object, Place, PredictError, Prediction, instant, predict};

pub(super) use look::look;
pub(super) use passes::{calendar, history, passes};
pub(super) use plots::{sky, timeline};

const DAY_US: i64 = 86_400_000_000;
/// The longest window of a request.
const WINDOW_MAX_US: i64 = 31 * DAY_US;
/// What is told when nobody says until when.
const WINDOW_US: i64 = 2 * DAY_US;
/// The most passes in one answer.
const ROWS_MAX: usize = 5000;
/// Element sets that one request goes by, for each satellite: more than any publisher makes in a month.
const SETS_MAX: u32 = 1000;
/// Requests that compute at once.
pub(super) const COMPUTING_MAX: usize = 4;

pub(super) fn bad(field: &str, message: impl Into<String>) -> Failure {
    Failure::field(ProblemKind::BadParameter, field, message)
}

/// Where the station stands.
pub(super) fn site(app: &App) -> Result<Site, Failure> {
    let place = app.state.identity.site.clone();
    place.ok_or_else(|| {
        Failure::new(
            ProblemKind::NoPlace,
            "The station does not know where it stands, so nothing can be said about passes. Set latitude_deg and \
             longitude_deg (and height_m) under [station] in the configuration, and start the server again.",
        )
    })
}

fn place(app: &App, site: &Site) -> Place {
    Place { name: app.state.identity.station.to_string(), station: site.place.clone() }
}

fn now(app: &App) -> UtcInstant {
    UtcInstant::from_unix_us(app.state.timer.now().utc.0)
}

/// Satellites with the elements that tell where they are in a window.
pub(super) struct Known {
    pub(super) objects: Vec<Object>,
    /// Asked for, and without elements.
    without: Vec<String>,
}

/// The one that is named, or all.
pub(super) async fn known(
    app: &App,
    named: Option<&str>,
    (start, stop): (UtcInstant, UtcInstant),
) -> Result<Known, Failure> {
    let asked: Vec<SatelliteId> = match named {
        Some(_) => vec![satellite(app, named)?],
        None => app.state.identity.satellites.iter().map(|known| known.id.clone()).collect(),
    };
    let mut known = Known { objects: Vec::new(), without: Vec::new() };
    for id in asked {
        let window = (start.unix_us(), stop.unix_us());
        let rows = app.state.store.elements_between(id.as_str(), window, SETS_MAX).await?;
        let mut sets = Vec::with_capacity(rows.len());
        for row in rows {
            let mut set = row.elements()?;
            // Known here by our own name, whatever its publisher calls it.
            set.name = Some(id.to_string());
            sets.push(set);
        }
        match Object::of_sets(sets) {
            Some(object) => known.objects.push(object),
            None => known.without.push(id.to_string()),
        }
    }
    if known.objects.is_empty() {
        return Err(Failure::new(
            ProblemKind::NoElements,
            format!(
                "There are no elements of {}. Add some with `gs-server elements add FILE` or POST /api/v1/elements, or \
                 name a source under [elements] in the configuration.",
                known.without.join(", ")
            ),
        ));
    }
    Ok(known)
}

/// Computes beside the event loop, when it is this request's turn.
pub(super) async fn compute<T: Send + 'static>(
    app: &App,
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    let died = || Failure::new(ProblemKind::Internal, "The computation ended; the server's log says more.");
    let turn = app.computing.clone().acquire_owned().await.map_err(|_| died())?;
    let done = tokio::task::spawn_blocking(move || {
        let result = work();
        drop(turn);
        result
    });
    done.await.map_err(|error| {
        tracing::error!(%error, "a computation for a request died");
        died()
    })?
}

/// A window of a request: from now, for two days, unless it says otherwise; 31 days at most.
fn window(
    app: &App,
    start: Option<FineTime>,
    stop: Option<FineTime>,
) -> Result<(UtcInstant, UtcInstant), Failure> {
    let start = start.map_or_else(|| now(app), instant);
    check_calendar("start", start)?;
    let stop = stop.map_or_else(|| start.plus_us(WINDOW_US), instant);
    check_calendar("stop", stop)?;
    if stop <= start {
        return Err(bad("stop", format!("must lie after start ({start}), found {stop}")));
    }
    if stop.us_since(start) > WINDOW_MAX_US {
        return Err(bad(
            "stop",
            format!("must lie at most 31 days after start ({start}), found {stop}: ask for the rest apart"),
        ));
    }
    Ok((start, stop))
}

pub(super) fn check_calendar(field: &str, at: UtcInstant) -> Result<(), Failure> {
    if (UtcInstant::EARLIEST..=UtcInstant::LATEST).contains(&at) {
        Ok(())
    } else {
        Err(bad(field, format!("must lie in the years 1900 to 2200, found {at}")))
    }
}

fn search(
    site: &Site,
    (start, stop): (UtcInstant, UtcInstant),
    min_elevation_deg: Option<f64>,
) -> Result<PassSearch, Failure> {
    let min_elevation_deg = min_elevation_deg.unwrap_or(site.min_elevation_deg);
    if !(-90.0..=90.0).contains(&min_elevation_deg) {
        return Err(bad(
            "min_elevation",
            format!("must lie from -90 to 90 degrees, found {min_elevation_deg}"),
        ));
    }
    Ok(PassSearch { orientation: site.orientation, ..PassSearch::new(start, stop, min_elevation_deg) })
}

fn frequency(asked_hz: Option<f64>) -> Result<Option<f64>, Failure> {
    match asked_hz {
        Some(hz) if !(1e5..=1e12).contains(&hz) => Err(bad(
            "frequency",
            format!("must lie from 100 kHz to 1 THz, in hertz, such as 435000000; found {hz}"),
        )),
        asked => Ok(asked),
    }
}

/// All passes of a search, bounded.
fn found(
    objects: &[Object],
    over: Place,
    search: &PassSearch,
    frequency_hz: Option<f64>,
) -> Result<Prediction, Failure> {
    let found = predict(objects, &[over], search, frequency_hz, |_| std::ops::ControlFlow::Continue(()));
    let too_many = || {
        bad(
            "stop",
            format!(
                "there are more than {ROWS_MAX} passes: choose a shorter window or a higher min_elevation"
            ),
        )
    };
    match found {
        Ok(found) if found.passes.len() > ROWS_MAX => Err(too_many()),
        Ok(found) => Ok(found),
        Err(PredictError::TooMany) => Err(too_many()),
        Err(PredictError::Search(error)) => Err(match error {
            SearchError::Elevation { .. } => bad("min_elevation", error.to_string()),
            _ => bad("start", error.to_string()),
        }),
        Err(error @ PredictError::Elements { .. }) => {
            tracing::error!(%error, "stored elements describe no orbit: {error}");
            Err(Failure::new(
                ProblemKind::Internal,
                "Stored elements describe no orbit; the server's log says more. Add newer ones.",
            ))
        }
    }
}
