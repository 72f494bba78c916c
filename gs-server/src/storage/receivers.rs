//! Who hears the satellite: what others reported, summed up by receiver.

use std::collections::BTreeMap;

use mission::reception::Ear;

use super::db::{Builder, sql};
use super::{Archive, During, Store, StoreError};

/// Newest receptions that medians and places are made of.
const NEWEST: i64 = 5_000;
/// Receivers that are told of, those first that heard last.
const MOST: i64 = 2_000;

/// Which receivers.
#[derive(Debug, Clone, Default)]
pub struct ReceiversQuery {
    /// Of this satellite.
    pub satellite: Option<String>,
    /// By what they heard then.
    pub during: During,
}

/// One receiver.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Receiver {
    /// Its id.
    pub id: String,
    /// What its owner calls it, as said last.
    pub name: Option<String>,
    /// By which sources it came.
    pub sources: Vec<String>,
    /// Latitude and longitude in degrees, as said last.
    pub place: Option<(f64, f64)>,
    /// Frames that it heard.
    pub frames: u64,
    /// Other packets.
    pub without_frame: u64,
    /// When it heard something first.
    pub first_us: i64,
    /// When it heard something last.
    pub last_us: i64,
    /// Median SNR, dB, over its newest receptions.
    pub median_snr_db: Option<f64>,
    /// Best RSSI, dBm.
    pub best_rssi_dbm: Option<f64>,
}

impl Store {
    /// Receivers that said who they are, those first that heard last.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn receivers(&self, query: &ReceiversQuery) -> Result<Vec<Receiver>, StoreError> {
        let mut statement = Builder::new(
            "select receiver, source, sum(case when kind = 'frame' then 1 else 0 end) as frames, count(*) as packets,
                min(received_at_us) as first_us, max(received_at_us) as last_us, max(rssi_dbm) as best_rssi_dbm
             from outside_receptions where receiver <> ''",
        );
        narrow(&mut statement, query);
        statement.push(" group by receiver, source order by last_us desc limit ").push_bind(MOST);
        let mut found: BTreeMap<String, Receiver> = BTreeMap::new();
        for row in &statement.build().fetch_all(&self.0.readers).await? {
            let id: String = row.try_get("receiver")?;
            let (frames, packets): (i64, i64) = (row.try_get("frames")?, row.try_get("packets")?);
            let (first_us, last_us): (i64, i64) = (row.try_get("first_us")?, row.try_get("last_us")?);
            let rssi: Option<f64> = row.try_get("best_rssi_dbm")?;
            let receiver = found.entry(id.clone()).or_insert_with(|| Receiver {
                id,
                first_us,
                last_us,
                ..Receiver::default()
            });
            receiver.sources.push(row.try_get("source")?);
            receiver.frames += frames.unsigned_abs();
            receiver.without_frame += (packets - frames).unsigned_abs();
            receiver.first_us = receiver.first_us.min(first_us);
            receiver.last_us = receiver.last_us.max(last_us);
            receiver.best_rssi_dbm = [receiver.best_rssi_dbm, rssi].into_iter().flatten().reduce(f64::max);
        }
        self.words_and_levels(query, &mut found).await?;
        let mut receivers: Vec<Receiver> = found.into_values().collect();
        receivers.sort_by_key(|receiver| std::cmp::Reverse(receiver.last_us));
        Ok(receivers)
    }

    /// Name, place and median, from the newest receptions.
    async fn words_and_levels(
        &self,
        query: &ReceiversQuery,
        found: &mut BTreeMap<String, Receiver>,
    ) -> Result<(), StoreError> {
        let mut statement = Builder::new(
            "select receiver, receiver_name, latitude_deg, longitude_deg, snr_db from outside_receptions where receiver <> ''",
        );
        narrow(&mut statement, query);
        statement.push(" order by received_at_us desc limit ").push_bind(NEWEST);
        let mut levels: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for row in &statement.build().fetch_all(&self.0.readers).await? {
            let id: String = row.try_get("receiver")?;
            let Some(receiver) = found.get_mut(&id) else { continue };
            if receiver.name.is_none() {
                receiver.name = row.try_get("receiver_name")?;
            }
            if receiver.place.is_none() {
                let latitude: Option<f64> = row.try_get("latitude_deg")?;
                receiver.place = latitude.zip(row.try_get("longitude_deg")?);
            }
            if let Some(snr) = row.try_get::<Option<f64>>("snr_db")? {
                levels.entry(id).or_default().push(snr);
            }
        }
        for (id, mut levels) in levels {
            levels.sort_by(f64::total_cmp);
            let middle = levels.len() / 2;
            let upper = levels.get(middle).copied();
            let lower = levels.len().is_multiple_of(2).then(|| levels.get(middle - 1).copied()).flatten();
            if let Some(receiver) = found.get_mut(&id) {
                receiver.median_snr_db =
                    upper.map(|upper| lower.map_or(upper, |lower| f64::midpoint(lower, upper)));
            }
        }
        Ok(())
    }
}

impl Archive {
    /// When a report of each source was taken in last, microseconds since 1970, beside servers that work there.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn heard_by_source(&self) -> Result<BTreeMap<String, i64>, StoreError> {
        let mut connection = self.reading().await?;
        let mut heard = BTreeMap::new();
        for ear in Ear::ALL {
            let newest =
                sql("select taken_at_us from outside_receptions where source = ? order by id desc limit 1");
            if let Some(at_us) = newest.bind(ear.name()).scalar_optional(&mut connection).await? {
                heard.insert(ear.name().to_owned(), at_us);
            }
        }
        connection.close().await?;
        Ok(heard)
    }
}

fn narrow(statement: &mut Builder, query: &ReceiversQuery) {
    if let Some(satellite) = &query.satellite {
        statement.push(" and satellite = ").push_bind(satellite.as_str());
    }
    if let Some(start_us) = query.during.start_us {
        statement.push(" and received_at_us >= ").push_bind(start_us);
    }
    if let Some(stop_us) = query.during.stop_us {
        statement.push(" and received_at_us < ").push_bind(stop_us);
    }
}
