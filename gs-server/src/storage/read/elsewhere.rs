//! What the other stations on the same database heard of our satellites' images while this server was down.

use std::collections::BTreeMap;

use mission::port::ReservedFrame;
use mission::{FrameId, SatelliteId, Source, UtcUs};
use protocol::down_type;

use super::super::convert::{narrow, route};
use super::super::db::{Builder, sql};
use super::super::row::{Row as _, select};
use super::super::rows::ImageRow;
use super::super::snapshot::Own;
use super::super::{FrameRow, ReceptionRow, Store, StoreError};

/// Frames read at once.
const PAGE: i64 = 500;
/// More than the largest image has chunks; what is left out is asked for over the air.
const MOST: usize = 100_000;

impl Store {
    /// Frames that tell of an image and that other stations heard, in the order in which they were heard: since our newest
    /// image of the satellite was declared, or since the one that others have now was. Empty where the database is ours alone.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read or holds what nobody wrote.
    pub async fn images_elsewhere(
        &self,
        satellite: &SatelliteId,
    ) -> Result<Vec<(FrameId, ReservedFrame)>, StoreError> {
        let mut told = Vec::new();
        if !self.is_shared() {
            return Ok(told);
        }
        let Some(since_us) = self.image_since(satellite).await? else { return Ok(told) };
        let own = Own::of(self.0.number);
        let mut last = (since_us, 0);
        while told.len() < MOST {
            let rows = sql(select::<FrameRow>(
                "where satellite = ?1 and packet_type in (?2, ?3) and nested = 0 and (id < ?4 or id > ?5)
                   and (heard_at_us > ?6 or (heard_at_us = ?6 and id > ?7))
                 order by heard_at_us, id limit ?8",
            ))
            .bind(satellite.as_str())
            .bind(i64::from(down_type::IMAGE_INFO))
            .bind(i64::from(down_type::IMAGE_CHUNK))
            .bind(own.after)
            .bind(own.before)
            .bind(last.0)
            .bind(last.1)
            .bind(PAGE)
            .fetch_all(&self.0.readers)
            .await?;
            let frames: Vec<FrameRow> = rows.iter().map(FrameRow::read).collect::<Result<_, _>>()?;
            let Some(newest) = frames.last() else { break };
            last = (newest.heard_at_us, newest.id);
            let mut receptions = self.first_receptions(&frames).await?;
            for frame in frames {
                let first = receptions.remove(&frame.id);
                told.push((FrameId(narrow("frames.id", frame.id)?), as_kept(frame, first.as_ref())?));
            }
        }
        Ok(told)
    }

    /// When the image of a satellite was first declared by anybody, if we do not have it: else when it was to us.
    async fn image_since(&self, satellite: &SatelliteId) -> Result<Option<i64>, StoreError> {
        let own = Own::of(self.0.number);
        let newest = |condition: &'static str| {
            let query = sql(select::<ImageRow>(condition)).bind(satellite.as_str());
            query.bind(own.after).bind(own.before).fetch_optional(&self.0.readers)
        };
        let ours = newest("where satellite = ? and id > ? and id < ? order by id desc limit 1").await?;
        if let Some(row) = ours {
            return Ok(Some(ImageRow::read(&row)?.declared_at_us));
        }
        let theirs = "where satellite = ? and (id < ? or id > ?) order by declared_at_us desc limit 1";
        let Some(row) = newest(theirs).await? else { return Ok(None) };
        let image = ImageRow::read(&row)?;
        sql("select min(declared_at_us) from images
             where satellite = ? and size_bytes = ? and chunks = ? and width_px = ? and height_px = ?")
        .bind(satellite.as_str())
        .bind(image.size_bytes)
        .bind(image.chunks)
        .bind(image.width_px)
        .bind(image.height_px)
        .scalar(&self.0.readers)
        .await
    }

    /// The first reception of each of these frames.
    async fn first_receptions(&self, frames: &[FrameRow]) -> Result<BTreeMap<i64, ReceptionRow>, StoreError> {
        let mut statement = Builder::new(format!("{} where frame in (", ReceptionRow::SELECT));
        for (at, frame) in frames.iter().enumerate() {
            statement.push(if at == 0 { "" } else { ", " }).push_bind(frame.id);
        }
        statement.push(") order by id desc");
        let mut first = BTreeMap::new();
        for row in &statement.build().fetch_all(&self.0.readers).await? {
            let row = ReceptionRow::read(row)?;
            first.insert(row.frame, row);
        }
        Ok(first)
    }
}

/// A frame as the engine takes it. What no station heard, only strangers, has no first reception.
pub(super) fn as_kept(frame: FrameRow, first: Option<&ReceptionRow>) -> Result<ReservedFrame, StoreError> {
    let (station, link) = first.map_or((&frame.station, &frame.link), |first| (&first.station, &first.link));
    Ok(ReservedFrame {
        route: route(&frame.satellite, station, link)?,
        source: first.map_or(Ok(Source::File), ReceptionRow::source)?,
        received_at: UtcUs(frame.heard_at_us),
        rssi_dbm: first.and_then(|first| i16::try_from(first.rssi_dbm?).ok()),
        bytes: frame.bytes.into(),
    })
}
