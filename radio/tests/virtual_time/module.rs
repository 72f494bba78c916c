//! The model by itself: timing, buffer, sub-packets, modes.

use radio::airtime::{LoraPhy, uart_us};
use radio::command::{Mode, at, read, switch, write};
use radio::model::{Firmware, ModelConfig, ModelOutput, Module, Quirks};
use radio::registers::Registers;

fn run(module: &mut Module, until_us: u64) -> Vec<ModelOutput> {
    std::iter::from_fn(|| module.poll(until_us)).collect()
}

fn host_bytes(outputs: &[ModelOutput]) -> Vec<u8> {
    outputs
        .iter()
        .filter_map(|output| match output {
            ModelOutput::HostBytes { bytes, .. } => Some(bytes.as_slice()),
            _ => None,
        })
        .collect::<Vec<_>>()
        .concat()
}

fn packets(outputs: &[ModelOutput]) -> Vec<(u64, u64, u16, Vec<u8>)> {
    outputs
        .iter()
        .filter_map(|output| match output {
            ModelOutput::AirSent { start_us, end_us, target, packet, .. } => {
                Some((*start_us, *end_us, *target, packet.clone()))
            }
            _ => None,
        })
        .collect()
}

fn prepared(quirks: Quirks) -> Module {
    let mut module = Module::new(ModelConfig { quirks, ..ModelConfig::prepared(true) });
    run(&mut module, 1_000_000);
    module
}

fn packet(len: usize) -> Vec<u8> {
    let mut bytes = vec![0xDE, 0x69, 0x19];
    bytes.extend((0..len).map(|n| n as u8));
    bytes
}

#[test]
fn a_frame_leaves_after_its_uart_time_and_takes_its_airtime() {
    let mut module = prepared(Quirks::default());
    module.host_write(1_000_000, &packet(240));
    let outputs = run(&mut module, 5_000_000);
    let [(start_us, end_us, target, payload)] = &packets(&outputs)[..] else { panic!("{outputs:?}") };
    assert_eq!(*start_us, 1_000_000 + uart_us(243, 9600));
    assert_eq!(end_us - start_us, LoraPhy::LIKELY_2K4.time_on_air_us(240));
    assert_eq!((*target, payload.len()), (0xDE69, 240));
    assert!(outputs.len() <= 4, "a frame costs few events: {outputs:?}");
}

#[test]
fn long_bursts_are_cut_and_a_pause_makes_two() {
    let mut module = prepared(Quirks::default());
    module.host_write(1_000_000, &packet(500));
    let lens: Vec<usize> = packets(&run(&mut module, 9_000_000)).iter().map(|p| p.3.len()).collect();
    assert_eq!(lens, [240, 240, 20]);

    let mut module = prepared(Quirks { header_counts_towards_subpacket: true, ..Quirks::default() });
    module.host_write(1_000_000, &packet(240));
    let lens: Vec<usize> = packets(&run(&mut module, 9_000_000)).iter().map(|p| p.3.len()).collect();
    assert_eq!(lens, [237, 3]);

    // An adapter that pauses: the rest of the frame is taken for a header of its own.
    let mut module = prepared(Quirks { split_writes_after: Some(100), ..Quirks::default() });
    module.host_write(1_000_000, &packet(240));
    let sent = packets(&run(&mut module, 9_000_000));
    assert_eq!(sent.iter().map(|p| (p.2, p.3.len())).collect::<Vec<_>>(), [(0xDE69, 97), (0x6162, 140)]);
}

#[test]
fn two_writes_back_to_back_are_one_burst_and_apart_are_two() {
    let mut module = prepared(Quirks::default());
    module.host_write(1_000_000, &packet(10));
    module.host_write(1_010_000, &packet(10));
    let gap_us = 1_010_000 + uart_us(13, 9600);
    module.host_write(gap_us + 30_000, &packet(10));
    let lens: Vec<usize> = packets(&run(&mut module, 9_000_000)).iter().map(|p| p.3.len()).collect();
    assert_eq!(lens, [23, 10]);
}

#[test]
fn the_buffer_holds_a_thousand_bytes() {
    let mut module = prepared(Quirks::default());
    for n in 0..10 {
        module.host_write(1_000_000 + n, &packet(240));
    }
    let outputs = run(&mut module, 60_000_000);
    assert!(module.counters().lost_input_bytes > 0);
    assert!(packets(&outputs).len() < 10);
    let mut end_us = 0;
    for (start_us, end, ..) in packets(&outputs) {
        assert!(start_us >= end_us, "two packets on the air");
        end_us = end;
    }
}

#[test]
fn hearing_is_half_duplex_and_addressed() {
    let mut module = prepared(Quirks::default());
    module.host_write(1_000_000, &packet(240));
    run(&mut module, 1_300_000);
    let end_us = module.transmitting_until_us().expect("on the air");
    // Began before our end: lost, though it ended after.
    module.air_receive(end_us + 10_000, end_us - 10_000, b"lost", -100);
    module.air_receive_for(end_us + 300_000, end_us + 100_000, 0x1234, 0x19, b"other address", -100);
    module.air_receive_for(end_us + 300_000, end_us + 100_000, 0xFFFF, 0x18, b"other channel", -100);
    module.air_receive_for(end_us + 300_000, end_us + 100_000, 0xDE70, 0x19, b"mine", -80);
    let outputs = run(&mut module, end_us + 900_000);
    assert_eq!(host_bytes(&outputs), b"mine\xb0");
    assert_eq!(module.counters().missed_packets, 3);
}

