//! Anything at any time: no panic, no shortcut to the radio, nothing that grows.

use std::collections::HashSet;

use mission::{
    BatchId, CommandId, DownloadId, Effect, Gate, Input, Intent, LinkState, MaybeRadiated, Record, Source,
    Stage, TxId,
};
use proptest::prelude::*;
use protocol::{Counter, Telecommand};

use crate::frames::{chunk_frame, frame, heartbeat_frame, info_frame};
use crate::world::{S, Setup, World, counter_of};

#[derive(Debug, Clone)]
enum Act {
    Bytes(Vec<u8>),
    Frame {
        kind: u8,
        tag: u8,
        payload: Vec<u8>,
    },
    Heartbeat {
        tag: u8,
        uptime_ms: u32,
    },
    Info {
        tag: u8,
        chunks: u32,
        size: u32,
    },
    Chunk {
        tag: u8,
        index: u16,
        fill: u8,
    },
    AnswerLast(u8),
    FromFile(Vec<u8>),
    Confirm,
    ConfirmAll,
    /// What is asked for last is confirmed first.
    Swap,
    Refuse,
    Again,
    StrayBatch(u64),
    StrayWitness(u64),
    TxStarted(u64),
    TxDone(u64, u64),
    TxFailed(u64, bool),
    Pass(u64),
    StepUtc(i64),
    Link(u8),
    Clock(bool),
    View(Option<Option<i64>>),
    Command(u8, bool, Option<u32>),
    Cancel(u64),
    Download,
    CancelDownload(u64),
    Confirmed,
    Arm(bool),
    Restart,
    /// Everything is confirmed, the radio reports, the satellite answers.
    Smooth,
    /// Whatever was switched off is switched on again, and the satellite is heard.
    Mend,
}

fn act() -> impl Strategy<Value = Act> {
    let tag = 0u8..6;
    prop_oneof![
        2 => proptest::collection::vec(any::<u8>(), 0..60).prop_map(Act::Bytes),
        2 => (0u8..8, tag.clone(), proptest::collection::vec(any::<u8>(), 0..20))
            .prop_map(|(kind, tag, payload)| Act::Frame { kind, tag, payload }),
        4 => (tag.clone(), any::<u32>()).prop_map(|(tag, uptime_ms)| Act::Heartbeat { tag, uptime_ms }),
        2 => (tag.clone(), 0u32..70_000, 0u32..3).prop_map(|(tag, chunks, off)| Act::Info {
            tag, chunks, size: (chunks * 222).saturating_sub(off) }),
        3 => (tag, 0u16..9, 0u8..3).prop_map(|(tag, index, fill)| Act::Chunk { tag, index, fill }),
        6 => (0u8..4).prop_map(Act::AnswerLast),
        1 => proptest::collection::vec(any::<u8>(), 0..30).prop_map(Act::FromFile),
        4 => Just(Act::Confirm),
        8 => Just(Act::ConfirmAll),
        2 => Just(Act::Swap),
        2 => Just(Act::Refuse),
        1 => Just(Act::Again),
        1 => any::<u64>().prop_map(Act::StrayBatch),
        1 => (0u64..3).prop_map(Act::StrayWitness),
        1 => (0u64..9).prop_map(Act::TxStarted),
        5 => (0u64..3, any::<u64>()).prop_map(|(back, us)| Act::TxDone(back, us)),
        2 => (0u64..3, any::<bool>()).prop_map(|(back, maybe)| Act::TxFailed(back, maybe)),
        8 => (0u64..6_000_000).prop_map(Act::Pass),
        1 => (0u64..200_000_000).prop_map(Act::Pass),
        1 => prop_oneof![Just(i64::MIN), Just(i64::MAX), -400_000_000_000_000i64..400_000_000_000_000]
            .prop_map(Act::StepUtc),
        1 => (0u8..8).prop_map(Act::Link),
        1 => any::<bool>().prop_map(Act::Clock),
        1 => proptest::option::of(proptest::option::of(-60_000_000i64..600_000_000)).prop_map(Act::View),
        6 => (0u8..9, any::<bool>(), proptest::option::of(0u32..30_000_000))
            .prop_map(|(what, blind, expires)| Act::Command(what, blind, expires)),
        2 => (0u64..9).prop_map(Act::Cancel),
        1 => Just(Act::Download),
        1 => (0u64..3).prop_map(Act::CancelDownload),
        1 => Just(Act::Confirmed),
        1 => any::<bool>().prop_map(Act::Arm),
        1 => Just(Act::Restart),
        6 => Just(Act::Smooth),
        4 => Just(Act::Mend),
    ]
}

