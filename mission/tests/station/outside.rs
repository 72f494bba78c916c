//! What others report fills the archive and the gaps of images, and does nothing else.

use std::sync::Arc;

use mission::reception::{
    Admission, Delivered, ELSEWHERE, Ear, Known, NotTaken, Said, Taken, Times, UNDATED, admit,
};
use mission::record::EventKind;
use mission::{FrameId, Input, Level, LimitRule, Record, SatelliteId, Stage, UtcUs};
use protocol::Telecommand;

use crate::frames::{chunk_frame, frame, heartbeat_frame, info_frame};
use crate::world::{S, Setup, World};

/// A report of these bytes; `None`: without a time.
pub(crate) fn report(world: &World, id: &str, bytes: &[u8], at: Option<UtcUs>) -> Delivered {
    let said = Said {
        bytes: Some(bytes.to_vec()),
        times: Times { stated: at, ..Times::default() },
        ..Said::new(Ear::TinygsApi, id.to_owned())
    };
    let reception = admit(said, &Admission::at(world.now.utc)).unwrap();
    Delivered { satellite: world.satellite.clone(), reception: Arc::new(reception), known: Box::default() }
}

impl World {
    fn told(&mut self, bytes: &[u8], at: UtcUs) -> Taken {
        let id = format!("{}", self.taken.len());
        let delivered = report(self, &id, bytes, Some(at));
        self.deliver(&[delivered])
    }

    fn deliver(&mut self, receptions: &[Delivered]) -> Taken {
        let delivery = self.taken.len() as u64;
        self.handle(Input::Outside { delivery, receptions });
        let (found, taken) = self.taken.last().unwrap();
        assert_eq!(*found, delivery);
        taken.unwrap()
    }

    fn frames(&self) -> Vec<(u64, String, String)> {
        let of = |record: &Record| match record {
            Record::Frame(frame) => {
                Some((frame.id.0, frame.route.station.to_string(), frame.route.link.to_string()))
            }
            _ => None,
        };
        self.stored.iter().filter_map(of).collect()
    }

    fn reports(&self) -> Vec<Option<FrameId>> {
        let of = |record: &Record| match record {
            Record::Outside(report) => Some(report.frame),
            _ => None,
        };
        self.stored.iter().filter_map(of).collect()
    }

    fn values(&self) -> usize {
        self.stored.iter().filter(|record| matches!(record, Record::Telemetry(_))).count()
    }
}

const NEW: Taken = Taken { frames: 1, merged: 0, without_frame: 0 };
const MERGED: Taken = Taken { frames: 0, merged: 1, without_frame: 0 };

#[test]
fn a_frame_is_one_frame_whoever_heard_it_first() {
    for radio_first in [true, false] {
        let mut world = World::in_contact();
        world.pass(30 * S);
        let before = world.frames().len();
        let values = world.values();
        let heartbeat = heartbeat_frame(0, 77, 5);
        if radio_first {
            world.hear(&heartbeat);
            assert_eq!(world.told(&heartbeat, world.now.utc.plus(-2_000_000)), MERGED);
        } else {
            assert_eq!(world.told(&heartbeat, world.now.utc.plus(-2_000_000)), NEW);
            world.hear(&heartbeat);
        }
        assert_eq!(world.told(&heartbeat, world.now.utc.plus(27_000_000)), MERGED);
        let frames = &world.frames()[before..];
        assert_eq!(frames.len(), 1, "radio first: {radio_first}");
        let expected = if radio_first { ("home", "radio") } else { (ELSEWHERE, "tinygs-api") };
        assert_eq!((frames[0].1.as_str(), frames[0].2.as_str()), expected);
        assert_eq!(world.reports(), [Some(FrameId(frames[0].0)); 2]);
        assert_eq!(world.values() - values, 1, "its values are there once");
        assert_eq!(
            world.told(&heartbeat, world.now.utc.plus(31_000_000)),
            NEW,
            "another half minute, another frame"
        );
    }
}