#[test]
fn output_is_paced_and_aux_leads_it() {
    let mut module = prepared(Quirks::default());
    module.air_receive(3_000_000, 2_000_000, &packet(237), -104);
    let outputs = run(&mut module, 4_000_000);
    let first = &outputs[0];
    assert_eq!(*first, ModelOutput::Aux { at_us: 3_000_000, idle: false });
    let ModelOutput::HostBytes { at_us, bytes } = &outputs[1] else { panic!("{outputs:?}") };
    assert_eq!(*at_us, 3_000_000 + 2_500 + uart_us(bytes.len(), 9600));
    let last_us = outputs.last().map(ModelOutput::at_us).expect("outputs");
    assert!(last_us.abs_diff(3_002_500 + uart_us(241, 9600)) < 10, "{last_us}");
    assert!(outputs.len() <= 13);
}

#[test]
fn modes_by_pins_and_by_command() {
    let mut module = prepared(Quirks::default());
    module.set_pins(1_000_000, false, true);
    run(&mut module, 1_009_000);
    assert_eq!(module.mode(), Mode::Normal, "not at once");
    run(&mut module, 1_020_000);
    assert_eq!(module.mode(), Mode::Configuration);
    module.host_write(1_020_000, &read(0, 9));
    let answer = host_bytes(&run(&mut module, 1_100_000));
    assert_eq!(answer, [0xC1, 0, 9, 0xDE, 0x70, 0, 0x62, 0x07, 0x19, 0xC3, 0, 0]);
    module.air_receive(2_000_000, 1_500_000, b"asleep to the air", -90);
    assert_eq!(module.counters().missed_packets, 1);

    let mut module = prepared(Quirks::default());
    module.host_write(1_000_000, &switch(Mode::Configuration));
    assert_eq!(host_bytes(&run(&mut module, 1_100_000)), [0xC1, 0xC2, 0xC3, 0x02, 0x02]);
    assert_eq!(module.mode(), Mode::Configuration);
    module.host_write(1_100_000, b"nonsense");
    assert_eq!(host_bytes(&run(&mut module, 1_200_000)), [0xFF, 0xFF, 0xFF]);
    module.host_write(1_200_000, &switch(Mode::Normal));
    run(&mut module, 1_300_000);
    assert_eq!(module.mode(), Mode::Normal);
}

#[test]
fn a_mode_change_waits_for_the_radio() {
    let mut module = prepared(Quirks::default());
    module.host_write(1_000_000, &packet(240));
    run(&mut module, 1_400_000);
    let end_us = module.transmitting_until_us().expect("on the air");
    module.set_pins(1_400_000, false, true);
    run(&mut module, end_us - 1);
    assert_eq!(module.mode(), Mode::Normal);
    run(&mut module, end_us + 11_000);
    assert_eq!(module.mode(), Mode::Configuration);
}

#[test]
fn ram_settings_last_until_the_power_goes() {
    let mut module = prepared(Quirks::default());
    module.host_write(1_000_000, &switch(Mode::Configuration));
    run(&mut module, 1_100_000);
    module.host_write(1_100_000, &write(false, 5, &[0x11]));
    run(&mut module, 1_200_000);
    assert_eq!(module.registers().channel(), 0x11);
    module.power_cycle(1_300_000);
    run(&mut module, 1_400_000);
    assert_eq!(module.registers().channel(), 0x19);
    assert_eq!(module.counters().flash_writes, 0);
}

#[test]
fn air_rates_clamp_on_the_second_generation_only() {
    for (firmware, expected) in [(Firmware::V1, 0), (Firmware::V2_1, 2), (Firmware::V2_2, 2)] {
        let config = ModelConfig { firmware, pins: (false, true), ..ModelConfig::default() };
        let mut module = Module::new(config);
        run(&mut module, 1_000_000);
        module.host_write(1_000_000, &write(true, 3, &[0x60]));
        assert_eq!(host_bytes(&run(&mut module, 1_100_000)), [0xC1, 3, 1, 0x60 | expected]);
    }
}

#[test]
fn ufreq_takes_effect_with_a_reset() {
    let config = ModelConfig { pins: (false, true), ..ModelConfig::default() };
    let mut module = Module::new(config);
    run(&mut module, 100_000);
    assert_eq!(module.registers(), Registers::FACTORY);
    module.host_write(100_000, &at("UFREQ=1,410000000,1000000,83", false));
    assert_eq!(host_bytes(&run(&mut module, 300_000)), b"AT+UFREQ=OK\r\n");
    assert_eq!(module.frequency_hz(), 433_125_000);
    module.host_write(300_000, &at("RESET", false));
    assert_eq!(host_bytes(&run(&mut module, 600_000)), b"AT+RESET=OK\r\n");
    assert_eq!(module.frequency_hz(), 433_000_000);
    assert_eq!(module.counters().resets, 1);
}