fn telecommand(what: u8) -> Telecommand {
    match what {
        0 => Telecommand::Reset,
        1 => Telecommand::GetImageInfo,
        2 => Telecommand::GetImageChunk { first: 1, count: 5 },
        3 => Telecommand::SetTransmitter { on: false },
        4 => Telecommand::SetTransmitter { on: true },
        5 => Telecommand::SetAdcsAuto,
        6 => Telecommand::CaptureImage {
            resolution: protocol::Resolution::Cif,
            grey: false,
            strong_compression: false,
        },
        7 => Telecommand::SetTimestamp { utc_ms: 1 },
        _ => Telecommand::Ping,
    }
}

/// What is checked after each act.
#[derive(Default)]
struct Watch {
    handed: usize,
    out: Option<TxId>,
    counters: Vec<u64>,
    bytes: HashSet<[u8; 240]>,
}

impl Watch {
    fn look(&mut self, world: &World) -> Result<(), TestCaseError> {
        for transmit in &world.transmits[self.handed..] {
            prop_assert!(self.out.is_none(), "two hand-overs outstanding");
            self.out = Some(transmit.tx);
            let counter = counter_of(transmit);
            let sealed = world.stored.iter().any(|r| {
                matches!(r, Record::Sealed(row) if *row.bytes == *transmit.frame && row.command == transmit.command)
            });
            prop_assert!(sealed, "handed over and not stored");
            let last = world.stage(transmit.command);
            prop_assert_eq!(last, Stage::Radiating);
            let witnessed = matches!(&world.witness, mission::snapshot::Witness::At(at) if at.0 >= counter);
            prop_assert!(witnessed, "handed over above the witness");
            prop_assert!(self.counters.last().is_none_or(|before| *before < counter), "counters fall");
            prop_assert!(self.bytes.insert(*transmit.frame), "the same bytes twice");
            self.counters.push(counter);
        }
        self.handed = world.transmits.len();
        Ok(())
    }

    /// What the radio said of a hand-over: nothing of it is outstanding; told `No`, it was not radiated.
    fn over(&mut self, tx: TxId) {
        self.out.take_if(|out| *out == tx);
    }
}

/// The simple acts that an act is made of.
fn parts(act: &Act) -> Vec<Act> {
    match act {
        Act::Smooth => vec![Act::ConfirmAll, Act::TxDone(0, 1), Act::AnswerLast(1), Act::ConfirmAll],
        Act::Mend => vec![
            Act::ConfirmAll,
            Act::Link(9),
            Act::View(Some(None)),
            Act::Clock(true),
            Act::Arm(true),
            Act::Confirmed,
            Act::Pass(3 * S),
            Act::ConfirmAll,
            Act::Heartbeat { tag: 0, uptime_ms: 4_000_000_000 },
            Act::Pass(4 * S),
            Act::ConfirmAll,
        ],
        simple => vec![simple.clone()],
    }
}

fn tx_back(world: &World, back: u64) -> TxId {
    let newest = world.transmits.last().map_or(0, |transmit| transmit.tx.0);
    TxId(newest.saturating_sub(back))
}

