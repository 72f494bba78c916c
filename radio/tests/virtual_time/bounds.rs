//! Whatever comes in, every wait ends, every frame is answered once, and nothing panics.

use crate::bench::{Bench, frame};
use proptest::prelude::*;
use radio::driver::{
    AuxWiring, Driver, DriverConfig, DriverInput, DriverOutput, DriverState, ModePins, Radiated,
};
use radio::model::{Firmware, ModelConfig, Quirks};
use std::collections::HashMap;

/// Longest way to Ready or Fault with nothing but wakes: six seconds of a stuck AUX before configuration, each AT
/// command and register exchange at its limit, a reset and the same again.
const SETTLED_WITHIN_US: u64 = 60_000_000;

#[derive(Debug, Clone)]
enum Op {
    Opened,
    Closed,
    Bytes(Vec<u8>),
    Aux(bool),
    Drained,
    Transmit(Vec<u8>),
    Stop,
    Pass(u64),
    Wake,
}

fn op() -> impl Strategy<Value = Op> {
    let fragment = prop_oneof![
        proptest::collection::vec(any::<u8>(), 0..300),
        Just(vec![0xC1, 0, 9, 0xDE, 0x70, 0, 0x62, 3, 0x19, 0xC3, 0, 0]),
        Just(vec![0xC1, 0, 9, 0, 0, 0, 0x62, 0, 0x17, 3, 0, 0]),
        Just(vec![0xC1, 0xC2, 0xC3, 2, 2]),
        Just(vec![0xC1, 0xC2, 0xC3, 2, 0]),
        Just(vec![0xC1, 0, 9]),
        Just(vec![0xFF; 3]),
        Just(b"AT+FWCODE=7453-0-21\r\n".to_vec()),
        Just(b"AT+DEVTYPE=E22-400T30D".to_vec()),
        Just(b"AT+UFREQ=0,1,1,1\r\n".to_vec()),
        Just(b"AT+UFREQ=1,410000000,1000000,83\r\n".to_vec()),
        Just(b"=OK\r\n".to_vec()),
        Just(b"=ERR".to_vec()),
        Just(b"AT+UAUX=0\r\n".to_vec()),
    ];
    prop_oneof![
        3 => Just(Op::Opened),
        1 => Just(Op::Closed),
        8 => fragment.prop_map(Op::Bytes),
        4 => any::<bool>().prop_map(Op::Aux),
        1 => Just(Op::Drained),
        4 => proptest::collection::vec(any::<u8>(), 0..260).prop_map(Op::Transmit),
        1 => Just(Op::Stop),
        8 => prop_oneof![0u64..3_000, 0u64..700_000, 0u64..8_000_000].prop_map(Op::Pass),
        6 => Just(Op::Wake),
    ]
}

fn wiring() -> impl Strategy<Value = DriverConfig> {
    (
        prop_oneof![
            any::<bool>().prop_map(|inverted| ModePins::Lines { inverted }),
            Just(ModePins::Software),
            Just(ModePins::Strapped)
        ],
        prop_oneof![Just(AuxWiring::Present), Just(AuxWiring::Absent)],
        any::<bool>(),
        any::<bool>(),
    )
        .prop_map(|(mode_pins, aux, transmit_unverified, save_to_flash)| DriverConfig {
            mode_pins,
            aux,
            transmit_unverified,
            save_to_flash,
            ..DriverConfig::default()
        })
}

/// Watches what the driver says.
#[derive(Debug, Default)]
struct Watch {
    asked: u64,
    outcomes: HashMap<u64, u32>,
    started: Option<u64>,
    /// The computed end of the last radiation.
    air_until_us: u64,
    reopen_pending: bool,
    stopped: bool,
}

