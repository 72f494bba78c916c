//! Questions to the station's memory: pages of rows, newest first or onwards from a place.
//!
//! Readers have connections of their own and never wait for the writer.

mod commands;
mod elsewhere;
mod events;
mod frames;
mod images;
mod plans;
mod reports;
mod sky;
mod summary;
mod telemetry;

pub use commands::{CommandLife, CommandNow, CommandQuery};
pub use events::{Counts, EventQuery};
pub use frames::{FrameQuery, Heard};
pub use images::{ChunkState, ImageBytes, ImageMap};
pub use plans::HeardCounts;
pub use reports::{ChunkCame, CommandThen, Span};
pub use summary::{EventCount, FrameCount};
pub use telemetry::{Bucket, LatestValue, Sample, Samples, Series, TelemetryQuery};

pub(super) use events::find_intent;

use super::db::{Builder, sql};
use super::row::Row;
use super::{Store, StoreError};

/// Which part of a list, by the id (or sequence number) of its rows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Page {
    /// Only rows behind this one, oldest first.
    pub after: Option<i64>,
    /// Only rows before this one, newest first. With `after`: those between, oldest first.
    pub before: Option<i64>,
    /// At most so many rows, 1 to 1000; 0 stands for 100.
    pub limit: u32,
}

impl Page {
    pub(in crate::storage) fn rows(&self) -> i64 {
        match self.limit {
            0 => 100,
            limit => i64::from(limit.min(1000)),
        }
    }
}

/// Whose rows.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Scope {
    /// Of this satellite.
    pub satellite: Option<String>,
    /// Of this station.
    pub station: Option<String>,
    /// Of this link.
    pub link: Option<String>,
    /// From when until when.
    pub during: During,
}

/// From when until when; no end where there is none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct During {
    /// Not before this, microseconds since 1970.
    pub start_us: Option<i64>,
    /// Before this.
    pub stop_us: Option<i64>,
}

impl During {
    /// Whether a moment lies within.
    pub fn holds(&self, at_us: i64) -> bool {
        self.start_us.is_none_or(|start_us| at_us >= start_us)
            && self.stop_us.is_none_or(|stop_us| at_us < stop_us)
    }
}

/// A list with conditions; values are bound, never written into the statement.
pub(super) struct List {
    pub(super) statement: Builder,
}

impl List {
    pub(super) fn of<R: Row>() -> Self {
        Self { statement: Builder::new(format!("{} where true", R::SELECT)) }
    }

    pub(super) fn equal(mut self, column: &'static str, value: Option<&str>) -> Self {
        if let Some(value) = value {
            self.statement.push(format_args!(" and {column} = ")).push_bind(value.to_owned());
        }
        self
    }

    fn equal_number(mut self, column: &'static str, value: Option<i64>) -> Self {
        if let Some(value) = value {
            self.statement.push(format_args!(" and {column} = ")).push_bind(value);
        }
        self
    }

    pub(super) fn any_of(mut self, column: &'static str, words: Option<Vec<&'static str>>) -> Self {
        if let Some(words) = words {
            self.statement.push(format_args!(" and {column} in ("));
            for (at, word) in words.into_iter().enumerate() {
                self.statement.push(if at == 0 { "" } else { ", " }).push_bind(word);
            }
            self.statement.push(")");
        }
        self
    }

    /// `at` is the column that says when.
    pub(super) fn scope(self, at: &'static str, scope: &Scope) -> Self {
        self.equal("satellite", scope.satellite.as_deref())
            .equal("station", scope.station.as_deref())
            .equal("link", scope.link.as_deref())
            .during(at, &scope.during)
    }

    /// `at` is the column that says when.
    pub(super) fn during(mut self, at: &'static str, during: &During) -> Self {
        if let Some(start_us) = during.start_us {
            self.statement.push(format_args!(" and {at} >= ")).push_bind(start_us);
        }
        if let Some(stop_us) = during.stop_us {
            self.statement.push(format_args!(" and {at} < ")).push_bind(stop_us);
        }
        self
    }

    /// The rows of the page, `id` being the column that numbers them.
    pub(super) async fn page<R: Row>(
        mut self,
        store: &Store,
        id: &'static str,
        page: &Page,
    ) -> Result<Vec<R>, StoreError> {
        if let Some(after) = page.after {
            self.statement.push(format_args!(" and {id} > ")).push_bind(after);
        }
        if let Some(before) = page.before {
            self.statement.push(format_args!(" and {id} < ")).push_bind(before);
        }
        let order = if page.after.is_some() { "asc" } else { "desc" };
        self.statement.push(format_args!(" order by {id} {order} limit ")).push_bind(page.rows());
        let rows = self.statement.build().fetch_all(&store.0.readers).await?;
        rows.iter().map(R::read).collect()
    }
}

/// At most one row.
pub(super) async fn one<R: Row>(
    store: &Store,
    condition: &'static str,
    id: i64,
) -> Result<Option<R>, StoreError> {
    let row = sql(super::row::select::<R>(condition)).bind(id).fetch_optional(&store.0.readers).await?;
    row.as_ref().map(R::read).transpose()
}

/// All rows that belong to something.
async fn all<R: Row>(store: &Store, condition: &'static str, id: i64) -> Result<Vec<R>, StoreError> {
    let rows = sql(super::row::select::<R>(condition)).bind(id).fetch_all(&store.0.readers).await?;
    rows.iter().map(R::read).collect()
}
