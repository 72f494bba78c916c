//! Every wiring with every firmware comes to Ready, sends and hears frames byte for byte.

use crate::bench::{Bench, frame};
use radio::driver::{
    AuxWiring, Diagnostic, DriverConfig, DriverOutput, DriverState, Generation, ModePins, Radiated, TxFailure,
};
use radio::model::{Firmware, ModelConfig, Quirks};
use radio::registers::{PowerStep, Registers};

const FIRMWARES: [Firmware; 3] = [Firmware::V1, Firmware::V2_1, Firmware::V2_2];

fn config(mode_pins: ModePins, aux: AuxWiring) -> DriverConfig {
    DriverConfig { mode_pins, aux, rssi_byte: Some(true), ..DriverConfig::default() }
}

fn send_and_hear(bench: &mut Bench, rssi_byte: bool) {
    for (id, len) in [(1, 240), (2, 1), (3, 239), (4, 240)] {
        let uplink = frame(len, id as u8);
        let before = bench.sent.len();
        let (airtime_us, _) = bench.send(id, &uplink).expect("sent");
        let sent = &bench.sent[before..];
        assert_eq!(sent.len(), 1, "one packet on the air");
        assert_eq!((sent[0].target, sent[0].channel), (0xDE69, 0x19));
        assert_eq!(sent[0].packet, uplink);
        let true_us = sent[0].end_us - sent[0].start_us;
        assert!(airtime_us.abs_diff(true_us) < 10_000, "airtime {airtime_us}, truly {true_us}");
        assert!(bench.now_us >= sent[0].end_us, "done before it was");
        assert!(bench.now_us <= sent[0].end_us + 500_000, "done late");

        bench.delivered.clear();
        let downlink = frame(len, 0x80);
        bench.hear_whole(&downlink, -104);
        let mut expected = downlink;
        if rssi_byte {
            expected.push(152);
        }
        assert_eq!(bench.delivered, expected);
    }
    assert_eq!(bench.driver.counters().tx_done, 4);
}

#[test]
fn lines_with_every_firmware_polarity_and_aux() {
    for firmware in FIRMWARES {
        for inverted in [false, true] {
            for aux in [AuxWiring::Present, AuxWiring::Absent] {
                for latency_us in [0, 16_000] {
                    let mut driver = config(ModePins::Lines { inverted }, aux);
                    if firmware == Firmware::V1 {
                        // The first generation has no offset: it can only stand on its own grid.
                        driver.frequency_hz = 435_125_000;
                    }
                    let model = ModelConfig { firmware, ..ModelConfig::default() };
                    let mut bench = Bench::new(driver, model);
                    bench.latency_us = latency_us;
                    bench.bring_up(8_000_000);
                    let facts = bench.driver.facts().clone();
                    assert!(facts.frequency_verified && facts.configuration_verified, "{facts:?}");
                    assert_eq!(bench.module.registers().0, [0xde, 0x70, 0, 0x62, 0x03, 0x19, 0xc3]);
                    assert_eq!(bench.module.frequency_hz(), bench.driver.config().frequency_hz);
                    let generation = match firmware {
                        Firmware::V1 => Generation::V1,
                        Firmware::V2_1 => Generation::V2_1,
                        Firmware::V2_2 => Generation::V2_2,
                    };
                    assert_eq!(facts.generation, generation);
                    send_and_hear(&mut bench, true);
                    assert_eq!(bench.module.counters().lost_input_bytes, 0);
                }
            }
        }
    }
}

#[test]
fn software_switch_with_both_generations_that_have_it() {
    for firmware in [Firmware::V2_1, Firmware::V2_2] {
        for aux in [AuxWiring::Present, AuxWiring::Absent] {
            for model in [
                ModelConfig { firmware, ..ModelConfig::prepared(false) },
                ModelConfig {
                    firmware,
                    registers: Registers::FACTORY.with_software_switch(true),
                    ..ModelConfig::default()
                },
            ] {
                let mut bench = Bench::new(config(ModePins::Software, aux), model);
                bench.bring_up(6_000_000);
                assert!(bench.driver.facts().frequency_verified);
                assert!(bench.module.registers().software_switch(), "it would lock itself out");
                send_and_hear(&mut bench, true);
            }
        }
    }
}

#[test]
fn strapped_with_every_firmware_sends_only_when_told_to() {
    for firmware in FIRMWARES {
        for aux in [AuxWiring::Present, AuxWiring::Absent] {
            let model = ModelConfig { firmware, ..ModelConfig::prepared(true) };
            let mut bench = Bench::new(config(ModePins::Strapped, aux), model.clone());
            bench.run_until(1_000_000);
            bench.bring_up(200_000);
            assert_eq!(bench.driver.facts().rssi_byte, None);
            assert_eq!(bench.send(1, b"x"), Err((Radiated::No, TxFailure::FrequencyUnverified)));
            assert!(
                !bench
                    .log
                    .iter()
                    .any(|(_, o)| matches!(o, DriverOutput::Write(_) | DriverOutput::SetPins { .. }))
            );
            assert!(matches!(bench.diagnostics()[..], [Diagnostic::FrequencyUnverified { .. }]));

            let trusting = DriverConfig { transmit_unverified: true, ..config(ModePins::Strapped, aux) };
            let mut bench = Bench::new(trusting, model);
            bench.run_until(1_000_000);
            bench.bring_up(200_000);
            send_and_hear(&mut bench, true);
        }
    }
}

