//! Alerts, the messages about them on their way out, and how far events were looked at.
//!
//! An alert and the messages about it are stored together ([`Store::keep_alerts`]): whatever is sent was written down
//! before, and whatever was written down is sent by this life of the server or the next.

use mission::alert::{Alert, Shelf, Signed, Told};
use mission::record::Record;
use mission::{AlertId, Batch, BatchId, Level, Principal, UtcUs};
use sqlx::AssertSqlSafe;

use super::convert::{int, narrow, parse};
use super::db::{Connection, sql};
use super::read::{During, List, Page, one};
use super::row::{Row as _, row, select};
use super::snapshot::Own;
use super::{Store, StoreError, StoredEvent, pg};

row! {
    /// An alert.
    AlertRow in "alerts" {
        /// Id, rising.
        id: i64,
        /// Where.
        station: String,
        /// The rule that raised it.
        rule: String,
        /// The word of [`mission::alert::AlertKind`].
        kind: String,
        /// What it is about.
        subject: String,
        /// The satellite it concerns.
        satellite: Option<String>,
        /// The word of [`mission::Level`].
        level: String,
        /// The gravest it had.
        worst: String,
        /// It holds now.
        active: bool,
        /// One sentence.
        message: String,
        /// How often it came.
        times: i64,
        /// When it came first.
        raised_at_us: i64,
        /// When it last changed.
        changed_at_us: i64,
        /// Since when it waits for somebody.
        waiting_since_us: i64,
        /// When it returned to normal.
        returned_at_us: Option<i64>,
        /// Who acknowledged.
        acknowledged_by: Option<String>,
        /// When.
        acknowledged_at_us: Option<i64>,
        /// Who put it on the shelf.
        shelved_by: Option<String>,
        /// Until when.
        shelved_until_us: Option<i64>,
        /// Whose it is.
        assignee: Option<String>,
        /// What somebody wrote to it.
        note: Option<String>,
        /// When it was over.
        closed_at_us: Option<i64>,
        /// What was told last: it held.
        told_active: Option<i64>,
        /// At this level.
        told_level: Option<String>,
        /// It had come so often.
        told_times: Option<i64>,
        /// When.
        told_at_us: Option<i64>,
        /// Steps of escalation that were taken.
        escalated: i64,
    }
}

row! {
    /// A message to one target.
    DeliveryRow in "alert_deliveries" {
        /// Id, rising.
        id: i64,
        /// Its number for the far end: the same in each attempt.
        message_id: String,
        /// From where.
        station: String,
        /// About which alert; `None` for a digest and a test.
        alert: Option<i64>,
        /// To whom.
        target: String,
        /// Why: a word of [`mission::alert::NoticeKind`], `digest` or `test`.
        what: String,
        /// The word of [`mission::Level`].
        level: String,
        /// One line.
        title: String,
        /// The whole text.
        body: String,
        /// When it was made.
        made_at_us: i64,
        /// The word of [`DeliveryState`].
        state: String,
        /// Attempts that were made.
        attempts: i64,
        /// When the next one is due.
        next_at_us: i64,
        /// When it went through.
        sent_at_us: Option<i64>,
        /// Why the last attempt failed.
        error: Option<String>,
        /// The digest that told it.
        digest: Option<i64>,
    }
}

row! {
    /// How far events and runs were looked at.
    AlertProgress in "alert_progress" {
        /// The station's number, from 1.
        id: i64,
        /// The last event.
        events_through: i64,
        /// The end of the last run.
        runs_through_us: i64,
    }
}

/// How a message stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeliveryState {
    /// It waits for the end of the quiet hours.
    Held,
    /// It is to be sent.
    Waiting,
    /// It went through.
    Sent,
    /// It did not in 24 hours.
    GivenUp,
    /// A digest told it.
    InDigest,
}

impl DeliveryState {
    /// The word in the database.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Waiting => "waiting",
            Self::Sent => "sent",
            Self::GivenUp => "given-up",
            Self::InDigest => "in-digest",
        }
    }
}

