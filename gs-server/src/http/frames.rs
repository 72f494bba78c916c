//! `GET /api/v1/frames` and `/api/v1/frames/{id}`: what was heard, byte for byte.

use api::{FrameView, PacketView, Page, ReceptionView};
use axum::Json;
use axum::extract::State;
use protocol::{DownFrame, Downlink};

use super::App;
use super::extract::{Id, Query, list_query, number, paged, scope, small, time};
use super::problem::Failure;
use super::receptions;
use crate::storage::{FrameQuery, FrameRow, ReceptionRow};

list_query! { Asked { satellite: String, station: String, link: String, packet_type: u8 } }

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<Page<FrameView>>, Failure> {
    let page = asked.page()?;
    let query = FrameQuery {
        scope: scope(&asked.satellite, &asked.station, &asked.link, asked.during()?),
        packet_type: asked.packet_type,
        page,
    };
    let heard = app.state.store.frames(&query).await?;
    let ids: Vec<i64> = heard.iter().map(|heard| heard.frame.id).collect();
    let mut elsewhere = app.state.store.outside_of(&ids).await?;
    let views = heard.into_iter().map(|heard| {
        let others = elsewhere.remove(&heard.frame.id).unwrap_or_default();
        FrameView {
            heard_elsewhere: others.into_iter().map(receptions::view).collect(),
            ..view(&heard.frame, heard.receptions)
        }
    });
    let views = views.collect();
    Ok(Json(paged(views, &query.page, |frame: &FrameView| frame.id)))
}

pub(super) async fn get(State(app): State<App>, id: Id) -> Result<Json<FrameView>, Failure> {
    let heard = app.state.store.frame(id.row()).await?;
    let heard = heard.ok_or_else(|| Failure::no_such("frame", id.0))?;
    let mut frame = view(&heard.frame, heard.receptions);
    let others = app.state.store.outside_of(&[heard.frame.id]).await?.remove(&heard.frame.id);
    frame.heard_elsewhere = others.unwrap_or_default().into_iter().map(receptions::view).collect();
    match decode(&heard.frame.bytes) {
        Ok(packet) => frame.packet = Some(packet),
        Err(why) => frame.undecoded = Some(why),
    }
    Ok(Json(frame))
}

fn decode(bytes: &[u8]) -> Result<PacketView, String> {
    let frame = DownFrame::parse(bytes).map_err(|error| error.to_string())?;
    frame.packet().map(|packet| PacketView::from_packet(&packet)).map_err(|error| error.to_string())
}

/// A frame as the wire has it, not decoded.
pub(super) fn view(row: &FrameRow, receptions: Vec<ReceptionRow>) -> FrameView {
    let packet_type = row.packet_type.map(small::<u8>);
    FrameView {
        id: number(row.id),
        satellite: row.satellite.clone(),
        station: row.station.clone(),
        link: row.link.clone(),
        heard_at: time(row.heard_at_us),
        form: row.form.clone(),
        packet_type,
        packet_name: packet_type.and_then(Downlink::name_of).map(str::to_owned),
        tag: row.tag.map(small),
        nested: row.nested,
        length: u32::try_from(row.bytes.len()).unwrap_or(u32::MAX),
        hex: hex::encode(&row.bytes),
        packet: None,
        undecoded: None,
        receptions: receptions.into_iter().map(reception).collect(),
        heard_elsewhere: Vec::new(),
    }
}

fn reception(row: ReceptionRow) -> ReceptionView {
    ReceptionView {
        satellite: row.satellite,
        station: row.station,
        link: row.link,
        source: row.source,
        received_at: time(row.received_at_us),
        rssi_dbm: row.rssi_dbm.map(small),
    }
}
