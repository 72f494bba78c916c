//! What a month came to, by UTC.

use std::collections::BTreeMap;
use std::str::FromStr;

use api::{DayCount, IncidentCount, MonthOfSatellite, MonthReport, PacketCount, WordCount};
use jiff::ToSpan as _;
use jiff::civil::Date;
use jiff::tz::TimeZone;
use mission::{Level, UtcUs};
use protocol::Downlink;
use radio::airtime::MAX_FRAME_BYTES;

use super::pass::{MARGIN_US, number, seconds, seconds_of, time};
use crate::http::{Identity, SatelliteIdentity};
use crate::storage::{EventCount, FrameCount, PassRow, Span, Store, StoreError};

/// A month of the calendar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Month(Date);

/// Text that is no month.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no month from 1970 on: write it as 2026-11")]
pub struct MonthError(String);

impl FromStr for Month {
    type Err = MonthError;

    fn from_str(text: &str) -> Result<Self, MonthError> {
        let wrong = || MonthError(text.chars().take(40).collect());
        let (year, month) = text.split_once('-').ok_or_else(wrong)?;
        if year.len() != 4 || month.len() != 2 || !text.bytes().all(|b| b.is_ascii_digit() || b == b'-') {
            return Err(wrong());
        }
        let year: i16 = year.parse().map_err(|_| wrong())?;
        let month: i8 = month.parse().map_err(|_| wrong())?;
        if year < 1970 {
            return Err(wrong());
        }
        // The last month that jiff knows has no next one.
        let date = Date::new(year, month, 1).map_err(|_| wrong())?;
        date.checked_add(1.month()).map_err(|_| wrong())?;
        Ok(Self(date))
    }
}

impl Month {
    /// The month that an instant lies in.
    #[must_use]
    pub fn of(at: UtcUs) -> Self {
        let text = time(at.0).to_string();
        // What lies outside the calendar belongs to its beginning.
        text.get(..7).and_then(|text| text.parse().ok()).unwrap_or(Self(Date::constant(1970, 1, 1)))
    }

    /// Its first microsecond, and that of the next one.
    fn span_us(self) -> (i64, i64) {
        let us = |date: Date| {
            date.to_zoned(TimeZone::UTC).map_or(i64::MAX, |midnight| midnight.timestamp().as_microsecond())
        };
        (us(self.0), us(self.0.saturating_add(1.month())))
    }

    /// `2026-11`.
    fn text(self) -> String {
        self.0.strftime("%Y-%m").to_string()
    }
}

impl std::fmt::Display for Month {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text())
    }
}

/// The report of a month, as of its end, or as of `now` while it lasts.
///
/// # Errors
/// [`StoreError`] when the archive cannot be read.
pub async fn month_report(
    store: &Store,
    identity: &Identity,
    month: Month,
    now: UtcUs,
) -> Result<MonthReport, StoreError> {
    let (from_us, next_us) = month.span_us();
    let is_final = next_us <= now.0;
    let to_us = if is_final { next_us - 1 } else { now.0.max(from_us) };
    let station = identity.station.as_str();
    let passes = store.passes_between(station, (from_us, to_us)).await?;
    let mut satellites = Vec::new();
    for known in &identity.satellites {
        let span = Span { satellite: known.id.as_str(), station, from_us, to_us };
        let own: Vec<&PassRow> = passes.iter().filter(|pass| pass.satellite == span.satellite).collect();
        satellites.push(of_satellite(store, known, &span, &own).await?);
    }
    let mut incidents: Vec<_> =
        store.incidents_counted(station, (from_us, to_us)).await?.into_iter().map(incident).collect();
    incidents.sort_by_key(|incident: &IncidentCount| {
        let level = incident.level.parse::<Level>().unwrap_or_default();
        (std::cmp::Reverse((level, incident.count)), incident.kind.clone())
    });
    Ok(MonthReport {
        month: month.text(),
        station: station.to_owned(),
        simulated: identity.simulated,
        as_of: time(to_us),
        is_final,
        satellites,
        incidents,
    })
}

