//! Values as a table: CSV for people and spreadsheets, Parquet for programs that read millions.

use std::fmt::Write as _;
use std::sync::Arc;

use api::client::{Client, ClientError, Filter};
use api::{TelemetryPage, Time};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

/// Values that one file may have.
const ROWS_MAX: usize = 2_000_000;
/// Values asked for at once: what the server gives at most.
const PAGE: u32 = 10_000;

const SCHEMA: &str = "message telemetry {
    required int64 time (TIMESTAMP(MICROS,true));
    required binary satellite (UTF8);
    required binary parameter (UTF8);
    required binary unit (UTF8);
    optional double value;
    required int64 frame (INTEGER(64,false));
}";

/// Values of one parameter, each as it was heard.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::panes) struct Column {
    pub(in crate::panes) satellite: String,
    pub(in crate::panes) parameter: String,
    pub(in crate::panes) unit: String,
    /// Microseconds since 1970, value, frame.
    pub(in crate::panes) rows: Vec<(i64, Option<f64>, u64)>,
}

/// Every value from `from_us` until before `to_us`, none thinned: a stretch with more than one answer holds is halved.
///
/// # Errors
/// What the server says; [`ClientError::Setup`] where there are too many for one file.
pub(in crate::panes) async fn fetch(
    client: &Client,
    satellite: &str,
    parameter: &str,
    from_us: i64,
    to_us: i64,
) -> Result<Column, ClientError> {
    let mut column = Column {
        satellite: satellite.to_owned(),
        parameter: parameter.to_owned(),
        unit: String::new(),
        rows: Vec::new(),
    };
    // The wire's times have milliseconds. The earliest stretch stands last.
    let mut open = vec![(from_us.div_euclid(1000), to_us.div_euclid(1000) + 1)];
    while let Some((from_ms, to_ms)) = open.pop() {
        let filter = Filter::new()
            .satellite(satellite)
            .with("parameter", parameter)
            .with("max_points", PAGE)
            .start(Time::from_unix_us(from_ms * 1000))
            .stop(Time::from_unix_us(to_ms * 1000));
        let page: TelemetryPage = client.telemetry(&filter).await?;
        column.unit.clone_from(&page.unit);
        if page.decimated && to_ms - from_ms > 1 {
            let middle = from_ms + (to_ms - from_ms) / 2;
            open.extend([(middle, to_ms), (from_ms, middle)]);
            continue;
        }
        let samples = page.samples.iter();
        column.rows.extend(samples.map(|sample| (sample.at.unix_us(), sample.value, sample.frame)));
        if column.rows.len() > ROWS_MAX {
            return Err(ClientError::Setup(format!(
                "{parameter} has more than {ROWS_MAX} values: show less time"
            )));
        }
    }
    Ok(column)
}

/// One line for each value: `time,satellite,parameter,unit,value,frame`. What is invalid has no value.
pub(in crate::panes) fn csv(columns: &[Column]) -> Vec<u8> {
    let mut text = "time,satellite,parameter,unit,value,frame\n".to_owned();
    for column in columns {
        let fixed = [&column.satellite, &column.parameter, &column.unit].map(|cell| cell_of(cell)).join(",");
        for (at_us, value, frame) in &column.rows {
            let value = value.map(|value| value.to_string()).unwrap_or_default();
            let _ = writeln!(text, "{},{fixed},{value},{frame}", Time::from_unix_us(*at_us));
        }
    }
    text.into_bytes()
}

/// A cell of CSV (RFC 4180). What a spreadsheet would take for a formula is made a text.
pub(in crate::panes) fn cell_of(text: &str) -> String {
    let formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']);
    let text = if formula { format!("'{text}") } else { text.to_owned() };
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    }
}

/// The same as Parquet: plain pages, one row group for each parameter.
pub(in crate::panes) fn parquet(columns: &[Column]) -> Result<Vec<u8>, String> {
    parquet_of(columns).map_err(|error| error.to_string())
}

fn parquet_of(columns: &[Column]) -> Result<Vec<u8>, ParquetError> {
    let schema = Arc::new(parse_message_type(SCHEMA)?);
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, properties)?;
    for column in columns.iter().filter(|column| !column.rows.is_empty()) {
        let mut group = writer.next_row_group()?;
        let mut number = 0;
        while let Some(mut into) = group.next_column()? {
            match number {
                0 => {
                    let times: Vec<i64> = column.rows.iter().map(|row| row.0).collect();
                    into.typed::<Int64Type>().write_batch(&times, None, None)?;
                }
                1..=3 => {
                    let text = [&column.satellite, &column.parameter, &column.unit][number - 1];
                    let text = vec![ByteArray::from(text.as_str()); column.rows.len()];
                    into.typed::<ByteArrayType>().write_batch(&text, None, None)?;
                }
                4 => {
                    let values: Vec<f64> = column.rows.iter().filter_map(|row| row.1).collect();
                    let held: Vec<i16> = column.rows.iter().map(|row| row.1.is_some().into()).collect();
                    into.typed::<DoubleType>().write_batch(&values, Some(&held), None)?;
                }
                _ => {
                    let frames: Vec<i64> = column.rows.iter().map(|row| row.2 as i64).collect();
                    into.typed::<Int64Type>().write_batch(&frames, None, None)?;
                }
            }
            into.close()?;
            number += 1;
        }
        group.close()?;
    }
    writer.into_inner()
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::RowAccessor as _;

    use super::*;

    fn columns() -> Vec<Column> {
        let column = |parameter: &str, unit: &str, rows| Column {
            satellite: "pixelsat-1".to_owned(),
            parameter: parameter.to_owned(),
            unit: unit.to_owned(),
            rows,
        };
        let at_us = 1_795_324_765_123_000;
        vec![
            column("heartbeat.temp", "°C", vec![(at_us, Some(21.5), 7), (at_us + 1000, None, 8)]),
            column("a,\"b\"", "", vec![(at_us, Some(-0.000_1), 7)]),
            column("none", "", vec![]),
        ]
    }

    #[test]
    fn csv_reads_back_equal() {
        let text = String::from_utf8(csv(&columns())).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines,
            [
                "time,satellite,parameter,unit,value,frame",
                "2026-11-22T05:19:25.123Z,pixelsat-1,heartbeat.temp,°C,21.5,7",
                "2026-11-22T05:19:25.124Z,pixelsat-1,heartbeat.temp,°C,,8",
                "2026-11-22T05:19:25.123Z,pixelsat-1,\"a,\"\"b\"\"\",,-0.0001,7",
            ]
        );
        assert_eq!(cell_of("=HYPERLINK(1)"), "'=HYPERLINK(1)");
    }

    #[test]
    fn parquet_reads_back_equal() {
        let bytes = parquet(&columns()).unwrap();
        let mut file = tempfile::tempfile().unwrap();
        std::io::Write::write_all(&mut file, &bytes).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let mut back = Vec::new();
        for row in reader.get_row_iter(None).unwrap() {
            let row = row.unwrap();
            let value = row.get_double(4).ok();
            back.push((
                row.get_timestamp_micros(0).unwrap(),
                row.get_string(2).unwrap().clone(),
                value,
                row.get_ulong(5).unwrap(),
            ));
        }
        let mut expected = Vec::new();
        for column in columns() {
            for (at_us, value, frame) in column.rows {
                expected.push((at_us, column.parameter.clone(), value, frame));
            }
        }
        assert_eq!(back, expected);
    }
}
