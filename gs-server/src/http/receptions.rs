//! `/api/v1/receptions` and `/api/v1/ears`: what others heard, what they are counted by, and reports that are handed in.

use std::sync::Arc;

use api::{EarView, ImportReport, ImportRequest, OutsideView, Page, ProblemKind, Time};
use axum::Json;
use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use mission::UtcUs;
use mission::reception::{Ear, Receiver, Refusal};

use super::App;
use super::extract::{Query, list_query, number, paged, satellite, small, time, whole};
use super::problem::Failure;
use super::write::Write;
use crate::ingest::formats::{self, Context, Format, Item, RECEPTION_MAX};
use crate::ingest::{EarsError, Outcome};
use crate::storage::{OutsideQuery, OutsideRow};

/// Where reports are, and where they are handed in.
pub(super) const PATH: &str = "/api/v1/receptions";
/// So many may hand reports in at once: what is read of a request takes memory.
pub(super) const AT_ONCE: usize = 1;
/// What a reception may be.
const KINDS: [&str; 4] = ["frame", "repairable", "damaged", "detection"];

list_query! { Asked { satellite: String, source: String, kind: String, original: bool } }

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<Page<OutsideView>>, Failure> {
    let wrong = |field, words: &str| {
        let message = format!("{field}: must be one of {words}");
        Err(Failure::field(ProblemKind::BadParameter, field, message))
    };
    if asked.source.as_deref().is_some_and(|source| Ear::from_name(source).is_none()) {
        return wrong("source", &Ear::ALL.map(Ear::name).join(", "));
    }
    if asked.kind.as_deref().is_some_and(|kind| !KINDS.contains(&kind)) {
        return wrong("kind", &KINDS.join(", "));
    }
    let (during, page) = (asked.during()?, asked.page()?);
    let query =
        OutsideQuery { satellite: asked.satellite, source: asked.source, kind: asked.kind, during, page };
    let rows = app.state.store.outside(&query).await?;
    let views = rows.into_iter().map(|(id, row)| {
        let original = row.original.clone().filter(|_| asked.original == Some(true));
        OutsideView {
            id: Some(number(id)),
            original: original.and_then(|original| String::from_utf8(original).ok()),
            ..view(row)
        }
    });
    Ok(Json(paged(views.collect(), &query.page, |view: &OutsideView| view.id.unwrap_or(0))))
}

/// What was counted, by ear.
pub(super) async fn ears(State(app): State<App>) -> Json<Page<EarView>> {
    let words = |counts: &std::collections::BTreeMap<&'static str, u64>| {
        counts.iter().map(|(word, count)| ((*word).to_owned(), *count)).collect()
    };
    let at = |at: Option<UtcUs>| at.map(|at| Time::from_unix_us(at.0));
    let counts = app.state.ears.counts();
    let views = counts.iter().map(|(ear, counts)| EarView {
        source: ear.name().to_owned(),
        taken: report(&counts.outcome),
        refused: words(&counts.refused),
        doubts: words(&counts.doubts),
        last_at: at(counts.last_at),
        last_new_at: at(counts.last_new_at),
    });
    Json(whole(views.collect()))
}

/// Before anything of the reports is read: whoever comes while there is no room comes again.
pub(super) async fn gate(State(app): State<App>, request: Request, next: Next) -> Response {
    match Arc::clone(&app.reports).try_acquire_owned() {
        Ok(_turn) => next.run(request).await,
        Err(_) => {
            app.state.ears.refuse(Ear::File, Refusal::NoRoom);
            let why = "Others are handing reports in: what the radio hears goes first. Send the same again in a second.";
            Failure::new(ProblemKind::Overloaded, why).into_response()
        }
    }
}

