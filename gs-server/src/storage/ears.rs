//! What others heard: its rows, and whether a report or a frame is there already.

use std::collections::{HashMap, HashSet};

use mission::reception::{Content, ELSEWHERE, Ear, Known, Reception, SAME_FRAME_US, UNDATED, is_same_frame};
use mission::record::{FrameRecord, OutsideRecord};
use mission::snapshot::RecentFrame;
use mission::{FrameId, SatelliteId, UtcUs};
use sqlx::AssertSqlSafe;

use super::convert::{int, narrow};
use super::db::{
    Builder, Connection, DbRow, On, Pool, Reading, Value, fitting, grouped, insert_rows, padded, sql,
};
use super::row::{Row as _, row, select};
use super::rows::FrameRow;
use super::{During, Page, Store, StoreError};

/// Frames or checksums in one statement.
const MANY: usize = 4_096;
/// Frames with one checksum that are looked at; whoever makes more of them up meets no more.
const SAME_CHECKSUM: i64 = 4_096;
/// Of those so many for each report. They are half a window apart at least, or made up.
const SAME_WINDOW: usize = 16;
/// Frames that a restart remembers.
const RECENT: i64 = 256;

row! {
    /// What an ear other than our radio reported.
    OutsideRow in "outside_receptions" {
        /// Whose frame it is.
        satellite: String,
        /// The station that took it in.
        station: String,
        /// The frame; `None` for what is none.
        frame: Option<i64>,
        /// `frame`, `repairable`, `damaged` or `detection`.
        kind: String,
        /// Through which ear.
        source: String,
        /// What tells it from all others of that ear and receiver.
        source_id: String,
        /// The receiver's id; empty when nobody said.
        receiver: String,
        /// What its owner calls it.
        receiver_name: Option<String>,
        /// Degrees north.
        latitude_deg: Option<f64>,
        /// Degrees east.
        longitude_deg: Option<f64>,
        /// Metres.
        altitude_m: Option<f64>,
        /// When it was received.
        received_at_us: i64,
        /// How that is known.
        time_basis: String,
        /// How far off it may be.
        time_error_us: Option<i64>,
        /// Nominal frequency.
        frequency_hz: Option<f64>,
        /// Calibration offset of the receiver.
        frequency_offset_hz: Option<f64>,
        /// Doppler that was corrected.
        doppler_hz: Option<f64>,
        /// Frequency error that was measured.
        frequency_error_hz: Option<f64>,
        /// LoRa spreading factor.
        spreading_factor: Option<i64>,
        /// LoRa bandwidth.
        bandwidth_hz: Option<f64>,
        /// Denominator of the coding rate.
        coding_rate: Option<i64>,
        /// Received power.
        rssi_dbm: Option<f64>,
        /// Signal to noise ratio.
        snr_db: Option<f64>,
        /// `right`, `wrong` or `unknown`.
        radio_crc: String,
        /// Its bytes are suspect.
        noisy: bool,
        /// What it was labelled as.
        label: Option<String>,
        /// The catalogue number of the label.
        norad: Option<i64>,
        /// Bytes before the frame.
        trim_bytes: i64,
        /// Bits before that.
        trim_bits: i64,
        /// The bit that would have to be flipped.
        repaired_bit: Option<i64>,
        /// What was not believed.
        doubts: String,
        /// The report, verbatim.
        original: Option<Vec<u8>>,
        /// When it was taken in.
        taken_at_us: i64,
    }
}

