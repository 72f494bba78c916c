//! Several satellites and several links: what one says is never taken for the other's word.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed")]

use mission::record::Record;
use mission::{
    CommandIntent, Effect, Entropy, Gate, Input, Intent, IntentEnvelope, IntentId, LinkConfig, LinkId,
    LinkState, MonoUs, Now, Principal, Profile, SatelliteConfig, SatelliteId, Snapshot, Source, Station,
    StationConfig, StationId, UtcUs,
};
use protocol::{Downlink, FrameForm, Key, RequestTag, Telecommand, encode_down};
use radio::airtime::LinkTiming;

struct Zeros;

impl Entropy for Zeros {
    fn fill(&mut self, bytes: &mut [u8]) {
        bytes.fill(0);
    }
}

const NOW: Now = Now { mono: MonoUs(1_000_000), utc: UtcUs(1_805_544_000_000_000) };

fn satellite(name: &str) -> SatelliteId {
    SatelliteId::new(name).expect("a name")
}

fn link(name: &str) -> LinkId {
    LinkId::new(name).expect("a name")
}

/// A station with these links, each with the satellite it serves.
fn station(links: &[(&str, &str)]) -> Station {
    let mut names: Vec<&str> = links.iter().map(|(_, satellite)| *satellite).collect();
    names.dedup();
    let satellites = names.iter().enumerate().map(|(n, name)| SatelliteConfig {
        id: satellite(name),
        profile: Profile { rssi: false, ..Profile::default() },
        key: Some(Key::from_bytes([n as u8; 16])),
        limits: Vec::new(),
    });
    let config = StationConfig {
        station: StationId::new("home").expect("a name"),
        site: None,
        times: mission::config::Times::default(),
        satellites: satellites.collect(),
        links: links
            .iter()
            .map(|(name, of)| LinkConfig {
                id: link(name),
                satellite: satellite(of),
                timing: LinkTiming::default(),
                armed: true,
                receive_only: false,
            })
            .collect(),
    };
    Station::new(config, Snapshot::default(), Box::new(Zeros), NOW)
}

/// Confirms every batch; all records.
fn records(station: &mut Station) -> Vec<Record> {
    let mut all = Vec::new();
    while let Some(effect) = station.next_effect() {
        if let Effect::Persist(batch) = effect {
            let id = batch.id;
            all.extend(batch.records.iter().cloned());
            station.handle(NOW, Input::PersistDone(id));
        }
    }
    all
}

#[test]
fn equal_bytes_of_two_satellites_are_two_frames() {
    let mut station = station(&[("la", "px-1"), ("lb", "px-2")]);
    let mut pong = [0; 240];
    let length = encode_down(&Downlink::Pong, RequestTag::new(1), FrameForm::Short, &mut pong);
    for name in ["la", "lb"] {
        let link = link(name);
        let bytes = &pong[..length];
        station.handle(NOW, Input::Bytes { link: &link, bytes, source: Source::Radio, received: NOW });
    }
    let heard: Vec<String> = records(&mut station)
        .iter()
        .filter_map(|record| match record {
            Record::Frame(frame) => Some(format!("{} {}", frame.id, frame.route.satellite)),
            _ => None,
        })
        .collect();
    assert_eq!(heard, ["1 px-1", "2 px-2"]);
}

#[test]
fn equal_bytes_over_two_links_of_one_satellite_are_one_frame_heard_twice() {
    let mut station = station(&[("la", "px-1"), ("lb", "px-1")]);
    let mut pong = [0; 240];
    let length = encode_down(&Downlink::Pong, RequestTag::new(1), FrameForm::Short, &mut pong);
    for name in ["la", "lb"] {
        let link = link(name);
        let bytes = &pong[..length];
        station.handle(NOW, Input::Bytes { link: &link, bytes, source: Source::Radio, received: NOW });
    }
    let all = records(&mut station);
    assert_eq!(all.iter().filter(|record| matches!(record, Record::Frame(_))).count(), 1);
    assert_eq!(all.iter().filter(|record| matches!(record, Record::Reception(_))).count(), 2);
}

#[test]
fn a_command_without_a_link_takes_the_one_that_is_up() {
    let mut station = station(&[("la", "px-1"), ("lb", "px-1")]);
    station.handle(NOW, Input::Link { link: &link("lb"), state: LinkState::Ok });
    let intent = Intent::Command(CommandIntent {
        satellite: satellite("px-1"),
        link: None,
        telecommand: Telecommand::Ping,
        priority: 0,
        gate: Gate::Heard,
        expires_at: None,
        when: None,
        attempts_allowed: None,
        confirmation: None,
    });
    let envelope = IntentEnvelope {
        id: IntentId(1),
        principal: Principal::new("operator"),
        idempotency_key: "1".to_owned(),
        digest: [0; 32],
        intent,
    };
    station.handle(NOW, Input::Intent(envelope));
    let taken = records(&mut station).into_iter().find_map(|record| match record {
        Record::Command(command) => Some(command.route.link),
        _ => None,
    });
    assert_eq!(taken, Some(link("lb")));
}
