//! Large questions: how far from the bound, in how many states.

use mission::schedule::plan;

use crate::cases::days;
use crate::rules::check;

#[expect(clippy::disallowed_methods, reason = "the one place where the time it takes is shown")]
fn measured(name: &str, satellites: usize, stations: usize, masts: usize, length: i64, most_gap: f64) {
    let problem = days(7, satellites, stations, masts, length);
    let begin = std::time::Instant::now();
    let schedule = plan(&problem, &[]);
    let took = begin.elapsed();
    let again = plan(&problem, &schedule.memory);
    println!(
        "{name}: {} passes, {} contacts, worth {} of at most {}: gap {:.4} %, {took:.0?}",
        problem.candidates.len(),
        schedule.contacts.len(),
        schedule.worth,
        schedule.bound,
        schedule.gap() * 100.0,
    );
    check(&problem, &schedule, name);
    assert!(schedule.gap() <= most_gap, "{name}: {}", schedule.gap());
    assert_eq!(schedule.contacts.len(), again.contacts.len(), "{name}");
    assert!(took.as_secs() < 60, "{name}: {took:?}");
}

#[test]
fn a_week_of_one_station_is_proved() {
    measured("5 satellites, one antenna, a week", 5, 1, 1, 7, 0.0);
    measured("20 satellites, one antenna, a week", 20, 1, 1, 7, 0.0);
    measured("20 satellites, two antennas, a week", 20, 1, 2, 7, 0.0);
}

#[test]
fn a_fortnight_of_three_stations_is_close_to_the_bound() {
    measured("20 satellites, 3 stations, 14 days", 20, 3, 1, 14, 0.01);
}

#[test]
fn a_crowd_is_answered_in_bounded_work() {
    measured("60 satellites, 3 stations with 2 antennas, 7 days", 60, 3, 2, 7, 0.05);
}
