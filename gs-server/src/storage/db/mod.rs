//! One way to ask two databases: SQLite in the data folder, or PostgreSQL.
//!
//! A [`Query`] is a text and its values. It is carried out [`On`] a connection, a transaction or a pool of either
//! database, through the native driver of each; a [`DbRow`] is read by the names of its columns. Statements are written
//! once: placeholders `?`, `?1` or `$1`, whole numbers and truth as 64 bits, and nothing that only one database knows.
//! What really differs (opening, beginning a transaction) says so by `match`.

mod many;
mod query;
mod value;

pub(in crate::storage) use many::{fitting, grouped, insert_rows, padded};
pub(in crate::storage) use query::{Builder, Query, sql};
pub(in crate::storage) use value::{DbRow, Value};

use sqlx::pool::PoolConnection;
use sqlx::postgres::PgPool;
use sqlx::sqlite::SqlitePool;
use sqlx::{Connection as _, PgConnection, Postgres, Sqlite, SqliteConnection, Transaction};

use super::StoreError;

/// A connection of its own.
pub(in crate::storage) enum Connection {
    Lite(SqliteConnection),
    Pg(Box<PgConnection>),
}

impl Connection {
    pub(in crate::storage) async fn close(self) -> Result<(), StoreError> {
        match self {
            Self::Lite(connection) => Ok(connection.close().await?),
            Self::Pg(connection) => Ok(connection.close().await?),
        }
    }
}

/// The connections of those who read.
#[derive(Clone)]
pub(in crate::storage) enum Pool {
    Lite(SqlitePool),
    Pg(PgPool),
}

impl Pool {
    /// A transaction that sees one state of the database.
    pub(in crate::storage) async fn begin(&self) -> Result<Reading, StoreError> {
        Ok(match self {
            Self::Lite(pool) => Reading::Lite(pool.begin().await?),
            Self::Pg(pool) => {
                Reading::Pg(pool.begin_with("begin isolation level repeatable read read only").await?)
            }
        })
    }

    pub(in crate::storage) async fn close(&self) {
        match self {
            Self::Lite(pool) => pool.close().await,
            Self::Pg(pool) => pool.close().await,
        }
    }
}

/// A transaction of a reader.
pub(in crate::storage) enum Reading {
    Lite(Transaction<'static, Sqlite>),
    Pg(Transaction<'static, Postgres>),
}

/// Where a query is carried out.
pub(in crate::storage) enum On<'a> {
    Lite(&'a mut SqliteConnection),
    LitePool(&'a SqlitePool),
    Pg(&'a mut PgConnection),
    PgPool(&'a PgPool),
}

impl<'a> From<&'a mut Connection> for On<'a> {
    fn from(connection: &'a mut Connection) -> Self {
        match connection {
            Connection::Lite(connection) => On::Lite(connection),
            Connection::Pg(connection) => On::Pg(connection),
        }
    }
}

impl<'a> From<&'a mut Reading> for On<'a> {
    fn from(reading: &'a mut Reading) -> Self {
        match reading {
            Reading::Lite(transaction) => On::Lite(transaction),
            Reading::Pg(transaction) => On::Pg(transaction),
        }
    }
}

impl<'a> From<&'a Pool> for On<'a> {
    fn from(pool: &'a Pool) -> Self {
        match pool {
            Pool::Lite(pool) => On::LitePool(pool),
            Pool::Pg(pool) => On::PgPool(pool),
        }
    }
}

impl<'a> From<&'a mut SqliteConnection> for On<'a> {
    fn from(connection: &'a mut SqliteConnection) -> Self {
        On::Lite(connection)
    }
}

impl<'a> From<&'a mut PgConnection> for On<'a> {
    fn from(connection: &'a mut PgConnection) -> Self {
        On::Pg(connection)
    }
}

impl<'a> From<&'a mut PoolConnection<Postgres>> for On<'a> {
    fn from(connection: &'a mut PoolConnection<Postgres>) -> Self {
        On::Pg(connection)
    }
}