/// A message to be kept; storage gives it its number.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivery {
    /// Its number for the far end.
    pub message_id: String,
    /// About which alert.
    pub alert: Option<AlertId>,
    /// To whom.
    pub target: String,
    /// Why.
    pub what: &'static str,
    /// How grave.
    pub level: Level,
    /// One line.
    pub title: String,
    /// The whole text.
    pub body: String,
    /// When it was made.
    pub made_at: UtcUs,
    /// Held, or to be sent.
    pub state: DeliveryState,
}

/// What is kept together.
#[derive(Debug, Clone, Default)]
pub struct AlertBatch {
    /// Alerts as they are now.
    pub alerts: Vec<Alert>,
    /// New messages.
    pub deliveries: Vec<Delivery>,
    /// Events and audit that go with it.
    pub records: Vec<Record>,
    /// How far events and runs were looked at, when that has changed.
    pub progress: Option<(i64, i64)>,
}

/// Which alerts.
#[derive(Debug, Clone, Default)]
pub struct AlertQuery {
    /// Only open ones, or only history; `None`: all.
    pub open: Option<bool>,
    /// Only of this satellite.
    pub satellite: Option<String>,
    /// Only those that were at least this grave.
    pub level: Level,
    /// Only those that were raised within.
    pub during: During,
    /// Which part, by id.
    pub page: Page,
}

/// A run of a plan that is over.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FinalRun {
    /// Its plan's name.
    pub plan: String,
    /// Whom it commanded.
    pub satellite: String,
    /// `ended`, `missed` or `dropped`.
    pub state: String,
    /// Why, where there is a why.
    pub why: Option<String>,
    /// How it ended, where it ran.
    pub outcome: Option<String>,
    /// Begin of its pass.
    pub aos_at: UtcUs,
    /// When it was over.
    pub at: UtcUs,
}

impl Store {
    /// Keeps alerts, the messages about them and what goes with it, whole or not at all. Durable when it returns.
    ///
    /// # Errors
    /// [`StoreError`]; nothing is kept then.
    pub async fn keep_alerts(&self, batch: &AlertBatch) -> Result<Vec<StoredEvent>, StoreError> {
        if !self.is_shared() {
            return self.put_alerts(batch).await;
        }
        // A database elsewhere may never answer.
        let kept = crate::clock::within(pg::APPLY, self.put_alerts(batch)).await;
        kept.unwrap_or_else(|| Err(StoreError::away("no answer within 20 s")))
    }

    async fn put_alerts(&self, batch: &AlertBatch) -> Result<Vec<StoredEvent>, StoreError> {
        let own = self.own();
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let before = writer.audit_head().map(|head| head.row);
        let mut transaction = writer.within(&mut connection);
        let result = async {
            let station = transaction.station.to_string();
            for alert in &batch.alerts {
                transaction.upsert("id", &AlertRow::of(alert, &station)?).await?;
            }
            let mut id = last_delivery(transaction.connection, own).await?;
            for delivery in &batch.deliveries {
                id += 1;
                // The answer to a commit may be lost with the connection: then the same batch comes again.
                let once =
                    AssertSqlSafe(format!("{} on conflict (message_id) do nothing", DeliveryRow::INSERT));
                let row = DeliveryRow::of(delivery, id, &station)?;
                row.bind(sql(once)).execute(&mut *transaction.connection).await?;
            }
            if let Some((events_through, runs_through_us)) = batch.progress {
                let row = AlertProgress { id: self.0.number + 1, events_through, runs_through_us };
                transaction.upsert("id", &row).await?;
            }
            transaction.batch(&Batch { id: BatchId(0), records: batch.records.clone() }).await
        }
        .await;
        let events = writer.end(connection, result).await?;
        self.tell_audit_head(writer.audit_head().filter(|head| Some(head.row) != before));
        Ok(events)
    }

