//! Where satellites stand at instants.

use api::{FineTime, LookList, ProblemKind};
use axum::Json;
use axum::extract::State;
use serde::Deserialize;
use tle::UtcInstant;

use super::super::App;
use super::super::extract::Query;
use super::super::problem::Failure;
use super::{bad, check_calendar, compute, frequency, known, now, place, site};
use crate::sky::{Looks, instant, look_at};

/// Instants of one request.
const INSTANTS_MAX: usize = 1000;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct Asked {
    satellite: Option<String>,
    at: Option<String>,
    frequency: Option<f64>,
}

pub(in crate::http) async fn look(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<LookList>, Failure> {
    let site = site(&app)?;
    let at = match &asked.at {
        None => vec![now(&app)],
        Some(text) => instants(text)?,
    };
    let frequency_hz = frequency(asked.frequency)?;
    let first = at.iter().copied().min().unwrap_or(UtcInstant::EARLIEST);
    let last = at.iter().copied().max().unwrap_or(first);
    let known = known(&app, asked.satellite.as_deref(), (first, last)).await?;
    let place = place(&app, &site);
    let orientation = site.orientation;
    let computed = compute(&app, move || {
        let places = [place];
        let looks =
            look_at(&Looks { objects: &known.objects, places: &places, at: &at, orientation, frequency_hz });
        let looks = looks.map_err(|error| {
            tracing::error!(%error, "stored elements describe no orbit: {error}");
            Failure::new(
                ProblemKind::Internal,
                "Stored elements describe no orbit; the server's log says more. Add newer ones.",
            )
        })?;
        Ok((looks, known.without))
    });
    let (looks, without_elements) = computed.await?;
    let ut1_minus_utc_s = orientation.ut1_minus_utc_s();
    Ok(Json(LookList { frequency_hz, ut1_minus_utc_s, looks, without_elements }))
}

fn instants(text: &str) -> Result<Vec<UtcInstant>, Failure> {
    let mut instants = Vec::new();
    for part in text.split(',') {
        if instants.len() == INSTANTS_MAX {
            return Err(bad("at", format!("more than {INSTANTS_MAX} instants: ask in several requests")));
        }
        let at: FineTime = part.trim().parse().map_err(|error| bad("at", format!("{error}")))?;
        let at = instant(at);
        check_calendar("at", at)?;
        instants.push(at);
    }
    Ok(instants)
}