async fn of_satellite(
    store: &Store,
    known: &SatelliteIdentity,
    span: &Span<'_>,
    passes: &[&PassRow],
) -> Result<MonthOfSatellite, StoreError> {
    let counts = store.frames_counted(span).await?;
    let mut passes_heard = 0;
    for pass in passes {
        let los_us = pass.los_at_us.or(pass.ended_at_us).unwrap_or(span.to_us);
        let (from_us, to_us) = (pass.aos_at_us.saturating_sub(MARGIN_US), los_us.saturating_add(MARGIN_US));
        let heard = store.heard_between(span.satellite, span.station, from_us, to_us.min(span.to_us)).await?;
        passes_heard += u64::from(heard.frames > 0);
    }
    let in_view_us: i64 = passes
        .iter()
        .filter_map(|pass| Some(pass.los_at_us?.min(span.to_us).saturating_sub(pass.aos_at_us)))
        .sum();
    let radiated = number(store.radiated_counted(span).await?);
    let [images_declared, images_completed, chunks, elements] = store.gains_counted(span).await?.map(number);
    let mut runs: BTreeMap<String, u64> = BTreeMap::new();
    for run in store.runs_in(span).await? {
        // One that began in the month before is counted there.
        if run.aos_at_us >= span.from_us {
            *runs.entry(run.outcome.unwrap_or(run.state)).or_default() += 1;
        }
    }
    let sum = |of: fn(&FrameCount) -> i64| number(counts.iter().map(of).sum());
    Ok(MonthOfSatellite {
        satellite: span.satellite.to_owned(),
        passes: passes.len() as u64,
        passes_heard,
        in_view_s: seconds(in_view_us),
        frames: sum(|count| count.frames),
        bytes: sum(|count| count.bytes.saturating_mul(count.frames)),
        packets: packets(&counts),
        airtime_down_s: seconds_of(counts.iter().map(|count| airtime_us(known, count)).sum()),
        radiated,
        airtime_up_s: seconds_of(known.timing.frame_us(MAX_FRAME_BYTES).saturating_mul(radiated)),
        commands: store
            .outcomes_counted(span)
            .await?
            .into_iter()
            .map(|(word, count)| WordCount { word, count: number(count) })
            .collect(),
        runs: runs.into_iter().map(|(word, count)| WordCount { word, count }).collect(),
        images_declared,
        images_completed,
        chunks,
        elements,
        days: days(&counts, passes, span),
    })
}

fn airtime_us(known: &SatelliteIdentity, count: &FrameCount) -> u64 {
    let bytes = usize::try_from(count.bytes).unwrap_or(0);
    known.timing.frame_us(bytes).saturating_mul(number(count.frames))
}

fn packets(counts: &[FrameCount]) -> Vec<PacketCount> {
    let mut by_type: BTreeMap<Option<i64>, u64> = BTreeMap::new();
    for count in counts {
        *by_type.entry(count.packet_type).or_default() += number(count.frames);
    }
    let mut packets: Vec<PacketCount> = by_type
        .into_iter()
        .map(|(code, frames)| {
            let packet_type = code.and_then(|code| u8::try_from(code).ok());
            let packet_name = packet_type.and_then(Downlink::name_of).map(str::to_owned);
            PacketCount { packet_type, packet_name, frames }
        })
        .collect();
    packets.sort_by_key(|count| std::cmp::Reverse(count.frames));
    packets
}

fn days(counts: &[FrameCount], passes: &[&PassRow], span: &Span<'_>) -> Vec<DayCount> {
    const DAY_US: i64 = 86_400_000_000;
    let day = |us: i64| us.div_euclid(DAY_US);
    (day(span.from_us)..=day(span.to_us))
        .map(|of| DayCount {
            day: time(of * DAY_US).to_string().chars().take(10).collect(),
            passes: passes.iter().filter(|pass| day(pass.aos_at_us) == of).count() as u64,
            frames: number(counts.iter().filter(|count| count.day == of).map(|count| count.frames).sum()),
        })
        .collect()
}

fn incident(count: EventCount) -> IncidentCount {
    IncidentCount {
        kind: count.last.kind,
        level: count.last.level,
        count: number(count.count),
        first: time(count.first_us),
        last: time(count.last.at_us),
        message: count.last.message,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_month_is_written_in_one_way() {
        let month: Month = "2024-02".parse().unwrap();
        let (from, next) = month.span_us();
        assert_eq!((month.text().as_str(), next - from), ("2024-02", 29 * 86_400_000_000));
        assert_eq!(time(from).to_string(), "2024-02-01T00:00:00.000Z");
        assert_eq!(Month::of(UtcUs(next - 1)), month);
        assert_ne!(Month::of(UtcUs(next)), month);
        for wrong in [
            "",
            "2024",
            "2024-13",
            "2024-00",
            "2024-2",
            "24-02",
            "1969-12",
            "2024-02-01",
            "+024-02",
            "9999-12",
        ] {
            assert!(wrong.parse::<Month>().is_err(), "{wrong}");
        }
    }
}
