//! What may go: values derived from raw frames, which `redecode` makes again. Nothing else ever does.

use super::db::sql;
use super::{Store, StoreError};

impl Store {
    /// Removes values older than this (microseconds since 1970), at most so many; how many went.
    ///
    /// A small transaction, so that a batch that waits for it waits for milliseconds.
    ///
    /// # Errors
    /// [`StoreError`] when the database does not take it; nothing went then.
    pub async fn remove_telemetry(&self, before_us: i64, at_most: u32) -> Result<u64, StoreError> {
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let result = sql("delete from telemetry where (parameter, at_us, frame) in (
               select t.parameter, t.at_us, t.frame from parameters p
               join telemetry t on t.parameter = p.id and t.at_us < $1 limit $2)")
        .bind(before_us)
        .bind(i64::from(at_most))
        .execute(&mut connection)
        .await;
        writer.end(connection, result).await
    }
}