#[test]
fn a_report_without_a_time_joins_by_bytes_that_are_unique_and_gives_no_values() {
    let mut world = World::in_contact();
    world.pass(3_600 * S);
    let heartbeat = heartbeat_frame(0, 77, 5);
    let (undated, pong) = (report(&world, "a", &heartbeat, None), frame(0, 0, &[]));
    let values = world.values();
    assert_eq!(world.deliver(&[undated]), NEW);
    assert_eq!(world.frames().last().unwrap().2, UNDATED);
    assert_eq!(world.values(), values);
    let hours_ago = world.now.utc.plus(-7_200_000_000);
    assert_eq!(world.told(&heartbeat, hours_ago), MERGED);
    assert_eq!(world.values(), values + 1, "now the time is known");
    assert_eq!(world.told(&heartbeat, hours_ago.plus(1)), MERGED);
    assert_eq!(world.values(), values + 1);
    // A Pong looks like every other Pong.
    let undated = report(&world, "p", &pong, None);
    assert_eq!(world.deliver(&[undated]), NEW);
    assert_eq!(world.told(&pong, hours_ago), NEW);
}

#[test]
fn what_the_archive_knows_is_believed_of_it() {
    let mut world = World::in_contact();
    let known = Known { frame: FrameId(1), at: world.now.utc, dated: true };
    let delivered = Delivered {
        known: Box::new([known]),
        ..report(&world, "k", &heartbeat_frame(0, 1, 1), Some(UtcUs(1_600_000_000_000_000)))
    };
    let values = world.values();
    assert_eq!(world.deliver(&[delivered]), MERGED);
    assert_eq!((world.reports(), world.values()), (vec![Some(FrameId(1))], values));
}

/// The archive was asked before the report was stored that told when one of its frames was heard.
#[test]
fn what_the_archive_knew_of_one_frame_a_moment_ago_hides_no_other() {
    let mut world = World::in_contact();
    world.pass(3_600 * S);
    let (pong, now) = (frame(0, 0, &[]), world.now.utc);
    let after = |seconds: i64| now.plus(seconds * 1_000_000);
    let undated = report(&world, "u", &pong, None);
    assert_eq!(world.deliver(&[undated]), NEW);
    let moved = world.reports()[0].unwrap();
    assert_eq!(world.told(&pong, after(20)), MERGED);
    let stays = Known { frame: FrameId(77_777), at: after(-40), dated: true };
    let stored = Known { frame: moved, at: after(20), dated: true };
    let before = Known { at: now, dated: false, ..stored };
    for known in [vec![before, stays], vec![stays]] {
        let id = format!("of {}", known.len());
        let late = Delivered { known: known.into(), ..report(&world, &id, &pong, Some(after(-19))) };
        assert_eq!(world.deliver(&[late]), MERGED);
        assert_eq!(world.reports().last(), Some(&Some(stays.frame)), "{id}");
    }
}

#[test]
fn strangers_chunks_fill_the_image_and_replace_nothing() {
    let mut world = World::in_contact();
    world.hear(&info_frame(0, true, 3, 666, 408));
    world.pass(10 * S);
    world.hear(&chunk_frame(0, 0, 0xAA));
    let at = world.now.utc;
    assert_eq!(world.told(&chunk_frame(0, 1, 0xBB), at), NEW);
    assert_eq!(world.images()[0].held, 2);
    // A forged one beside a good one: both are kept, the good one stands.
    world.told(&chunk_frame(0, 0, 0xEE), at);
    assert_eq!((world.images()[0].held, world.images()[0].conflicts), (2, 1));
    // From before the image was declared: it may be of another one.
    world.told(&chunk_frame(0, 2, 0xCC), at.plus(-60_000_000));
    assert_eq!(world.images()[0].held, 2);
    let undated = report(&world, "u", &chunk_frame(0, 2, 0xCD), None);
    world.deliver(&[undated]);
    assert_eq!(world.images()[0].held, 2);
    // And a forged one that came first does not keep the good one out of sight.
    world.told(&chunk_frame(0, 2, 0x66), at);
    world.hear(&chunk_frame(0, 2, 0xCC));
    let image = &world.images()[0];
    assert_eq!((image.held, image.conflicts), (3, 2));
    assert!(image.completed_at.is_some());
}