impl Watch {
    fn drain(&mut self, driver: &mut Driver, now_us: u64) {
        while let Some(output) = driver.next_output() {
            match output {
                DriverOutput::TxStarted { id } => self.started = Some(id),
                DriverOutput::Write(bytes) if self.started.take().is_some() => {
                    assert!(now_us >= self.air_until_us, "frame over frame");
                    self.air_until_us = now_us + driver.config().timing.send_us(bytes.len() - 3);
                }
                DriverOutput::TxDone { id, .. } => {
                    assert!(now_us >= self.air_until_us, "done before the end");
                    *self.outcomes.entry(id).or_default() += 1;
                }
                DriverOutput::TxFailed { id, .. } => *self.outcomes.entry(id).or_default() += 1,
                DriverOutput::Reopen { after_us } => {
                    assert!(after_us <= 5_000_000);
                    self.reopen_pending = true;
                }
                _ => {}
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn any_inputs_end_in_ready_or_a_reopening(config in wiring(), ops in proptest::collection::vec(op(), 0..120)) {
        let mut driver = Driver::new(config);
        let mut watch = Watch::default();
        let mut now_us = 1;
        for op in &ops {
            match op {
                Op::Opened => {
                    watch.reopen_pending = false;
                    watch.stopped = false;
                    driver.handle(now_us, DriverInput::Opened);
                }
                Op::Closed => driver.handle(now_us, DriverInput::Closed),
                Op::Bytes(bytes) => driver.handle(now_us, DriverInput::Bytes(bytes)),
                Op::Aux(idle) => driver.handle(now_us, DriverInput::Aux { idle: *idle }),
                Op::Drained => driver.handle(now_us, DriverInput::Drained),
                Op::Transmit(bytes) => {
                    watch.asked += 1;
                    driver.handle(now_us, DriverInput::Transmit { id: watch.asked, target: 1, frame: bytes });
                }
                Op::Stop => {
                    watch.stopped = true;
                    driver.handle(now_us, DriverInput::Stop);
                }
                Op::Pass(pause_us) => now_us += pause_us,
                Op::Wake => {
                    now_us = driver.next_wakeup_us().unwrap_or(now_us).max(now_us);
                    driver.handle(now_us, DriverInput::Wake);
                }
            }
            watch.drain(&mut driver, now_us);
        }
        let last_input_us = now_us;
        let mut wakes = 0;
        while let Some(at_us) = driver.next_wakeup_us() {
            wakes += 1;
            prop_assert!(wakes < 1_000, "wakes without end in {:?}", driver.state());
            now_us = now_us.max(at_us);
            driver.handle(now_us, DriverInput::Wake);
            watch.drain(&mut driver, now_us);
        }
        prop_assert!(now_us - last_input_us <= SETTLED_WITHIN_US, "took {} us", now_us - last_input_us);
        match driver.state() {
            DriverState::Ready => {}
            DriverState::Fault => prop_assert!(watch.reopen_pending),
            DriverState::Closed => {
                let untouched = !ops.iter().any(|op| matches!(op, Op::Opened | Op::Closed | Op::Stop));
                prop_assert!(watch.reopen_pending || watch.stopped || untouched);
            }
            other => prop_assert!(false, "rests in {other:?}"),
        }
        for id in 1..=watch.asked {
            prop_assert_eq!(watch.outcomes.get(&id), Some(&1), "frame {}", id);
        }
    }

    /// Against a module with any mixture of faults: never two packets on the air (the bench asserts it), a frame at
    /// most once and unchanged, and what is reported done was radiated.
    #[test]
    fn any_module_is_sent_each_frame_at_most_once(
        mut config in wiring(),
        firmware in prop_oneof![Just(Firmware::V1), Just(Firmware::V2_1), Just(Firmware::V2_2)],
        junk_prefix in proptest::collection::vec(any::<u8>(), 0..6),
        flags in any::<[bool; 9]>(),
        aux_stuck in proptest::option::weighted(0.2, any::<bool>()),
        aux_chatter_us in proptest::option::weighted(0.3, 200u64..3_000_000),
        slow_boot_us in proptest::option::weighted(0.3, 0u64..1_500_000),
        hangs_at_transmission in proptest::option::weighted(0.2, 1u32..4),
        prepared: bool,
        latency_us in prop_oneof![Just(0u64), 0u64..20_000],
        pauses in proptest::collection::vec(0u64..4_000_000, 1..6),
    ) {
        let [echo, no_newline, rejects_crlf, no_ufreq, no_uaux, mute, no_configuration, split_frames, unplug] = flags;
        let quirks = Quirks {
            junk_prefix, echo, no_newline, rejects_crlf, no_ufreq, no_uaux, split_frames, aux_stuck, aux_chatter_us,
            slow_boot_us, hangs_at_transmission,
            mute: mute && echo && no_ufreq,
            no_configuration: no_configuration && no_uaux,
            ..Quirks::default()
        };
        if config.mode_pins == (ModePins::Lines { inverted: false }) && firmware == Firmware::V1 {
            config.frequency_hz = 435_125_000;
        }
        let strapped = config.mode_pins == ModePins::Strapped;
        let base = if prepared { ModelConfig::prepared(true) } else { ModelConfig::default() };
        let mut bench = Bench::new(config, ModelConfig { firmware, quirks, ..base });
        bench.latency_us = latency_us;
        if strapped {
            // Nobody asks a strapped module whether it has booted.
            bench.run_until(2_000_000);
        }
        bench.open();
        bench.run_to_state(DriverState::Ready, SETTLED_WITHIN_US);
        let settled = matches!(
            bench.driver.state(),
            DriverState::Ready | DriverState::Fault | DriverState::Opening | DriverState::Identify
        );
        prop_assert!(settled, "{:?}", bench.driver.state());
        let fixed = bench.module.registers().fixed_point();
        let frames: Vec<Vec<u8>> = (0..pauses.len()).map(|n| frame(240 - n, n as u8)).collect();
        let before = bench.sent.len();
        for (n, pause_us) in pauses.iter().enumerate() {
            bench.transmit(n as u64, &frames[n]);
            bench.run_for(*pause_us);
            if unplug && n == 2 {
                bench.unplug();
                bench.port_present = true;
            }
        }
        bench.run_for(SETTLED_WITHIN_US);
        for (n, frame) in frames.iter().enumerate() {
            let outcome = bench.outcome(n as u64);
            prop_assert!(outcome.is_some(), "frame {n} was not answered");
            if !fixed {
                continue;
            }
            let times = bench.sent[before..].iter().filter(|sent| sent.packet == *frame).count();
            match outcome {
                Some(Ok(_)) if !bench.module.config().quirks.mute && hangs_at_transmission.is_none() => {
                    prop_assert_eq!(times, 1, "done but not radiated");
                }
                Some(Err((Radiated::No, _))) => prop_assert_eq!(times, 0, "failed but radiated"),
                _ => prop_assert!(times <= 1),
            }
        }
    }
}
