//! Passes against Skyfield: `vectors/passes.txt`, made by `scripts/pass_vectors.py`.

#![expect(clippy::unwrap_used, reason = "vectors that cannot be read fail their test")]

use tle::passes::{EndCause, Pass, PassEnd, PassFinder, PassSearch};
use tle::{Elements, Station, UtcInstant};

/// One search of the file.
struct Record<'a> {
    name: &'a str,
    elements: Elements,
    station: Station,
    search: PassSearch,
    passes: Vec<Known<'a>>,
}

/// A pass as Skyfield has it; times in seconds since the window's start.
#[derive(Debug)]
struct Known<'a> {
    aos: (&'a str, f64, f64),
    los: (&'a str, f64, f64),
    max_elevation_deg: f64,
    summits: usize,
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|word| word.parse().unwrap()).collect()
}

fn record(text: &str) -> Record<'_> {
    let value = |key: &str| {
        text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(": ")).unwrap_or_default()
    };
    let instant = |key: &str| UtcInstant::from_unix_us(value(key).parse().unwrap());
    let e = numbers(value("elements"));
    let station = numbers(value("station"));
    let elements = Elements {
        name: None,
        object_id: None,
        norad_cat_id: None,
        epoch: instant("epoch_us"),
        mean_motion_rev_day: e[0],
        eccentricity: e[1],
        inclination_deg: e[2],
        raan_deg: e[3],
        arg_of_perigee_deg: e[4],
        mean_anomaly_deg: e[5],
        bstar: e[6],
        mean_motion_dot: 0.0,
        mean_motion_ddot: 0.0,
        ephemeris_type: None,
        classification: None,
        element_set_no: None,
        rev_at_epoch: None,
        further: Vec::new(),
    };
    let passes = text
        .lines()
        .filter_map(|line| line.strip_prefix("pass: "))
        .map(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            let number = |k: usize| -> f64 { words[k].parse().unwrap() };
            Known {
                aos: (words[0], number(1), number(2)),
                los: (words[3], number(4), number(5)),
                max_elevation_deg: number(6),
                summits: words[7].parse().unwrap(),
            }
        })
        .collect();
    Record {
        name: value("search"),
        elements,
        station: Station::new(station[0], station[1], station[2]).unwrap(),
        search: PassSearch::new(
            instant("start_us"),
            instant("stop_us"),
            value("threshold_deg").parse().unwrap(),
        ),
        passes,
    }
}

/// How far an end is off, as a part of what is allowed: 1 ms, or 0.00001 degrees of elevation where that is longer.
fn end_error(record: &Record<'_>, end: &PassEnd, (kind, at_s, rate): (&str, f64, f64)) -> (f64, f64) {
    let kinds_agree = matches!(
        (kind, end.cause),
        ("cross", EndCause::Horizon) | ("cut", EndCause::Window { .. }) | ("lost", EndCause::NoState(_))
    );
    assert!(kinds_agree, "{}: {kind} at {at_s}, found {end:?}", record.name);
    let off_s = (end.at.seconds_since(record.search.start) - at_s).abs();
    let allowed_s = if kind == "cross" { f64::max(1e-3, 1e-5 / rate.abs()) } else { 1e-3 };
    (off_s, off_s / allowed_s)
}

#[test]
fn passes_are_those_of_skyfield() {
    let text = include_str!("../vectors/passes.txt");
    let (mut count, mut worst_s, mut worst_part, mut worst_deg) = (0, 0.0f64, 0.0f64, 0.0f64);
    let (mut clipped, mut lost, mut many) = (0, 0, 0);
    for chunk in text.split("\n\n").filter(|chunk| chunk.contains("search: ")) {
        let record = record(chunk);
        let found = PassFinder::new(&record.elements)
            .unwrap()
            .find(std::slice::from_ref(&record.station), &record.search)
            .unwrap();
        let passes: &Vec<Pass> = &found.stations[0];
        let times: Vec<_> = passes
            .iter()
            .map(|pass| {
                let since = |at: UtcInstant| at.seconds_since(record.search.start);
                (since(pass.aos.at), since(pass.los.at), pass.tca.look.elevation_deg)
            })
            .collect();
        assert_eq!(
            passes.len(),
            record.passes.len(),
            "{}: found {times:?}, Skyfield has {:#?}",
            record.name,
            record.passes
        );
        for (pass, known) in passes.iter().zip(&record.passes) {
            for (end, expected) in [(&pass.aos, known.aos), (&pass.los, known.los)] {
                let (off_s, part) = end_error(&record, end, expected);
                assert!(part < 1.0, "{}: {off_s} s: {pass:?}, Skyfield has {known:?}", record.name);
                if expected.2.abs() > 0.01 {
                    worst_s = worst_s.max(off_s);
                }
                worst_part = worst_part.max(part);
            }
            let off_deg = (pass.tca.look.elevation_deg - known.max_elevation_deg).abs();
            worst_deg = worst_deg.max(off_deg);
            assert!(off_deg < 5e-4, "{}: {off_deg} deg: {pass:?}, Skyfield has {known:?}", record.name);
            let tca_is_summit = pass.tca.at > pass.aos.at && pass.tca.at < pass.los.at;
            let summits = pass.other_summits.len() + usize::from(tca_is_summit);
            assert_eq!(summits, known.summits, "{}: {pass:?}, Skyfield has {known:?}", record.name);
            count += 1;
            clipped += usize::from(known.aos.0 == "cut" || known.los.0 == "cut");
            lost += usize::from(known.aos.0 == "lost" || known.los.0 == "lost");
            many += usize::from(known.summits > 1);
        }
    }
    println!(
        "{count} passes ({clipped} clipped, {lost} ended by SGP4, {many} with several summits): AOS and LOS within \
         {worst_s:.2e} s where the rate is above 0.01 deg/s, {worst_part:.3} of what is allowed; summits {worst_deg:.2e} deg"
    );
    assert!(count >= 1000 && clipped > 20 && lost >= 5 && many > 20);
}
