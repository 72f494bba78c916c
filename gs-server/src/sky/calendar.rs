//! Passes as a calendar (RFC 5545), for a file or a feed that calendars subscribe to.
//!
//! An event keeps its UID when fresher elements move the pass by seconds, and its SEQUENCE grows with the epoch of the
//! elements, so that a refreshed feed updates what is there. The orbit of a pass is told by the half hour in which its TCA
//! lies: revolution numbers would name it better, but publishers count them differently, and new satellites have none. (A
//! TCA that moves by 5 s crosses into another half hour once in 360 times; the event is then another one.)

use std::collections::HashMap;
use std::fmt::Write as _;

use api::{FineTime, PassView};
use sha2::{Digest as _, Sha256};
use tle::UtcInstant;

use super::instant;
use super::table::{clock, day};

/// Octets of a line without its line end.
const LINE_OCTETS: usize = 75;
const HALF_HOUR_US: i64 = 1_800_000_000;
/// 2000-01-01T00:00:00Z: SEQUENCE counts minutes from here, to stay small.
const YEAR_2000_US: i64 = 946_684_800_000_000;

/// The passes as one calendar. `now` is when it was made, `name` what calendars show.
#[must_use]
pub fn icalendar(passes: &[PassView], name: &str, now: FineTime) -> String {
    let mut text = String::new();
    let mut line = |content: &str| fold(&mut text, content);
    line("BEGIN:VCALENDAR");
    line("VERSION:2.0");
    line("PRODID:-//PixelSat Ground//passes//EN");
    line("CALSCALE:GREGORIAN");
    line("METHOD:PUBLISH");
    line(&format!("NAME:{}", escaped(name)));
    line(&format!("X-WR-CALNAME:{}", escaped(name)));
    line("REFRESH-INTERVAL;VALUE=DURATION:PT2H");
    line("X-PUBLISHED-TTL:PT2H");
    let mut seen: HashMap<String, u32> = HashMap::new();
    for pass in passes {
        let uid = uid(pass);
        // A mask may cut one orbit into two passes.
        let nth = seen.entry(uid.clone()).and_modify(|nth| *nth += 1).or_insert(1);
        let nth = if *nth == 1 { String::new() } else { format!("-{nth}") };
        line("BEGIN:VEVENT");
        line(&format!("UID:{uid}{nth}@passes.pixelsat-ground"));
        line(&format!("DTSTAMP:{}", stamp(now.unix_us())));
        line(&format!("SEQUENCE:{}", sequence(pass.epoch)));
        line(&format!("DTSTART:{}", stamp(pass.aos.unix_us())));
        // Whole seconds: the end is rounded up, so that no event has no length.
        line(&format!("DTEND:{}", stamp(pass.los.unix_us() + 999_999)));
        line(&format!(
            "SUMMARY:{}",
            escaped(&format!("{} over {}, {:.0}°", pass.satellite, pass.station, pass.max_elevation_deg))
        ));
        line(&format!("LOCATION:{}", escaped(&pass.station)));
        line(&format!("DESCRIPTION:{}", escaped(&description(pass))));
        line("CATEGORIES:pass");
        line("TRANSP:TRANSPARENT");
        line("END:VEVENT");
    }
    line("END:VCALENDAR");
    text
}

fn uid(pass: &PassView) -> String {
    let satellite = pass.norad_cat_id.map_or_else(|| pass.satellite.clone(), |number| number.to_string());
    let digest = Sha256::digest(format!("{satellite}\n{}", pass.station));
    let half_hour = (pass.tca.unix_us() + HALF_HOUR_US / 2).div_euclid(HALF_HOUR_US) * HALF_HOUR_US;
    format!("{}-{}", stamp(half_hour), hex::encode(&digest[..8]))
}

fn sequence(epoch: FineTime) -> i64 {
    ((epoch.unix_us() - YEAR_2000_US) / 60_000_000).clamp(0, i64::from(i32::MAX))
}

/// `20261122T051925Z`.
fn stamp(unix_us: i64) -> String {
    let text = UtcInstant::from_unix_us(unix_us).to_string();
    let digits: String = text.chars().take(19).filter(|c| !matches!(c, '-' | ':')).collect();
    format!("{digits}Z")
}

fn description(pass: &PassView) -> String {
    let mut text = String::new();
    let points = [
        ("AOS", pass.aos, pass.aos_azimuth_deg, pass.aos_elevation_deg, pass.aos_doppler_hz),
        ("TCA", pass.tca, pass.tca_azimuth_deg, pass.max_elevation_deg, pass.tca_doppler_hz),
        ("LOS", pass.los, pass.los_azimuth_deg, pass.los_elevation_deg, pass.los_doppler_hz),
    ];
    for (name, at, azimuth, elevation, doppler_hz) in points {
        let at = instant(at);
        let doppler = doppler_hz.map(|hz| format!(", Doppler {hz:+.0} Hz")).unwrap_or_default();
        let elevation = (elevation * 10.0).round() / 10.0 + 0.0;
        let _ = writeln!(
            text,
            "{name} {} {} UTC, azimuth {azimuth:.0}°, elevation {elevation:.1}°{doppler}",
            day(at),
            clock(at)
        );
    }
    if pass.aos_clipped || pass.los_clipped {
        text.push_str("The pass is longer than what was searched.\n");
    }
    let _ = write!(
        text,
        "Elements of {} {} UTC, {:.1} days old at TCA",
        day(instant(pass.epoch)),
        clock(instant(pass.epoch)),
        pass.age_days
    );
    text
}

