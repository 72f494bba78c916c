//! Twin, channel and module together, as a host sees them through its serial port.

mod common;

use std::hash::{DefaultHasher, Hasher};

use common::{SECOND_US, config, key};
use protocol::{
    CHUNK_LEN, Counter, DownDecoder, DownItem, Downlink, Nonce, RequestTag, SealedUplink, Telecommand, seal,
};
use radio::model::ModelConfig;
use satellite::{
    Burst, Camera, ChannelConfig, Device, DeviceConfig, DeviceOutput, Fault, JournalEntry, PassProfile,
    StateChange, TwinConfig, TwinState,
};

/// Ground's end of the serial line.
struct Host {
    device: Device,
    now_us: u64,
    counter: u64,
    decoder: DownDecoder,
    heard: Vec<(u64, Option<RequestTag>, Downlink)>,
    rssi_dbm: Vec<i16>,
    journal: Vec<JournalEntry>,
    hash: DefaultHasher,
}

impl Host {
    fn new(twin: TwinConfig, channel: ChannelConfig) -> Self {
        let device = Device::new(DeviceConfig::new(twin, channel, ModelConfig::prepared(true)));
        Self {
            device,
            now_us: 0,
            counter: 1_000,
            decoder: DownDecoder::new(true),
            heard: Vec::new(),
            rssi_dbm: Vec::new(),
            journal: Vec::new(),
            hash: DefaultHasher::new(),
        }
    }

    fn run_until(&mut self, until_us: u64) {
        loop {
            while let Some(output) = self.device.poll(self.now_us) {
                self.hash.write(format!("{} {output:?}", self.now_us).as_bytes());
                match output {
                    DeviceOutput::HostBytes(bytes) => self.take(&bytes),
                    DeviceOutput::Journal(entry) => self.journal.push(entry),
                    DeviceOutput::Aux { .. } => {}
                }
            }
            match self.device.next_event_us() {
                Some(at_us) if at_us <= until_us => self.now_us = at_us,
                _ => break,
            }
        }
        self.now_us = until_us;
    }

    fn take(&mut self, bytes: &[u8]) {
        let Self { decoder, heard, rssi_dbm, now_us, .. } = self;
        decoder.push(bytes, &mut |item| match item {
            DownItem::Frame { frame, nested: false, .. } | DownItem::Promoted { frame, .. } => {
                if let Ok(packet) = frame.packet() {
                    heard.push((*now_us, frame.tag(), packet));
                }
            }
            DownItem::Rssi { dbm, .. } => rssi_dbm.push(dbm),
            DownItem::Frame { .. } => {}
        });
    }

    fn run_for(&mut self, us: u64) {
        self.run_until(self.now_us + us);
    }

    fn sealed(&mut self, command: &Telecommand) -> SealedUplink {
        self.counter += 1;
        let tag = RequestTag::new(self.counter as u8).unwrap_or(RequestTag::FIRST);
        seal(&key(), Nonce::new(Counter(self.counter), [3; 4]), tag, command, &[1; 200])
    }

    fn send_to(&mut self, header: [u8; 3], frame: &SealedUplink) {
        self.device.host_write(self.now_us, &[&header[..], frame.as_bytes()].concat());
    }

    fn send(&mut self, command: &Telecommand) {
        let frame = self.sealed(command);
        self.send_to([0xDE, 0x69, 0x19], &frame);
    }

    fn chunks(&self) -> Vec<u16> {
        self.heard
            .iter()
            .filter_map(|(_, _, packet)| match packet {
                Downlink::ImageChunk(chunk) => Some(chunk.index.0),
                _ => None,
            })
            .collect()
    }
}

fn always() -> ChannelConfig {
    ChannelConfig::perfect()
}

const GET_ALL: Telecommand = Telecommand::GetImageChunk { first: 0, count: 64 };

#[test]
fn a_heartbeat_arrives_with_its_strength_after_its_airtime() {
    let mut host = Host::new(config(), always());
    host.run_until(6 * SECOND_US);
    let [(at_us, None, Downlink::Heartbeat(_))] = host.heard.as_slice() else { panic!("{:?}", host.heard) };
    // due at 3 s; UART to the module, air, UART to the host
    let phy = radio::airtime::LoraPhy::LIKELY_2K4;
    assert!(*at_us > 3 * SECOND_US + phy.time_on_air_us(133));
    assert!(*at_us < 3 * SECOND_US + phy.time_on_air_us(133) + SECOND_US / 2);
    assert!(host.rssi_dbm.iter().all(|dbm| (-125..=-104).contains(dbm)));
    assert_eq!(host.rssi_dbm.len(), 1);
    assert_eq!(host.device.stats().airtime_down_us, phy.time_on_air_us(133));
}

