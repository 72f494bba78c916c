//! `/api/v1/downloads`: standing orders to bring an image home.

use api::{DownloadRequest, DownloadView, Nothing, Page};
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use mission::{DownloadId, Intent};

use super::App;
use super::commands::link;
use super::extract::{Id, ListQuery, Query, number, paged, satellite, small, time};
use super::problem::Failure;
use super::write::Write;
use crate::storage::DownloadRow;

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<ListQuery>,
) -> Result<Json<Page<DownloadView>>, Failure> {
    let page = asked.page()?;
    let rows = app.state.store.downloads(&asked.scope()?, &page).await?;
    Ok(Json(paged(rows.into_iter().map(view).collect(), &page, |download: &DownloadView| download.id)))
}

pub(super) async fn get(State(app): State<App>, id: Id) -> Result<Json<DownloadView>, Failure> {
    let row = app.state.store.download(id.row()).await?;
    row.map(|row| Json(view(row))).ok_or_else(|| Failure::no_such("download", id.0))
}

pub(super) async fn create(
    State(app): State<App>,
    write: Write<DownloadRequest>,
) -> Result<Response, Failure> {
    let satellite = satellite(&app, write.body.satellite.as_deref())?;
    let link = write.body.link.as_deref().map(link).transpose()?;
    write.submit(&app, Intent::Download { satellite, link }).await
}

pub(super) async fn cancel(
    State(app): State<App>,
    id: Id,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    write.submit(&app, Intent::CancelDownload(DownloadId(id.0))).await
}

pub(super) fn view(row: DownloadRow) -> DownloadView {
    DownloadView {
        id: number(row.id),
        satellite: row.satellite,
        station: row.station,
        link: row.link,
        image: row.image.map(number),
        principal: row.principal,
        state: row.state,
        created_at: time(row.created_at_us),
        requests: small(row.requests),
        chunks_requested: small(row.chunks_requested),
        chunks_bridged: small(row.chunks_bridged),
    }
}