impl OutsideRow {
    fn of(record: &OutsideRecord) -> Result<Self, StoreError> {
        let reception: &Reception = &record.reception;
        let (receiver, signal) = (&reception.receiver, &reception.signal);
        let (trim, bit) = match &reception.content {
            Content::Frame { trim, .. } => (*trim, None),
            Content::Damaged { offered, .. } => {
                (mission::reception::Trim::default(), offered.as_ref().map(|offered| i64::from(offered.bit)))
            }
            Content::Detection => (mission::reception::Trim::default(), None),
        };
        let doubts: Vec<&str> = reception.doubts.iter().map(|doubt| doubt.name()).collect();
        Ok(Self {
            satellite: record.satellite.to_string(),
            station: record.station.to_string(),
            frame: record.frame.map(|frame| int("frame", frame.0)).transpose()?,
            kind: reception.content.kind().into(),
            source: reception.ear.name().into(),
            source_id: reception.source_id.clone(),
            receiver: reception.receiver_id().into(),
            receiver_name: receiver.name.clone(),
            latitude_deg: receiver.latitude_deg,
            longitude_deg: receiver.longitude_deg,
            altitude_m: receiver.altitude_m,
            received_at_us: reception.received_at.0,
            time_basis: reception.time_basis.name().into(),
            time_error_us: reception.time_error_us.and_then(|us| i64::try_from(us).ok()),
            frequency_hz: signal.frequency_hz,
            frequency_offset_hz: signal.frequency_offset_hz,
            doppler_hz: signal.doppler_hz,
            frequency_error_hz: signal.frequency_error_hz,
            spreading_factor: signal.spreading_factor.map(i64::from),
            bandwidth_hz: signal.bandwidth_hz,
            coding_rate: signal.coding_rate.map(i64::from),
            rssi_dbm: signal.rssi_dbm,
            snr_db: signal.snr_db,
            radio_crc: reception.radio_crc.name().into(),
            noisy: reception.noisy,
            label: reception.label.clone(),
            norad: reception.norad.map(i64::from),
            trim_bytes: i64::from(trim.bytes),
            trim_bits: i64::from(trim.bits),
            repaired_bit: bit,
            doubts: doubts.join(" "),
            original: reception.original.as_ref().map(|original| original.to_vec()),
            taken_at_us: record.taken_at.0,
        })
    }
}

/// Frames that are new, and reports; both in few statements.
pub(super) async fn insert(
    connection: &mut Connection,
    frames: &[&FrameRecord],
    reports: &[&OutsideRecord],
) -> Result<(), StoreError> {
    insert_rows(connection, frames.iter().map(|frame| FrameRow::of(frame)), "").await?;
    let reports = reports.iter().map(|report| OutsideRow::of(report));
    insert_rows(connection, reports, " on conflict (source, source_id, receiver) do nothing").await
}

/// Which reports of others.
#[derive(Debug, Clone, Default)]
pub struct OutsideQuery {
    /// Of this satellite.
    pub satellite: Option<String>,
    /// Through this ear.
    pub source: Option<String>,
    /// Of this kind.
    pub kind: Option<String>,
    /// Received then.
    pub during: During,
    /// Which part, by the number of the report.
    pub page: Page,
}

