//! Elements, and passes with the elements they used.

use super::super::db::sql;
use super::super::row::{Row as _, select};
use super::super::{ElementsRow, PassElementsRow, PassRow, Store, StoreError};
use super::{List, Page, Scope, all, one};

impl Store {
    /// Element sets, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn elements(&self, scope: &Scope, page: &Page) -> Result<Vec<ElementsRow>, StoreError> {
        List::of::<ElementsRow>().scope("added_at_us", scope).page(self, "id", page).await
    }

    /// One set of elements.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn element_set(&self, id: i64) -> Result<Option<ElementsRow>, StoreError> {
        one(self, "where id = ?", id).await
    }

    /// The element sets that tell where a satellite is between two instants, by epoch: the newest at or before the
    /// first, those up to the second, and when there is none of these the first one after; at most `limit`, the newest.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn elements_between(
        &self,
        satellite: &str,
        (from_us, until_us): (i64, i64),
        limit: u32,
    ) -> Result<Vec<ElementsRow>, StoreError> {
        let condition = "where satellite = ?1
            and epoch_us >= coalesce(
                (select max(epoch_us) from elements where satellite = ?1 and epoch_us <= ?2), ?2)
            and (epoch_us <= ?3
                or epoch_us <= (select min(epoch_us) from elements where satellite = ?1))
            order by epoch_us desc, id desc limit ?4";
        let rows = sql(select::<ElementsRow>(condition))
            .bind(satellite)
            .bind(from_us)
            .bind(until_us)
            .bind(i64::from(limit))
            .fetch_all(&self.0.readers)
            .await?;
        rows.iter().rev().map(ElementsRow::read).collect()
    }

    /// Passes that began, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn passes(&self, scope: &Scope, page: &Page) -> Result<Vec<PassRow>, StoreError> {
        List::of::<PassRow>().scope("aos_at_us", scope).page(self, "id", page).await
    }

    /// What a pass used, in order of time.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn pass_elements(&self, pass: i64) -> Result<Vec<PassElementsRow>, StoreError> {
        all(self, "where pass = ? order by id", pass).await
    }
}
