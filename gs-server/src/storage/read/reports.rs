//! What reports count: everything of one satellite over one station between two instants, both included.

use super::super::db::{Query, sql};
use super::super::row::{Row, select};
use super::super::{
    CommandRow, EventRow, FrameRow, ImageRow, PassRow, ReceptionRow, RunRow, StageRow, Store, StoreError,
};
use super::{Heard, one};

/// Of whom, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span<'a> {
    /// The satellite.
    pub satellite: &'a str,
    /// The station.
    pub station: &'a str,
    /// From here, microseconds since 1970 UTC.
    pub from_us: i64,
    /// To here.
    pub to_us: i64,
}

/// A command with its stages up to an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandThen {
    /// The command.
    pub command: CommandRow,
    /// Its stages until then, in order.
    pub stages: Vec<StageRow>,
}

/// When a chunk came that is held, or another version of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChunkCame {
    /// Which.
    pub index: i64,
    /// When.
    pub at_us: i64,
    /// It differs from what is held.
    pub conflict: bool,
}

impl Store {
    /// One pass.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn pass(&self, id: i64) -> Result<Option<PassRow>, StoreError> {
        one(self, "where id = $1", id).await
    }

    /// Passes that had ended and whose report may be missing: the newest ones.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn passes_ended(&self, limit: u32) -> Result<Vec<PassRow>, StoreError> {
        self.reported("where ended_at_us is not null order by id desc limit $1", |query| {
            query.bind(i64::from(limit))
        })
        .await
    }

    /// Frames with their receptions, oldest first.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn frames_in(&self, span: &Span<'_>) -> Result<Vec<Heard>, StoreError> {
        let frames: Vec<FrameRow> = self
            .reported(
                "where satellite = $1 and station = $2 and heard_at_us between $3 and $4 order by heard_at_us, id",
                |query| bound(query, span),
            )
            .await?;
        let receptions: Vec<ReceptionRow> = self
            .reported(
                "where frame in (select id from frames
                   where satellite = $1 and station = $2 and heard_at_us between $3 and $4) order by frame, id",
                |query| bound(query, span),
            )
            .await?;
        let mut heard: Vec<Heard> =
            frames.into_iter().map(|frame| Heard { frame, receptions: Vec::new() }).collect();
        let mut places: Vec<(i64, usize)> =
            heard.iter().enumerate().map(|(place, heard)| (heard.frame.id, place)).collect();
        places.sort_unstable();
        for row in receptions {
            let found = places.binary_search_by_key(&row.frame, |(frame, _)| *frame);
            if let Some(heard) =
                found.ok().and_then(|at| places.get(at)).and_then(|(_, place)| heard.get_mut(*place))
            {
                heard.receptions.push(row);
            }
        }
        Ok(heard)
    }

    /// Commands that reached a stage in the span, by number, with their stages up to its end; at most `limit`.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn commands_in(&self, span: &Span<'_>, limit: u32) -> Result<Vec<CommandThen>, StoreError> {
        let commands: Vec<CommandRow> = self
            .reported(
                "where id in (select command from command_stages
                   where satellite = $1 and station = $2 and at_us between $3 and $4) order by id limit $5",
                |query| bound(query, span).bind(i64::from(limit)),
            )
            .await?;
        let mut then = Vec::with_capacity(commands.len());
        for command in commands {
            let stages = self
                .reported("where command = $1 and at_us <= $2 order by id", |query| {
                    query.bind(command.id).bind(span.to_us)
                })
                .await?;
            then.push(CommandThen { command, stages });
        }
        Ok(then)
    }

    /// How many commands reached a stage in the span.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn commands_counted(&self, span: &Span<'_>) -> Result<i64, StoreError> {
        let query = sql("select count(distinct command) from command_stages
               where satellite = $1 and station = $2 and at_us between $3 and $4");
        bound(query, span).scalar(&self.0.readers).await
    }

    /// Images that were declared or grew in the span, by number, with what came of their chunks up to its end.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn images_in(&self, span: &Span<'_>) -> Result<Vec<(ImageRow, Vec<ChunkCame>)>, StoreError> {
        let images: Vec<ImageRow> = self
            .reported(
                "where satellite = $1 and ((station = $2 and declared_at_us between $3 and $4)
                   or id in (select image from chunks where frame in (select id from frames
                     where satellite = $1 and station = $2 and heard_at_us between $3 and $4))) order by id",
                |query| bound(query, span),
            )
            .await?;
        let mut with_chunks = Vec::with_capacity(images.len());
        for image in images {
            // Without their bytes: a picture has many.
            let rows = sql("select chunk_index, at_us, conflict from chunks
                   where image = $1 and at_us <= $2 order by chunk_index, id")
            .bind(image.id)
            .bind(span.to_us)
            .fetch_all(&self.0.readers)
            .await?;
            let came = rows.iter().map(|row| {
                Ok(ChunkCame {
                    index: row.try_get("chunk_index")?,
                    at_us: row.try_get("at_us")?,
                    conflict: row.try_get::<i64>("conflict")? != 0,
                })
            });
            with_chunks.push((image, came.collect::<Result<_, StoreError>>()?));
        }
        Ok(with_chunks)
    }

    /// Events of level `warning` or graver of this satellite and of the station itself, in order; at most `limit`.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn alarms_in(&self, span: &Span<'_>, limit: u32) -> Result<Vec<EventRow>, StoreError> {
        self.reported(
            "where at_us between $3 and $4 and station = $2 and (satellite is null or satellite = $1)
               and level not in ('normal', 'watch') order by seq limit $5",
            |query| bound(query, span).bind(i64::from(limit)),
        )
        .await
    }

    /// How many alarms there are in the span.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn alarms_counted(&self, span: &Span<'_>) -> Result<i64, StoreError> {
        let query = sql("select count(*) from events where at_us between $3 and $4 and station = $2
               and (satellite is null or satellite = $1) and level not in ('normal', 'watch')");
        bound(query, span).scalar(&self.0.readers).await
    }

    /// Runs of plans whose pass overlaps the span, in order.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn runs_in(&self, span: &Span<'_>) -> Result<Vec<RunRow>, StoreError> {
        self.reported(
            "where satellite = $1 and station = $2 and aos_at_us <= $4 and los_at_us >= $3 order by aos_at_us, id",
            |query| bound(query, span),
        )
        .await
    }

    /// Rows of a table by a condition that is written here.
    async fn reported<R: Row>(
        &self,
        condition: &'static str,
        bind: impl FnOnce(Query) -> Query,
    ) -> Result<Vec<R>, StoreError> {
        let rows = bind(sql(select::<R>(condition))).fetch_all(&self.0.readers).await?;
        rows.iter().map(R::read).collect()
    }
}

fn bound(query: Query, span: &Span<'_>) -> Query {
    query.bind(span.satellite).bind(span.station).bind(span.from_us).bind(span.to_us)
}
