//! What goes wrong with these modules in the field, one test each.

use crate::bench::{Bench, frame};
use radio::airtime::{LinkTiming, LoraPhy};
use radio::driver::{
    AuxWiring, Diagnostic, Driver, DriverConfig, DriverInput, DriverOutput, DriverState, Generation,
    ModePins, Radiated, TxFailure,
};
use radio::model::{Firmware, ModelConfig, Quirks};
use radio::registers::Registers;

const LINES: ModePins = ModePins::Lines { inverted: false };

fn lines(aux: AuxWiring) -> DriverConfig {
    DriverConfig { mode_pins: LINES, aux, rssi_byte: Some(true), ..DriverConfig::default() }
}

fn software() -> DriverConfig {
    DriverConfig { mode_pins: ModePins::Software, ..lines(AuxWiring::Absent) }
}

fn strapped() -> DriverConfig {
    DriverConfig { mode_pins: ModePins::Strapped, transmit_unverified: true, ..lines(AuxWiring::Absent) }
}

fn with(quirks: Quirks) -> ModelConfig {
    ModelConfig { quirks, ..ModelConfig::default() }
}

fn has(bench: &Bench, wanted: impl Fn(&Diagnostic) -> bool) -> bool {
    bench.diagnostics().into_iter().any(wanted)
}

fn sends_whole(bench: &mut Bench, id: u64) {
    let uplink = frame(240, id as u8);
    bench.send(id, &uplink).expect("sent");
    assert_eq!(bench.sent.last().expect("on the air").packet, uplink);
}

#[test]
fn aux_stuck_low_from_the_start_is_named_and_done_without() {
    let quirks = Quirks { aux_stuck: Some(false), ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Present), with(quirks));
    bench.bring_up(10_000_000);
    assert!(has(&bench, |d| matches!(d, Diagnostic::AuxStuckLow { .. })));
    sends_whole(&mut bench, 1);
    sends_whole(&mut bench, 2);
}

#[test]
fn aux_stuck_high_is_never_trusted() {
    let quirks = Quirks { aux_stuck: Some(true), ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Present), with(quirks));
    bench.bring_up(3_000_000);
    assert!(!bench.driver.facts().aux_trusted);
    for id in 1..4 {
        let (airtime_us, measured) = bench.send(id, &frame(240, 0)).expect("sent");
        assert_eq!((airtime_us, measured), (1_229_824, false));
    }
    assert_eq!(bench.sent.len(), 3);
}

#[test]
fn aux_that_sticks_low_during_a_transmission_leads_to_a_reset() {
    let mut bench = Bench::new(lines(AuxWiring::Present), ModelConfig::default());
    bench.bring_up(4_000_000);
    sends_whole(&mut bench, 1);
    let resets = bench.module.counters().resets;
    bench.transmit(2, &frame(240, 2));
    bench.run_for(100_000);
    bench.module.quirks_mut().aux_stuck = Some(false);
    let began_us = bench.now_us;
    bench.run(began_us + 30_000_000, |bench| bench.outcome(2).is_some());
    assert_eq!(bench.outcome(2), Some(Err((Radiated::Maybe, TxFailure::AuxStuckLow))));
    assert!(bench.now_us - began_us < 6_000_000, "timeout");
    bench.module.quirks_mut().aux_stuck = None;
    assert!(bench.run_to_state(DriverState::Ready, 4_000_000));
    assert_eq!(bench.module.counters().resets, resets + 1);
    assert!(bench.driver.facts().frequency_verified && bench.driver.facts().configuration_verified);
    assert_eq!(bench.sent.len(), 2, "never repeated");
    sends_whole(&mut bench, 3);
}

#[test]
fn aux_that_falls_silent_makes_the_frame_unknown_once() {
    let mut bench = Bench::new(lines(AuxWiring::Present), ModelConfig::default());
    bench.bring_up(4_000_000);
    sends_whole(&mut bench, 1);
    bench.module.quirks_mut().aux_stuck = Some(true);
    assert_eq!(bench.send(2, &frame(240, 2)), Err((Radiated::Maybe, TxFailure::AuxSilent)));
    assert!(has(&bench, |d| *d == Diagnostic::AuxSilent));
    assert!(bench.run_to_state(DriverState::Ready, 5_000_000));
    sends_whole(&mut bench, 3);
}

