//! Elements, and passes with the elements they used.

use super::super::{ElementsRow, PassElementsRow, PassRow, Store, StoreError};
use super::{List, Page, Scope, all, one};

impl Store {
    /// Element sets, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn elements(&self, scope: &Scope, page: &Page) -> Result<Vec<ElementsRow>, StoreError> {
        List::of::<ElementsRow>().scope(scope).page(self, "id", page).await
    }

    /// One set of elements.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn element_set(&self, id: i64) -> Result<Option<ElementsRow>, StoreError> {
        one(self, "where id = ?", id).await
    }

    /// Passes that began, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn passes(&self, scope: &Scope, page: &Page) -> Result<Vec<PassRow>, StoreError> {
        List::of::<PassRow>().scope(scope).page(self, "id", page).await
    }

    /// What a pass used, in order of time.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn pass_elements(&self, pass: i64) -> Result<Vec<PassElementsRow>, StoreError> {
        all(self, "where pass = ? order by id", pass).await
    }
}
