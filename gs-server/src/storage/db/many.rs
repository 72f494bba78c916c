//! Many rows by few statements.

use std::pin::pin;
use std::task::Poll;

use futures_util::poll;
use sqlx::{AssertSqlSafe, SqlSafeStr as _};

use super::query::Query;
use super::value::Value;
use super::{Connection, On};
use crate::storage::StoreError;
use crate::storage::row::Row;

/// Values of one statement: below the limit of either database (32,766), and little enough memory for what SQLite makes
/// of it.
const VALUES: usize = 16_384;
/// Rows of one statement.
const ROWS: usize = 4_096;

/// How many rows of so many columns a statement may hold, largest first. Only these: a statement is prepared once for
/// each. Few and large ones, since each is a way to another thread and back.
fn sizes(columns: usize) -> impl Iterator<Item = usize> {
    let largest = ROWS.min(VALUES / columns.max(1)).max(1);
    std::iter::successors(Some(largest), |size| (*size > 1).then_some((size / 4).max(1)))
}

/// The largest size that such rows fill.
pub(in crate::storage) fn fitting(rows: usize, columns: usize) -> usize {
    sizes(columns).find(|size| *size <= rows).unwrap_or(1)
}

/// The smallest size that holds so many values, of those for one column.
pub(in crate::storage) fn padded(values: usize) -> usize {
    sizes(1).take_while(|size| *size >= values).last().unwrap_or(values)
}

/// A statement with so many groups of so many placeholders between its head and its tail.
pub(in crate::storage) fn grouped(
    head: &str,
    (rows, columns): (usize, usize),
    tail: &str,
    values: Vec<Value>,
) -> Query {
    let group = format!("({}?)", "?, ".repeat(columns.saturating_sub(1)));
    let mut text = String::with_capacity(head.len() + tail.len() + rows * (group.len() + 2));
    text.push_str(head);
    for row in 0..rows {
        text.push_str(if row == 0 { "" } else { ", " });
        text.push_str(&group);
    }
    text.push_str(tail);
    Query::new(AssertSqlSafe(text).into_sql_str(), values)
}

/// Inserts rows; `tail` is what stands behind the last one. While the database works on one statement, the rows of the
/// next are made.
pub(in crate::storage) async fn insert_rows<R: Row>(
    connection: &mut Connection,
    mut rows: impl ExactSizeIterator<Item = Result<R, StoreError>> + Send,
    tail: &str,
) -> Result<(), StoreError> {
    let mut next = insert_of(&mut rows, tail)?;
    while let Some(statement) = next {
        let mut under_way = pin!(statement.execute(On::from(&mut *connection)));
        // This hands it over; a database that is elsewhere, or has a thread of its own, works from now on.
        let handed_over = poll!(&mut under_way);
        let following = insert_of(&mut rows, tail);
        match handed_over {
            Poll::Ready(done) => done?,
            Poll::Pending => under_way.await?,
        };
        next = following?;
    }
    Ok(())
}

/// The statement for as many of these rows as one may hold; `None` when there are none.
fn insert_of<R: Row>(
    rows: &mut (impl ExactSizeIterator<Item = Result<R, StoreError>> + Send),
    tail: &str,
) -> Result<Option<Query>, StoreError> {
    if rows.len() == 0 {
        return Ok(None);
    }
    let size = fitting(rows.len(), R::COLUMNS);
    let mut values = Vec::with_capacity(size * R::COLUMNS);
    for row in rows.take(size) {
        row?.give(&mut values);
    }
    Ok(Some(grouped(R::HEAD, (size, R::COLUMNS), tail, values)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_few_and_within_the_limits() {
        assert_eq!(sizes(34).collect::<Vec<_>>(), [481, 120, 30, 7, 1]);
        assert_eq!(sizes(1).collect::<Vec<_>>(), [4_096, 1_024, 256, 64, 16, 4, 1]);
        assert_eq!([0, 1, 2, 256, 257, 4_096, 5_000].map(padded), [1, 1, 4, 256, 1_024, 4_096, 5_000]);
        assert_eq!([1, 6, 7, 480, 481, 9_999].map(|rows| fitting(rows, 34)), [1, 1, 7, 120, 481, 481]);
    }
}