#[test]
fn a_chattering_aux_is_ignored() {
    for period_us in [300, 2_000, 7_001, 20_000] {
        let quirks = Quirks { aux_chatter_us: Some(period_us), ..Quirks::default() };
        let mut bench = Bench::new(lines(AuxWiring::Present), with(quirks));
        bench.bring_up(12_000_000);
        assert!(has(&bench, |d| *d == Diagnostic::AuxChatter));
        for id in 1..4 {
            sends_whole(&mut bench, id);
        }
    }
}

#[test]
fn a_slowly_chattering_aux_never_overlaps_frames() {
    for period_us in [90_000, 170_000, 333_333, 1_000_000, 3_000_000] {
        let quirks = Quirks { aux_chatter_us: Some(period_us), ..Quirks::default() };
        let mut bench = Bench::new(lines(AuxWiring::Present), with(quirks));
        bench.open();
        bench.run_to_state(DriverState::Ready, 20_000_000);
        for id in 1..12 {
            let _ = bench.send(id, &frame(240, id as u8));
        }
        // The bench itself asserts that nothing is written while the module sends.
        assert!(bench.sent.len() <= 11);
    }
}

#[test]
fn a_silent_radio_is_named_and_tried_again_ever_more_slowly() {
    let quirks = Quirks { mute: true, ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Absent), with(quirks));
    bench.open();
    assert!(bench.run_to_state(DriverState::Fault, 6_000_000));
    assert!(has(&bench, |d| *d == Diagnostic::NoAnswer));
    bench.run_for(60_000_000);
    let pauses: Vec<u64> = bench
        .log
        .iter()
        .filter_map(|(_, output)| match output {
            DriverOutput::Reopen { after_us } => Some(*after_us),
            _ => None,
        })
        .collect();
    assert!(pauses.starts_with(&[500_000, 1_000_000, 2_000_000, 5_000_000, 5_000_000]), "{pauses:?}");
    assert_eq!(bench.send(1, b"x"), Err((Radiated::No, TxFailure::NotReady)));
    bench.module.quirks_mut().mute = false;
    assert!(bench.run_to_state(DriverState::Ready, 15_000_000));
    sends_whole(&mut bench, 2);
}

#[test]
fn a_port_at_the_wrong_rate_is_named() {
    let model = ModelConfig { host_baud: 19_200, ..ModelConfig::default() };
    let mut bench = Bench::new(lines(AuxWiring::Absent), model);
    bench.open();
    assert!(bench.run_to_state(DriverState::Fault, 6_000_000));
    assert!(has(&bench, |d| matches!(d, Diagnostic::Garbled { .. })), "{:?}", bench.diagnostics());
}

#[test]
fn a_module_stored_at_another_rate_is_put_right() {
    for code in [0, 7] {
        let registers = Registers::FACTORY.with_baud_code(code);
        let mut bench =
            Bench::new(lines(AuxWiring::Present), ModelConfig { registers, ..ModelConfig::default() });
        bench.bring_up(5_000_000);
        assert_eq!(bench.module.registers().baud(), 9600);
        sends_whole(&mut bench, 1);
    }
    // Without lines there is no way in.
    let registers = ModelConfig::prepared(true).registers.with_baud_code(7);
    let mut bench = Bench::new(software(), ModelConfig { registers, ..ModelConfig::prepared(true) });
    bench.bring_up(3_000_000);
    assert!(has(&bench, |d| *d == Diagnostic::SoftwareSwitchSilent));
    assert_eq!(bench.send(1, b"x"), Err((Radiated::No, TxFailure::FrequencyUnverified)));
}

#[test]
fn an_echoing_adapter_is_seen_through() {
    let quirks = Quirks { echo: true, ..Quirks::default() };
    for driver in [lines(AuxWiring::Absent), lines(AuxWiring::Present), software()] {
        let mut bench =
            Bench::new(driver, ModelConfig { quirks: quirks.clone(), ..ModelConfig::prepared(true) });
        bench.bring_up(4_000_000);
        assert!(bench.driver.facts().echo && bench.driver.facts().configuration_verified);
        assert!(has(&bench, |d| *d == Diagnostic::Echo));
        bench.delivered.clear();
        sends_whole(&mut bench, 1);
        bench.hear_whole(&frame(240, 9), -100);
        assert_eq!(bench.delivered.len(), 241, "our own frame was delivered");
        assert_eq!(bench.driver.counters().echo_bytes, 243);
    }
}

