//! `/api/v1/elements`: what is held, what operators add, and the sources.

use api::{
    ElementsAdded, ElementsRequest, ElementsSource, FetchReport, HeldElements, Nothing, Page, ProblemKind,
};
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue};
use axum::response::{IntoResponse as _, Response};
use tle::formats::Checksums;

use super::App;
use super::conditional;
use super::extract::{ListQuery, Query, paged, satellite, whole};
use super::problem::Failure;
use super::write::{IDEMPOTENCY_REPLAYED, Write};
use crate::elements::door::{Adder, report};
use crate::elements::{AddError, Door, FetchError, NoMatch, SetsOfText, held, sets_of};

/// The field of the request that holds the elements.
const TEXT: &str = "text";

pub(super) async fn list(
    State(app): State<App>,
    Query(query): Query<ListQuery>,
    headers: HeaderMap,
) -> Result<Response, Failure> {
    let (scope, page) = (query.scope()?, query.page()?);
    if scope.link.is_some() {
        let message = "elements are of a satellite, not of a link: ask by satellite or station";
        return Err(Failure::field(ProblemKind::BadParameter, "link", message));
    }
    let state = &app.state;
    let now = state.timer.now().utc;
    let items = held(&state.store, state.elements.wanted(), &scope, &page, now).await?;
    // Age changes with every look; whoever holds these very sets, judged alike, holds the list.
    let which: Vec<_> = items.iter().map(|held| (held.id, held.in_use, held.level.as_str())).collect();
    let tag = conditional::tag_of(format!("{which:?}").as_bytes());
    let list: Page<HeldElements> = paged(items, &page, |held| held.id);
    let body = serde_json::to_vec(&list).map_err(|error| {
        tracing::error!(%error, "A list of elements could not be written.");
        Failure::new(ProblemKind::Internal, "The list cannot be written.")
    })?;
    Ok(conditional::tagged("application/json", body, &tag, &headers))
}

pub(super) async fn sources(State(app): State<App>) -> Json<Page<ElementsSource>> {
    Json(whole(app.state.elements.sources().as_ref().clone()))
}

/// Sets of one satellite; those of other objects in the same text are passed over.
pub(super) async fn add(State(app): State<App>, write: Write<ElementsRequest>) -> Result<Response, Failure> {
    let ElementsRequest { satellite: named, text, source, lenient } = &write.body;
    let id = satellite(&app, named.as_deref())?;
    let checksums = if *lenient { Checksums::Lenient } else { Checksums::Strict };
    let bad = |why: String| Failure::field(ProblemKind::BadArgument, TEXT, why);
    let read = SetsOfText::read(text.as_bytes(), checksums).map_err(|error| bad(error.to_string()))?;
    let wanted = app.state.elements.wanted().iter().find(|wanted| wanted.satellite == id);
    let wanted =
        wanted.ok_or_else(|| Failure::new(ProblemKind::Internal, "The satellite has no section."))?;
    let sets = sets_of(wanted, &read.sets, true).map_err(|why| bad(no_match(&why, &read)))?;
    let source = source.as_deref().unwrap_or("API");
    let (principal, key, digest) = write.who();
    let adder = Adder { principal, key, digest };
    let door = Door { engine: app.state.engine.clone(), store: app.state.store.clone() };
    let (added, replayed) = door.add(&id, &sets, source, &adder).await?;
    let mut response = Json::<ElementsAdded>(report(added, &read, sets.len(), source)).into_response();
    if replayed {
        response.headers_mut().insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
    }
    Ok(response)
}

/// The reason, and the first broken set when nothing else was in the text.
fn no_match(why: &NoMatch, read: &SetsOfText) -> String {
    match read.refused.first() {
        Some(refused) if read.sets.is_empty() => format!("no set can be used; {refused}"),
        _ => why.to_string(),
    }
}

/// Asks the sources of the configuration, within the bounds that they set. Asking again is harmless: no source is asked
/// twice within its minimum age.
pub(super) async fn fetch(
    State(app): State<App>,
    _write: Write<Nothing>,
) -> Result<Json<FetchReport>, Failure> {
    let report = app.state.elements.fetch().await.map_err(|error| {
        let kind = match error {
            FetchError::Busy => ProblemKind::Overloaded,
            FetchError::Stopping => ProblemKind::Stopping,
        };
        Failure::new(kind, error.to_string())
    })?;
    Ok(Json(report))
}

impl From<AddError> for Failure {
    fn from(error: AddError) -> Self {
        match error {
            AddError::Intent(error) => error.into(),
            AddError::Store(error) => error.into(),
        }
    }
}
