//! A ground that speaks to the twin without a radio.
#![allow(dead_code, unreachable_pub, reason = "each test binary uses a part of this")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test helper may panic")]
#![allow(missing_docs, reason = "a test helper")]

use protocol::{
    Counter, DownFrame, Downlink, ErrorCode, Key, Nonce, RequestTag, SealedUplink, Telecommand, seal,
    seal_plaintext,
};
use satellite::{Camera, JournalEntry, Twin, TwinConfig, TwinState};

pub const SECOND_US: u64 = 1_000_000;
/// Airtime of one frame in these tests.
pub const FRAME_US: u64 = SECOND_US;
pub const IMAGE_LEN: usize = 1_500;
pub const IMAGE_CHUNKS: u32 = 7;

pub fn key() -> Key {
    Key::from_bytes(*b"a key for tests.")
}

pub fn config() -> TwinConfig {
    let camera = Camera::Pattern { size_bytes: IMAGE_LEN as u32 };
    TwinConfig { camera, boot_us: 0, ..TwinConfig::new(42, key()) }
}

/// A frame the satellite sent, with the time it was handed to the radio.
#[derive(Clone, Debug, PartialEq)]
pub struct Heard {
    pub at_us: u64,
    pub tag: Option<RequestTag>,
    pub packet: Downlink,
    pub len: usize,
}

pub struct Ground {
    pub twin: Twin,
    pub now_us: u64,
    pub counter: u64,
    pub tag: RequestTag,
    pub journal: Vec<JournalEntry>,
}

impl Ground {
    pub fn new(config: TwinConfig) -> Self {
        Self::with_state(config, TwinState::default())
    }

    pub fn with_state(config: TwinConfig, state: TwinState) -> Self {
        let now_us = config.start_us;
        let twin = Twin::new(config, state);
        Self { twin, now_us, counter: 1_000_000_000, tag: RequestTag::FIRST, journal: Vec::new() }
    }

    pub fn seal(&mut self, command: &Telecommand) -> SealedUplink {
        self.counter += 1_000_000;
        self.tag = self.tag.next();
        let nonce = Nonce::new(Counter(self.counter), [1, 2, 3, 4]);
        seal(&key(), nonce, self.tag, command, &[0x5a; 200])
    }

    /// Seals any header and payload.
    pub fn seal_raw(&mut self, packet_type: u8, tag: u8, length: u16, payload: &[u8]) -> SealedUplink {
        self.counter += 1_000_000;
        let mut plaintext = [0; 200];
        let [high, low] = length.to_be_bytes();
        plaintext[..4].copy_from_slice(&[packet_type, tag, high, low]);
        plaintext[4..4 + payload.len()].copy_from_slice(payload);
        seal_plaintext(&key(), Nonce::new(Counter(self.counter), [1, 2, 3, 4]), &plaintext)
    }

    pub fn hand_over(&mut self, frame: &SealedUplink) {
        self.twin.receive(self.now_us, frame.as_bytes());
    }

    /// Sends a request and hears what follows at once, heartbeats by the clock apart.
    pub fn ask(&mut self, command: &Telecommand) -> Vec<Heard> {
        let mut heard = self.ask_all(command);
        heard.retain(|one| one.tag.is_some() || !matches!(one.packet, Downlink::Heartbeat(_)));
        heard
    }

    /// Sends a request and hears everything until the satellite has said what follows at once.
    pub fn ask_all(&mut self, command: &Telecommand) -> Vec<Heard> {
        let frame = self.seal(command);
        self.hand_over(&frame);
        self.listen(SECOND_US)
    }

    /// The one answer to a request.
    pub fn answer(&mut self, command: &Telecommand) -> Downlink {
        let heard = self.ask(command);
        let [one] = heard.as_slice() else { panic!("{command}: {heard:?}") };
        assert_eq!(one.tag, Some(self.tag), "{command}");
        one.packet
    }

    /// Lets time pass; each frame takes its airtime, which may end later than asked for.
    pub fn listen(&mut self, for_us: u64) -> Vec<Heard> {
        let until_us = self.now_us + for_us;
        let mut heard = Vec::new();
        loop {
            self.journal.extend(std::iter::from_fn(|| self.twin.next_journal()));
            if let Some(frame) = self.twin.poll(self.now_us) {
                let view = DownFrame::parse(&frame).unwrap();
                let packet = view.packet().unwrap();
                heard.push(Heard { at_us: self.now_us, tag: view.tag(), packet, len: frame.len() });
                self.now_us += FRAME_US;
                self.twin.sent(self.now_us);
                continue;
            }
            self.journal.extend(std::iter::from_fn(|| self.twin.next_journal()));
            match self.twin.next_event_us() {
                Some(at_us) if at_us <= until_us => self.now_us = self.now_us.max(at_us),
                _ => break,
            }
        }
        self.now_us = self.now_us.max(until_us);
        heard
    }
}

pub fn errors(heard: &[Heard]) -> Vec<ErrorCode> {
    heard
        .iter()
        .filter_map(|one| match one.packet {
            Downlink::Error(code) => Some(code),
            _ => None,
        })
        .collect()
}

pub fn chunk_numbers(heard: &[Heard]) -> Vec<u16> {
    heard
        .iter()
        .filter_map(|one| match one.packet {
            Downlink::ImageChunk(chunk) => Some(chunk.index.0),
            _ => None,
        })
        .collect()
}
