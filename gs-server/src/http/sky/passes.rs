//! Passes to come and gone: computed, kept, and as a calendar.

use std::collections::BTreeMap;

use api::{ElementsUsed, FineTime, Page, PassKept, PassList, PlaceView};
use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::IntoResponse;
use serde::Deserialize;

use super::super::App;
use super::super::extract::{ListQuery, Query, number, paged};
use super::super::problem::Failure;
use super::{DAY_US, bad, compute, found, frequency, known, now, place, search, site, window};
use crate::sky::{fine_time, icalendar};
use crate::storage::{PassRow, StoreError};

/// How far a calendar reaches.
const CALENDAR_US: i64 = 14 * DAY_US;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct Asked {
    satellite: Option<String>,
    start: Option<FineTime>,
    stop: Option<FineTime>,
    min_elevation: Option<f64>,
    frequency: Option<f64>,
}

pub(in crate::http) async fn passes(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<PassList>, Failure> {
    let site = site(&app)?;
    let window = window(&app, asked.start, asked.stop)?;
    let search = search(&site, window, asked.min_elevation)?;
    let frequency_hz = frequency(asked.frequency)?;
    let known = known(&app, asked.satellite.as_deref(), window).await?;
    let over = place(&app, &site);
    let found =
        compute(&app, move || found(&known.objects, over, &search, frequency_hz).map(|found| (found, known)));
    let (found, known) = found.await?;
    Ok(Json(PassList {
        station: app.state.identity.station.to_string(),
        start: fine_time(search.start),
        stop: fine_time(search.stop),
        min_elevation_deg: search.min_elevation_deg,
        frequency_hz,
        ut1_minus_utc_s: site.orientation.ut1_minus_utc_s(),
        place: Some(PlaceView {
            latitude_deg: site.place.latitude_deg(),
            longitude_deg: site.place.longitude_deg(),
            height_m: site.place.height_m(),
            horizon_deg: site.place.mask().points().iter().map(|&(azimuth, up)| [azimuth, up]).collect(),
        }),
        passes: found.passes,
        gaps: found.gaps,
        without_elements: known.without,
    }))
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct AskedCalendar {
    satellite: Option<String>,
    min_elevation: Option<f64>,
}

/// The pass that lasts and those of the next two weeks.
pub(in crate::http) async fn calendar(
    State(app): State<App>,
    Query(asked): Query<AskedCalendar>,
) -> Result<impl IntoResponse, Failure> {
    let site = site(&app)?;
    let now = now(&app);
    // A pass that lasts is whole: else its event would begin anew at each refresh.
    let window = (now.plus_us(-DAY_US), now.plus_us(CALENDAR_US));
    let search = search(&site, window, asked.min_elevation)?;
    let known = known(&app, asked.satellite.as_deref(), window).await?;
    let over = place(&app, &site);
    let name = match &asked.satellite {
        Some(satellite) => format!("{satellite} over {}", over.name),
        None => format!("Passes over {}", over.name),
    };
    let text = compute(&app, move || {
        let mut passes = found(&known.objects, over, &search, None)?.passes;
        passes.retain(|pass| pass.los > fine_time(now));
        Ok(icalendar(&passes, &name, fine_time(now)))
    });
    let headers = [
        (header::CONTENT_TYPE, "text/calendar; charset=utf-8"),
        (header::CONTENT_DISPOSITION, "inline; filename=\"passes.ics\""),
    ];
    Ok((headers, text.await?))
}

pub(in crate::http) async fn history(
    State(app): State<App>,
    Query(query): Query<ListQuery>,
) -> Result<Json<Page<PassKept>>, Failure> {
    let (scope, page) = (query.scope()?, query.page()?);
    if scope.link.is_some() {
        return Err(bad("link", "a pass is over a station, not over a link: ask by satellite or station"));
    }
    let store = &app.state.store;
    let mut epochs = BTreeMap::new();
    let mut items = Vec::new();
    for row in store.passes(&scope, &page).await? {
        let mut elements = Vec::new();
        for used in store.pass_elements(row.id).await? {
            let epoch_us = match epochs.get(&used.elements) {
                Some(epoch_us) => *epoch_us,
                None => {
                    let set = store.element_set(used.elements).await?;
                    let missing = || StoreError::damaged(format!("pass {}: its elements are gone", row.id));
                    let epoch_us = set.ok_or_else(missing)?.epoch_us;
                    epochs.insert(used.elements, epoch_us);
                    epoch_us
                }
            };
            elements.push(ElementsUsed {
                id: number(used.elements),
                from: FineTime::from_unix_us(used.from_us),
                epoch: FineTime::from_unix_us(epoch_us),
            });
        }
        items.push(kept(row, elements));
    }
    Ok(Json(paged(items, &page, |pass| pass.id)))
}

fn kept(row: PassRow, elements: Vec<ElementsUsed>) -> PassKept {
    PassKept {
        id: number(row.id),
        satellite: row.satellite,
        station: row.station,
        aos: FineTime::from_unix_us(row.aos_at_us),
        tca: FineTime::from_unix_us(row.tca_at_us),
        los: row.los_at_us.map(FineTime::from_unix_us),
        max_elevation_deg: row.max_elevation_deg,
        ended_at: row.ended_at_us.map(FineTime::from_unix_us),
        elements,
    }
}
