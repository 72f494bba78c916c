//! What is passed on to others: one row for each reception and target, and how far the receptions were looked at.
//!
//! Receptions are taken up by their numbers, which one writer gives in order, so the place reached says it all: rows and
//! place change together, and neither a restart nor a kill takes one up twice or leaves one out.

use std::collections::BTreeMap;

use mission::record::AuditRecord;
use mission::{Principal, UtcUs};
use sha2::{Digest as _, Sha256};

use super::db::{Builder, Connection, DbRow, sql};
use super::ears::OutsideRow;
use super::read::{During, List, Page, one};
use super::row::{Row as _, row, select};
use super::rows::FrameRow;
use super::snapshot::Own;
use super::write::Transaction;
use super::{Store, StoreError};

/// Receptions that are taken up together.
const TOGETHER: i64 = 200;

row! {
    /// A reception on its way to a target.
    ForwardRow in "forwards" {
        /// Id, rising.
        id: i64,
        /// Its number for the far end: the same for this reception and target in whatever archive.
        message_id: String,
        /// From where it goes.
        station: String,
        /// To whom.
        target: String,
        /// Whose frame.
        satellite: String,
        /// The frame.
        frame: i64,
        /// `radio` or `own-mqtt`.
        source: String,
        /// The reception, in the table of its source.
        reception: i64,
        /// Who heard it, as the target is told.
        receiver: String,
        /// When.
        received_at_us: i64,
        /// When it was taken up.
        made_at_us: i64,
        /// The word of [`ForwardState`].
        state: String,
        /// Attempts that were begun.
        attempts: i64,
        /// When it was taken.
        sent_at_us: Option<i64>,
        /// Why the last attempt failed.
        error: Option<String>,
    }
}

row! {
    /// How far a target is.
    ForwardTargetRow in "forward_targets" {
        /// Id.
        id: i64,
        /// Whose receptions.
        station: String,
        /// For whom.
        target: String,
        /// The last reception of our own radio that was looked at.
        radio_through: i64,
        /// The last reception of others that was looked at.
        outside_through: i64,
        /// Who has paused it.
        paused_by: Option<String>,
        /// When.
        paused_at_us: Option<i64>,
    }
}

/// How a reception stands with a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ForwardState {
    /// It is to be sent.
    Waiting,
    /// An attempt is under way, or the server died in it.
    Sending,
    /// The far end has it.
    Sent,
    /// Nobody knows whether the far end has it, and asking again could make it two.
    Unknown,
    /// The far end does not want it.
    Refused,
    /// It would have been sent: the target is a dry run.
    Dry,
}

impl ForwardState {
    /// Every state.
    pub const ALL: [Self; 6] =
        [Self::Waiting, Self::Sending, Self::Sent, Self::Unknown, Self::Refused, Self::Dry];

    /// The word in the database.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Sending => "sending",
            Self::Sent => "sent",
            Self::Unknown => "unknown",
            Self::Refused => "refused",
            Self::Dry => "dry",
        }
    }

    /// The state with this word.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|state| state.name() == name)
    }
}

/// What a target wants.
#[derive(Debug, Clone)]
pub struct ForwardWish {
    /// Its name.
    pub target: String,
    /// Whose frames; empty: everybody's.
    pub satellites: Vec<String>,
    /// What our own boards heard, too.
    pub own_boards: bool,
    /// How our own radio is called.
    pub receiver: String,
    /// Nothing that was received before.
    pub since_us: Option<i64>,
    /// Only written down, never sent.
    pub dry: bool,
}

/// A reception with all that a far end may be told of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ForwardSubject {
    /// The frame.
    pub frame: FrameRow,
    /// Received power.
    pub rssi_dbm: Option<f64>,
    /// What only others measure and tell.
    pub outside: Option<Box<OutsideRow>>,
}

/// How a target stands.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ForwardCounts {
    /// Receptions by state.
    pub states: BTreeMap<String, i64>,
    /// When the oldest that waits was received.
    pub oldest_waiting_us: Option<i64>,
    /// When one was sent last.
    pub last_sent_us: Option<i64>,
}

/// Which receptions.
#[derive(Debug, Clone, Default)]
pub struct ForwardQuery {
    /// To this target.
    pub target: Option<String>,
    /// In this state.
    pub state: Option<ForwardState>,
    /// Received then.
    pub during: During,
    /// Which part, by id.
    pub page: Page,
}

