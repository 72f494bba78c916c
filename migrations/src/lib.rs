//! The schema of the station's database, step by step, and the machine that brings a file up to date.
//!
//! One folder per database: `sqlite/` today. A step that was released is never edited, because every database
//! remembers the checksum of the steps that made it; what changes comes as the next number.
//!
//! What it does **not** do: open a database, or go back a step. A program that meets a newer schema than it knows
//! must refuse it, see [`newest_sqlite`].

use sqlx::migrate::Migrator;

/// All steps for SQLite, in order.
pub static SQLITE: Migrator = sqlx::migrate!("./sqlite");

/// The number of the newest step that this program knows.
pub fn newest_sqlite() -> i64 {
    SQLITE.iter().map(|step| step.version).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sqlx::Connection as _;
    use sqlx::sqlite::SqliteConnection;

    #[test]
    fn steps_are_numbered_without_gaps() {
        let numbers: Vec<i64> = SQLITE.iter().map(|step| step.version).collect();
        assert_eq!(numbers, (1..=newest_sqlite()).collect::<Vec<_>>());
    }

    #[test]
    fn every_table_is_strict() {
        let runtime = tokio_runtime();
        runtime.block_on(async {
            let mut db = SqliteConnection::connect("sqlite::memory:").await.unwrap();
            SQLITE.run(&mut db).await.unwrap();
            SQLITE.run(&mut db).await.unwrap();
            let loose: Vec<String> = sqlx::query_scalar(
                "select name from pragma_table_list
                 where schema = 'main' and type = 'table' and strict = 0
                   and name not like 'sqlite~_%' escape '~' and name <> '_sqlx_migrations'",
            )
            .fetch_all(&mut db)
            .await
            .unwrap();
            assert_eq!(loose, [""; 0]);
        });
    }

    fn tokio_runtime() -> tokio::runtime::Runtime {
        tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap()
    }
}
