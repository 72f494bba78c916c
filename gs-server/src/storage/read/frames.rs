//! Raw frames and who heard them.

use super::super::row::Row as _;
use super::super::row::select;
use super::super::{FrameRow, ReceptionRow, Store, StoreError};
use super::{List, Page, Scope, all, one};

/// Which frames.
#[derive(Debug, Clone, Default)]
pub struct FrameQuery {
    /// Whose, as first heard.
    pub scope: Scope,
    /// Only of this packet type.
    pub packet_type: Option<u8>,
    /// Which part, by frame id.
    pub page: Page,
}

/// A frame and who heard it.
#[derive(Debug, Clone, PartialEq)]
pub struct Heard {
    /// The frame.
    pub frame: FrameRow,
    /// Who heard it, in the order in which it was reported.
    pub receptions: Vec<ReceptionRow>,
}

impl Store {
    /// Frames with their receptions.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn frames(&self, query: &FrameQuery) -> Result<Vec<Heard>, StoreError> {
        let frames: Vec<FrameRow> = List::of::<FrameRow>()
            .scope(&query.scope)
            .equal_number("packet_type", query.packet_type.map(i64::from))
            .page(self, "id", &query.page)
            .await?;
        let mut heard: Vec<Heard> =
            frames.into_iter().map(|frame| Heard { frame, receptions: Vec::new() }).collect();
        // A dense page takes one sweep; a sparse one would read receptions that belong to other frames.
        let (low, high) = heard
            .iter()
            .map(|heard| heard.frame.id)
            .fold((i64::MAX, 0), |(low, high), id| (low.min(id), high.max(id)));
        if high - low < 4 * heard.len() as i64 {
            let rows = sqlx::query(select::<ReceptionRow>("where frame between ? and ? order by id"))
                .bind(low)
                .bind(high)
                .fetch_all(&self.0.readers)
                .await?;
            for row in &rows {
                let row = ReceptionRow::read(row)?;
                if let Some(heard) = heard.iter_mut().find(|heard| heard.frame.id == row.frame) {
                    heard.receptions.push(row);
                }
            }
        } else {
            for heard in &mut heard {
                heard.receptions = all(self, "where frame = ? order by id", heard.frame.id).await?;
            }
        }
        Ok(heard)
    }

    /// A frame with its receptions.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn frame(&self, id: i64) -> Result<Option<Heard>, StoreError> {
        let Some(frame) = one::<FrameRow>(self, "where id = ?", id).await? else { return Ok(None) };
        let receptions = all(self, "where frame = ? order by id", id).await?;
        Ok(Some(Heard { frame, receptions }))
    }
}