#[test]
fn a_ping_is_radiated_stored_accepted_and_only_then_answered() {
    let mut host = Host::new(config(), always());
    host.run_until(10 * SECOND_US);
    host.journal.clear();
    let ping = host.sealed(&Telecommand::Ping);
    host.send_to([0xDE, 0x69, 0x19], &ping);
    host.run_for(5 * SECOND_US);
    assert!(matches!(host.heard.last(), Some((_, Some(_), Downlink::Pong))));
    let [
        JournalEntry::GroundRadiated { at_us, end_us, target: 0xDE69, channel: 0x19, packet },
        JournalEntry::Stored { change: StateChange::Nonce(nonce), at_us: stored_us },
        JournalEntry::Accepted { packet_type: 0, .. },
        JournalEntry::SatelliteSent { at_us: sent_us, .. },
    ] = host.journal.as_slice()
    else {
        panic!("{:?}", host.journal)
    };
    assert_eq!((packet.as_slice(), nonce), (&ping.as_bytes()[..], &ping.nonce()));
    assert!(at_us < end_us && end_us < stored_us && stored_us < sent_us);
}

#[test]
fn the_satellite_does_not_hear_while_it_sends() {
    let mut host = Host::new(config(), always());
    host.run_until(6 * SECOND_US);
    host.send(&GET_ALL);
    host.run_for(4 * SECOND_US);
    host.send(&Telecommand::Reset);
    host.run_for(30 * SECOND_US);
    assert_eq!(host.device.stats().up_half_duplex, 1);
    assert_eq!((host.device.stats().twin.accepted, host.device.twin().state().boots), (1, 1));
    assert!(host.chunks().len() < common::IMAGE_CHUNKS as usize, "and ground did not hear either");
    assert_eq!(host.device.stats().twin.chunks, u64::from(common::IMAGE_CHUNKS));
    host.send(&Telecommand::Ping);
    host.run_for(4 * SECOND_US);
    assert!(matches!(host.heard.last(), Some((_, _, Downlink::Pong))));
}

#[test]
fn ground_does_not_hear_while_it_sends() {
    let mut host = Host::new(config(), always());
    host.run_until(2 * SECOND_US + SECOND_US / 2);
    host.send(&Telecommand::Ping);
    host.run_until(20 * SECOND_US);
    assert!(host.heard.iter().all(|(_, tag, _)| tag.is_some()), "the heartbeat at 3 s was missed");
    assert_eq!(host.device.stats().twin.heartbeats, 1);
}

#[test]
fn other_addresses_and_channels_are_not_heard() {
    let mut host = Host::new(config(), always());
    host.run_until(6 * SECOND_US);
    for header in [[0xDE, 0x68, 0x19], [0xDE, 0x69, 0x18]] {
        let frame = host.sealed(&Telecommand::Ping);
        host.send_to(header, &frame);
        host.run_for(4 * SECOND_US);
    }
    assert_eq!((host.device.stats().up_not_for_us, host.device.stats().twin.accepted), (2, 0));
    let frame = host.sealed(&Telecommand::Ping);
    host.send_to([0xFF, 0xFF, 0x19], &frame);
    host.run_for(4 * SECOND_US);
    assert_eq!(host.device.stats().twin.accepted, 1);
}

#[test]
fn chunks_follow_each_other_without_pauses() {
    let camera = Camera::Pattern { size_bytes: 40 * CHUNK_LEN as u32 };
    let mut host = Host::new(TwinConfig { camera, ..config() }, always());
    host.run_until(6 * SECOND_US);
    host.send(&GET_ALL);
    host.run_for(55 * SECOND_US);
    let times: Vec<u64> = host.heard.iter().skip(1).map(|(at_us, ..)| *at_us).collect();
    assert_eq!(host.chunks(), (0..40).collect::<Vec<_>>());
    let frame_us = radio::airtime::LoraPhy::LIKELY_2K4.time_on_air_us(240);
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] < frame_us + 20_000), "{times:?}");
}

#[test]
fn nothing_is_heard_below_the_horizon() {
    let channel = ChannelConfig { passes: PassProfile::default(), ..always() };
    let mut host = Host::new(config(), channel);
    assert!(!host.device.in_view(0));
    assert_eq!(host.device.next_view_change_us(0), Some(20 * SECOND_US));
    host.run_until(90 * 60 * SECOND_US);
    assert!(host.heard.iter().all(|(at_us, ..)| (20..622).contains(&(at_us / SECOND_US))));
    assert_eq!(host.heard.len(), 10);
    assert!(host.device.stats().twin.heartbeats > 80);
}

