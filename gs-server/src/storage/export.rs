//! The archive read through from its beginning, page by page: for whoever takes it elsewhere.

use std::collections::HashMap;
use std::sync::Arc;

use mission::UtcUs;
use mission::reception::{
    Attribution, Content, Doubts, Ear, RadioCrc, Receiver, Reception, Signal, TimeBasis, Trim, attribute,
};

use super::db::{Pool, Value, grouped, padded, sql};
use super::ears::{self, OutsideQuery, OutsideRow};
use super::row::{Row as _, select};
use super::rows::{FrameRow, ReceptionRow};
use super::{Archive, During, Page, Store, StoreError};

/// Rows of a page.
const PAGE: u32 = 256;

/// A way to read that locks nothing.
pub struct Export(Pool);

/// What is exported of one reception, and its number in its table.
pub type Exported = (i64, Arc<Reception>);

impl Export {
    /// Of an archive that is open.
    pub fn of(store: &Store) -> Self {
        Self(store.0.readers.clone())
    }

    /// Of this archive, beside the servers that work on it.
    ///
    /// # Errors
    /// [`StoreError`] when there is none, or it cannot be reached.
    pub async fn beside(archive: &Archive) -> Result<Self, StoreError> {
        archive.readers().await.map(Self)
    }

    /// The next reports of others behind this number, oldest first; none at the end. Of damaged ones there are the bytes
    /// where the report holds them as they are.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn reports(&self, query: &OutsideQuery, after: i64) -> Result<Vec<Exported>, StoreError> {
        let page = Page { after: Some(after), before: None, limit: PAGE };
        let rows = ears::outside(&self.0, &OutsideQuery { page, ..query.clone() }).await?;
        let ids: Vec<i64> = rows.iter().filter_map(|(_, row)| row.frame).collect();
        let frames = self.bytes(&ids).await?;
        rows.into_iter()
            .map(|(id, row)| {
                let bytes = row.frame.and_then(|frame| frames.get(&frame)).cloned();
                Ok((id, Arc::new(reception(row, bytes)?)))
            })
            .collect()
    }

    /// The next receptions of our own stations behind this number, oldest first; none at the end.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn own(
        &self,
        satellite: Option<&str>,
        during: &During,
        after: i64,
    ) -> Result<Vec<Exported>, StoreError> {
        let rows = sql("select id, frame, satellite, station, link, source, received_at_us, rssi_dbm, crc from receptions
            where id > ?1 and (?2 = '' or satellite = ?2) and received_at_us >= ?3 and received_at_us < ?4
            order by id limit ?5")
        .bind(after)
        .bind(satellite.unwrap_or(""))
        .bind(during.start_us.unwrap_or(i64::MIN))
        .bind(during.stop_us.unwrap_or(i64::MAX))
        .bind(i64::from(PAGE))
        .fetch_all(&self.0)
        .await?;
        let rows: Vec<(i64, ReceptionRow)> = rows
            .iter()
            .map(|row| Ok((row.try_get("id")?, ReceptionRow::read(row)?)))
            .collect::<Result<_, StoreError>>()?;
        let frames = self.bytes(&rows.iter().map(|(_, row)| row.frame).collect::<Vec<_>>()).await?;
        let own = rows.into_iter().filter_map(|(id, row)| {
            let bytes = frames.get(&row.frame)?.clone();
            Some((id, Arc::new(heard_here(&row, bytes))))
        });
        Ok(own.collect())
    }

    async fn bytes(&self, frames: &[i64]) -> Result<HashMap<i64, Vec<u8>>, StoreError> {
        let mut found = HashMap::new();
        for frames in frames.chunks(PAGE as usize) {
            let Some(last) = frames.last() else { continue };
            let columns = padded(frames.len());
            let mut values: Vec<Value> = frames.iter().map(Value::from).collect();
            values.resize(columns, Value::from(last));
            let head = select::<FrameRow>("where id in ").0;
            for row in &grouped(&head, (1, columns), "", values).fetch_all(&self.0).await? {
                let row = FrameRow::read(row)?;
                found.insert(row.id, row.bytes);
            }
        }
        Ok(found)
    }
}