impl Store {
    /// How far a target of this station is; made at the end of what was received, or at its begin.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read or written.
    pub async fn forward_target(&self, name: &str, from_begin: bool) -> Result<ForwardTargetRow, StoreError> {
        if let Some(row) = self.find_forward_target(name).await? {
            return Ok(row);
        }
        let own = self.own();
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let mut transaction = writer.within(&mut connection);
        let result = async {
            let station = transaction.station.to_string();
            let id = last(transaction.connection, "forward_targets", own).await? + 1;
            let (radio_through, outside_through) = match from_begin {
                true => (0, 0),
                false => (
                    newest(transaction.connection, "receptions", &station).await?,
                    newest(transaction.connection, "outside_receptions", &station).await?,
                ),
            };
            let row = ForwardTargetRow {
                id,
                station,
                target: name.to_owned(),
                radio_through,
                outside_through,
                paused_by: None,
                paused_at_us: None,
            };
            transaction.insert(&row).await?;
            Ok(row)
        }
        .await;
        writer.end(connection, result).await
    }

    /// How far a target of this station is, if it was ever used.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn find_forward_target(&self, name: &str) -> Result<Option<ForwardTargetRow>, StoreError> {
        let own = self.own();
        let condition = "where target = $1 and id > $2 and id < $3";
        let row = sql(select::<ForwardTargetRow>(condition))
            .bind(name)
            .bind(own.after)
            .bind(own.before)
            .fetch_optional(&self.0.readers)
            .await?;
        row.as_ref().map(ForwardTargetRow::read).transpose()
    }

    /// Takes up what was received since: rows and place together. How many receptions were looked at; at most 400.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub async fn take_up_forwards(
        &self,
        place: &mut ForwardTargetRow,
        wish: &ForwardWish,
        now: UtcUs,
    ) -> Result<usize, StoreError> {
        let radio = self.radio_after(place).await?;
        let outside = match wish.own_boards {
            true => self.boards_after(place).await?,
            false => Vec::new(),
        };
        let looked_at = radio.len() + outside.len();
        if looked_at == 0 {
            return Ok(0);
        }
        let own = self.own();
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let mut transaction = writer.within(&mut connection);
        let result = async {
            // As it is now: a pause may have come meanwhile.
            let condition = "where id = $1";
            let row = sql(select::<ForwardTargetRow>(condition)).bind(place.id);
            let mut reached = ForwardTargetRow::read(&row.fetch_one(&mut *transaction.connection).await?)?;
            let mut id = last(transaction.connection, "forwards", own).await?;
            for heard in radio.iter().chain(&outside) {
                if heard.is_wanted(wish) {
                    id += put(&mut transaction, heard, wish, id + 1, now).await?;
                }
            }
            reached.radio_through = radio.last().map_or(reached.radio_through, |heard| heard.reception);
            reached.outside_through = outside.last().map_or(reached.outside_through, |heard| heard.reception);
            transaction.upsert("id", &reached).await?;
            Ok(reached)
        }
        .await;
        *place = writer.end(connection, result).await?;
        Ok(looked_at)
    }

    async fn radio_after(&self, place: &ForwardTargetRow) -> Result<Vec<Heard>, StoreError> {
        let rows = sql("select r.id as id, r.frame as frame, r.satellite as satellite, r.source as source,
                    r.received_at_us as received_at_us, '' as receiver, f.bytes as bytes
                from receptions r join frames f on f.id = r.frame
                where r.id > $1 and r.station = $2 order by r.id limit $3")
        .bind(place.radio_through)
        .bind(place.station.as_str())
        .bind(TOGETHER)
        .fetch_all(&self.0.readers)
        .await?;
        rows.iter().map(Heard::read).collect()
    }

    async fn boards_after(&self, place: &ForwardTargetRow) -> Result<Vec<Heard>, StoreError> {
        let rows = sql("select r.id as id, r.frame as frame, r.satellite as satellite, r.source as source,
                    r.received_at_us as received_at_us, coalesce(r.receiver_name, r.receiver) as receiver, f.bytes as bytes
                from outside_receptions r join frames f on f.id = r.frame
                where r.id > $1 and r.station = $2 order by r.id limit $3")
        .bind(place.outside_through)
        .bind(place.station.as_str())
        .bind(TOGETHER)
        .fetch_all(&self.0.readers)
        .await?;
        rows.iter().map(Heard::read).collect()
    }

    /// What is to be sent to a target, the oldest first; or what was under way when the server died.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn forwards_in(
        &self,
        target: &str,
        state: ForwardState,
    ) -> Result<Vec<ForwardRow>, StoreError> {
        let own = self.own();
        let condition = "where target = $1 and state = $2 and id > $3 and id < $4 order by id limit 50";
        let rows = sql(select::<ForwardRow>(condition))
            .bind(target)
            .bind(state.name())
            .bind(own.after)
            .bind(own.before)
            .fetch_all(&self.0.readers)
            .await?;
        rows.iter().map(ForwardRow::read).collect()
    }

    /// What a far end may be told of a reception.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read, or has no such reception.
    pub async fn forward_subject(&self, row: &ForwardRow) -> Result<ForwardSubject, StoreError> {
        let frame = one::<FrameRow>(self, "where id = $1", row.frame).await?;
        let frame = frame.ok_or_else(|| StoreError::damaged(format!("there is no frame {}", row.frame)))?;
        if row.source == "radio" {
            let rssi = sql("select rssi_dbm from receptions where id = $1")
                .bind(row.reception)
                .fetch_one(&self.0.readers)
                .await?;
            let rssi: Option<i64> = rssi.try_get("rssi_dbm")?;
            return Ok(ForwardSubject { frame, rssi_dbm: rssi.map(|dbm| dbm as f64), outside: None });
        }
        let outside = one::<OutsideRow>(self, "where id = $1", row.reception).await?;
        let rssi_dbm = outside.as_ref().and_then(|outside| outside.rssi_dbm);
        Ok(ForwardSubject { frame, rssi_dbm, outside: outside.map(Box::new) })
    }

    /// Writes down how a reception stands. Durable when it returns.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub async fn keep_forward(&self, row: &ForwardRow) -> Result<(), StoreError> {
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let result = writer.within(&mut connection).upsert("id", row).await;
        writer.end(connection, result).await
    }

    /// Receptions of this station, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn forwards(&self, query: &ForwardQuery) -> Result<Vec<ForwardRow>, StoreError> {
        let mut list = List::of::<ForwardRow>()
            .equal("target", query.target.as_deref())
            .equal("state", query.state.map(ForwardState::name))
            .during("received_at_us", &query.during);
        let own = self.own();
        list.statement.push(" and id > ").push_bind(own.after).push(" and id < ").push_bind(own.before);
        list.page(self, "id", &query.page).await
    }

    /// One of them; of this station alone.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn forward(&self, id: i64) -> Result<Option<ForwardRow>, StoreError> {
        let own = self.own();
        if id <= own.after || id >= own.before {
            return Ok(None);
        }
        one(self, "where id = $1", id).await
    }

    /// How a target of this station stands.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn forward_counts(&self, target: &str) -> Result<ForwardCounts, StoreError> {
        let own = self.own();
        let mut statement = Builder::new(
            "select state, count(*) as number, min(received_at_us) as oldest, max(sent_at_us) as newest from forwards where target = ",
        );
        statement.push_bind(target.to_owned());
        statement.push(" and id > ").push_bind(own.after);
        statement.push(" and id < ").push_bind(own.before).push(" group by state");
        let mut counts = ForwardCounts::default();
        for row in &statement.build().fetch_all(&self.0.readers).await? {
            let state: String = row.try_get("state")?;
            match ForwardState::from_name(&state) {
                Some(ForwardState::Waiting) => counts.oldest_waiting_us = row.try_get("oldest")?,
                Some(ForwardState::Sent) => counts.last_sent_us = row.try_get("newest")?,
                _ => {}
            }
            counts.states.insert(state, row.try_get("number")?);
        }
        Ok(counts)
    }

    /// Pauses a target, or lets it go on. Whether that changed anything.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub async fn pause_forwards(
        &self,
        place: &ForwardTargetRow,
        pause: bool,
        who: &Principal,
        at: UtcUs,
    ) -> Result<bool, StoreError> {
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let before = writer.audit_head().map(|head| head.row);
        let mut transaction = writer.within(&mut connection);
        let result = async {
            let now = sql(select::<ForwardTargetRow>("where id = $1"))
                .bind(place.id)
                .fetch_one(&mut *transaction.connection)
                .await?;
            let now = ForwardTargetRow::read(&now)?;
            if now.paused_by.is_some() == pause {
                return Ok(false);
            }
            let (paused_by, paused_at_us) =
                if pause { (Some(who.to_string()), Some(at.0)) } else { (None, None) };
            let row = ForwardTargetRow { paused_by, paused_at_us, ..now };
            transaction.upsert("id", &row).await?;
            let action = if pause { "forward.pause" } else { "forward.resume" };
            transaction.audit(&AuditRecord { at, who: who.clone(), action, detail: row.target }).await?;
            Ok(true)
        }
        .await;
        let changed = writer.end(connection, result).await?;
        self.tell_audit_head(writer.audit_head().filter(|head| Some(head.row) != before));
        Ok(changed)
    }

    /// Has a reception sent again that the far end refused, or of which nobody knows; or sent at all, of a dry run. `None`:
    /// it is in another state, or another station's.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub async fn retry_forward(
        &self,
        id: i64,
        who: &Principal,
        at: UtcUs,
    ) -> Result<Option<ForwardRow>, StoreError> {
        let own = self.own();
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let before = writer.audit_head().map(|head| head.row);
        let mut transaction = writer.within(&mut connection);
        let result = async {
            let condition =
                "where id = $1 and state in ('unknown', 'refused', 'dry') and id > $2 and id < $3";
            let found = sql(select::<ForwardRow>(condition))
                .bind(id)
                .bind(own.after)
                .bind(own.before)
                .fetch_optional(&mut *transaction.connection)
                .await?;
            let Some(found) = found else { return Ok(None) };
            let row =
                ForwardRow { state: ForwardState::Waiting.name().to_owned(), ..ForwardRow::read(&found)? };
            transaction.upsert("id", &row).await?;
            let detail = format!("{} to {}", row.id, row.target);
            let action = "forward.retry";
            transaction.audit(&AuditRecord { at, who: who.clone(), action, detail }).await?;
            Ok(Some(row))
        }
        .await;
        let row = writer.end(connection, result).await?;
        self.tell_audit_head(writer.audit_head().filter(|head| Some(head.row) != before));
        Ok(row)
    }
}

