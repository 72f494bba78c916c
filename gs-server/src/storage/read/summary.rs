//! What monthly summaries and handovers count.

use super::super::db::sql;
use super::super::row::{Row, select};
use super::super::{AuditRow, CommandRow, EventRow, PassRow, RunRow, StageRow, Store, StoreError};
use super::{CommandThen, Span};

/// Frames of one packet type and one length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameCount {
    /// Packet type, if there is one.
    pub packet_type: Option<i64>,
    /// Bytes of each frame.
    pub bytes: i64,
    /// The day, counted from 1970 UTC.
    pub day: i64,
    /// How many.
    pub frames: i64,
}

/// Events of one kind and level.
#[derive(Debug, Clone, PartialEq)]
pub struct EventCount {
    /// How many.
    pub count: i64,
    /// When the first one happened.
    pub first_us: i64,
    /// The last one.
    pub last: EventRow,
}

impl Store {
    /// Frames of the span by packet, length and day.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn frames_counted(&self, span: &Span<'_>) -> Result<Vec<FrameCount>, StoreError> {
        let rows = sql(
            "select packet_type, cast(length(bytes) as bigint) as bytes, heard_at_us / 86400000000 as day,
               count(*) as frames from frames
               where satellite = $1 and station = $2 and heard_at_us between $3 and $4
               group by packet_type, length(bytes), heard_at_us / 86400000000",
        )
        .bind(span.satellite)
        .bind(span.station)
        .bind(span.from_us)
        .bind(span.to_us)
        .fetch_all(&self.0.readers)
        .await?;
        rows.iter()
            .map(|row| {
                Ok(FrameCount {
                    packet_type: row.try_get("packet_type")?,
                    bytes: row.try_get("bytes")?,
                    day: row.try_get("day")?,
                    frames: row.try_get("frames")?,
                })
            })
            .collect()
    }

    /// Passes of a station that began between two instants, in order.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn passes_between(
        &self,
        station: &str,
        (from_us, to_us): (i64, i64),
    ) -> Result<Vec<PassRow>, StoreError> {
        let rows = sql(select::<PassRow>(
            "where station = $1 and aos_at_us between $2 and $3 order by aos_at_us, id",
        ))
        .bind(station)
        .bind(from_us)
        .bind(to_us)
        .fetch_all(&self.0.readers)
        .await?;
        rows.iter().map(PassRow::read).collect()
    }

    /// How often something was radiated in the span.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn radiated_counted(&self, span: &Span<'_>) -> Result<i64, StoreError> {
        self.count(
            "select count(*) from command_stages where satellite = $1 and station = $2
               and at_us between $3 and $4 and stage = 'radiated'",
            span,
        )
        .await
    }

    /// Commands that were given in the span, by their last stage until its end.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn outcomes_counted(&self, span: &Span<'_>) -> Result<Vec<(String, i64)>, StoreError> {
        let rows = sql("select last.stage as stage, count(*) as commands from command_stages as last
               where last.id in (select max(one.id) from command_stages as one
                 join commands on commands.id = one.command
                 where commands.satellite = $1 and commands.station = $2
                   and commands.created_at_us between $3 and $4 and one.at_us <= $4
                 group by one.command)
               group by last.stage order by last.stage")
        .bind(span.satellite)
        .bind(span.station)
        .bind(span.from_us)
        .bind(span.to_us)
        .fetch_all(&self.0.readers)
        .await?;
        rows.iter().map(|row| Ok((row.try_get("stage")?, row.try_get("commands")?))).collect()
    }

    /// Images declared, images that became whole, chunks that came, sets of elements that were added.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn gains_counted(&self, span: &Span<'_>) -> Result<[i64; 4], StoreError> {
        Ok([
            self.count(
                "select count(*) from images where satellite = $1 and station = $2
                   and declared_at_us between $3 and $4",
                span,
            )
            .await?,
            self.count(
                "select count(*) from images where satellite = $1 and station = $2
                   and completed_at_us between $3 and $4",
                span,
            )
            .await?,
            self.count(
                "select count(*) from chunks where conflict = 0 and frame in (select id from frames
                   where satellite = $1 and station = $2 and heard_at_us between $3 and $4)",
                span,
            )
            .await?,
            self.count(
                "select count(*) from elements where satellite = $1 and station = $2
                   and added_at_us between $3 and $4",
                span,
            )
            .await?,
        ])
    }

    /// Events of level `warning` or graver of a station between two instants, by kind and level.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn incidents_counted(
        &self,
        station: &str,
        (from_us, to_us): (i64, i64),
    ) -> Result<Vec<EventCount>, StoreError> {
        let rows = sql("select count(*) as count, min(at_us) as first_us, max(seq) as last from events
               where station = $1 and at_us between $2 and $3 and level not in ('normal', 'watch')
               group by kind, level")
        .bind(station)
        .bind(from_us)
        .bind(to_us)
        .fetch_all(&self.0.readers)
        .await?;
        let mut counts = Vec::with_capacity(rows.len());
        for row in rows {
            let seq: i64 = row.try_get("last")?;
            let last = sql(select::<EventRow>("where seq = $1")).bind(seq).fetch_one(&self.0.readers).await?;
            counts.push(EventCount {
                count: row.try_get("count")?,
                first_us: row.try_get("first_us")?,
                last: EventRow::read(&last)?,
            });
        }
        Ok(counts)
    }

    /// The newest events of level `warning` or graver of a station since an instant, newest first; at most `limit`.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn alarms_since(
        &self,
        station: &str,
        from_us: i64,
        limit: u32,
    ) -> Result<Vec<EventRow>, StoreError> {
        self.since(
            "where at_us >= $2 and station = $1 and level not in ('normal', 'watch') order by seq desc limit $3",
            (station, from_us, limit),
        )
        .await
    }

    /// How many events of level `warning` or graver a station has had since an instant.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn alarms_counted_since(&self, station: &str, from_us: i64) -> Result<i64, StoreError> {
        let query = sql(
            "select count(*) from events where at_us >= $2 and station = $1 and level not in ('normal', 'watch')",
        );
        query.bind(station).bind(from_us).scalar(&self.0.readers).await
    }

    /// What was done at a station since an instant, newest first; at most `limit`.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn actions_since(
        &self,
        station: &str,
        from_us: i64,
        limit: u32,
    ) -> Result<Vec<AuditRow>, StoreError> {
        self.since("where station = $1 and at_us >= $2 order by id desc limit $3", (station, from_us, limit))
            .await
    }

    /// Runs of a station that are to come or last, and those that changed since an instant, by begin; at most `limit`.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn runs_since(
        &self,
        station: &str,
        from_us: i64,
        limit: u32,
    ) -> Result<Vec<RunRow>, StoreError> {
        self.since(
            "where station = $1 and (state in ('planned', 'waiting', 'running', 'held') or at_us >= $2)
               order by aos_at_us desc, id desc limit $3",
            (station, from_us, limit),
        )
        .await
    }

    /// Commands of a station that are on their way, and those that became `unknown` since an instant and still are, newest
    /// first; at most `limit`.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn commands_unsettled(
        &self,
        station: &str,
        from_us: i64,
        limit: u32,
    ) -> Result<Vec<CommandThen>, StoreError> {
        let commands: Vec<CommandRow> = self
            .since(
                "where station = $1 and exists (select 1 from command_stages as last
                   where last.id = (select max(id) from command_stages where command = commands.id)
                     and (last.stage in ('queued', 'sealed', 'radiating', 'radiated')
                       or (last.stage = 'unknown' and last.at_us >= $2)))
                   order by id desc limit $3",
                (station, from_us, limit),
            )
            .await?;
        let mut unsettled = Vec::with_capacity(commands.len());
        for command in commands {
            let stages: Vec<StageRow> =
                super::all(self, "where command = $1 order by id", command.id).await?;
            unsettled.push(CommandThen { command, stages });
        }
        Ok(unsettled)
    }

    async fn count(&self, statement: &'static str, span: &Span<'_>) -> Result<i64, StoreError> {
        let query = sql(statement).bind(span.satellite).bind(span.station);
        query.bind(span.from_us).bind(span.to_us).scalar(&self.0.readers).await
    }

    async fn since<R: Row>(
        &self,
        condition: &'static str,
        (station, from_us, limit): (&str, i64, u32),
    ) -> Result<Vec<R>, StoreError> {
        let rows = sql(select::<R>(condition))
            .bind(station)
            .bind(from_us)
            .bind(i64::from(limit))
            .fetch_all(&self.0.readers)
            .await?;
        rows.iter().map(R::read).collect()
    }
}