#[test]
fn an_echo_without_a_module_is_named() {
    let quirks = Quirks { echo: true, mute: true, ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Absent), with(quirks));
    bench.open();
    assert!(bench.run_to_state(DriverState::Fault, 6_000_000));
    assert!(has(&bench, |d| *d == Diagnostic::EchoOnly));
}

#[test]
fn junk_before_replies_is_skipped() {
    let junks: [&[u8]; 6] =
        [&[0], &[0, 0], &[0, 0, 0xC1], &[0xC1, 0x00], &[0xFF, 0xFE, 0x0D], &[0xC1, 0xC2, 0xC3, 0x02]];
    for junk in junks {
        for firmware in [Firmware::V2_1, Firmware::V2_2] {
            for driver in [lines(AuxWiring::Present), software()] {
                let quirks = Quirks { junk_prefix: junk.to_vec(), ..Quirks::default() };
                let model = ModelConfig { quirks, firmware, ..ModelConfig::prepared(false) };
                let mut bench = Bench::new(driver, model);
                bench.bring_up(5_000_000);
                assert!(bench.driver.facts().configuration_verified, "{junk:02x?}");
                assert!(bench.driver.facts().frequency_verified, "{junk:02x?}");
            }
        }
    }
}

#[test]
fn line_ends_of_at_commands_are_found_out() {
    let cases = [
        Quirks { rejects_crlf: true, ..Quirks::default() },
        Quirks { rejects_crlf: true, no_newline: true, ..Quirks::default() },
        Quirks { wants_crlf: true, ..Quirks::default() },
        Quirks { wants_crlf: true, no_newline: true, ..Quirks::default() },
        Quirks { no_newline: true, echo: true, ..Quirks::default() },
    ];
    for quirks in cases {
        let mut bench = Bench::new(lines(AuxWiring::Present), with(quirks.clone()));
        bench.bring_up(6_000_000);
        let facts = bench.driver.facts();
        assert_eq!(facts.firmware.as_deref(), Some("7453-0-21"), "{quirks:?}");
        assert_eq!(facts.device_type.as_deref(), Some("E22-400T30D"));
        assert_eq!(facts.uaux, Some(true));
        assert!(facts.frequency_verified);
    }
}

#[test]
fn a_clamped_air_rate_is_reported_and_silences_us() {
    let driver = DriverConfig { air_rate: 0, ..lines(AuxWiring::Absent) };
    let mut bench = Bench::new(driver, ModelConfig::default());
    bench.bring_up(5_000_000);
    let refused = Diagnostic::Refused { register: 3, wanted: 0x60, found: 0x62 };
    assert!(has(&bench, |d| *d == refused));
    assert!(refused.to_string().contains("module refused"));
    assert_eq!(bench.send(1, b"x"), Err((Radiated::No, TxFailure::ConfigurationUnverified)));
    bench.hear_whole(b"heard", -90);
    assert_eq!(bench.delivered.len(), 6);
}

#[test]
fn a_slow_boot_is_waited_for() {
    let quirks = Quirks { slow_boot_us: Some(900_000), ..Quirks::default() };
    for driver in [lines(AuxWiring::Present), lines(AuxWiring::Absent), software()] {
        let mut bench =
            Bench::new(driver, ModelConfig { quirks: quirks.clone(), ..ModelConfig::prepared(true) });
        bench.bring_up(6_000_000);
        assert!(bench.driver.facts().configuration_verified);
    }
}

#[test]
fn split_output_and_a_missing_rssi_byte_are_delivered_as_they_come() {
    let quirks = Quirks { split_frames: true, ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Absent), with(quirks));
    bench.bring_up(3_000_000);
    bench.hear_whole(&frame(240, 1), -100);
    assert_eq!(bench.delivered.len(), 241);
    assert_eq!(bench.delivered[..240], frame(240, 1));

    let quirks = Quirks { missing_rssi_byte: true, ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Absent), with(quirks));
    bench.bring_up(3_000_000);
    bench.hear_whole(&frame(240, 1), -100);
    assert_eq!(bench.delivered, frame(240, 1));
    assert_eq!(bench.driver.facts().rssi_byte, Some(true), "the register says so");
}

