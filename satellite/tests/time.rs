//! Rhythm, uptime, restarts of the process, and speed.

mod common;

use common::{Ground, SECOND_US, chunk_numbers, config, errors};
use protocol::{Downlink, ErrorCode, Telecommand};
use satellite::{Camera, Fault, JournalEntry, TwinConfig, TwinState};

const DAY_US: u64 = 86_400 * SECOND_US;

#[test]
fn heartbeats_come_every_minute() {
    let mut ground = Ground::new(config());
    let heard = ground.listen(600 * SECOND_US);
    let times: Vec<u64> = heard.iter().map(|one| one.at_us / SECOND_US).collect();
    assert_eq!(times, [3, 63, 123, 183, 243, 303, 363, 423, 483, 543]);
    assert!(heard.iter().all(|one| one.tag.is_none() && one.len == 133));
}

#[test]
fn a_due_heartbeat_goes_between_two_chunks_and_keeps_its_rhythm() {
    let camera = Camera::Pattern { size_bytes: 222 * 200 };
    let mut ground = Ground::new(TwinConfig { camera, ..config() });
    ground.now_us = SECOND_US / 2;
    let heard = ground.ask_all(&Telecommand::GetImageChunk { first: 0, count: 150 });
    assert_eq!(chunk_numbers(&heard), (0..150).collect::<Vec<_>>());
    let beats: Vec<usize> = heard
        .iter()
        .enumerate()
        .filter(|(_, one)| matches!(one.packet, Downlink::Heartbeat(_)))
        .map(|(place, _)| place)
        .collect();
    assert_eq!(beats.len(), 3);
    for place in beats {
        assert!(matches!(heard[place - 1].packet, Downlink::ImageChunk(_)));
        assert!(matches!(heard[place + 1].packet, Downlink::ImageChunk(_)));
        assert_eq!(heard[place].tag, None);
        let late_us = (heard[place].at_us - 3 * SECOND_US) % (60 * SECOND_US);
        assert!(late_us < SECOND_US, "at most one chunk late");
    }
    assert_eq!(ground.twin.heartbeat_due_us() % (60 * SECOND_US), 3 * SECOND_US);
}

#[test]
fn a_low_battery_makes_heartbeats_rare_and_complains_once() {
    let mut ground = Ground::new(TwinConfig { faults: vec![(0, Fault::LowBattery(true))], ..config() });
    let heard = ground.listen(1_000 * SECOND_US);
    let beats = heard.iter().filter(|one| matches!(one.packet, Downlink::Heartbeat(_))).count();
    assert_eq!(beats, 5);
    assert_eq!(errors(&heard), [ErrorCode::LOW_BATTERY]);
}

#[test]
fn uptime_wraps_after_49_days_in_a_year_of_heartbeats() {
    let hourly = TwinConfig { heartbeat_period_us: 3_600 * SECOND_US, ..config() };
    let mut ground = Ground::new(hourly);
    let mut uptimes = Vec::new();
    for _ in 0..365 {
        for one in ground.listen(DAY_US) {
            if let Downlink::Heartbeat(beat) = one.packet {
                assert_eq!(u64::from(beat.uptime_ms), (one.at_us / 1000) % (1 << 32));
                uptimes.push(beat.uptime_ms);
            }
        }
    }
    assert_eq!(uptimes.len(), 365 * 24);
    assert_eq!(uptimes.windows(2).filter(|pair| pair[1] < pair[0]).count(), 7);
}

#[test]
fn a_twin_goes_on_from_its_journal_where_it_was() {
    let mut ground = Ground::new(config());
    ground.ask(&Telecommand::SetTimestamp { utc_ms: 1_900_000_000_000 });
    ground.ask(&Telecommand::Reset);
    let capture = Telecommand::CaptureImage {
        resolution: protocol::Resolution::Cif,
        grey: true,
        strong_compression: false,
    };
    ground.ask(&capture);
    let last = ground.seal(&Telecommand::Ping);
    ground.hand_over(&last);
    ground.listen(100 * SECOND_US);

    let text: String = ground.journal.iter().map(|entry| entry.to_line() + "\n").collect();
    let state = TwinState::from_journal(&text).unwrap();
    assert_eq!(&state, ground.twin.state());

    let start_us = ground.now_us + 1_234;
    let mut again = Ground::with_state(TwinConfig { start_us, ..config() }, state);
    assert_eq!(again.twin.image(), ground.twin.image());
    assert!(again.twin.heartbeat_due_us().abs_diff(ground.twin.heartbeat_due_us()) < 1_000);
    assert_eq!(again.twin.uptime_ms(start_us), ground.twin.uptime_ms(start_us));
    again.hand_over(&last);
    assert!(again.listen(SECOND_US).is_empty(), "what was accepted before the restart is not accepted again");
    assert_eq!(again.twin.stats().refused.replayed, 1);
    again.counter = ground.counter;
    let Downlink::Heartbeat(beat) = again.answer(&Telecommand::SetTransmitter { on: true }) else { panic!() };
    assert!(beat.timestamp_ms > 1_900_000_000_000, "the clock went on");
}

#[test]
fn a_capture_cut_short_by_a_restart_leaves_no_image_and_its_number_is_not_used_twice() {
    let mut ground = Ground::new(config());
    let capture = Telecommand::CaptureImage {
        resolution: protocol::Resolution::Cif,
        grey: false,
        strong_compression: false,
    };
    ground.ask(&capture);
    let mut state = TwinState::default();
    for entry in &ground.journal {
        if let JournalEntry::Stored { change, .. } = entry {
            state.apply(change);
        }
    }
    let again = Ground::with_state(TwinConfig { start_us: ground.now_us, ..config() }, state);
    assert!(again.twin.image().is_empty());
    assert_eq!(again.twin.state().next_image, 1);
}
