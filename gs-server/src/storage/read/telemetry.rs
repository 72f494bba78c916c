//! Values over time, thinned out here so that a year costs no more to send than an hour.

use super::super::db::sql;
use super::super::row::{Row as _, select};
use super::super::{ParameterRow, Store, StoreError, TelemetryRow};

/// The most buckets or samples that one question brings.
const MOST_POINTS: u32 = 10_000;

/// Which values.
#[derive(Debug, Clone)]
pub struct TelemetryQuery {
    /// Whose.
    pub satellite: String,
    /// Which, e.g. `heartbeat.temp`.
    pub parameter: String,
    /// From this time on.
    pub start_us: i64,
    /// Before this time.
    pub stop_us: i64,
    /// More values than this come as so many buckets; 1 to 10,000, 0 stands for 1000.
    pub max_points: u32,
}

/// Values of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Which parameter.
    pub parameter: ParameterRow,
    /// Its values.
    pub samples: Samples,
}

/// As they came, or thinned out.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// Every value, in the order of time.
    Raw(Vec<Sample>),
    /// Buckets of equal length, in the order of time; those without a value are left out.
    Buckets(Vec<Bucket>),
}

/// One value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// When it was heard.
    pub at_us: i64,
    /// The value; `None` is invalid.
    pub value: Option<f64>,
    /// The frame it stands in.
    pub frame: i64,
}

/// What is known of the values in a span of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bucket {
    /// From this time on.
    pub start_us: i64,
    /// Before this time.
    pub stop_us: i64,
    /// Valid values.
    pub count: i64,
    /// Invalid values.
    pub invalid: i64,
    /// The smallest valid value.
    pub min: Option<f64>,
    /// The largest valid value.
    pub max: Option<f64>,
    /// The mean of the valid values.
    pub mean: Option<f64>,
    /// The newest value, valid or not.
    pub last: Sample,
}

/// A parameter and its newest value.
#[derive(Debug, Clone, PartialEq)]
pub struct LatestValue {
    /// Which parameter.
    pub parameter: ParameterRow,
    /// Its newest value.
    pub sample: Sample,
}

impl Sample {
    fn of(row: &TelemetryRow) -> Self {
        Self { at_us: row.at_us, value: row.value, frame: row.frame }
    }
}

impl Store {
    /// All parameters that were ever heard, by satellite and name.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn parameters(&self) -> Result<Vec<ParameterRow>, StoreError> {
        let rows = sql(select::<ParameterRow>("order by satellite, name")).fetch_all(&self.0.readers).await?;
        rows.iter().map(ParameterRow::read).collect()
    }

    /// The newest value of each parameter of a satellite, by name.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn latest(&self, satellite: &str) -> Result<Vec<LatestValue>, StoreError> {
        let mut latest = Vec::new();
        for parameter in self.parameters().await?.into_iter().filter(|row| row.satellite == satellite) {
            if let Some(sample) = self.newest(parameter.id, i64::MIN, i64::MAX).await? {
                latest.push(LatestValue { parameter, sample });
            }
        }
        Ok(latest)
    }

    /// Values of one parameter in a span of time, thinned out when they are many; `None` when the satellite was
    /// never heard to have such a parameter.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn telemetry(&self, query: &TelemetryQuery) -> Result<Option<Series>, StoreError> {
        let found = sql(select::<ParameterRow>("where satellite = ? and name = ?"))
            .bind(&query.satellite)
            .bind(&query.parameter)
            .fetch_optional(&self.0.readers)
            .await?;
        let Some(found) = found else { return Ok(None) };
        let parameter = ParameterRow::read(&found)?;
        let points = match query.max_points {
            0 => 1000,
            points => points.min(MOST_POINTS),
        };
        let rows = sql(select::<TelemetryRow>(
            "where parameter = ? and at_us >= ? and at_us < ? order by at_us, frame limit ?",
        ))
        .bind(parameter.id)
        .bind(query.start_us)
        .bind(query.stop_us)
        .bind(i64::from(points) + 1)
        .fetch_all(&self.0.readers)
        .await?;
        let samples = if rows.len() <= points as usize {
            let rows = rows.iter().map(TelemetryRow::read).collect::<Result<Vec<_>, _>>()?;
            Samples::Raw(rows.iter().map(Sample::of).collect())
        } else {
            Samples::Buckets(self.buckets(parameter.id, query, points).await?)
        };
        Ok(Some(Series { parameter, samples }))
    }

    async fn newest(
        &self,
        parameter: i64,
        start_us: i64,
        stop_us: i64,
    ) -> Result<Option<Sample>, StoreError> {
        let row = sql(select::<TelemetryRow>(
            "where parameter = ? and at_us >= ? and at_us < ? order by at_us desc, frame desc limit 1",
        ))
        .bind(parameter)
        .bind(start_us)
        .bind(stop_us)
        .fetch_optional(&self.0.readers)
        .await?;
        Ok(row.as_ref().map(TelemetryRow::read).transpose()?.as_ref().map(Sample::of))
    }

    /// One sweep over a bucket after the other: they lie side by side on the disk, and nothing has to be sorted as
    /// `group by` would.
    async fn buckets(
        &self,
        parameter: i64,
        query: &TelemetryQuery,
        count: u32,
    ) -> Result<Vec<Bucket>, StoreError> {
        // The span that holds values: who asks from 1970 to the end of time still gets useful buckets.
        let span = sql(
            "select (select min(at_us) from telemetry where parameter = ?1 and at_us >= ?2 and at_us < ?3) as first,
                    (select max(at_us) from telemetry where parameter = ?1 and at_us >= ?2 and at_us < ?3) as last",
        )
        .bind(parameter)
        .bind(query.start_us)
        .bind(query.stop_us)
        .fetch_one(&self.0.readers)
        .await?;
        let (first, last): (i64, i64) = (span.try_get("first")?, span.try_get("last")?);
        let width_us = (last.abs_diff(first) / u64::from(count) + 1).try_into().unwrap_or(i64::MAX);
        let mut buckets = Vec::with_capacity(count as usize);
        let mut start_us = first;
        while start_us <= last {
            let stop_us = start_us.saturating_add(width_us);
            let row =
                sql("select count(*) as rows, count(value) as count, min(value) as min, max(value) as max,
                   avg(value) as mean from telemetry where parameter = ? and at_us >= ? and at_us < ?")
                .bind(parameter)
                .bind(start_us)
                .bind(stop_us)
                .fetch_one(&self.0.readers)
                .await?;
            let count: i64 = row.try_get("count")?;
            if let Some(last) = self.newest(parameter, start_us, stop_us).await? {
                buckets.push(Bucket {
                    start_us,
                    stop_us,
                    count,
                    invalid: row.try_get::<i64>("rows")? - count,
                    min: row.try_get("min")?,
                    max: row.try_get("max")?,
                    mean: row.try_get("mean")?,
                    last,
                });
            }
            start_us = stop_us;
        }
        Ok(buckets)
    }
}