    /// The numbers that this station gives.
    pub(super) fn own(&self) -> Own {
        Own::of(self.0.number)
    }

    /// How far events and runs were looked at; `None` before the first time.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn alert_progress(&self) -> Result<Option<AlertProgress>, StoreError> {
        one(self, "where id = $1", self.0.number + 1).await
    }

    /// The alerts that are not history, and the highest id that this station ever gave.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn open_alerts(&self) -> Result<(Vec<Alert>, u64), StoreError> {
        let own = self.own();
        let mine = "where closed_at_us is null and id > $1 and id < $2 order by id";
        let rows =
            sql(select::<AlertRow>(mine)).bind(own.after).bind(own.before).fetch_all(&self.0.readers).await?;
        let open =
            rows.iter().map(|row| AlertRow::read(row)?.alert()).collect::<Result<Vec<_>, StoreError>>()?;
        let last: i64 = sql("select coalesce(max(id), $1) from alerts where id > $1 and id < $2")
            .bind(own.after)
            .bind(own.before)
            .scalar(&self.0.readers)
            .await?;
        Ok((open, narrow("alerts.id", last)?))
    }

    /// Alerts of this station, by id.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn alerts(&self, query: &AlertQuery) -> Result<Vec<Alert>, StoreError> {
        let worst = (query.level > Level::Normal).then(|| {
            Level::ALL.iter().filter(|level| **level >= query.level).map(|level| level.name()).collect()
        });
        let mut list = List::of::<AlertRow>()
            .equal("satellite", query.satellite.as_deref())
            .any_of("worst", worst)
            .during("raised_at_us", &query.during);
        let own = self.own();
        list.statement.push(" and id > ").push_bind(own.after).push(" and id < ").push_bind(own.before);
        if let Some(open) = query.open {
            list.statement.push(if open {
                " and closed_at_us is null"
            } else {
                " and closed_at_us is not null"
            });
        }
        let rows: Vec<AlertRow> = list.page(self, "id", &query.page).await?;
        rows.iter().map(AlertRow::alert).collect()
    }

    /// One alert.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn alert(&self, id: i64) -> Result<Option<Alert>, StoreError> {
        one::<AlertRow>(self, "where id = $1", id).await?.map(|row| row.alert()).transpose()
    }

    /// Messages, by id, newest first.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn deliveries(
        &self,
        target: Option<&str>,
        page: &Page,
    ) -> Result<Vec<DeliveryRow>, StoreError> {
        List::of::<DeliveryRow>().equal("target", target).page(self, "id", page).await
    }

    /// The messages to a target that are to be sent, those that are due first.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn waiting_deliveries(&self, target: &str) -> Result<Vec<DeliveryRow>, StoreError> {
        let own = self.own();
        let condition = "where target = $1 and state = 'waiting' and id > $2 and id < $3
            order by next_at_us, id limit 50";
        let rows = sql(select::<DeliveryRow>(condition))
            .bind(target)
            .bind(own.after)
            .bind(own.before)
            .fetch_all(&self.0.readers)
            .await?;
        rows.iter().map(DeliveryRow::read).collect()
    }

    /// Whether a target has messages that wait for the end of its quiet hours.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn has_held_deliveries(&self, target: &str) -> Result<bool, StoreError> {
        let own = self.own();
        let held = "select id from alert_deliveries
            where target = $1 and state = 'held' and id > $2 and id < $3 limit 1";
        let found: Option<i64> =
            sql(held).bind(target).bind(own.after).bind(own.before).scalar_optional(&self.0.readers).await?;
        Ok(found.is_some())
    }

    /// What became of an attempt.
    ///
    /// # Errors
    /// [`StoreError`]; nothing is kept then, and the message goes out once more.
    pub async fn keep_delivery(&self, row: &DeliveryRow) -> Result<(), StoreError> {
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let result = writer.within(&mut connection).upsert("id", row).await;
        writer.end(connection, result).await
    }

    /// Makes one message of all that a target was not told in its quiet hours. A single one goes as it is.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub async fn digest_deliveries(
        &self,
        target: &str,
        message_id: &str,
        at: UtcUs,
        compose: impl FnOnce(&[DeliveryRow]) -> (String, String) + Send,
    ) -> Result<(), StoreError> {
        let own = self.own();
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let mut transaction = writer.within(&mut connection);
        let result = async {
            let held = "where target = $1 and state = 'held' and id > $2 and id < $3 order by id";
            let rows = sql(select::<DeliveryRow>(held))
                .bind(target)
                .bind(own.after)
                .bind(own.before)
                .fetch_all(&mut *transaction.connection)
                .await?;
            let held = rows.iter().map(DeliveryRow::read).collect::<Result<Vec<_>, StoreError>>()?;
            let worst = |row: &&DeliveryRow| row.level.parse::<Level>().unwrap_or_default();
            let Some(gravest) = held.iter().max_by_key(worst) else { return Ok(()) };
            let (state, digest) = match held.len() {
                1 => (DeliveryState::Waiting, None),
                _ => (DeliveryState::InDigest, Some(last_delivery(transaction.connection, own).await? + 1)),
            };
            if let Some(id) = digest {
                let (title, body) = compose(&held);
                let row = DeliveryRow {
                    id,
                    message_id: message_id.to_owned(),
                    alert: None,
                    what: "digest".to_owned(),
                    title,
                    body,
                    made_at_us: at.0,
                    state: DeliveryState::Waiting.name().to_owned(),
                    next_at_us: at.0,
                    ..gravest.clone()
                };
                transaction.insert(&row).await?;
            }
            for row in held {
                // From now on it counts as made: a night is no failed delivery.
                let made_at_us = if digest.is_none() { at.0 } else { row.made_at_us };
                let row = DeliveryRow {
                    state: state.name().to_owned(),
                    digest,
                    next_at_us: at.0,
                    made_at_us,
                    ..row
                };
                transaction.upsert("id", &row).await?;
            }
            Ok(())
        }
        .await;
        writer.end(connection, result).await
    }

    /// Runs that were over after this instant, in order of time; at most 100.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn runs_over_since(&self, at: UtcUs) -> Result<Vec<FinalRun>, StoreError> {
        let own = self.own();
        let rows = sql(
            "select p.name as name, r.satellite as satellite, r.state as state, r.why as why, r.outcome as outcome,
               r.aos_at_us as aos_at_us, r.at_us as at_us
             from plan_runs r join plans p on p.id = r.plan
             where r.state in ('ended', 'missed', 'dropped') and r.at_us > $1 and r.id > $2 and r.id < $3
             order by r.at_us limit 100",
        )
        .bind(at.0)
        .bind(own.after)
        .bind(own.before)
        .fetch_all(&self.0.readers)
        .await?;
        rows.iter()
            .map(|row| {
                Ok(FinalRun {
                    plan: row.try_get("name")?,
                    satellite: row.try_get("satellite")?,
                    state: row.try_get("state")?,
                    why: row.try_get("why")?,
                    outcome: row.try_get("outcome")?,
                    aos_at: UtcUs(row.try_get("aos_at_us")?),
                    at: UtcUs(row.try_get("at_us")?),
                })
            })
            .collect()
    }
}

