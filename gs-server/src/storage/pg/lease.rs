//! Who may seal with a key, and who works on an intent: decided in the database, by its clock, in the transaction that
//! needs it.

use std::collections::BTreeMap;
use std::time::Duration;

use protocol::{Counter, KeyId};

use super::Shared;
use crate::storage::convert::narrow;
use crate::storage::db::{Connection, sql};
use crate::storage::{Store, StoreError};

/// A lease lasts so long after it was last renewed; whoever died with it holds nobody up longer.
const LEASE_US: i64 = 30_000_000;

const NOW_US: &str = "select (extract(epoch from clock_timestamp()) * 1000000)::bigint";

/// Who may seal with a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Leased {
    /// We may.
    Ours {
        /// For so long.
        remaining: Duration,
        /// The highest counter that any server has spent.
        spent: Option<Counter>,
    },
    /// Another server may.
    Other {
        /// Its station.
        station: String,
        /// Until then, microseconds since 1970 by the database's clock, unless it is renewed.
        until_us: i64,
    },
    /// Nobody does.
    Free,
}

/// Which server a transaction belongs to.
#[derive(Debug, Clone)]
pub(in crate::storage) struct Fence {
    pub(super) station: String,
    pub(super) life: String,
}

struct Held {
    station: String,
    life: String,
    until_us: i64,
}

