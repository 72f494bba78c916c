//! One macro that makes a table's row: a plain struct, its statements, and the checksum that guards it.
//!
//! The checksum is CRC-32 over the name of the table and all values in order, each with a byte for its kind, so that
//! nothing can be mistaken for something else. SQLite notices damaged pages, but not a digit that has changed
//! inside a value; this does.

use std::fmt;

use sqlx::AssertSqlSafe;

use super::StoreError;
use super::db::{DbRow, Query, Value};

/// Collects the values of one row.
pub(super) struct Digest(Vec<u8>);

impl Digest {
    pub(super) fn new(table: &str) -> Self {
        let mut digest = Self(Vec::with_capacity(512));
        table.feed(&mut digest);
        digest
    }

    fn put(&mut self, kind: u8, bytes: &[u8]) {
        self.0.push(kind);
        self.0.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
        self.0.extend_from_slice(bytes);
    }

    pub(super) fn finish(&self) -> i64 {
        i64::from(protocol::crc32(&self.0))
    }
}

/// A value that a checksum can be made over.
pub(super) trait Feed {
    fn feed(&self, digest: &mut Digest);
}

impl Feed for i64 {
    fn feed(&self, digest: &mut Digest) {
        digest.put(1, &self.to_le_bytes());
    }
}

impl Feed for bool {
    fn feed(&self, digest: &mut Digest) {
        i64::from(*self).feed(digest);
    }
}

impl Feed for f64 {
    fn feed(&self, digest: &mut Digest) {
        // -0.0 is written as 0.0 by SQLite when it packs a REAL as an integer; PostgreSQL keeps it.
        digest.put(2, &(self + 0.0).to_bits().to_le_bytes());
    }
}

impl Feed for str {
    fn feed(&self, digest: &mut Digest) {
        digest.put(3, self.as_bytes());
    }
}

impl Feed for String {
    fn feed(&self, digest: &mut Digest) {
        self.as_str().feed(digest);
    }
}

impl Feed for Vec<u8> {
    fn feed(&self, digest: &mut Digest) {
        digest.put(4, self);
    }
}

impl<T: Feed> Feed for Option<T> {
    fn feed(&self, digest: &mut Digest) {
        match self {
            Some(value) => value.feed(digest),
            None => digest.put(0, &[]),
        }
    }
}

/// The sentence for a row whose checksum is wrong.
pub(super) fn wrong_row(table: &str, first: &dyn fmt::Debug) -> StoreError {
    StoreError::damaged(format!("the row of {table} that begins with {first:?} is not what was written"))
}

/// What every table's row can do.
pub(super) trait Row: Sized + Send {
    /// `insert into …`, all columns.
    const INSERT: &'static str;
    /// `insert into … values `, to be followed by groups of values.
    const HEAD: &'static str;
    /// How many columns, with the checksum.
    const COLUMNS: usize;
    /// `select … from …`, to be followed by a condition.
    const SELECT: &'static str;
    /// Everything but the first column, taken from the row that was to be inserted.
    const EXCLUDED: &'static str;
    /// The checksum of this row.
    fn crc(&self) -> i64;
    /// All columns and the checksum, in the order of [`Self::INSERT`].
    fn bind(&self, query: Query) -> Query;
    /// The same, handed over.
    fn give(self, out: &mut Vec<Value>);
    /// The row, when its checksum is right.
    fn read(row: &DbRow) -> Result<Self, StoreError>;
}

/// `select` with a condition written here; values are bound, never part of it.
pub(super) fn select<R: Row>(condition: &'static str) -> AssertSqlSafe<String> {
    AssertSqlSafe(format!("{} {condition}", R::SELECT))
}

/// `insert`, or bring up to date the row that has this key.
pub(super) fn upsert<R: Row>(key: &'static str) -> AssertSqlSafe<String> {
    AssertSqlSafe(format!("{} on conflict ({key}) do update set {}", R::INSERT, R::EXCLUDED))
}

/// A struct for a row of a table whose last column is `crc`.
macro_rules! row {
    (
        $(#[$meta:meta])*
        $name:ident in $table:literal {
            $(#[$first_meta:meta])* $first:ident: $first_type:ty,
            $($(#[$field_meta:meta])* $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $(#[$first_meta])* pub $first: $first_type,
            $($(#[$field_meta])* pub $field: $type,)*
        }

        impl crate::storage::row::Row for $name {
            const INSERT: &'static str = concat!(
                "insert into ", $table, " (", stringify!($first), $(", ", stringify!($field),)* ", crc) values (?",
                $(row!(@ ", ?" $field),)* ", ?)"
            );
            const HEAD: &'static str = concat!(
                "insert into ", $table, " (", stringify!($first), $(", ", stringify!($field),)* ", crc) values "
            );
            const COLUMNS: usize = 2 $(+ row!(@ 1 $field))*;
            const SELECT: &'static str = concat!(
                "select ", stringify!($first), $(", ", stringify!($field),)* ", crc from ", $table
            );
            const EXCLUDED: &'static str = concat!(
                $(stringify!($field), " = excluded.", stringify!($field), ", ",)* "crc = excluded.crc"
            );

            fn crc(&self) -> i64 {
                use crate::storage::row::Feed as _;
                let mut digest = crate::storage::row::Digest::new($table);
                self.$first.feed(&mut digest);
                $(self.$field.feed(&mut digest);)*
                digest.finish()
            }

            fn bind(&self, query: crate::storage::db::Query) -> crate::storage::db::Query {
                query.bind(&self.$first)$(.bind(&self.$field))*.bind(self.crc())
            }

            fn give(self, out: &mut Vec<crate::storage::db::Value>) {
                let crc = crate::storage::row::Row::crc(&self);
                out.push(self.$first.into());
                $(out.push(self.$field.into());)*
                out.push(crc.into());
            }

            fn read(row: &crate::storage::db::DbRow) -> Result<Self, crate::storage::StoreError> {
                let read = Self {
                    $first: row.try_get(stringify!($first))?,
                    $($field: row.try_get(stringify!($field))?,)*
                };
                match row.try_get::<i64>("crc")? == crate::storage::row::Row::crc(&read) {
                    true => Ok(read),
                    false => Err(crate::storage::row::wrong_row($table, &read.$first)),
                }
            }
        }
    };
    (@ $text:literal $field:ident) => { $text };
}
pub(super) use row;
