//! The satellite's rules, and what follows from the model.

use mission::UtcUs;
use mission::downlink::{Battery, Listener, Pointing, Task, TaskError, expected_of, plan, round_robin};
use protocol::{DownlinkSchedule, DownlinkSlot, Telecommand};

use crate::world::{HOUR_US, START, task};

#[test]
fn schedule_is_one_that_the_satellite_takes() {
    for seed in [3, 8, 13] {
        let task = task(seed);
        let found = plan(&task).unwrap();
        let schedule = found.schedule();
        Telecommand::SetDownlinkSchedule(schedule.clone()).validate().unwrap();
        assert!(!schedule.slots.is_empty() && schedule.slots.len() <= 8);
        for pair in found.entries.windows(2) {
            assert!(pair[1].at.0 >= pair[0].end_at.0 + task.rules.pause_us, "{pair:?}");
        }
        for entry in &found.entries {
            assert!(entry.count <= 64 && entry.at >= task.from && entry.end_at <= task.until, "{entry:?}");
            assert!(!entry.ears.is_empty() && entry.expected_chunks > 0.0, "{entry:?}");
        }
        let sum: f64 = found.entries.iter().map(|entry| entry.expected_chunks).sum();
        assert!((sum - found.expected_chunks).abs() < 1e-6);
    }
}

#[test]
fn satellite_is_silent_where_it_must_hear() {
    let free = task(4);
    let found = plan(&free).unwrap();
    let first = &found.entries[0];
    let silent = vec![UtcUs(first.at.0 - 60_000_000)..UtcUs(first.end_at.0 + 60_000_000)];
    let task = Task { silent: silent.clone(), ..free };
    for found in [plan(&task).unwrap(), round_robin(&task).unwrap()] {
        for entry in &found.entries {
            assert!(entry.end_at <= silent[0].start || entry.at >= silent[0].end, "{entry:?}");
        }
    }
}

#[test]
fn battery_allows_as_many_entries_as_it_can_feed() {
    let free = task(5);
    // Enough for about two entries of 80 s at 3 W, and no Sun.
    let battery = Battery {
        capacity_wh: 40.0,
        charge_wh: 10.14,
        floor_wh: 10.0,
        sunlit_w: 0.0,
        load_w: 0.0,
        transmit_w: 3.0,
    };
    let tight = plan(&Task { battery: Some(battery), ..free.clone() }).unwrap();
    let sent: u32 = tight.entries.iter().map(|entry| u32::from(entry.count)).sum();
    assert!((80..=135).contains(&sent), "{sent} frames");
    let sunny = Battery { sunlit_w: 20.0, ..battery };
    let better = plan(&Task { battery: Some(sunny), ..free.clone() }).unwrap();
    assert!(better.expected_chunks >= tight.expected_chunks);
    let empty = Battery { charge_wh: 9.0, ..battery };
    assert!(plan(&Task { battery: Some(empty), ..free }).unwrap().entries.is_empty());
}

#[test]
fn antenna_that_looks_down_is_worth_its_turn() {
    let even = task(6);
    let pointing =
        Pointing { axis_body: [0.0, 0.0, 1.0], loose_loss_db: 5.0, held_loss_db: 0.0, settle_s: 45.0 };
    let held = plan(&Task { pointing: Some(pointing), ..even.clone() }).unwrap();
    assert!(held.entries.iter().all(|entry| entry.attitude_mrp.is_some()));
    let loose = Pointing { held_loss_db: 5.0, ..pointing };
    let loose = plan(&Task { pointing: Some(loose), ..even.clone() }).unwrap();
    let best = plan(&even).unwrap();
    assert!(best.entries.iter().all(|entry| entry.attitude_mrp.is_none()));
    assert!(loose.expected_chunks < held.expected_chunks && held.expected_chunks < best.expected_chunks);
    assert!(held.expected_chunks <= held.upper_bound_chunks);
}

#[test]
fn chunk_sent_twice_in_one_pass_of_a_station_gains_less_than_in_two() {
    let one = Listener {
        name: "alone".to_owned(),
        place: tle::Station::new(47.0, 8.0, 400.0).unwrap(),
        last_seen: Some(START),
        success: Some(0.5),
    };
    let base = task(1);
    let until = UtcUs(START.0 + 24 * HOUR_US);
    let task = Task::new(base.elements, vec![one], vec![0], START, until);
    let found = plan(&task).unwrap();
    assert!(found.entries.len() >= 2, "{found:?}");
    let at = |us: i64| DownlinkSlot { time_ms: (us / 1000) as u64, first: 0, count: 1, attitude_mrp: None };
    let of = |times: &[i64]| {
        let mut slots: DownlinkSchedule = DownlinkSchedule { slots: Default::default() };
        for time in times {
            let _ = slots.slots.push(at(*time));
        }
        expected_of(&task, &slots).unwrap()
    };
    let (first, second) = (found.entries[0].at.0, found.entries[1].at.0);
    let once = of(&[first]);
    let twice_here = of(&[first, first + 5_000_000]);
    let twice_apart = of(&[first, second]);
    assert!(once < 0.5 && twice_here < 0.5, "it listens in half of the passes: {once} {twice_here}");
    assert!(twice_apart > twice_here + 0.1, "{twice_apart} {twice_here}");
}

#[test]
fn what_makes_no_sense_is_refused() {
    let sound = task(2);
    let reversed = Task { until: START, ..sound.clone() };
    assert!(matches!(plan(&reversed), Err(TaskError::Window(_))));
    let unordered = Task { missing: vec![3, 3], ..sound.clone() };
    assert_eq!(plan(&unordered).unwrap_err(), TaskError::Missing { found: 3 });
    let nothing = plan(&Task { missing: Vec::new(), ..sound.clone() }).unwrap();
    assert!(nothing.entries.is_empty() && nothing.upper_bound_chunks == 0.0);
    let nobody = plan(&Task { listeners: Vec::new(), ..sound }).unwrap();
    assert!(nobody.entries.is_empty() && nobody.expected_chunks == 0.0);
}