impl Store {
    /// Reports with their numbers.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn outside(&self, query: &OutsideQuery) -> Result<Vec<(i64, OutsideRow)>, StoreError> {
        outside(&self.0.readers, query).await
    }

    /// Who else heard these frames.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn outside_of(&self, frames: &[i64]) -> Result<HashMap<i64, Vec<OutsideRow>>, StoreError> {
        let mut heard: HashMap<i64, Vec<OutsideRow>> = HashMap::new();
        for frames in frames.chunks(MANY) {
            let mut statement = Builder::new(format!("{} where frame in (", numbered()));
            for (at, frame) in frames.iter().enumerate() {
                statement.push(if at == 0 { "" } else { ", " }).push_bind(*frame);
            }
            statement.push(") order by id");
            for row in &statement.build().fetch_all(&self.0.readers).await? {
                let (_, row) = read(row)?;
                if let Some(frame) = row.frame {
                    heard.entry(frame).or_default().push(row);
                }
            }
        }
        Ok(heard)
    }

    /// Which of these reports are stored already, by ear, id and receiver.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn known_reports(
        &self,
        reports: &[&Reception],
    ) -> Result<HashSet<(Ear, String, String)>, StoreError> {
        let mut known = HashSet::new();
        for ear in Ear::ALL {
            let of_ear = reports.iter().copied().filter(|report| report.ear == ear).collect::<Vec<_>>();
            if !self.known_in_a_row(ear, &of_ear, &mut known).await? {
                self.known_each(&of_ear, &mut known).await?;
            }
        }
        Ok(known)
    }

    /// Whose ids begin with their time stand side by side in the index when they came one after another: one look at all
    /// between the first and the last, where that is not many more. False when it was no use.
    async fn known_in_a_row(
        &self,
        ear: Ear,
        reports: &[&Reception],
        known: &mut HashSet<(Ear, String, String)>,
    ) -> Result<bool, StoreError> {
        let ids = || reports.iter().map(|report| report.source_id.as_str());
        let (Some(first), Some(last)) = (ids().min(), ids().max()) else { return Ok(true) };
        let most = reports.len() as i64 * 2;
        let between = "from outside_receptions where source = ? and source_id >= ? and source_id <= ?";
        let count = sql(AssertSqlSafe(format!("select count(*) from (select 1 {between} limit ?) as found")));
        let count = count.bind(ear.name()).bind(first).bind(last).bind(most + 1);
        let count: i64 = count.scalar(&self.0.readers).await?;
        if count > most || count == 0 {
            return Ok(count == 0);
        }
        let rows = sql(AssertSqlSafe(format!("select source_id, receiver {between}")));
        for row in &rows.bind(ear.name()).bind(first).bind(last).fetch_all(&self.0.readers).await? {
            known.insert((ear, row.try_get("source_id")?, row.try_get("receiver")?));
        }
        Ok(true)
    }

    /// Wherever they stand.
    async fn known_each(
        &self,
        reports: &[&Reception],
        known: &mut HashSet<(Ear, String, String)>,
    ) -> Result<(), StoreError> {
        let mut rest = reports;
        while !rest.is_empty() {
            let (reports, later) = rest.split_at(fitting(rest.len(), 3));
            rest = later;
            let mut values = Vec::with_capacity(reports.len() * 3);
            for report in reports {
                let key = [report.ear.name(), &report.source_id, report.receiver_id()];
                values.extend(key.map(Value::from));
            }
            let head = "select source, source_id, receiver from outside_receptions
                where (source, source_id, receiver) in (values ";
            let statement = grouped(head, (reports.len(), 3), ")", values);
            for row in &statement.fetch_all(&self.0.readers).await? {
                let source: String = row.try_get("source")?;
                if let Some(ear) = Ear::from_name(&source) {
                    known.insert((ear, row.try_get("source_id")?, row.try_get("receiver")?));
                }
            }
        }
        Ok(())
    }

    /// The frames of the archive that these reports may be of, in their order; of each the nearest in time first.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn known_frames(
        &self,
        satellite: &SatelliteId,
        reports: &[&Reception],
    ) -> Result<Vec<Box<[Known]>>, StoreError> {
        let mut found = Vec::with_capacity(reports.len());
        for reports in reports.chunks(MANY) {
            let candidates = self.candidates(satellite, reports).await?;
            found.extend(reports.iter().map(|report| nearest(report, &candidates)));
        }
        Ok(found)
    }

    /// Frames with the bytes of these reports.
    async fn candidates(
        &self,
        satellite: &SatelliteId,
        reports: &[&Reception],
    ) -> Result<Candidates, StoreError> {
        let checksums: HashSet<&[u8]> =
            reports.iter().filter_map(|report| report.frame()?.get(8..12)).collect();
        let mut candidates = Candidates::new();
        if checksums.is_empty() {
            return Ok(candidates);
        }
        let mut values: Vec<Value> = vec![ELSEWHERE.into(), UNDATED.into(), satellite.as_str().into()];
        values.extend(checksums.iter().copied().map(Value::from));
        // The last one again, up to a number that other statements have as well.
        let columns = padded(checksums.len());
        values.resize(3 + columns, checksums.iter().copied().last().map_or(Value::Bytes(None), Value::from));
        let head = "select id, bytes, heard_at_us,
              cast(case when station = ? and link = ? then 0 else 1 end as bigint) as dated
            from frames where satellite = ? and nested = 0 and substr(bytes, 9, 4) in ";
        values.push(SAME_CHECKSUM.max(checksums.len() as i64 * 4).into());
        let statement = grouped(head, (1, columns), " order by id desc limit ?", values);
        for row in &statement.fetch_all(&self.0.readers).await? {
            let id: i64 = row.try_get("id")?;
            let mut at = UtcUs(row.try_get("heard_at_us")?);
            let mut dated = row.try_get::<i64>("dated")? == 1;
            if !dated && let Some(told_us) = told_us(id, &self.0.readers).await? {
                (at, dated) = (UtcUs(told_us), true);
            }
            candidates.entry(row.try_get("bytes")?).or_default().push(Known {
                frame: FrameId(narrow("frames.id", id)?),
                at,
                dated,
            });
        }
        Ok(candidates)
    }
}

