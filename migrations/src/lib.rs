//! The schema of the station's database, step by step, and the machine that brings a file up to date.
//!
//! One folder per database: `sqlite/` and `postgres/`, with the same tables under the same numbers. A step that was released is never edited, because every database
//! remembers the checksum of the steps that made it; what changes comes as the next number.
//!
//! What it does **not** do: open a database, or go back a step. A program that meets a newer schema than it knows
//! must refuse it, see [`newest_sqlite`] and [`newest_postgres`].

#[cfg(feature = "cluster")]
pub mod cluster;
#[cfg(feature = "cluster")]
pub mod tables;

use sqlx::migrate::Migrator;

/// All steps for SQLite, in order.
pub static SQLITE: Migrator = sqlx::migrate!("./sqlite");

/// All steps for PostgreSQL, in order.
pub static POSTGRES: Migrator = sqlx::migrate!("./postgres");

/// The number of the newest step for SQLite that this program knows.
pub fn newest_sqlite() -> i64 {
    newest(&SQLITE)
}

/// The number of the newest step for PostgreSQL that this program knows.
pub fn newest_postgres() -> i64 {
    newest(&POSTGRES)
}

fn newest(steps: &Migrator) -> i64 {
    steps.iter().map(|step| step.version).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sqlx::Connection as _;
    use sqlx::sqlite::SqliteConnection;

    #[test]
    fn steps_are_numbered_without_gaps() {
        let steps = |steps: &Migrator| -> Vec<(i64, String)> {
            steps.iter().map(|step| (step.version, step.description.to_string())).collect()
        };
        let numbers: Vec<i64> = steps(&SQLITE).into_iter().map(|(number, _)| number).collect();
        assert_eq!(numbers, (1..=newest_sqlite()).collect::<Vec<_>>());
        assert_eq!(steps(&SQLITE), steps(&POSTGRES), "each step has a twin of the same number and name");
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
