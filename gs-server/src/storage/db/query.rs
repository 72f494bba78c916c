//! A statement and its values, for whichever database.

use std::borrow::Cow;
use std::fmt::{Display, Write as _};

use futures_util::stream::{BoxStream, StreamExt as _};
use sqlx::{AssertSqlSafe, Postgres, SqlSafeStr, SqlStr, Sqlite};

use super::value::{Column, DbRow, Value};
use super::{On, Pool};
use crate::storage::StoreError;

/// A statement. As with `sqlx::query`, only text that is written in the program is taken; values are bound.
pub(in crate::storage) fn sql(text: impl SqlSafeStr) -> Query {
    Query { text: text.into_sql_str(), values: Vec::new() }
}

/// A statement on its way to a database.
#[must_use]
pub(in crate::storage) struct Query {
    text: SqlStr,
    values: Vec<Value>,
}

/// Carries a query out on whichever database: one body, with the driver's own types in each arm.
macro_rules! on_each {
    ($query:expr, $on:expr, |$statement:ident, $executor:ident| $body:expr) => {{
        let Query { text, values } = $query;
        match $on {
            On::Lite($executor) => {
                let $statement = lite(text, values);
                $body
            }
            On::LitePool($executor) => {
                let $statement = lite(text, values);
                $body
            }
            On::Pg($executor) => {
                let $statement = pg(text, values);
                $body
            }
            On::PgPool($executor) => {
                let $statement = pg(text, values);
                $body
            }
        }
    }};
}

impl Query {
    pub(super) const fn new(text: SqlStr, values: Vec<Value>) -> Self {
        Self { text, values }
    }

    /// The value of the next placeholder.
    pub(in crate::storage) fn bind(mut self, value: impl Into<Value>) -> Self {
        self.values.push(value.into());
        self
    }

    /// Carries it out; the number of rows that it touched.
    pub(in crate::storage) async fn execute(self, on: impl Into<On<'_>>) -> Result<u64, StoreError> {
        on_each!(self, on.into(), |statement, executor| Ok(statement
            .execute(executor)
            .await?
            .rows_affected()))
    }

    /// All rows.
    pub(in crate::storage) async fn fetch_all(self, on: impl Into<On<'_>>) -> Result<Vec<DbRow>, StoreError> {
        on_each!(self, on.into(), |statement, executor| {
            let rows = statement.fetch_all(executor).await?;
            Ok(rows.into_iter().map(DbRow::from).collect())
        })
    }

    /// The first row, if any.
    pub(in crate::storage) async fn fetch_optional(
        self,
        on: impl Into<On<'_>>,
    ) -> Result<Option<DbRow>, StoreError> {
        on_each!(self, on.into(), |statement, executor| Ok(statement
            .fetch_optional(executor)
            .await?
            .map(DbRow::from)))
    }

    /// The first row.
    pub(in crate::storage) async fn fetch_one(self, on: impl Into<On<'_>>) -> Result<DbRow, StoreError> {
        self.fetch_optional(on).await?.ok_or(StoreError::Database(sqlx::Error::RowNotFound))
    }

    /// The first column of the first row.
    pub(in crate::storage) async fn scalar<T: Column>(self, on: impl Into<On<'_>>) -> Result<T, StoreError> {
        self.fetch_one(on).await?.first()
    }

    /// The first column of the first row, if there is a row.
    pub(in crate::storage) async fn scalar_optional<T: Column>(
        self,
        on: impl Into<On<'_>>,
    ) -> Result<Option<T>, StoreError> {
        self.fetch_optional(on).await?.map(|row| row.first()).transpose()
    }

    /// The first column of all rows.
    pub(in crate::storage) async fn scalars<T: Column>(
        self,
        on: impl Into<On<'_>>,
    ) -> Result<Vec<T>, StoreError> {
        self.fetch_all(on).await?.iter().map(DbRow::first).collect()
    }

    /// Rows one after the other: never all in memory.
    pub(in crate::storage) fn fetch(self, pool: &Pool) -> BoxStream<'_, Result<DbRow, StoreError>> {
        let Self { text, values } = self;
        match pool {
            Pool::Lite(pool) => lite(text, values).fetch(pool).map(|row| Ok(DbRow::from(row?))).boxed(),
            Pool::Pg(pool) => pg(text, values).fetch(pool).map(|row| Ok(DbRow::from(row?))).boxed(),
        }
    }
}

fn lite(
    text: SqlStr,
    values: Vec<Value>,
) -> sqlx::query::Query<'static, Sqlite, sqlx::sqlite::SqliteArguments> {
    values.into_iter().fold(sqlx::query(text), |query, value| match value {
        Value::Int(value) => query.bind(value),
        Value::Real(value) => query.bind(value),
        Value::Text(value) => query.bind(value),
        Value::Bytes(value) => query.bind(value),
    })
}

fn pg(
    text: SqlStr,
    values: Vec<Value>,
) -> sqlx::query::Query<'static, Postgres, sqlx::postgres::PgArguments> {
    let text = match numbered(text.as_str()) {
        Some(numbered) => AssertSqlSafe(numbered).into_sql_str(),
        None => text,
    };
    values.into_iter().fold(sqlx::query(text), |query, value| match value {
        Value::Int(value) => query.bind(value),
        Value::Real(value) => query.bind(value),
        Value::Text(value) => query.bind(value.map(|text| super::value::without_nul(&text).into_owned())),
        Value::Bytes(value) => query.bind(value),
    })
}

/// `?` and `?7` as PostgreSQL writes them: `$1`, `$7`. `None` when there is none. No text of ours holds a `?` that is
/// not a placeholder.
fn numbered(text: &str) -> Option<String> {
    if !text.contains('?') {
        return None;
    }
    let mut numbered = String::with_capacity(text.len() + 16);
    let mut next = 1;
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        if character != '?' {
            numbered.push(character);
            continue;
        }
        numbered.push('$');
        if !characters.peek().is_some_and(char::is_ascii_digit) {
            let _ = write!(numbered, "{next}");
            next += 1;
        }
    }
    Some(numbered)
}

/// A statement that is put together from parts; values are bound, never written into it.
pub(in crate::storage) struct Builder {
    text: String,
    values: Vec<Value>,
}

impl Builder {
    pub(in crate::storage) fn new(text: impl Into<Cow<'static, str>>) -> Self {
        Self { text: text.into().into_owned(), values: Vec::new() }
    }

    /// Text of the program's own.
    pub(in crate::storage) fn push(&mut self, text: impl Display) -> &mut Self {
        let _ = write!(self.text, "{text}");
        self
    }

    /// A placeholder and its value.
    pub(in crate::storage) fn push_bind(&mut self, value: impl Into<Value>) -> &mut Self {
        self.values.push(value.into());
        let _ = write!(self.text, "${}", self.values.len());
        self
    }

    pub(in crate::storage) fn build(self) -> Query {
        Query { text: AssertSqlSafe(self.text).into_sql_str(), values: self.values }
    }
}

#[cfg(test)]
mod tests {
    use super::numbered;

    #[test]
    fn placeholders_become_numbers() {
        assert_eq!(numbered("select $1, $2"), None);
        assert_eq!(numbered("a = ? and b = ?").as_deref(), Some("a = $1 and b = $2"));
        assert_eq!(numbered("?1 or ?12 or ?1").as_deref(), Some("$1 or $12 or $1"));
    }
}
