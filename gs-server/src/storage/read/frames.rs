//! Raw frames and who heard them.

use mission::FrameId;
use mission::port::ReservedFrame;

use super::super::convert::int;
use super::super::db::sql;
use super::super::row::Row as _;
use super::super::row::select;
use super::super::{FrameRow, ReceptionRow, Store, StoreError};
use super::elsewhere::as_kept;
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
            .scope("heard_at_us", &query.scope)
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
            let rows = sql(select::<ReceptionRow>("where frame between ? and ? order by id"))
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

    /// A frame as the engine takes it, as it was first heard.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read or holds what nobody wrote.
    pub async fn frame_as_kept(&self, id: FrameId) -> Result<Option<ReservedFrame>, StoreError> {
        let Some(heard) = self.frame(int("frame", id.0)?).await? else { return Ok(None) };
        if heard.frame.nested {
            return Ok(None);
        }
        as_kept(heard.frame, heard.receptions.first()).map(Some)
    }

    /// Those of these frames that the archive does not have: the reserve may hold some that were stored after all.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn not_yet_stored(&self, kept: Vec<ReservedFrame>) -> Result<Vec<ReservedFrame>, StoreError> {
        let mut missing = Vec::new();
        for frame in kept {
            let there: i64 = sql("select count(*) from frames
                 where satellite = ? and station = ? and heard_at_us = ? and link = ? and bytes = ?")
            .bind(frame.route.satellite.as_str())
            .bind(frame.route.station.as_str())
            .bind(frame.received_at.0)
            .bind(frame.route.link.as_str())
            .bind(frame.bytes.to_vec())
            .scalar(&self.0.readers)
            .await?;
            if there == 0 {
                missing.push(frame);
            }
        }
        Ok(missing)
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