fn reception(row: OutsideRow, frame: Option<Vec<u8>>) -> Result<Reception, StoreError> {
    let strange =
        |what: &str, found: &str| StoreError::damaged(format!("a reception has the {what} '{found}'"));
    let small = |value: Option<i64>| value.and_then(|value| u8::try_from(value).ok());
    let content = match (frame, row.kind.as_str()) {
        (Some(bytes), "frame") => Content::Frame { bytes: bytes.into(), trim: Trim::default() },
        (_, "detection") => Content::Detection,
        _ => damaged(row.original.as_deref().unwrap_or_default()),
    };
    Ok(Reception {
        ear: Ear::from_name(&row.source).ok_or_else(|| strange("source", &row.source))?,
        source_id: row.source_id,
        receiver: Receiver {
            id: Some(row.receiver).filter(|receiver| !receiver.is_empty()),
            name: row.receiver_name,
            latitude_deg: row.latitude_deg,
            longitude_deg: row.longitude_deg,
            altitude_m: row.altitude_m,
        },
        received_at: UtcUs(row.received_at_us),
        time_basis: TimeBasis::from_name(&row.time_basis)
            .ok_or_else(|| strange("time basis", &row.time_basis))?,
        time_error_us: row.time_error_us.and_then(|us| u64::try_from(us).ok()),
        signal: Signal {
            frequency_hz: row.frequency_hz,
            frequency_offset_hz: row.frequency_offset_hz,
            doppler_hz: row.doppler_hz,
            frequency_error_hz: row.frequency_error_hz,
            spreading_factor: small(row.spreading_factor),
            bandwidth_hz: row.bandwidth_hz,
            coding_rate: small(row.coding_rate),
            rssi_dbm: row.rssi_dbm,
            snr_db: row.snr_db,
        },
        radio_crc: match row.radio_crc.as_str() {
            "right" => RadioCrc::Right,
            "wrong" => RadioCrc::Wrong,
            _ => RadioCrc::Unknown,
        },
        noisy: row.noisy,
        label: row.label,
        norad: row.norad.and_then(|norad| u32::try_from(norad).ok()),
        content,
        doubts: Doubts::default(),
        original: None,
    })
}

/// The damaged bytes themselves, in whichever words the report has them.
fn damaged(original: &[u8]) -> Content {
    let text = std::str::from_utf8(original).unwrap_or_default();
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '+' | '/' | '=')));
    let said = words.filter(|word| word.len() >= 16).flat_map(|word| {
        use base64::Engine as _;
        [hex::decode(word).ok(), base64::engine::general_purpose::STANDARD.decode(word).ok()]
    });
    let mut candidates = std::iter::once(original.to_vec()).chain(said.flatten());
    let found = candidates.find_map(|bytes| match attribute(&bytes) {
        Attribution::Damaged { offered } if bytes.len() <= mission::reception::DELIVERED_MAX => {
            Some(Content::Damaged { delivered: bytes.into(), offered })
        }
        _ => None,
    });
    found.unwrap_or(Content::Damaged { delivered: [].into(), offered: None })
}

/// What one of our own stations heard, as another archive would hear of it.
fn heard_here(row: &ReceptionRow, bytes: Vec<u8>) -> Reception {
    Reception {
        ear: Ear::File,
        source_id: format!("{}/{}/{}", row.station, row.link, row.received_at_us),
        receiver: Receiver {
            id: Some(row.station.clone()),
            name: Some(row.station.clone()),
            ..Receiver::default()
        },
        received_at: UtcUs(row.received_at_us),
        time_basis: TimeBasis::Stated,
        time_error_us: None,
        signal: Signal { rssi_dbm: row.rssi_dbm.map(|dbm| dbm as f64), ..Signal::default() },
        radio_crc: RadioCrc::Unknown,
        noisy: false,
        label: None,
        norad: None,
        content: Content::Frame { bytes: bytes.into(), trim: Trim::default() },
        doubts: Doubts::default(),
        original: None,
    }
}
