//! What other servers committed, told by the database at the commit.

use sqlx::postgres::PgListener;

use crate::storage::db::Pool;
use crate::storage::{EventQuery, Page, Store, StoreError, StoredEvent};

/// The channel on which a commit says `number first count`: whose events, the place of the first, and how many.
pub(super) const CHANNEL: &str = "ground_events";

/// Events read at once.
const PAGE: u32 = 500;

/// Follows what the other stations on the same database commit.
pub struct Others {
    store: Store,
    listener: PgListener,
    /// Everything up to here was told or is ours.
    last: i64,
}

impl Store {
    /// Follows the other stations from this place of the events on; `None` when the database is ours alone.
    ///
    /// # Errors
    /// [`StoreError`] when the database does not answer.
    pub async fn others(&self, after: i64) -> Result<Option<Others>, StoreError> {
        let Pool::Pg(pool) = &self.0.readers else { return Ok(None) };
        let mut listener = PgListener::connect_with(pool).await?;
        listener.listen(CHANNEL).await?;
        Ok(Some(Others { store: self.clone(), listener, last: after }))
    }
}

impl Others {
    /// How far it has come: where to begin again after an error.
    pub fn place(&self) -> i64 {
        self.last
    }

    /// Waits until another server has committed events.
    ///
    /// # Errors
    /// [`StoreError::Away`] when the connection is lost: what is committed meanwhile is not told.
    pub async fn wait(&mut self) -> Result<(), StoreError> {
        loop {
            match self.listener.try_recv().await? {
                Some(told) => {
                    let mut words = told.payload().split(' ').map(|word| word.parse::<i64>().ok());
                    match (words.next().flatten(), words.next().flatten(), words.next().flatten()) {
                        // Our own, and nothing between.
                        (Some(number), Some(first), Some(count))
                            if number == self.store.0.number && first == self.last + 1 =>
                        {
                            self.last += count;
                        }
                        _ => return Ok(()),
                    }
                }
                None => return Err(StoreError::away("the connection that listens was lost")),
            }
        }
    }

    /// The next events after the last that were told, in order; those of this station are among them. Empty: no more.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn read(&mut self) -> Result<Vec<StoredEvent>, StoreError> {
        let page = Page { after: Some(self.last), before: None, limit: PAGE };
        let events = self.store.events(&EventQuery { page, ..EventQuery::default() }).await?;
        if let Some(newest) = events.last() {
            self.last = newest.sequence;
        }
        Ok(events)
    }
}
