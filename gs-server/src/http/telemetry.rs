//! `GET /api/v1/telemetry`, `/telemetry/latest` and `/parameters`: values over time.

use std::collections::BTreeMap;

use api::{Bucket, LatestValue, Page, ParameterView, ProblemKind, Sample, TelemetryPage, Time};
use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use serde::Deserialize;

use super::App;
use super::conditional;
use super::extract::{Query, number, satellite, time, whole};
use super::problem::Failure;
use crate::storage::{self, Samples, TelemetryQuery};

/// The most values or buckets in one answer.
const POINTS_MAX: u32 = 10_000;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Asked {
    parameter: String,
    satellite: Option<String>,
    start: Option<Time>,
    stop: Option<Time>,
    max_points: Option<u32>,
}

pub(super) async fn series(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<TelemetryPage>, Failure> {
    let satellite = satellite(&app, asked.satellite.as_deref())?;
    let wrong = |field, message: String| Failure::field(ProblemKind::BadParameter, field, message);
    let max_points = match asked.max_points {
        None => 1000,
        Some(points @ 1..=POINTS_MAX) => points,
        Some(points) => {
            return Err(wrong("max_points", format!("must lie from 1 to {POINTS_MAX}, found {points}")));
        }
    };
    if let (Some(start), Some(stop)) = (asked.start, asked.stop)
        && start >= stop
    {
        return Err(wrong("stop", format!("must lie after start ({start}), found {stop}")));
    }
    let query = TelemetryQuery {
        satellite: satellite.to_string(),
        parameter: asked.parameter.clone(),
        start_us: asked.start.map_or(i64::MIN, Time::unix_us),
        stop_us: asked.stop.map_or(i64::MAX, Time::unix_us),
        max_points,
    };
    let Some(series) = app.state.store.telemetry(&query).await? else {
        return Err(Failure::new(
            ProblemKind::NotFound,
            format!(
                "{satellite} was never heard to have this parameter; /api/v1/parameters lists those it has."
            ),
        ));
    };
    let (samples, buckets) = match series.samples {
        Samples::Raw(samples) => (samples.iter().map(sample).collect(), Vec::new()),
        Samples::Buckets(buckets) => (Vec::new(), buckets.iter().map(bucket).collect()),
    };
    Ok(Json(TelemetryPage {
        parameter: series.parameter.name,
        unit: series.parameter.unit,
        satellite: series.parameter.satellite,
        start: asked.start,
        stop: asked.stop,
        decimated: !buckets.is_empty(),
        samples,
        buckets,
    }))
}

fn sample(sample: &storage::Sample) -> Sample {
    Sample { at: time(sample.at_us), value: sample.value, frame: number(sample.frame) }
}

fn bucket(bucket: &storage::Bucket) -> Bucket {
    Bucket {
        start: time(bucket.start_us),
        stop: time(bucket.stop_us),
        min: bucket.min,
        max: bucket.max,
        avg: bucket.mean,
        count: number(bucket.count),
        invalid: number(bucket.invalid),
        last: sample(&bucket.last),
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AskedLatest {
    satellite: Option<String>,
}

pub(super) async fn latest(
    State(app): State<App>,
    Query(asked): Query<AskedLatest>,
    headers: HeaderMap,
) -> Result<Response, Failure> {
    let satellite = satellite(&app, asked.satellite.as_deref())?;
    let latest = app.state.store.latest(satellite.as_str()).await?;
    // The values of one packet share their frame: few frames name station and link for all of them.
    let mut routes = BTreeMap::new();
    for value in &latest {
        if let std::collections::btree_map::Entry::Vacant(place) = routes.entry(value.sample.frame) {
            let heard = app.state.store.frame(value.sample.frame).await?;
            place.insert(heard.map(|heard| (heard.frame.station, heard.frame.link)).unwrap_or_default());
        }
    }
    let views: Vec<LatestValue> = latest
        .into_iter()
        .map(|value| {
            let (station, link) = routes.get(&value.sample.frame).cloned().unwrap_or_default();
            LatestValue {
                parameter: value.parameter.name,
                unit: value.parameter.unit,
                value: value.sample.value,
                at: time(value.sample.at_us),
                frame: number(value.sample.frame),
                satellite: value.parameter.satellite,
                station,
                link,
            }
        })
        .collect();
    conditional::json(&whole(views), &headers)
}

pub(super) async fn parameters(State(app): State<App>) -> Result<Json<Page<ParameterView>>, Failure> {
    let rows = app.state.store.parameters().await?;
    let views = rows.into_iter().map(|row| ParameterView {
        parameter: row.name,
        unit: row.unit,
        satellite: row.satellite,
    });
    Ok(Json(whole(views.collect())))
}
