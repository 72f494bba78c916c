//! `/api/v1/receivers` and `/api/v1/ears/ways`: who hears the satellite, and how the ways in over the network work.

use api::{Page, ReceiverView, Time, WayView};
use axum::Json;
use axum::extract::State;
use serde::Deserialize;

use super::App;
use super::extract::{Query, during, time, whole};
use super::problem::Failure;
use crate::storage::{Receiver, ReceiversQuery};

/// What is looked back at unless somebody says otherwise, microseconds: 30 days.
const BACK_US: i64 = 30 * 86_400_000_000;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Asked {
    satellite: Option<String>,
    start: Option<Time>,
    stop: Option<Time>,
}

/// How each way stands.
pub(super) async fn ways(State(app): State<App>) -> Json<Page<WayView>> {
    Json(whole(app.state.ways.views()))
}

/// Receivers, those first that heard last; then boards of one's own that heard nothing yet.
pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<Page<ReceiverView>>, Failure> {
    let mut during = during(asked.start, asked.stop)?;
    if asked.start.is_none() && asked.stop.is_none() {
        during.start_us = Some(app.state.timer.now().utc.0 - BACK_US);
    }
    let query = ReceiversQuery { satellite: asked.satellite, during };
    let mut views: Vec<ReceiverView> =
        app.state.store.receivers(&query).await?.into_iter().map(view).collect();
    for (id, about, board) in app.state.ways.boards() {
        if let Some(known) = views.iter_mut().find(|known| known.id == id) {
            known.board = Some(board);
            continue;
        }
        let mut silent =
            view(Receiver { id, name: Some(about.station), place: about.place, ..Receiver::default() });
        (silent.first_heard_at, silent.last_heard_at) = (None, None);
        silent.board = Some(board);
        views.push(silent);
    }
    Ok(Json(whole(views)))
}

fn view(receiver: Receiver) -> ReceiverView {
    ReceiverView {
        id: receiver.id,
        name: receiver.name,
        sources: receiver.sources,
        latitude_deg: receiver.place.map(|place| place.0),
        longitude_deg: receiver.place.map(|place| place.1),
        frames: receiver.frames,
        without_frame: receiver.without_frame,
        first_heard_at: Some(time(receiver.first_us)),
        last_heard_at: Some(time(receiver.last_us)),
        median_snr_db: receiver.median_snr_db,
        best_rssi_dbm: receiver.best_rssi_dbm,
        board: None,
    }
}