fn bad_weather(seed: u64) -> ChannelConfig {
    ChannelConfig {
        seed,
        loss: 0.2,
        flips: 2e-4,
        cut: 0.05,
        noise: 0.3,
        burst: Some(Burst { enter: 0.05, leave: 0.3, loss: 0.9 }),
        ..always()
    }
}

/// A ground that knows nothing of strategy: asks for what is missing, one run at a time.
fn fetch_image(seed: u64) -> (Host, Vec<u8>) {
    let camera = Camera::Pattern { size_bytes: 5_000 };
    let mut host = Host::new(TwinConfig { camera, seed, ..config() }, bad_weather(seed));
    host.run_until(8 * SECOND_US);
    let total = 5_000_usize.div_ceil(CHUNK_LEN);
    let mut image: Vec<Option<[u8; CHUNK_LEN]>> = vec![None; total];
    for _ in 0..200 {
        let Some(first) = image.iter().position(Option::is_none) else { break };
        let count = image[first..].iter().take_while(|chunk| chunk.is_none()).count();
        host.send(&Telecommand::GetImageChunk { first: first as u16, count: count as u16 });
        host.run_for((5 + 2 * count as u64) * SECOND_US);
        for (_, _, packet) in std::mem::take(&mut host.heard) {
            if let Downlink::ImageChunk(chunk) = packet {
                image[usize::from(chunk.index.0)] = Some(chunk.data);
            }
        }
    }
    let mut bytes: Vec<u8> = image.into_iter().flatten().flatten().collect();
    bytes.truncate(5_000);
    (host, bytes)
}

#[test]
fn an_image_comes_whole_through_bad_weather() {
    let (mut lost, mut flipped, mut noise, mut cut) = (0, 0, 0, 0);
    for seed in 0..5 {
        let (host, bytes) = fetch_image(seed);
        assert_eq!(bytes, host.device.twin().image(), "seed {seed}");
        let channel = host.device.stats().channel;
        lost += channel.lost_down + channel.lost_up;
        flipped += channel.flipped;
        noise += channel.noise;
        cut += channel.cut;
    }
    assert!(lost > 0 && flipped > 0 && noise > 0 && cut > 0, "the weather was bad");
}

#[test]
fn the_same_seed_gives_the_same_transcript() {
    let transcript = |seed| fetch_image(seed).0.hash.finish();
    assert_eq!(transcript(7), transcript(7));
    assert_ne!(transcript(7), transcript(8));
}

#[test]
fn the_journal_of_a_device_rebuilds_the_satellites_memory() {
    let (mut host, _) = fetch_image(3);
    host.device.inject(host.now_us, Fault::Reset);
    host.run_for(20 * SECOND_US);
    let text: String = host.journal.iter().map(|entry| entry.to_line() + "\n").collect();
    assert_eq!(&TwinState::from_journal(&text).unwrap(), host.device.twin().state());
}

#[test]
fn a_restarted_device_goes_on_and_refuses_what_it_had_accepted() {
    let mut host = Host::new(config(), always());
    host.run_until(6 * SECOND_US);
    let reset = host.sealed(&Telecommand::Reset);
    host.send_to([0xDE, 0x69, 0x19], &reset);
    host.run_for(20 * SECOND_US);
    let text: String = host.journal.iter().map(|entry| entry.to_line() + "\n").collect();

    let start_us = host.now_us;
    let config = DeviceConfig {
        state: TwinState::from_journal(&text).unwrap(),
        ..DeviceConfig::new(TwinConfig { start_us, ..config() }, always(), ModelConfig::prepared(true))
    };
    host.device = Device::new(config);
    host.run_for(SECOND_US);
    host.send_to([0xDE, 0x69, 0x19], &reset);
    host.run_for(4 * SECOND_US);
    host.send(&Telecommand::Ping);
    host.run_for(4 * SECOND_US);
    assert!(matches!(host.heard.last(), Some((_, Some(_), Downlink::Pong))));
    let stats = host.device.stats().twin;
    assert_eq!((stats.refused.replayed, stats.accepted, host.device.twin().state().boots), (1, 1, 2));
}

#[test]
fn faults_reach_the_satellite_through_the_device() {
    let mut host = Host::new(config(), always());
    host.run_until(6 * SECOND_US);
    host.device.inject(host.now_us, Fault::Mute(true));
    host.send(&Telecommand::Ping);
    host.run_for(120 * SECOND_US);
    assert_eq!(host.heard.len(), 1);
    assert_eq!(host.device.stats().twin.unsent, 3);
}

#[test]
fn a_month_passes_in_a_moment() {
    let mut host = Host::new(config(), ChannelConfig { passes: PassProfile::default(), ..bad_weather(1) });
    host.run_until(30 * 86_400 * SECOND_US);
    assert_eq!(host.device.stats().twin.heartbeats, 30 * 1440);
    assert!(host.heard.len() > 1_000);
}
