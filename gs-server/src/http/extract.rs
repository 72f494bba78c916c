//! Numbers in paths and parameters in queries, with problems instead of axum's own refusals.

use api::{Page, ProblemKind, Time};
use axum::extract::{FromRequestParts, RawPathParams};
use axum::http::request::Parts;
use mission::SatelliteId;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::App;
use super::problem::Failure;
use crate::storage;

/// The number in a path such as `/frames/{id}`.
pub(super) struct Id(pub(super) u64);

impl Id {
    /// As the archive counts; what does not fit cannot be there.
    pub(super) fn row(&self) -> i64 {
        i64::try_from(self.0).unwrap_or(i64::MAX)
    }
}

impl FromRequestParts<App> for Id {
    type Rejection = Failure;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Failure> {
        let Name(text) = Name::from_request_parts(parts, app).await?;
        text.parse().map(Self).map_err(|_| {
            let shown: String = text.chars().take(40).collect();
            Failure::field(ProblemKind::BadParameter, "id", format!("'{shown}' is no number"))
        })
    }
}

/// The name in a path such as `/links/{id}/arm`.
pub(super) struct Name(pub(super) String);

impl FromRequestParts<App> for Name {
    type Rejection = Failure;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self, Failure> {
        let params = RawPathParams::from_request_parts(parts, app)
            .await
            .map_err(|_| Failure::new(ProblemKind::BadParameter, "The path is not valid UTF-8."))?;
        let value = params.iter().next().map(|(_, value)| value.to_owned());
        value.map(Self).ok_or_else(|| Failure::new(ProblemKind::NotFound, "This path leads nowhere."))
    }
}

/// The parameters of a query; those nobody knows are refused.
pub(super) struct Query<T>(pub(super) T);

impl<T: DeserializeOwned> FromRequestParts<App> for Query<T> {
    type Rejection = Failure;

    async fn from_request_parts(parts: &mut Parts, _: &App) -> Result<Self, Failure> {
        axum::extract::Query::try_from_uri(&parts.uri).map(|query| Self(query.0)).map_err(|error| {
            use std::error::Error as _;
            let inner = error.source().map_or_else(|| error.body_text(), ToString::to_string);
            Failure::new(ProblemKind::BadParameter, format!("The query is wrong: {inner}."))
        })
    }
}

/// The parameters of a list: these, and those that every list takes (from when until when, and which part).
macro_rules! list_query {
    ($(#[$meta:meta])* $name:ident { $($(#[$about:meta])* $field:ident: $type:ty),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub(super) struct $name {
            $($(#[$about])* $field: Option<$type>,)*
            start: Option<api::Time>,
            stop: Option<api::Time>,
            after: Option<i64>,
            before: Option<i64>,
            limit: Option<u32>,
        }

        impl $name {
            pub(super) fn during(&self) -> Result<$crate::storage::During, $crate::http::problem::Failure> {
                $crate::http::extract::during(self.start, self.stop)
            }

            pub(super) fn page(&self) -> Result<$crate::storage::Page, $crate::http::problem::Failure> {
                $crate::http::extract::page(self.after, self.before, self.limit)
            }
        }
    };
}

pub(super) use list_query;

list_query! {
    /// Whose, and which part.
    ListQuery { satellite: String, station: String, link: String }
}

/// Rows of a page, when nobody says how many.
const LIMIT: u32 = 100;
/// Rows of a page at most.
const LIMIT_MAX: u32 = 1000;

pub(super) fn limit(asked: Option<u32>) -> Result<u32, Failure> {
    match asked {
        None => Ok(LIMIT),
        Some(limit @ 1..=LIMIT_MAX) => Ok(limit),
        Some(limit) => Err(Failure::field(
            ProblemKind::BadParameter,
            "limit",
            format!("must lie from 1 to {LIMIT_MAX}, found {limit}"),
        )),
    }
}

impl ListQuery {
    pub(super) fn scope(&self) -> Result<storage::Scope, Failure> {
        Ok(scope(&self.satellite, &self.station, &self.link, self.during()?))
    }
}

/// From when until when: what a list that comes whole takes.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Within {
    start: Option<Time>,
    stop: Option<Time>,
}

impl Within {
    pub(super) fn during(&self) -> Result<storage::During, Failure> {
        during(self.start, self.stop)
    }
}

pub(super) fn during(start: Option<Time>, stop: Option<Time>) -> Result<storage::During, Failure> {
    if let (Some(start), Some(stop)) = (start, stop)
        && start >= stop
    {
        let message = format!("must lie after start ({start}), found {stop}");
        return Err(Failure::field(ProblemKind::BadParameter, "stop", message));
    }
    Ok(storage::During { start_us: start.map(Time::unix_us), stop_us: stop.map(Time::unix_us) })
}

pub(super) fn scope(
    satellite: &Option<String>,
    station: &Option<String>,
    link: &Option<String>,
    during: storage::During,
) -> storage::Scope {
    storage::Scope { satellite: satellite.clone(), station: station.clone(), link: link.clone(), during }
}

pub(super) fn page(
    after: Option<i64>,
    before: Option<i64>,
    asked: Option<u32>,
) -> Result<storage::Page, Failure> {
    Ok(storage::Page { after, before, limit: limit(asked)? })
}

/// A page of views, and the cursor of the next when this one is full.
pub(super) fn paged<T>(items: Vec<T>, page: &storage::Page, id: impl Fn(&T) -> u64) -> Page<T> {
    let full = items.len() >= page.limit as usize;
    let next = items.last().filter(|_| full).map(id);
    Page { items, next }
}

/// A list that comes whole.
pub(super) fn whole<T>(items: Vec<T>) -> Page<T> {
    Page { items, next: None }
}

/// The satellite that is meant: the one named, or the only one.
pub(super) fn satellite(app: &App, named: Option<&str>) -> Result<SatelliteId, Failure> {
    let known = || {
        let names: Vec<&str> = app.state.identity.satellites.iter().map(|known| known.id.as_str()).collect();
        names.join(", ")
    };
    match (named, app.state.identity.satellites.as_slice()) {
        (None, [only]) => Ok(only.id.clone()),
        (None, _) => Err(Failure::field(
            ProblemKind::UnknownSatellite,
            "satellite",
            format!("name one of: {}", known()),
        )),
        (Some(name), satellites) => satellites
            .iter()
            .find_map(|known| (known.id.as_str() == name).then(|| known.id.clone()))
            .ok_or_else(|| {
                let shown: String = name.chars().take(40).collect();
                Failure::field(
                    ProblemKind::UnknownSatellite,
                    "satellite",
                    format!("'{shown}' is not in the configuration; there is {}", known()),
                )
            }),
    }
}

/// A number of the archive as the wire has it; ids are never negative.
pub(super) fn number(value: i64) -> u64 {
    u64::try_from(value).unwrap_or(0)
}

/// A number of the archive that its column bounds.
pub(super) fn small<T: TryFrom<i64> + Default>(value: i64) -> T {
    T::try_from(value).unwrap_or_default()
}

pub(super) fn time(us: i64) -> Time {
    Time::from_unix_us(us)
}