/// TEXT of RFC 5545, 3.3.11.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\\' | ';' | ',' => escaped.extend(['\\', c]),
            '\n' => escaped.push_str("\\n"),
            c if c.is_control() => {}
            c => escaped.push(c),
        }
    }
    escaped
}

/// Writes a line, folded between characters so that no piece is longer than 75 octets.
fn fold(text: &mut String, content: &str) {
    let mut octets = 0;
    for c in content.chars() {
        if octets + c.len_utf8() > LINE_OCTETS {
            text.push_str("\r\n ");
            octets = 1;
        }
        text.push(c);
        octets += c.len_utf8();
    }
    text.push_str("\r\n");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::{Catalogue, Place, predict};
    use std::ops::ControlFlow;
    use tle::formats::Checksums;
    use tle::passes::PassSearch;

    fn passes(mean_anomaly: &str, epoch: &str, station: &str) -> Vec<PassView> {
        let text = format!(
            "[{{\"OBJECT_NAME\":\"ISS; \\\"ZARYA\\\", ÄÖÜ\",\"NORAD_CAT_ID\":25544,\"EPOCH\":\"{epoch}\",\"MEAN_MOTION\":15.49507896,\
             \"ECCENTRICITY\":0.0001413,\"INCLINATION\":51.6461,\"RA_OF_ASC_NODE\":221.2784,\"ARG_OF_PERICENTER\":89.1723,\
             \"MEAN_ANOMALY\":{mean_anomaly},\"BSTAR\":0.00001}}]"
        );
        let mut catalogue = Catalogue::default();
        catalogue.read("test", text.as_bytes(), Checksums::Strict).unwrap();
        let start: UtcInstant = "2020-07-13T00:00:00Z".parse().unwrap();
        let search = PassSearch::new(start, start.plus_seconds(86_400.0), 0.0);
        let place: Place = station.parse().unwrap();
        predict(&catalogue.objects, &[place], &search, Some(437e6), |_| ControlFlow::Continue(()))
            .unwrap()
            .passes
    }

    fn unfolded(calendar: &str) -> Vec<String> {
        calendar.replace("\r\n ", "").split("\r\n").map(str::to_owned).collect()
    }

    fn values(calendar: &str, name: &str) -> Vec<String> {
        unfolded(calendar).iter().filter_map(|line| line.strip_prefix(name)).map(str::to_owned).collect()
    }

    #[test]
    fn lines_end_in_crlf_and_have_75_octets_at_most() {
        let now = FineTime::from_unix_us(1_594_600_000_000_000);
        let name = "Überflüge, ".repeat(20);
        let calendar =
            icalendar(&passes("280.4612", "2020-07-12T21:16:01.000416", "A, B=46.5,6.5,410"), &name, now);
        assert!(calendar.ends_with("END:VCALENDAR\r\n"));
        assert!(!calendar.replace("\r\n", "").contains(['\r', '\n']));
        assert!(calendar.split("\r\n").all(|line| line.len() <= 75));
        assert_eq!(values(&calendar, "NAME:"), [name.replace(',', "\\,")]);
        assert_eq!(values(&calendar, "LOCATION:")[0], "A\\, B");
        assert!(values(&calendar, "SUMMARY:")[0].starts_with("ISS\\; \"ZARYA\"\\, ÄÖÜ over A\\, B\\, "));
        assert_eq!(values(&calendar, "DTSTAMP:")[0], "20200713T002640Z");
        let description = &values(&calendar, "DESCRIPTION:")[0];
        assert!(
            description.contains("Doppler +") && description.contains("\\nTCA 2020-07-13 "),
            "{description}"
        );
    }

    #[test]
    fn fresher_elements_change_the_sequence_and_not_the_event() {
        let now = FineTime::from_unix_us(0);
        let calendar = |passes: &[PassView]| icalendar(passes, "passes", now);
        let old = passes("280.4612", "2020-07-12T21:16:01.000416", "A=46.5,6.5,410");
        // 0.01 degrees of mean anomaly: 0.15 s.
        let new = passes("280.4712", "2020-07-12T21:18:01.000416", "A=46.5,6.5,410");
        let moved: Vec<PassView> = old
            .iter()
            .cloned()
            .map(|mut pass| {
                pass.tca = FineTime::from_unix_us(pass.tca.unix_us() + 2_000_000);
                pass.epoch = new[0].epoch;
                pass
            })
            .collect();
        let (before, after) = (calendar(&old), calendar(&moved));
        assert_eq!(values(&before, "UID:"), values(&after, "UID:"));
        let mut unique = values(&before, "UID:");
        unique.sort();
        unique.dedup();
        assert_eq!(unique.len(), old.len());
        let sequence = |text: &str| values(text, "SEQUENCE:")[0].parse::<i64>().unwrap();
        assert_eq!(sequence(&after) - sequence(&before), 2);
        let elsewhere = calendar(&passes("280.4612", "2020-07-12T21:16:01.000416", "B=46.5,6.5,410"));
        assert!(values(&elsewhere, "UID:").iter().all(|uid| !values(&before, "UID:").contains(uid)));
        let twice: Vec<PassView> = [&old[..1], &old[..1]].concat();
        let uids = values(&calendar(&twice), "UID:");
        assert_ne!(uids[0], uids[1], "two passes of one half hour");
    }
}