fn carry_out(world: &mut World, act: &Act, watch: &mut Watch) {
    match act {
        Act::Bytes(bytes) => world.hear(bytes),
        Act::Frame { kind, tag, payload } => world.hear(&frame(*kind, *tag, payload)),
        Act::Heartbeat { tag, uptime_ms } => world.hear(&heartbeat_frame(*tag, *uptime_ms, world.now.mono.0)),
        Act::Info { tag, chunks, size } => world.hear(&info_frame(*tag, *chunks > 0, *chunks, *size, 408)),
        Act::Chunk { tag, index, fill } => world.hear(&chunk_frame(*tag, *index, *fill)),
        Act::AnswerLast(how) => {
            if world.transmits.is_empty() {
                return;
            }
            let (tag, asked) = world.last_request();
            match (how, asked) {
                (0, _) => world.hear(&frame(1, tag, &[1])),
                (_, Telecommand::Ping) => world.hear(&frame(0, tag, &[])),
                (_, Telecommand::GetImageInfo | Telecommand::CaptureImage { .. }) => {
                    world.hear(&info_frame(tag, true, 8, 8 * 222, 408));
                }
                (_, Telecommand::GetImageChunk { first, count }) => {
                    for index in first..first + count.min(7) {
                        world.hear(&chunk_frame(tag, index, 0));
                    }
                }
                (_, Telecommand::SetAdcsAuto) => world.hear(&frame(4, tag, &[0; 141])),
                _ => world.hear(&heartbeat_frame(tag, 1, world.now.mono.0)),
            }
        }
        Act::FromFile(bytes) => world.hear_from_file(bytes),
        Act::Confirm if !world.waiting.is_empty() => world.confirm(),
        Act::ConfirmAll => {
            world.confirms = true;
            world.settle();
            world.confirms = false;
        }
        Act::Swap if !world.waiting.is_empty() => world.waiting.rotate_left(1),
        Act::Refuse if !world.waiting.is_empty() => world.refuse(),
        Act::Again => {
            // Confirmations of things long confirmed.
            let newest = world
                .waiting
                .iter()
                .find_map(|e| if let Effect::Persist(b) = e { Some(b.id.0) } else { None });
            for batch in (0..4).filter(|batch| newest.is_some_and(|newest| *batch < newest)) {
                world.handle(Input::PersistFailed {
                    batch: BatchId(batch),
                    reason: "late",
                    again_us: 1_000_000,
                });
            }
        }
        Act::StrayBatch(batch) => {
            let out: HashSet<u64> = world
                .waiting
                .iter()
                .filter_map(|e| if let Effect::Persist(b) = e { Some(b.id.0) } else { None })
                .collect();
            if !out.contains(batch) {
                world.handle(Input::PersistDone(BatchId(batch.saturating_add(1 << 40))));
            }
        }
        Act::StrayWitness(back) => {
            // Told again, or told of an older counter: true, and long known.
            let key = world.key();
            if let mission::snapshot::Witness::At(at) = &world.witness {
                let counter = Counter(at.0.saturating_sub(*back));
                world.handle(Input::WitnessDone { key, counter });
            }
        }
        Act::TxStarted(back) => {
            let tx = tx_back(world, *back);
            world.handle(Input::TxStarted(tx));
        }
        Act::TxDone(back, airtime_us) => {
            let tx = tx_back(world, *back);
            watch.over(tx);
            world.handle(Input::TxDone { tx, airtime_us: *airtime_us, measured: true });
        }
        Act::TxFailed(back, maybe) => {
            let tx = tx_back(world, *back);
            watch.over(tx);
            let radiated = if *maybe { MaybeRadiated::Maybe } else { MaybeRadiated::No };
            world.handle(Input::TxFailed { tx, radiated, reason: "chaos" });
        }
        Act::Pass(us) => {
            let before = world.now.mono;
            world.pass(*us);
            // The engine gives a silent radio up after 30 s, and says so.
            if world.now.mono.since(before) >= 30 * S || !world.station.status(world.now).links[0].on_air {
                watch.out = None;
            }
        }
        Act::StepUtc(us) => match *us {
            i64::MIN | i64::MAX => world.now.utc = mission::UtcUs(*us),
            us => world.step_utc(us),
        },
        Act::Link(state) => world.link_state(match state {
            0 => LinkState::Unavailable { reason: "gone".into() },
            1 => LinkState::Failed { reason: "broken".into() },
            2 => LinkState::Disabled,
            _ => LinkState::Ok,
        }),
        Act::Clock(synchronised) => world.handle(Input::Clock { synchronised: *synchronised }),
        Act::View(view) => {
            let utc = world.now.utc;
            world.view(view.map(|los| los.map(|us| utc.plus(us))));
        }
        Act::Command(what, blind, expires) => {
            let mut intent = world.intent_of(telecommand(*what));
            intent.gate = if *blind { Gate::Blind } else { Gate::Heard };
            intent.expires_at = expires.map(|us| world.now.utc.plus(i64::from(us)));
            world.want(Intent::Command(intent));
        }
        Act::Cancel(command) => {
            world.want(Intent::Cancel(CommandId(*command)));
        }
        Act::Download => {
            let satellite = world.satellite.clone();
            world.want(Intent::Download { satellite, link: None });
        }
        Act::CancelDownload(download) => {
            world.want(Intent::CancelDownload(DownloadId(*download)));
        }
        Act::Confirmed => {
            let key = world.key();
            world.want(Intent::ConfirmCounter { key, above: None });
            world.want(Intent::VouchClock);
        }
        Act::Arm(armed) => {
            let link = world.link.clone();
            world.want(Intent::ArmLink { link, armed: *armed });
        }
        Act::Restart => {
            watch.out = None;
            world.restart();
            world.confirms = false;
            world.link_state(LinkState::Ok);
        }
        Act::Confirm | Act::Swap | Act::Refuse | Act::Smooth | Act::Mend => {}
    }
}