/// A reception that may be wanted.
struct Heard {
    reception: i64,
    frame: i64,
    satellite: String,
    source: String,
    received_at_us: i64,
    receiver: String,
    bytes: Vec<u8>,
}

impl Heard {
    fn read(row: &DbRow) -> Result<Self, StoreError> {
        Ok(Self {
            reception: row.try_get("id")?,
            frame: row.try_get("frame")?,
            satellite: row.try_get("satellite")?,
            source: row.try_get("source")?,
            received_at_us: row.try_get("received_at_us")?,
            receiver: row.try_get("receiver")?,
            bytes: row.try_get("bytes")?,
        })
    }

    /// What was replayed from a file, or told by others than our boards, is not ours to tell.
    fn is_wanted(&self, wish: &ForwardWish) -> bool {
        matches!(self.source.as_str(), "radio" | "own-mqtt")
            && (wish.satellites.is_empty() || wish.satellites.contains(&self.satellite))
            && wish.since_us.is_none_or(|since_us| self.received_at_us >= since_us)
    }
}

/// Writes one down, unless this receiver's is there already: 1, or 0.
async fn put(
    transaction: &mut Transaction<'_>,
    heard: &Heard,
    wish: &ForwardWish,
    id: i64,
    now: UtcUs,
) -> Result<i64, StoreError> {
    let receiver = if heard.source == "radio" { &wish.receiver } else { &heard.receiver };
    let state = if wish.dry { ForwardState::Dry } else { ForwardState::Waiting };
    let row = ForwardRow {
        id,
        message_id: message_id(&wish.target, receiver, heard),
        station: transaction.station.to_string(),
        target: wish.target.clone(),
        satellite: heard.satellite.clone(),
        frame: heard.frame,
        source: heard.source.clone(),
        reception: heard.reception,
        receiver: receiver.clone(),
        received_at_us: heard.received_at_us,
        made_at_us: now.0,
        state: state.name().to_owned(),
        attempts: 0,
        sent_at_us: None,
        error: None,
    };
    let once = sqlx::AssertSqlSafe(format!("{} on conflict do nothing", ForwardRow::INSERT));
    let inserted = row.bind(sql(once)).execute(&mut *transaction.connection).await?;
    Ok(i64::from(inserted > 0))
}

fn message_id(target: &str, receiver: &str, heard: &Heard) -> String {
    let mut hash = Sha256::new();
    for part in [target.as_bytes(), receiver.as_bytes(), &heard.received_at_us.to_le_bytes(), &heard.bytes] {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hash.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

async fn last(connection: &mut Connection, table: &'static str, own: Own) -> Result<i64, StoreError> {
    let mut statement = Builder::new("select coalesce(max(id), ");
    statement.push_bind(own.after).push(format!(") from {table} where id > ")).push_bind(own.after);
    statement.push(" and id < ").push_bind(own.before);
    statement.build().scalar(connection).await
}

pub(super) async fn newest(
    connection: &mut Connection,
    table: &'static str,
    station: &str,
) -> Result<i64, StoreError> {
    let mut statement = Builder::new(format!("select coalesce(max(id), 0) from {table} where station = "));
    statement.push_bind(station.to_owned());
    statement.build().scalar(connection).await
}