#[test]
fn a_pseudo_terminal_is_up_within_a_second() {
    for registers in [ModelConfig::prepared(true).registers, Registers::FACTORY.with_software_switch(true)] {
        for ufreq in [ModelConfig::prepared(true).ufreq, None] {
            let model = ModelConfig { registers, ufreq, ..ModelConfig::prepared(true) };
            let mut bench = Bench::new(config(ModePins::Software, AuxWiring::Absent), model);
            bench.bring_up(1_000_000);
            assert!(bench.driver.facts().frequency_verified && bench.driver.facts().configuration_verified);
        }
    }
}

#[test]
fn a_module_that_is_as_wanted_is_not_written() {
    let model = ModelConfig {
        registers: ModelConfig::prepared(true).registers.with_software_switch(false),
        ..ModelConfig::prepared(true)
    };
    let mut driver = config(ModePins::Lines { inverted: false }, AuxWiring::Absent);
    driver.save_to_flash = true;
    let mut bench = Bench::new(driver, model);
    bench.bring_up(3_000_000);
    assert!(bench.driver.facts().configuration_verified);
    assert_eq!(bench.module.counters().flash_writes, 0);
    assert!(!bench.log.iter().any(|(_, o)| *o == DriverOutput::State(DriverState::Configure)));
}

#[test]
fn settings_go_to_flash_only_when_asked_to() {
    for save_to_flash in [false, true] {
        let mut driver = config(ModePins::Lines { inverted: false }, AuxWiring::Absent);
        driver.save_to_flash = save_to_flash;
        driver.power = PowerStep::Dbm30;
        let model = ModelConfig { ufreq: ModelConfig::prepared(true).ufreq, ..ModelConfig::default() };
        let mut bench = Bench::new(driver, model);
        bench.bring_up(3_000_000);
        assert_eq!(bench.module.counters().flash_writes, u64::from(save_to_flash));
        let now_us = bench.now_us;
        bench.module.power_cycle(now_us);
        assert_eq!(bench.module.registers() == Registers::FACTORY, !save_to_flash);
    }
}

#[test]
fn the_rssi_byte_is_followed_unless_set() {
    for (held, asked, expected) in
        [(true, None, true), (false, None, false), (true, Some(false), false), (false, Some(true), true)]
    {
        let mut driver = config(ModePins::Lines { inverted: false }, AuxWiring::Present);
        driver.rssi_byte = asked;
        let model =
            ModelConfig { registers: Registers::FACTORY.with_rssi_byte(held), ..ModelConfig::default() };
        let mut bench = Bench::new(driver, model);
        bench.bring_up(4_000_000);
        assert_eq!(bench.driver.facts().rssi_byte, Some(expected));
        assert_eq!(bench.module.registers().rssi_byte(), expected);
    }
}

#[test]
fn first_generation_cannot_reach_the_offset_and_does_not_send() {
    let model = ModelConfig { firmware: Firmware::V1, ..ModelConfig::default() };
    let mut bench = Bench::new(config(ModePins::Lines { inverted: false }, AuxWiring::Absent), model);
    bench.bring_up(5_000_000);
    assert_eq!(bench.driver.facts().frequency_hz, Some(435_125_000));
    for id in 1..=3 {
        assert_eq!(bench.send(id, b"x"), Err((Radiated::No, TxFailure::FrequencyUnverified)));
        assert!(bench.run_to_state(DriverState::Ready, 5_000_000));
        bench.run_for(20_000_000);
    }
    // Asked twice again whether it knows more: then it is left to what it can do.
    assert_eq!(bench.send(4, b"x"), Err((Radiated::No, TxFailure::FrequencyUnverified)));
    bench.hear_whole(b"still heard", -90);
    assert_eq!(bench.delivered.len(), 12);
}

#[test]
fn aux_measures_the_airtime_where_it_follows_the_radio() {
    for (firmware, quirks, measures) in [
        (Firmware::V2_2, Quirks::default(), true),
        (Firmware::V2_1, Quirks::default(), true),
        (Firmware::V2_2, Quirks { no_uaux: true, ..Quirks::default() }, false),
    ] {
        let model = ModelConfig { firmware, quirks, ..ModelConfig::default() };
        let mut bench = Bench::new(config(ModePins::Lines { inverted: false }, AuxWiring::Present), model);
        bench.bring_up(6_000_000);
        let (_, measured) = bench.send(1, &frame(240, 0)).expect("sent");
        assert_eq!(measured, measures, "{firmware:?}");
    }
}

#[test]
fn frames_heard_while_the_port_opens_are_not_lost() {
    let mut bench = Bench::new(config(ModePins::Software, AuxWiring::Absent), ModelConfig::prepared(true));
    bench.run_until(2_000_000);
    bench.hear(&frame(240, 7), -100);
    bench.run_for(100_000);
    // The port opens in the middle of the output.
    bench.bring_up(2_000_000);
    let expected = frame(240, 7);
    assert!(bench.delivered.len() > 100);
    let (tail, rssi) = bench.delivered.split_at(bench.delivered.len() - 1);
    assert!(expected.ends_with(tail));
    assert_eq!(rssi, [156]);
}