proptest! {
    #![proptest_config(ProptestConfig { max_shrink_iters: 4_000, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_the_order_is_kept_and_nothing_panics(
        acts in proptest::collection::vec(act(), 1..160), tags in any::<bool>(), ranges in any::<bool>(),
    ) {
        let profile = mission::Profile { tags, ranges, ..mission::Profile::default() };
        let mut world = World::in_contact_with(Setup { profile, ..Setup::default() });
        world.confirms = false;
        let mut watch = Watch::default();
        for act in acts.iter().flat_map(parts) {
            carry_out(&mut world, &act, &mut watch);
            watch.look(&world)?;
            let persists = world.waiting.iter().filter(|e| matches!(e, Effect::Persist(_))).count();
            prop_assert!(persists <= 1, "one batch is out at a time");
            prop_assert!(world.waiting.len() <= 4, "{:?}", world.waiting);
        }
        radiated_at_most_as_often_as_allowed(&world)?;
        stages_follow_each_other(&world)?;
    }

    #[test]
    fn any_bytes_in_any_pieces_are_taken(pieces in proptest::collection::vec(
        prop_oneof![
            proptest::collection::vec(any::<u8>(), 0..300),
            (any::<u8>(), any::<u8>(), proptest::collection::vec(any::<u8>(), 0..224))
                .prop_map(|(kind, tag, payload)| frame(kind, tag, &payload)),
        ], 0..60)) {
        let mut world = World::in_contact();
        for piece in pieces {
            let link = world.link.clone();
            let received = world.now;
            world.handle(Input::Bytes { link: &link, bytes: &piece, source: Source::Radio, received });
            world.pass(30_000);
        }
        prop_assert!(world.transmits.is_empty(), "nothing that is heard makes us send");
    }
}

/// By what the store says: `radiating` not taken back, counted by command.
fn radiated_at_most_as_often_as_allowed(world: &World) -> Result<(), TestCaseError> {
    for record in &world.stored {
        let Record::Command(command) = record else { continue };
        let stages = world.stages(command.id);
        let radiated =
            stages.windows(2).filter(|w| w[0] == Stage::Radiating && w[1] != Stage::Queued).count();
        prop_assert!(radiated <= usize::from(command.attempts_allowed), "{:?}: {:?}", command, stages);
        if !command.telecommand.is_idempotent() {
            prop_assert!(radiated <= 1);
        }
    }
    Ok(())
}

fn stages_follow_each_other(world: &World) -> Result<(), TestCaseError> {
    for record in &world.stored {
        let Record::Command(command) = record else { continue };
        let idempotent = command.telecommand.is_idempotent();
        for pair in world.stages(command.id).windows(2) {
            prop_assert!(pair[0].may_be_followed_by(pair[1], idempotent), "{:?}", pair);
        }
    }
    Ok(())
}