#[test]
fn configuration_that_is_never_answered() {
    let quirks = Quirks { no_configuration: true, ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Absent), with(quirks.clone()));
    bench.open();
    assert!(bench.run_to_state(DriverState::Fault, 6_000_000));

    // Without lines the module is used as it is: heard, and silent.
    let mut bench = Bench::new(software(), ModelConfig { quirks, ..ModelConfig::prepared(true) });
    bench.bring_up(2_000_000);
    assert!(has(&bench, |d| *d == Diagnostic::SoftwareSwitchSilent));
    bench.run_for(3_000_000);
    bench.hear_whole(&frame(240, 1), -100);
    assert_eq!(bench.delivered.len(), 241);
    assert_eq!(bench.send(1, b"x"), Err((Radiated::No, TxFailure::FrequencyUnverified)));
}

#[test]
fn a_module_that_answers_late_is_looked_at_again_when_somebody_wants_to_send() {
    let quirks = Quirks { no_configuration: true, ..Quirks::default() };
    let mut bench = Bench::new(software(), ModelConfig { quirks, ..ModelConfig::prepared(true) });
    bench.bring_up(2_000_000);
    bench.run_for(60_000_000);
    assert_eq!(bench.driver.state(), DriverState::Ready, "nobody wants anything: nothing is said");
    // Still silent: one look for many wishes, since each may go on the air.
    let looks = |bench: &Bench| {
        bench.diagnostics().iter().filter(|d| ***d == Diagnostic::SoftwareSwitchSilent).count()
    };
    let before = looks(&bench);
    for id in 1..=10 {
        assert!(bench.send(id, b"x").is_err());
        bench.run_for(400_000);
    }
    assert_eq!(looks(&bench), before + 1);
    bench.module.quirks_mut().no_configuration = false;
    bench.run_for(6_000_000);
    assert!(bench.send(11, b"x").is_err());
    assert!(bench.run_to_state(DriverState::Ready, 3_000_000));
    sends_whole(&mut bench, 12);
}

#[test]
fn a_module_whose_at_commands_come_late_is_looked_at_again_too() {
    let quirks = Quirks { silent_at: true, ..Quirks::default() };
    let mut bench = Bench::new(software(), ModelConfig { quirks, ..ModelConfig::prepared(true) });
    bench.bring_up(5_000_000);
    assert_eq!(bench.driver.facts().frequency_hz, Some(435_125_000), "by its own grid, one thinks");
    bench.module.quirks_mut().silent_at = false;
    assert_eq!(bench.send(1, b"x"), Err((Radiated::No, TxFailure::FrequencyUnverified)));
    assert!(bench.run_to_state(DriverState::Ready, 5_000_000));
    sends_whole(&mut bench, 2);
}

#[test]
fn a_module_of_another_family_is_left_untouched() {
    let quirks = Quirks { device_type: Some("E220-400T30D".into()), ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Absent), with(quirks));
    bench.open();
    assert!(bench.run_to_state(DriverState::Fault, 5_000_000));
    assert!(has(&bench, |d| matches!(d, Diagnostic::OtherFamily { .. })));
    assert_eq!(bench.module.registers(), Registers::FACTORY);
}

#[test]
fn without_ufreq_nothing_is_sent_off_the_grid() {
    let quirks = Quirks { no_ufreq: true, ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Absent), with(quirks.clone()));
    bench.bring_up(4_000_000);
    assert_eq!(bench.driver.facts().generation, Generation::V2_2);
    assert_eq!(bench.send(1, b"x"), Err((Radiated::No, TxFailure::FrequencyUnverified)));
    let on_grid = DriverConfig { frequency_hz: 435_125_000, ..lines(AuxWiring::Absent) };
    let mut bench = Bench::new(on_grid, with(quirks));
    bench.bring_up(4_000_000);
    sends_whole(&mut bench, 1);
    assert_eq!(bench.sent[0].frequency_hz, 435_125_000);
}

