//! Expected against had: schedules of the planner on the twin, many runs each.

#![expect(clippy::unwrap_used, reason = "what is made up here is valid")]

use mission::UtcUs;
use mission::downlink::{Listener, Pointing, Task, plan, round_robin};
use rehearsal::downlink::downlink;
use tle::{Elements, Station, UtcInstant};

const START: UtcUs = UtcUs(1_790_000_000_000_000);

fn elements(turn_deg: f64) -> Elements {
    Elements {
        name: Some("TEST".to_owned()),
        object_id: None,
        norad_cat_id: Some(99_999),
        epoch: UtcInstant::from_unix_us(START.0),
        mean_motion_rev_day: 15.2,
        eccentricity: 0.001,
        inclination_deg: 97.5,
        raan_deg: turn_deg,
        arg_of_perigee_deg: 10.0,
        mean_anomaly_deg: 3.0 * turn_deg,
        bstar: 0.0,
        mean_motion_dot: 0.0,
        mean_motion_ddot: 0.0,
        ephemeris_type: Some(0),
        classification: Some('U'),
        element_set_no: None,
        rev_at_epoch: None,
        further: Vec::new(),
    }
}

/// A few stations, so that chance is felt.
fn task(number: u16) -> Task {
    let places = [(47.4, 8.5), (52.2, 21.0), (40.4, -3.7), (-33.4, -70.6), (35.7, 139.7), (12.97, 77.6)];
    let listeners = places.iter().enumerate().map(|(index, &(latitude, longitude))| Listener {
        name: format!("station {index}"),
        place: Station::new(latitude, longitude, 100.0).unwrap(),
        last_seen: Some(UtcUs(START.0 - 3_600_000_000 * index as i64)),
        success: Some(0.25 + 0.1 * f64::from(number % 5)),
    });
    let listeners = listeners.take(2 + usize::from(number) % 5).collect();
    let missing = (0..60 + 20 * number).filter(|chunk| chunk % 40 != 7).collect();
    let until = UtcUs(START.0 + 20 * 3_600_000_000);
    Task::new(elements(40.0 + 55.0 * f64::from(number)), listeners, missing, START, until)
}

#[test]
fn expected_chunks_are_had_on_the_twin() {
    let runs = 120;
    for number in 0..5 {
        let mut task = task(number);
        if number == 3 {
            let axis_body = [0.0, 0.0, 1.0];
            task.pointing =
                Some(Pointing { axis_body, loose_loss_db: 4.0, held_loss_db: 0.0, settle_s: 45.0 });
        }
        let found = plan(&task).unwrap();
        let had = downlink(&task, &found.schedule(), 0.0, 0..runs).unwrap();
        println!(
            "task {number}: {} of {} expected, had {:.1} +- {:.1}, eight of ten runs {} to {}, in turn {:.1}",
            found.expected_chunks,
            found.missing,
            had.mean(),
            had.mean_error(),
            had.quantile(0.1),
            had.quantile(0.9),
            found.round_robin_chunks,
        );
        let frames: u32 = found.entries.iter().map(|entry| u32::from(entry.count)).sum();
        assert_eq!(had.sent, frames as usize, "every frame of the schedule was sent");
        let off = (had.mean() - found.expected_chunks).abs();
        // Three sigma, and what the raster rounds: heartbeats in their own phase move a frame by a second.
        assert!(off < 3.0 * had.mean_error() + 0.01 * found.expected_chunks + 0.2, "task {number}: {off}");
        let naive = downlink(&task, &round_robin(&task).unwrap().schedule(), 0.0, 0..20).unwrap();
        assert!(naive.mean() < had.mean(), "task {number}: {} in turn", naive.mean());
    }
}

#[test]
fn elements_a_minute_off_cost_chunks() {
    let task = task(1);
    let found = plan(&task).unwrap();
    let sure = downlink(&task, &found.schedule(), 0.0, 0..60).unwrap();
    let unsure = downlink(&task, &found.schedule(), 120.0, 0..60).unwrap();
    println!("{:.1} with true elements, {:.1} with elements two minutes off", sure.mean(), unsure.mean());
    assert!(unsure.mean() < sure.mean() - 2.0 * sure.mean_error());
}

#[test]
fn same_seeds_give_the_same_runs() {
    let task = task(2);
    let found = plan(&task).unwrap();
    let run = |seeds| downlink(&task, &found.schedule(), 5.0, seeds).unwrap();
    assert_eq!(run(0..10), run(0..10));
    assert_ne!(run(0..10).chunks, run(10..20).chunks);
}
