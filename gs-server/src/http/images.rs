//! `/api/v1/images`: pictures, which chunks of them are held, and the file itself.

use api::{ChunkMap, ImageView, Page};
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::response::Response;
use sha2::{Digest as _, Sha256};

use super::App;
use super::conditional;
use super::extract::{Id, ListQuery, Query, number, paged, small, time};
use super::problem::Failure;
use crate::storage::{ChunkState, ImageRow};

const COMPLETE: HeaderName = HeaderName::from_static("x-image-complete");
const CONTIGUOUS: HeaderName = HeaderName::from_static("x-image-contiguous-bytes");

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<ListQuery>,
) -> Result<Json<Page<ImageView>>, Failure> {
    let page = asked.page()?;
    let rows = app.state.store.images(&asked.scope()?, &page).await?;
    Ok(Json(paged(rows.into_iter().map(view).collect(), &page, |image: &ImageView| image.id)))
}

pub(super) async fn get(State(app): State<App>, id: Id) -> Result<Json<ImageView>, Failure> {
    let image = app.state.store.image(id.row()).await?;
    image.map(|image| Json(view(image.image))).ok_or_else(|| Failure::no_such("image", id.0))
}

pub(super) async fn chunks(State(app): State<App>, id: Id, headers: HeaderMap) -> Result<Response, Failure> {
    let image = app.state.store.image(id.row()).await?.ok_or_else(|| Failure::no_such("image", id.0))?;
    let letter = |chunk: &ChunkState| match (chunk.frame, chunk.conflicts.is_empty()) {
        (_, false) => '!',
        (Some(_), true) => '#',
        (None, true) => '.',
    };
    let count = |test: &dyn Fn(&ChunkState) -> bool| {
        small(image.chunks.iter().filter(|chunk| test(chunk)).count() as i64)
    };
    let map = ChunkMap {
        image: id.0,
        chunks: small(image.chunks.len() as i64),
        held: count(&|chunk| chunk.frame.is_some()),
        conflicts: count(&|chunk| !chunk.conflicts.is_empty()),
        map: image.chunks.iter().map(letter).collect(),
        frames: image.chunks.iter().map(|chunk| chunk.frame.map(number)).collect(),
    };
    conditional::json(&map, &headers)
}

/// The file as far as it is held: what is missing is zero. `x-image-complete` says whether anything is.
pub(super) async fn file(State(app): State<App>, id: Id, headers: HeaderMap) -> Result<Response, Failure> {
    let image =
        app.state.store.image_bytes(id.row()).await?.ok_or_else(|| Failure::no_such("image", id.0))?;
    let tag = format!("\"{}\"", hex::encode(Sha256::digest(&image.bytes)));
    let mut response = conditional::tagged("image/jpeg", image.bytes, &tag, &headers);
    let headers = response.headers_mut();
    headers.insert(COMPLETE, HeaderValue::from_static(if image.complete { "true" } else { "false" }));
    headers.insert(CONTIGUOUS, HeaderValue::from(image.contiguous));
    if let Ok(name) = HeaderValue::try_from(format!("inline; filename=\"image-{}.jpg\"", id.0)) {
        headers.insert(header::CONTENT_DISPOSITION, name);
    }
    Ok(response)
}

fn view(row: ImageRow) -> ImageView {
    ImageView {
        id: number(row.id),
        satellite: row.satellite,
        station: row.station,
        link: row.link,
        declared_by: number(row.declared_by),
        declared_at: time(row.declared_at_us),
        size_bytes: small(row.size_bytes),
        chunks: small(row.chunks),
        width_px: small(row.width_px),
        height_px: small(row.height_px),
        held: small(row.held),
        conflicts: small(row.conflicts),
        complete: row.completed_at_us.is_some(),
        completed_at: row.completed_at_us.map(time),
        sha256: row.sha256.map(hex::encode),
    }
}