#[test]
fn a_module_that_hangs_while_sending_is_unknown_then_faulty_then_back() {
    let quirks = Quirks { hangs_at_transmission: Some(2), ..Quirks::default() };
    let mut bench = Bench::new(lines(AuxWiring::Present), with(quirks));
    bench.bring_up(4_000_000);
    sends_whole(&mut bench, 1);
    assert_eq!(bench.send(2, &frame(240, 2)), Err((Radiated::Maybe, TxFailure::AuxStuckLow)));
    assert!(bench.run_to_state(DriverState::Fault, 6_000_000));
    let now_us = bench.now_us;
    bench.module.power_cycle(now_us);
    assert!(bench.run_to_state(DriverState::Ready, 20_000_000));
    sends_whole(&mut bench, 3);
    assert_eq!(bench.sent.len(), 2);
}

#[test]
fn unplugged_in_the_middle_of_a_frame_it_is_unknown() {
    for driver in [lines(AuxWiring::Present), software(), strapped()] {
        for after_us in [0, 1_000, 200_000, 300_000, 1_400_000] {
            let mut bench = Bench::new(driver.clone(), ModelConfig::prepared(true));
            bench.bring_up(5_000_000);
            bench.transmit(1, &frame(240, 1));
            bench.run_for(after_us);
            bench.unplug();
            assert_eq!(bench.outcome(1), Some(Err((Radiated::Maybe, TxFailure::PortClosed))));
            assert_eq!(bench.driver.state(), DriverState::Closed);
            bench.run_for(10_000_000);
            bench.port_present = true;
            let back_us = bench.now_us;
            assert!(bench.run_to_state(DriverState::Ready, 2_000_000), "back within two seconds");
            assert!(bench.now_us - back_us <= 2_000_000);
            sends_whole(&mut bench, 2);
            let outcomes = bench.log.iter().filter(|(_, o)| {
                matches!(o, DriverOutput::TxDone { id: 1, .. } | DriverOutput::TxFailed { id: 1, .. })
            });
            assert_eq!(outcomes.count(), 1);
        }
    }
}

#[test]
fn a_port_that_blinks_does_not_put_two_frames_on_the_air() {
    for driver in [lines(AuxWiring::Present), lines(AuxWiring::Absent), software(), strapped()] {
        let mut bench = Bench::new(driver, ModelConfig::prepared(true));
        bench.bring_up(5_000_000);
        bench.transmit(1, &frame(240, 1));
        bench.run_for(1_000);
        bench.unplug();
        bench.port_present = true;
        bench.run_for(100_001);
        for id in 2..200 {
            // Refused until it is ready again; the bench asserts that nothing is written while the module sends.
            bench.transmit(id, &frame(240, 2));
            bench.run_for(50_000);
        }
        assert!(bench.sent.len() > 2);
    }
}

#[test]
fn what_was_never_handed_over_was_not_radiated() {
    let mut driver = Driver::new(strapped());
    driver.handle(0, DriverInput::Opened);
    driver.handle(100_000, DriverInput::Wake);
    assert_eq!(driver.state(), DriverState::Ready);
    driver.handle(200_000, DriverInput::Transmit { id: 1, target: 1, frame: &[1, 2, 3] });
    driver.handle(200_001, DriverInput::Closed);
    let outputs: Vec<_> = std::iter::from_fn(|| driver.next_output()).collect();
    assert!(!outputs.iter().any(|o| matches!(o, DriverOutput::Write(_))));
    assert!(outputs.contains(&DriverOutput::TxFailed {
        id: 1,
        radiated: Radiated::No,
        reason: TxFailure::PortClosed
    }));

    // Waiting for the end of incoming bytes, nothing was handed over either.
    driver.handle(300_000, DriverInput::Opened);
    driver.handle(400_000, DriverInput::Wake);
    driver.handle(400_001, DriverInput::Bytes(b"abc"));
    driver.handle(400_002, DriverInput::Transmit { id: 2, target: 1, frame: &[1] });
    driver.handle(400_003, DriverInput::Stop);
    let outputs: Vec<_> = std::iter::from_fn(|| driver.next_output()).collect();
    let stopped = DriverOutput::TxFailed { id: 2, radiated: Radiated::No, reason: TxFailure::Stopped };
    assert!(outputs.contains(&stopped));
    assert!(!outputs.iter().any(|o| matches!(o, DriverOutput::Reopen { .. })));
}