#[test]
fn strangers_prove_nothing_settle_nothing_and_declare_nothing() {
    let mut world = World::in_contact();
    let reset = world.command(Telecommand::Reset);
    world.radiate();
    assert_eq!(world.stage(reset), Stage::Radiated);
    // A forged heartbeat with a small uptime would settle the Reset if our radio heard it.
    world.pass(5 * S);
    world.told(&heartbeat_frame(0, 4_000, 5), world.now.utc);
    assert_ne!(world.stage(reset), Stage::Answered);
    world.told(&info_frame(0, true, 3, 666, 408), world.now.utc);
    assert_eq!(world.images().len(), 0);

    let mut world = World::in_contact();
    let ping = world.command(Telecommand::Ping);
    world.radiate();
    let tag = world.last_request().0;
    world.told(&frame(0, tag, &[]), world.now.utc);
    assert_eq!(world.stage(ping), Stage::Radiated, "its Pong, as a stranger says");
    world.hear(&frame(0, tag, &[]));
    assert_eq!(
        world.stage(ping),
        Stage::Answered,
        "and as our radio heard it, though the stranger was first"
    );
}

#[test]
fn strangers_open_no_gate() {
    let mut world = World::new(Setup::default());
    world.link_state(mission::LinkState::Ok);
    let ping = world.command(Telecommand::Ping);
    for second in 0..20 {
        world.told(&heartbeat_frame(0, 1_000 * second, 5), world.now.utc);
        world.pass(5 * S);
    }
    assert_eq!(
        (world.stage(ping), world.transmits.len()),
        (Stage::Queued, 0),
        "the satellite was not heard here"
    );
    world.heartbeat();
    world.pass(5 * S);
    assert_eq!(world.transmits.len(), 1);
}

#[test]
fn strangers_may_raise_an_alarm_of_the_present_and_never_end_one() {
    let rule = LimitRule {
        parameter: "heartbeat.temp".into(),
        above: vec![(Level::Warning, 40.0)],
        below: Vec::new(),
        deadband: 0.0,
        persistence: 1,
    };
    let hot = |uptime: u32, temp: f32| {
        let mut payload = vec![0; 117];
        payload[100..104].copy_from_slice(&temp.to_be_bytes());
        payload[104..108].copy_from_slice(&uptime.to_be_bytes());
        frame(6, 0, &payload)
    };
    let mut world = World::in_contact_with(Setup { limits: vec![rule], ..Setup::default() });
    let alarms = |world: &World| {
        let of = |record: &&Record| matches!(record, Record::Event(event) if event.kind == EventKind::Limit);
        world.stored.iter().filter(of).count()
    };
    world.told(&hot(1, 99.0), world.now.utc.plus(-3_600_000_000));
    assert_eq!(alarms(&world), 0, "an hour ago");
    world.told(&hot(2, 99.0), world.now.utc.plus(-5_000_000));
    assert_eq!(alarms(&world), 1);
    world.told(&hot(3, 20.0), world.now.utc);
    assert_eq!(alarms(&world), 1, "all is well, says somebody");
    world.hear(&hot(4, 20.0));
    assert_eq!(alarms(&world), 2, "all is well, we heard");
}

#[test]
fn strangers_wait_while_storage_fails() {
    let mut world = World::in_contact();
    world.confirms = false;
    world.hear(&heartbeat_frame(0, 9, 9));
    world.refuse();
    let delivered = report(&world, "x", &frame(0, 3, &[]), Some(world.now.utc));
    let unknown = Delivered { satellite: SatelliteId::new("other").unwrap(), ..delivered.clone() };
    world
        .station
        .handle(world.now, Input::Outside { delivery: 0, receptions: std::slice::from_ref(&delivered) });
    world.settle();
    assert_eq!(world.taken, [(0, Err(NotTaken::Busy))]);
    assert!(world.reports().is_empty());
    let mut world = World::in_contact();
    world.handle(Input::Outside { delivery: 1, receptions: &[unknown] });
    assert_eq!(world.taken, [(1, Err(NotTaken::UnknownSatellite))]);
    world.handle(Input::Stop);
    world.handle(Input::Outside { delivery: 2, receptions: &[delivered] });
    assert_eq!(world.taken[1], (2, Err(NotTaken::Stopping)));
}
