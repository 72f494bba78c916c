//! Plans and their runs.

use super::super::{ConditionRow, PlanRow, RunRow, Store, StoreError};
use super::{List, Page, Scope, one};

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
        List::of::<RunRow>().scope(scope).page(self, "id", page).await
    }

    /// One run.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn run(&self, id: i64) -> Result<Option<RunRow>, StoreError> {
        one(self, "where id = ?", id).await
    }

    /// What a command waits for besides contact; `None`: nothing.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn command_condition(&self, command: i64) -> Result<Option<ConditionRow>, StoreError> {
        one(self, "where command = ?", command).await
    }
}