#[test]
fn one_frame_at_a_time_in_one_write() {
    let mut bench = Bench::new(lines(AuxWiring::Absent), ModelConfig::default());
    assert_eq!(bench.send(9, b"x"), Err((Radiated::No, TxFailure::NotReady)));
    bench.bring_up(4_000_000);
    assert_eq!(bench.send(10, b""), Err((Radiated::No, TxFailure::Length { found: 0 })));
    assert_eq!(bench.send(11, &[0; 241]), Err((Radiated::No, TxFailure::Length { found: 241 })));
    bench.transmit(12, &frame(240, 1));
    bench.transmit(13, b"x");
    assert_eq!(bench.outcome(13), Some(Err((Radiated::No, TxFailure::Busy))));
    let order: Vec<&DriverOutput> = bench.log.iter().rev().map(|(_, o)| o).take(4).collect();
    let [
        _,
        DriverOutput::Write(bytes),
        DriverOutput::TxStarted { id: 12 },
        DriverOutput::State(DriverState::Sending),
    ] = order[..]
    else {
        panic!("{order:?}")
    };
    assert_eq!(bytes[..3], [0xDE, 0x69, 0x19]);
    assert_eq!(bytes[3..], frame(240, 1));
    bench.run_for(5_000_000);
    assert_eq!(bench.driver.state(), DriverState::Ready);
    assert_eq!(bench.driver.counters().airtime_us, 1_229_824);
}

#[test]
fn nothing_is_sent_while_a_packet_comes_in() {
    for aux in [AuxWiring::Present, AuxWiring::Absent] {
        let mut bench = Bench::new(lines(aux), ModelConfig::default());
        bench.bring_up(4_000_000);
        bench.run_for(2_000_000);
        bench.hear(&frame(240, 1), -100);
        bench.run_for(100_000);
        let heard_us = bench.now_us + 153_000;
        bench.send(1, &frame(10, 1)).expect("sent");
        assert!(bench.sent[0].start_us > heard_us);
        assert_eq!(bench.delivered.len(), 241);
    }
    // Bytes without end: refused after six seconds, nothing radiated.
    let mut bench = Bench::new(strapped(), ModelConfig::prepared(true));
    bench.bring_up(1_000_000);
    bench.input(DriverInput::Bytes(b"noise"));
    bench.transmit(1, b"x");
    for _ in 0..700 {
        bench.run_for(10_000);
        bench.input(DriverInput::Bytes(b"noise"));
    }
    assert_eq!(bench.outcome(1), Some(Err((Radiated::No, TxFailure::ModuleBusy))));
    assert!(bench.sent.is_empty());
}

#[test]
fn a_slow_phy_is_given_its_time() {
    let slow = LoraPhy { spreading_factor: 12, bandwidth_hz: 125_000, ..LoraPhy::LIKELY_2K4 };
    for aux in [AuxWiring::Present, AuxWiring::Absent] {
        let timing = LinkTiming { phy: slow, ..LinkTiming::default() };
        let driver = DriverConfig { timing, ..lines(aux) };
        let mut bench = Bench::new(driver, ModelConfig { phy: slow, ..ModelConfig::default() });
        bench.bring_up(4_000_000);
        for id in 1..4 {
            sends_whole(&mut bench, id);
        }
    }
}

#[test]
fn a_late_drain_prolongs_the_wait() {
    let mut driver = Driver::new(strapped());
    driver.handle(0, DriverInput::Opened);
    driver.handle(100_000, DriverInput::Wake);
    driver.handle(200_000, DriverInput::Transmit { id: 1, target: 1, frame: &[0; 240] });
    let computed_us = driver.next_wakeup_us().expect("an end");
    driver.handle(1_200_000, DriverInput::Drained);
    let prolonged_us = driver.next_wakeup_us().expect("an end");
    assert!(prolonged_us >= 1_200_000 + 1_229_824 && prolonged_us > computed_us);
}

#[test]
fn a_configuration_the_module_cannot_have_is_a_fault() {
    let driver = DriverConfig { channel: 84, ..strapped() };
    let mut bench = Bench::new(driver, ModelConfig::default());
    bench.open();
    assert_eq!(bench.driver.state(), DriverState::Fault);
    assert!(has(&bench, |d| matches!(d, Diagnostic::Configuration(_))));
}