async fn last_delivery(connection: &mut Connection, own: Own) -> Result<i64, StoreError> {
    sql("select coalesce(max(id), $1) from alert_deliveries where id > $1 and id < $2")
        .bind(own.after)
        .bind(own.before)
        .scalar(connection)
        .await
}

impl AlertRow {
    fn of(alert: &Alert, station: &str) -> Result<Self, StoreError> {
        Ok(Self {
            id: int("alert", alert.id.0)?,
            station: station.to_owned(),
            rule: alert.rule.clone(),
            kind: alert.kind.name().to_owned(),
            subject: alert.subject.clone(),
            satellite: alert.satellite.as_ref().map(ToString::to_string),
            level: alert.level.name().to_owned(),
            worst: alert.worst.name().to_owned(),
            active: alert.active,
            message: alert.message.clone(),
            times: i64::from(alert.times),
            raised_at_us: alert.raised_at.0,
            changed_at_us: alert.changed_at.0,
            waiting_since_us: alert.waiting_since.0,
            returned_at_us: alert.returned_at.map(|at| at.0),
            acknowledged_by: alert.acknowledged.as_ref().map(|signed| signed.who.to_string()),
            acknowledged_at_us: alert.acknowledged.as_ref().map(|signed| signed.at.0),
            shelved_by: alert.shelved.as_ref().map(|shelf| shelf.who.to_string()),
            shelved_until_us: alert.shelved.as_ref().map(|shelf| shelf.until.0),
            assignee: alert.assignee.clone(),
            note: alert.note.clone(),
            closed_at_us: alert.closed_at.map(|at| at.0),
            told_active: alert.told.map(|told| i64::from(told.active)),
            told_level: alert.told.map(|told| told.level.name().to_owned()),
            told_times: alert.told.map(|told| i64::from(told.times)),
            told_at_us: alert.told.map(|told| told.at.0),
            escalated: i64::from(alert.escalated),
        })
    }