/// Frames by their bytes.
type Candidates = HashMap<Vec<u8>, Vec<Known>>;

/// Those that the report may be of, the nearest first, of two as near the older, as the engine has it.
fn nearest(report: &Reception, candidates: &Candidates) -> Box<[Known]> {
    let Some(bytes) = report.frame() else { return Box::default() };
    let mine = (report.received_at, report.is_dated());
    let same = candidates.get(bytes).into_iter().flatten();
    let same = same.filter(|known| is_same_frame(bytes, (known.at, known.dated), mine));
    let mut same: Vec<Known> = same.copied().collect();
    same.sort_unstable_by_key(|known| (known.at.0.abs_diff(mine.0.0), known.frame.0));
    same.truncate(SAME_WINDOW);
    same.into()
}

/// Reports with their numbers.
pub(super) async fn outside(
    readers: &Pool,
    query: &OutsideQuery,
) -> Result<Vec<(i64, OutsideRow)>, StoreError> {
    let mut statement = Builder::new(format!("{} where 1 = 1", numbered()));
    for (column, value) in [("satellite", &query.satellite), ("source", &query.source), ("kind", &query.kind)]
    {
        if let Some(value) = value {
            statement.push(format!(" and {column} = ")).push_bind(value.as_str());
        }
    }
    if let Some(start_us) = query.during.start_us {
        statement.push(" and received_at_us >= ").push_bind(start_us);
    }
    if let Some(stop_us) = query.during.stop_us {
        statement.push(" and received_at_us < ").push_bind(stop_us);
    }
    if let Some(after) = query.page.after {
        statement.push(" and id > ").push_bind(after);
    }
    if let Some(before) = query.page.before {
        statement.push(" and id < ").push_bind(before);
    }
    let forward = query.page.after.is_some();
    statement.push(if forward { " order by id limit " } else { " order by id desc limit " });
    statement.push_bind(query.page.rows());
    let rows = statement.build().fetch_all(readers).await?;
    rows.iter().map(read).collect()
}

/// When a frame was heard that came without a time, as somebody has told since.
pub(super) async fn told_us<'a, T>(frame: i64, on: T) -> Result<Option<i64>, StoreError>
where
    T: Into<On<'a>>,
{
    sql("select at_us from (
           select received_at_us as at_us, taken_at_us as came_us, id from outside_receptions
             where frame = ?1 and time_basis not in ('import', 'board-alone')
           union all select received_at_us as at_us, received_at_us as came_us, id from receptions where frame = ?1) as told
         order by came_us, id limit 1")
    .bind(frame)
    .scalar_optional(on)
    .await
}

/// The newest frames of these satellites, for a restart.
pub(super) async fn recent(
    connection: &mut Reading,
    satellites: &[SatelliteId],
) -> Result<Vec<RecentFrame>, StoreError> {
    let rows = sql(select::<FrameRow>("where nested = 0 order by id desc limit ?"))
        .bind(RECENT)
        .fetch_all(&mut *connection)
        .await?;
    let rows: Vec<FrameRow> = rows.iter().map(FrameRow::read).collect::<Result<_, _>>()?;
    let newest = rows.iter().map(|row| row.heard_at_us).max().unwrap_or(0);
    let mut recent = Vec::new();
    for row in rows.into_iter().rev().filter(|row| newest - row.heard_at_us <= 4 * SAME_FRAME_US) {
        let Some(satellite) = satellites.iter().find(|satellite| satellite.as_str() == row.satellite) else {
            continue;
        };
        let elsewhere = row.station == ELSEWHERE;
        let undated = elsewhere && row.link == UNDATED;
        let told_us = if undated { told_us(row.id, &mut *connection).await? } else { None };
        recent.push(RecentFrame {
            id: FrameId(narrow("frames.id", row.id)?),
            satellite: satellite.clone(),
            at: UtcUs(told_us.unwrap_or(row.heard_at_us)),
            dated: !undated || told_us.is_some(),
            bytes: row.bytes.into(),
            elsewhere,
        });
    }
    Ok(recent)
}

fn numbered() -> String {
    OutsideRow::SELECT.replacen("select ", "select id, ", 1)
}

fn read(row: &DbRow) -> Result<(i64, OutsideRow), StoreError> {
    Ok((row.try_get("id")?, OutsideRow::read(row)?))
}
