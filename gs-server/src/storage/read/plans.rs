//! Plans and their runs.

use super::super::db::sql;
use super::super::{ConditionRow, PlanRow, RunRow, Store, StoreError};
use super::{List, Page, Scope, one};

/// How much was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HeardCounts {
    /// Frames.
    pub frames: i64,
    /// Chunks of images that came with them and were not held before.
    pub chunks: i64,
}

impl Store {
    /// Plans that were handed over, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn plans(&self, page: &Page) -> Result<Vec<PlanRow>, StoreError> {
        List::of::<PlanRow>().page(self, "id", page).await
    }

    /// One plan.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn plan(&self, id: i64) -> Result<Option<PlanRow>, StoreError> {
        one(self, "where id = ?", id).await
    }

    /// Runs of plans, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn runs(&self, scope: &Scope, page: &Page) -> Result<Vec<RunRow>, StoreError> {
        List::of::<RunRow>().scope("aos_at_us", scope).page(self, "id", page).await
    }

    /// One run.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn run(&self, id: i64) -> Result<Option<RunRow>, StoreError> {
        one(self, "where id = ?", id).await
    }

    /// What one station heard of one satellite between two instants, both included.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn heard_between(
        &self,
        satellite: &str,
        station: &str,
        from_us: i64,
        to_us: i64,
    ) -> Result<HeardCounts, StoreError> {
        let row = sql(
            "with heard as (select id from frames where satellite = ? and station = ? and heard_at_us between ? and ?)
             select (select count(*) from heard) as frames,
               (select count(*) from chunks where conflict = 0 and frame in (select id from heard)) as chunks",
        )
        .bind(satellite)
        .bind(station)
        .bind(from_us)
        .bind(to_us)
        .fetch_one(&self.0.readers)
        .await?;
        Ok(HeardCounts { frames: row.try_get("frames")?, chunks: row.try_get("chunks")? })
    }

    /// What a command waits for besides contact; `None`: nothing.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn command_condition(&self, command: i64) -> Result<Option<ConditionRow>, StoreError> {
        one(self, "where command = ?", command).await
    }
}