/// Takes reports in. The same reports again change nothing, under whatever idempotency key.
pub(super) async fn import(
    State(app): State<App>,
    write: Write<ImportRequest>,
) -> Result<Json<ImportReport>, Failure> {
    let ImportRequest { satellite: named, receiver, at, items } = write.into_body();
    let id = satellite(&app, named.as_deref())?;
    let mut context = Context::file(app.state.aliases.admission(&id, app.state.ears.now()));
    context.receiver = Receiver { id: receiver.clone(), name: receiver.clone(), ..Receiver::default() };
    context.at = at.map(|at| UtcUs(at.unix_us()));
    let mut found = Vec::new();
    for (place, item) in (1..).zip(items) {
        let bad = |field: &str, message: String| {
            Failure::field(ProblemKind::BadArgument, format!("items[{}].{field}", place - 1), message)
        };
        let format = Format::named(&item.format).ok_or_else(|| {
            bad("format", format!("'{}' is none of json, satnogs-csv, kiss, hex, raw", item.format))
        })?;
        let body = match (item.text, item.hex) {
            (Some(text), None) => text.into_bytes(),
            (None, Some(digits)) => hex::decode(digits).map_err(|error| bad("hex", error.to_string()))?,
            _ => return Err(bad("text", "one of text and hex must be there".into())),
        };
        let body = if body.len() > formats::PACKET_MAX.max(RECEPTION_MAX) {
            Err(Refusal::TooLong)
        } else {
            Ok(body)
        };
        let occurrence = item.occurrence.unwrap_or(1);
        let prefix = item.topic;
        if format == Format::Json {
            // What is inside is cut and bounded as in a file.
            let body = body.unwrap_or_default();
            for item in formats::Items::new(format, body.as_slice()) {
                let Ok(item) = item else { break };
                let prefix = prefix.clone().or(item.prefix.clone());
                formats::read(&Item { line: place, prefix, ..item }, &context, &mut found);
            }
        } else {
            formats::read(&Item { format, line: place, prefix, occurrence, body }, &context, &mut found);
        }
    }
    let outcome = app.state.ears.take(&id, Ear::File, found).await?;
    Ok(Json(report(&outcome)))
}

const fn report(outcome: &Outcome) -> ImportReport {
    ImportReport {
        frames: outcome.frames,
        merged: outcome.merged,
        without_frame: outcome.without_frame,
        repeated: outcome.repeated,
        refused: outcome.refused,
    }
}

/// A reception as it stands with its frame.
pub(super) fn view(row: OutsideRow) -> OutsideView {
    OutsideView {
        id: None,
        satellite: row.satellite,
        station: row.station,
        frame: row.frame.map(number),
        kind: row.kind,
        source: row.source,
        source_id: row.source_id,
        receiver: Some(row.receiver).filter(|receiver| !receiver.is_empty()),
        receiver_name: row.receiver_name,
        latitude_deg: row.latitude_deg,
        longitude_deg: row.longitude_deg,
        altitude_m: row.altitude_m,
        received_at: time(row.received_at_us),
        time_basis: row.time_basis,
        time_error_s: row.time_error_us.map(|us| us as f64 / 1e6),
        frequency_hz: row.frequency_hz,
        frequency_offset_hz: row.frequency_offset_hz,
        doppler_hz: row.doppler_hz,
        frequency_error_hz: row.frequency_error_hz,
        spreading_factor: row.spreading_factor.map(small),
        bandwidth_hz: row.bandwidth_hz,
        coding_rate: row.coding_rate.map(small),
        rssi_dbm: row.rssi_dbm,
        snr_db: row.snr_db,
        radio_crc: row.radio_crc,
        noisy: row.noisy,
        label: row.label,
        norad: row.norad.map(small),
        trim_bytes: small(row.trim_bytes),
        trim_bits: small(row.trim_bits),
        repaired_bit: row.repaired_bit.map(small),
        doubts: row.doubts.split_whitespace().map(str::to_owned).collect(),
        original: None,
    }
}

impl From<EarsError> for Failure {
    fn from(error: EarsError) -> Self {
        let kind = match &error {
            EarsError::NotTaken(mission::reception::NotTaken::Busy) => ProblemKind::Overloaded,
            EarsError::NotTaken(mission::reception::NotTaken::UnknownSatellite) => {
                ProblemKind::UnknownSatellite
            }
            EarsError::NotTaken(mission::reception::NotTaken::Stopping) | EarsError::Ending => {
                ProblemKind::Stopping
            }
            EarsError::Storage(_) => ProblemKind::StorageFailing,
        };
        Self::new(kind, error.to_string())
    }
}