impl Fence {
    /// Makes sure, within the transaction, that this server may seal with the key: renews its lease, or takes one that
    /// nobody holds.
    ///
    /// # Errors
    /// [`StoreError::Leased`] when another server holds it: nothing of the transaction may be stored.
    pub(in crate::storage) async fn hold(
        &self,
        connection: &mut Connection,
        key: &str,
    ) -> Result<i64, StoreError> {
        let now_us: i64 = sql(NOW_US).scalar(&mut *connection).await?;
        if let Some(held) = held(connection, key).await?
            && held.life != self.life
            && held.until_us > now_us
        {
            return Err(StoreError::Leased {
                key: key.to_owned(),
                station: held.station,
                until_us: held.until_us,
            });
        }
        sql("insert into leases (key, station, life, epoch, until_us) values ($1, $2, $3, 1, $4)
             on conflict (key) do update set station = $2, life = $3, until_us = $4,
               epoch = leases.epoch + case when leases.life = $3 then 0 else 1 end")
        .bind(key)
        .bind(&self.station)
        .bind(&self.life)
        .bind(now_us + LEASE_US)
        .execute(connection)
        .await?;
        Ok(LEASE_US)
    }

    /// Takes the intent for this server, within the transaction. False when another server has it that was not replaced.
    async fn claim(
        &self,
        connection: &mut Connection,
        principal: &str,
        idempotency_key: &str,
    ) -> Result<bool, StoreError> {
        let taken = sql("insert into claims (principal, idempotency_key, life) values ($1, $2, $3)
             on conflict (principal, idempotency_key) do update set life = $3
               where claims.life = $3 or claims.life not in (select life from stations)")
        .bind(principal)
        .bind(idempotency_key)
        .bind(&self.life)
        .execute(connection)
        .await?;
        Ok(taken > 0)
    }
}

/// Stations that were found to be away from the database: by their life, since when in microseconds of its clock.
#[derive(Debug, Default)]
pub(super) struct Away(BTreeMap<String, i64>);

impl Away {
    /// Whether this life has been away for as long as a lease lasts, counted from when that was first noticed.
    fn is_over(&mut self, life: &str, now_us: i64) -> bool {
        now_us - *self.0.entry(life.to_owned()).or_insert(now_us) >= LEASE_US
    }
}

impl Shared {
    /// Takes the intent for this server, within the transaction. False when another server works on it. One that has been
    /// away for as long as a lease lasts loses it, and its station with it: if it was only cut off it finds out at its
    /// next batch, and what it still had under way is not stored a second time.
    pub(in crate::storage) async fn claim(
        &mut self,
        connection: &mut Connection,
        principal: &str,
        idempotency_key: &str,
    ) -> Result<bool, StoreError> {
        if self.fence.claim(connection, principal, idempotency_key).await? {
            return Ok(true);
        }
        let row = sql(
            "select number, stations.life as life from claims join stations on stations.life = claims.life
             where principal = ? and idempotency_key = ?",
        )
        .bind(principal)
        .bind(idempotency_key)
        .fetch_one(&mut *connection)
        .await?;
        let (number, life): (i64, String) = (row.try_get("number")?, row.try_get("life")?);
        let is_away: bool =
            sql("select case when pg_try_advisory_xact_lock(?) then 1::bigint else 0::bigint end")
                .bind(super::AT_WORK + number)
                .scalar(&mut *connection)
                .await?;
        if !is_away {
            self.away.0.remove(&life);
            return Ok(false);
        }
        let now_us: i64 = sql(NOW_US).scalar(&mut *connection).await?;
        if !self.away.is_over(&life, now_us) {
            return Ok(false);
        }
        sql("update stations set life = '' where number = ?").bind(number).execute(&mut *connection).await?;
        tracing::warn!(
            number,
            "station {number} has been away from the database: what it had under way is ours"
        );
        self.fence.claim(connection, principal, idempotency_key).await
    }

    /// Whoever is away now has been away for long.
    #[cfg(test)]
    pub(in crate::storage) fn wait_out(&mut self) {
        self.away.0.values_mut().for_each(|since| *since -= LEASE_US);
    }
}

async fn held(connection: &mut Connection, key: &str) -> Result<Option<Held>, StoreError> {
    let row = sql("select station, life, until_us from leases where key = ?")
        .bind(key)
        .fetch_optional(connection)
        .await?;
    let read = |row: crate::storage::db::DbRow| {
        Ok(Held {
            station: row.try_get("station")?,
            life: row.try_get("life")?,
            until_us: row.try_get("until_us")?,
        })
    };
    row.map(read).transpose()
}

impl Store {
    /// Takes or renews the lease of a key, or gives it back when it is not `wanted`. `None` when the database is ours
    /// alone and needs no leases.
    ///
    /// # Errors
    /// [`StoreError`] when the database does not answer: nobody knows who holds it then.
    pub async fn lease(&self, key: KeyId, wanted: bool) -> Result<Option<Leased>, StoreError> {
        if !self.is_shared() {
            return Ok(None);
        }
        match crate::clock::within(super::APPLY, self.ask_for_lease(key, wanted)).await {
            Some(result) => result.map(Some),
            None => Err(StoreError::away("no answer within 20 s")),
        }
    }

    async fn ask_for_lease(&self, key: KeyId, wanted: bool) -> Result<Leased, StoreError> {
        let mut writer = self.0.writer.lock().await;
        let Some(fence) = writer.fence() else { return Ok(Leased::Free) };
        let mut connection = writer.begin().await?;
        let result = decide(&mut connection, &fence, &key.to_string(), wanted).await;
        writer.end(connection, result).await
    }
}

async fn decide(
    connection: &mut Connection,
    fence: &Fence,
    key: &str,
    wanted: bool,
) -> Result<Leased, StoreError> {
    if wanted {
        return match fence.hold(connection, key).await {
            Ok(remaining_us) => {
                let highest: Option<i64> = sql("select max(counter) from (
                       select max(counter) as counter from sealed_frames where key = ?1
                       union all select max(counter) from counter_floors where key = ?1) as spent")
                .bind(key)
                .scalar(connection)
                .await?;
                let spent = highest.map(|counter| narrow("counter", counter).map(Counter)).transpose()?;
                Ok(Leased::Ours { remaining: Duration::from_micros(remaining_us.unsigned_abs()), spent })
            }
            Err(StoreError::Leased { station, until_us, .. }) => Ok(Leased::Other { station, until_us }),
            Err(error) => Err(error),
        };
    }
    let now_us: i64 = sql(NOW_US).scalar(&mut *connection).await?;
    match held(connection, key).await? {
        Some(held) if held.life == fence.life && held.until_us > now_us => {
            sql("update leases set until_us = ? where key = ?")
                .bind(now_us)
                .bind(key)
                .execute(connection)
                .await?;
            Ok(Leased::Free)
        }
        Some(held) if held.until_us > now_us => {
            Ok(Leased::Other { station: held.station, until_us: held.until_us })
        }
        _ => Ok(Leased::Free),
    }
}