    fn alert(&self) -> Result<Alert, StoreError> {
        let told = match (self.told_active, &self.told_level, self.told_times, self.told_at_us) {
            (Some(active), Some(level), Some(times), Some(at)) => Some(Told {
                active: active != 0,
                level: parse("alerts.told_level", level)?,
                times: narrow("alerts.told_times", times)?,
                at: UtcUs(at),
            }),
            _ => None,
        };
        let acknowledged = self.acknowledged_by.as_ref().zip(self.acknowledged_at_us);
        let shelved = self.shelved_by.as_ref().zip(self.shelved_until_us);
        Ok(Alert {
            id: AlertId(narrow("alerts.id", self.id)?),
            rule: self.rule.clone(),
            kind: parse("alerts.kind", &self.kind)?,
            subject: self.subject.clone(),
            satellite: self.satellite.as_deref().map(|name| parse("alerts.satellite", name)).transpose()?,
            level: parse("alerts.level", &self.level)?,
            worst: parse("alerts.worst", &self.worst)?,
            active: self.active,
            message: self.message.clone(),
            times: narrow("alerts.times", self.times)?,
            raised_at: UtcUs(self.raised_at_us),
            changed_at: UtcUs(self.changed_at_us),
            waiting_since: UtcUs(self.waiting_since_us),
            returned_at: self.returned_at_us.map(UtcUs),
            acknowledged: acknowledged.map(|(who, at)| Signed { who: Principal::new(who), at: UtcUs(at) }),
            shelved: shelved.map(|(who, until)| Shelf { who: Principal::new(who), until: UtcUs(until) }),
            assignee: self.assignee.clone(),
            note: self.note.clone(),
            closed_at: self.closed_at_us.map(UtcUs),
            told,
            escalated: narrow("alerts.escalated", self.escalated)?,
        })
    }
}

impl DeliveryRow {
    fn of(delivery: &Delivery, id: i64, station: &str) -> Result<Self, StoreError> {
        Ok(Self {
            id,
            message_id: delivery.message_id.clone(),
            station: station.to_owned(),
            alert: delivery.alert.map(|alert| int("alert", alert.0)).transpose()?,
            target: delivery.target.clone(),
            what: delivery.what.to_owned(),
            level: delivery.level.name().to_owned(),
            title: delivery.title.clone(),
            body: delivery.body.clone(),
            made_at_us: delivery.made_at.0,
            state: delivery.state.name().to_owned(),
            attempts: 0,
            next_at_us: delivery.made_at.0,
            sent_at_us: None,
            error: None,
            digest: None,
        })
    }
}
