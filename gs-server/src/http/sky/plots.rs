//! Passes as pictures.

use api::{FineTime, ProblemKind};
use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;
use serde::Deserialize;

use super::super::App;
use super::super::extract::{Query, satellite};
use super::super::problem::Failure;
use super::{DAY_US, bad, check_calendar, compute, found, known, now, place, search, site, window};
use crate::sky::{
    Object, PlotForm, Theme, Timeline, fine_time, instant, plot_pass_at, timeline_svg_of_width,
};

/// How far ahead a pass is sought for its plot.
const AHEAD_US: i64 = 14 * DAY_US;
const WIDTH_PX: std::ops::RangeInclusive<u32> = 280..=4000;

fn drawn(svg: String) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "image/svg+xml")], svg)
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct AskedSky {
    satellite: Option<String>,
    at: Option<FineTime>,
    min_elevation: Option<f64>,
    #[serde(default)]
    form: PlotForm,
    #[serde(default)]
    theme: Theme,
}

/// The pass that lasts at the instant, or the first one after it.
pub(in crate::http) async fn sky(
    State(app): State<App>,
    Query(asked): Query<AskedSky>,
) -> Result<impl IntoResponse, Failure> {
    let site = site(&app)?;
    let satellite = satellite(&app, asked.satellite.as_deref())?;
    let at = asked.at.map_or_else(|| now(&app), instant);
    check_calendar("at", at)?;
    // A pass that lasts is whole.
    let window = (at.plus_us(-DAY_US), at.plus_us(AHEAD_US));
    let search = search(&site, window, asked.min_elevation)?;
    let known = known(&app, Some(satellite.as_str()), window).await?;
    let over = place(&app, &site);
    let svg = compute(&app, move || {
        let found = found(&known.objects, over.clone(), &search, None)?;
        let pass = found.passes.iter().find(|pass| pass.los > fine_time(at)).ok_or_else(|| {
            let height = search.min_elevation_deg;
            let why = found.gaps.last().map_or_else(
                || format!("it does not rise above {height} degrees within 14 days"),
                |gap| format!("its elements have no state from {}: {}", gap.from, gap.error),
            );
            Failure::new(ProblemKind::NotFound, format!("There is no pass of {satellite} after {at}: {why}."))
        })?;
        let sets = known.objects.iter().flat_map(Object::sets);
        let set = sets.rev().find(|set| fine_time(set.epoch) == pass.epoch);
        let picture = set.map(|set| plot_pass_at(pass, set, &over, search.orientation, at, asked.form));
        match picture {
            Some(Ok(svg)) => Ok(asked.theme.paint(&svg)),
            Some(Err(error)) => Err(Failure::new(
                ProblemKind::NotFound,
                format!("The pass of {satellite} cannot be drawn: {error}."),
            )),
            None => Err(Failure::new(ProblemKind::Internal, "The elements of the pass are gone.")),
        }
    });
    Ok(drawn(svg.await?))
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct AskedTimeline {
    satellite: Option<String>,
    start: Option<FineTime>,
    stop: Option<FineTime>,
    min_elevation: Option<f64>,
    width: Option<u32>,
    #[serde(default)]
    form: PlotForm,
    #[serde(default)]
    theme: Theme,
}

pub(in crate::http) async fn timeline(
    State(app): State<App>,
    Query(asked): Query<AskedTimeline>,
) -> Result<impl IntoResponse, Failure> {
    let site = site(&app)?;
    let window = window(&app, asked.start, asked.stop)?;
    let search = search(&site, window, asked.min_elevation)?;
    let width_px = asked.width.unwrap_or(1080);
    if !WIDTH_PX.contains(&width_px) {
        let (least, most) = (WIDTH_PX.start(), WIDTH_PX.end());
        return Err(bad("width", format!("must lie from {least} to {most} pixels, found {width_px}")));
    }
    let known = known(&app, asked.satellite.as_deref(), window).await?;
    let over = place(&app, &site);
    let svg = compute(&app, move || {
        let found = found(&known.objects, over, &search, None)?;
        let timeline = Timeline { start: search.start, stop: search.stop, passes: &found.passes };
        Ok(asked.theme.paint(&timeline_svg_of_width(&timeline, width_px, asked.form)))
    });
    Ok(drawn(svg.await?))
}
