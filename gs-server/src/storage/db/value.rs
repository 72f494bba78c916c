//! Values on their way into a database, and rows on their way out.

use std::borrow::Cow;

use sqlx::postgres::PgRow;
use sqlx::sqlite::SqliteRow;
use sqlx::{ColumnIndex, Row as _};

use crate::storage::StoreError;

/// What a column holds; `None` is null.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::storage) enum Value {
    Int(Option<i64>),
    Real(Option<f64>),
    Text(Option<String>),
    Bytes(Option<Vec<u8>>),
}

macro_rules! into_value {
    ($($type:ty => $variant:ident, |$value:ident| $owned:expr;)*) => {$(
        impl From<$type> for Value {
            fn from($value: $type) -> Self {
                Self::$variant(Some($owned))
            }
        }

        impl From<Option<$type>> for Value {
            fn from(value: Option<$type>) -> Self {
                Self::$variant(value.map(|$value| $owned))
            }
        }
    )*};
}

into_value! {
    i64 => Int, |value| value;
    &i64 => Int, |value| *value;
    bool => Int, |value| i64::from(value);
    &bool => Int, |value| i64::from(*value);
    f64 => Real, |value| value;
    &f64 => Real, |value| *value;
    &str => Text, |value| value.to_owned();
    String => Text, |value| value;
    &String => Text, |value| value.clone();
    &[u8] => Bytes, |value| value.to_vec();
    Vec<u8> => Bytes, |value| value;
    &Vec<u8> => Bytes, |value| value.clone();
}

macro_rules! into_value_by_reference {
    ($($type:ty)*) => {$(
        impl From<&Option<$type>> for Value {
            fn from(value: &Option<$type>) -> Self {
                value.as_ref().into()
            }
        }
    )*};
}

into_value_by_reference! { i64 bool f64 String Vec<u8> }

/// A row of either database.
pub(in crate::storage) enum DbRow {
    Lite(SqliteRow),
    Pg(PgRow),
}

impl From<SqliteRow> for DbRow {
    fn from(row: SqliteRow) -> Self {
        Self::Lite(row)
    }
}

impl From<PgRow> for DbRow {
    fn from(row: PgRow) -> Self {
        Self::Pg(row)
    }
}

impl DbRow {
    /// The value in the column of this name.
    pub(in crate::storage) fn try_get<T: Column>(&self, name: &str) -> Result<T, StoreError> {
        T::of(self, name)
    }

    /// The value in the first column.
    pub(in crate::storage) fn first<T: Column>(&self) -> Result<T, StoreError> {
        T::of(self, 0)
    }
}

/// What a column can be read as.
pub(in crate::storage) trait Column: Sized {
    fn of<I: ColumnIndex<SqliteRow> + ColumnIndex<PgRow>>(row: &DbRow, column: I)
    -> Result<Self, StoreError>;
}

macro_rules! columns {
    ($($type:ty)*) => {$(
        impl Column for $type {
            fn of<I: ColumnIndex<SqliteRow> + ColumnIndex<PgRow>>(
                row: &DbRow,
                column: I,
            ) -> Result<Self, StoreError> {
                Ok(match row {
                    DbRow::Lite(row) => row.try_get(column)?,
                    DbRow::Pg(row) => row.try_get(column)?,
                })
            }
        }
    )*};
}

columns! { i64 Option<i64> f64 Option<f64> Vec<u8> Option<Vec<u8>> }

impl Column for bool {
    fn of<I: ColumnIndex<SqliteRow> + ColumnIndex<PgRow>>(
        row: &DbRow,
        column: I,
    ) -> Result<Self, StoreError> {
        match i64::of(row, column)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(StoreError::damaged(format!("{other} stands where 0 or 1 should"))),
        }
    }
}

impl Column for Option<String> {
    fn of<I: ColumnIndex<SqliteRow> + ColumnIndex<PgRow>>(
        row: &DbRow,
        column: I,
    ) -> Result<Self, StoreError> {
        Ok(match row {
            DbRow::Lite(row) => row.try_get(column)?,
            DbRow::Pg(row) => row.try_get::<Option<String>, _>(column)?.map(with_nul),
        })
    }
}

impl Column for String {
    fn of<I: ColumnIndex<SqliteRow> + ColumnIndex<PgRow>>(
        row: &DbRow,
        column: I,
    ) -> Result<Self, StoreError> {
        Ok(match row {
            DbRow::Lite(row) => row.try_get(column)?,
            DbRow::Pg(row) => with_nul(row.try_get(column)?),
        })
    }
}

/// Text of PostgreSQL holds no NUL; SQLite's does, and whoever hands text in may send one. It is stored as two
/// characters, and so is the first of these two.
const MARK: char = '\u{1}';

pub(super) fn without_nul(text: &str) -> Cow<'_, str> {
    if !text.contains(['\0', MARK]) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.replace(MARK, "\u{1}1").replace('\0', "\u{1}0"))
}

fn with_nul(text: String) -> String {
    if !text.contains(MARK) {
        return text;
    }
    text.replace("\u{1}0", "\0").replace("\u{1}1", "\u{1}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_with_nul_comes_back() {
        for text in ["", "plain", "\0", "a\0b", "\u{1}", "\u{1}0", "\u{1}\0\u{1}1", "\0\u{1}0\0"] {
            let stored = without_nul(text).into_owned();
            assert!(!stored.contains('\0'), "{text:?}");
            assert_eq!(with_nul(stored), text, "{text:?}");
        }
    }
}
