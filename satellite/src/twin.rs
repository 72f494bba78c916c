//! The flight software: hears packets, keeps time, answers. It has no radio of its own; [`crate::Device`] gives it one.

mod commands;
mod queue;
mod timers;

use std::collections::VecDeque;

use protocol::{
    Downlink, ErrorCode, FRAME_LEN, FrameForm, Nonce, OpenedContents, RequestTag, SealedUplink, Telecommand,
    UpDecoder, encode_down, open,
};

use self::{
    commands::Exposure,
    queue::{Answer, Queue},
    timers::Torque,
};
use crate::{
    Fault, ImageSource, JournalEntry, Refusal, StateChange, TwinConfig, TwinState, TwinStats,
    body::{Body, Reading},
    orbit::Orbit,
    store::{Image, NO_IMAGE},
};

/// Journal entries that may wait for their reader; with more the twin is deaf. A packet makes at most three for each
/// of its candidates.
const JOURNAL_MAX: usize = 1024;
/// Unsolicited Errors that may wait for the next heartbeat; further ones are dropped, the oldest stay.
const ERRORS_MAX: usize = 4;

/// What the statistics tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Heartbeat,
    Chunk,
    Other,
}

/// The satellite's computer.
///
/// Drive it with [`Twin::receive`] and [`Twin::poll`] in order of time, and take [`Twin::next_journal`] until it is
/// empty before each: **nothing is handed out for sending while a journal entry waits**, so that what the satellite
/// must remember is durable before its answer is on the air.
#[derive(Clone, Debug)]
pub struct Twin {
    config: TwinConfig,
    state: TwinState,
    stats: TwinStats,
    journal: VecDeque<JournalEntry>,
    decoder: UpDecoder,
    body: Body,
    image: Option<Image>,
    /// End of the boot.
    up_again_us: u64,
    heartbeat_due_us: u64,
    queue: Queue,
    /// Errors that go out after the next heartbeat.
    errors: VecDeque<ErrorCode>,
    /// A frame to be sent again, by the fault of that name.
    repeat: Option<(Vec<u8>, Kind)>,
    sending: bool,
    exposure: Option<Exposure>,
    torque: Option<Torque>,
    schedule: VecDeque<protocol::DownlinkSlot>,
    faults: VecDeque<(u64, Fault)>,
    is_mute: bool,
    is_sensor_nan: bool,
    is_battery_low: bool,
    repeats_answers: bool,
}

impl Twin {
    /// A satellite that is switched on at `config.start_us` if `state` is new, or found in flight otherwise: uptime,
    /// rhythm, counters, image and clock go on; what was only in its memory (schedule, waiting answers) is lost.
    #[must_use]
    pub fn new(config: TwinConfig, state: TwinState) -> Self {
        let mut faults: Vec<(u64, Fault)> = config.faults.clone();
        faults.sort_by_key(|(at_us, _)| *at_us);
        let now_us = config.start_us;
        let orbit = config.orbit.clone();
        let orbit = orbit.unwrap_or_else(|| Orbit::fictional(config.seed, config.utc_at_zero()));
        let mut twin = Self {
            body: Body::new(config.seed, now_us, orbit),
            image: None,
            stats: TwinStats::default(),
            journal: VecDeque::new(),
            decoder: UpDecoder::new(),
            up_again_us: 0,
            heartbeat_due_us: 0,
            queue: Queue::default(),
            errors: VecDeque::new(),
            repeat: None,
            sending: false,
            exposure: None,
            torque: None,
            schedule: VecDeque::new(),
            faults: faults.into(),
            is_mute: false,
            is_sensor_nan: false,
            is_battery_low: false,
            repeats_answers: false,
            config,
            state,
        };
        if twin.state.boots == 0 {
            twin.boot(now_us);
            if twin.config.image != ImageSource::None {
                twin.store(now_us, StateChange::Image(Image::first_recipe()));
            }
        } else {
            twin.resume(now_us);
        }
        twin.image = twin.state.image.and_then(|recipe| {
            Image::recall(twin.config.seed, &recipe, &twin.config.image, twin.config.camera)
        });
        twin
    }

    /// A packet arrived; `now_us` is when its last byte reached the computer. While it boots the satellite is deaf. That
    /// its radio cannot hear while it sends is the radio's matter: a packet heard just before may arrive here later.
    pub fn receive(&mut self, now_us: u64, packet: &[u8]) {
        self.advance(now_us);
        if now_us < self.up_again_us || self.journal.len() >= JOURNAL_MAX {
            self.stats.deaf += 1;
            return;
        }
        let mut candidates = Vec::new();
        self.decoder.push(packet, &mut |_, candidate| candidates.push(*candidate));
        for candidate in &candidates {
            self.handle(now_us, candidate);
        }
    }

    /// The frame to radiate now, if there is one. [`Twin::sent`] must follow before the next.
    pub fn poll(&mut self, now_us: u64) -> Option<Vec<u8>> {
        self.advance(now_us);
        if self.sending || now_us < self.up_again_us || !self.journal.is_empty() {
            return None;
        }
        loop {
            let (frame, kind) = self.next_frame(now_us)?;
            if self.is_mute || !self.state.transmitter {
                self.stats.unsent += 1;
                continue;
            }
            self.stats.frames += 1;
            self.stats.heartbeats += u64::from(kind == Kind::Heartbeat);
            self.stats.chunks += u64::from(kind == Kind::Chunk);
            self.sending = true;
            return Some(frame);
        }
    }

    /// The frame that [`Twin::poll`] gave has left the antenna.
    pub fn sent(&mut self, _now_us: u64) {
        self.sending = false;
    }

    /// The next thing to write to the journal.
    pub fn next_journal(&mut self) -> Option<JournalEntry> {
        self.journal.pop_front()
    }

    /// When [`Twin::poll`] may have something next; `None` while a frame is being sent.
    #[must_use]
    pub fn next_event_us(&self) -> Option<u64> {
        if self.sending {
            return None;
        }
        let own_us = self.own_event_us();
        let answer_us = if self.repeat.is_some() { Some(0) } else { self.queue.ready_us() };
        let radio_us = answer_us.unwrap_or(u64::MAX).min(self.heartbeat_due_us).max(self.up_again_us);
        Some(own_us.map_or(radio_us, |own_us| own_us.min(radio_us)))
    }

    /// Something goes wrong, or right again, now.
    pub fn inject(&mut self, now_us: u64, fault: Fault) {
        self.advance(now_us);
        self.apply_fault(now_us, fault);
    }

    /// The stored image, byte for byte; empty if there is none.
    #[must_use]
    pub fn image(&self) -> &[u8] {
        self.image.as_ref().map_or(&[], |image| image.bytes())
    }

    /// What it did so far.
    #[must_use]
    pub fn stats(&self) -> &TwinStats {
        &self.stats
    }

    /// What it would remember after a loss of power.
    #[must_use]
    pub fn state(&self) -> &TwinState {
        &self.state
    }

    /// What it was made as.
    #[must_use]
    pub fn config(&self) -> &TwinConfig {
        &self.config
    }

    /// The orbit it flies.
    #[must_use]
    pub fn orbit(&self) -> &Orbit {
        self.body.orbit()
    }

    /// It flies another orbit from now on. What the flight software stores as its elements is another matter.
    pub fn set_orbit(&mut self, orbit: Orbit) {
        self.body.set_orbit(orbit);
    }

    /// When the next heartbeat is due.
    #[must_use]
    pub fn heartbeat_due_us(&self) -> u64 {
        self.heartbeat_due_us
    }

    /// Time since boot, ms; wraps after 2^32.
    #[must_use]
    pub fn uptime_ms(&self, now_us: u64) -> u32 {
        // wrapping is what the satellite does
        self.utc_ms(now_us).wrapping_sub(self.state.booted_utc_ms) as u32
    }

    /// The ICD's order: tag, counter (stored), CRC, header, payload.
    fn handle(&mut self, now_us: u64, candidate: &SealedUplink) {
        let nonce = candidate.nonce();
        let Ok(contents) = open(&self.config.key, candidate) else {
            self.refuse(now_us, Refusal::Authentication, nonce);
            return;
        };
        if let Err(reason) = self.state.nonces.check(self.config.replay, nonce) {
            self.refuse(now_us, reason, nonce);
            return;
        }
        let is_late = self.state.nonces.highest() > Some(nonce.counter());
        self.store(now_us, StateChange::Nonce(nonce));
        if contents.check_crc().is_err() {
            self.refuse(now_us, Refusal::Crc, nonce);
            self.answer(now_us, contents.tag(), Answer::Error(ErrorCode::CRC_FAILED));
            return;
        }
        let Some((tag, command)) = self.understand(&contents) else {
            self.refuse(now_us, Refusal::Malformed, nonce);
            self.answer(now_us, contents.tag(), Answer::Error(ErrorCode::MALFORMED_PACKET));
            return;
        };
        if self.queue.is_full() {
            self.refuse(now_us, Refusal::Busy, nonce);
            return;
        }
        self.stats.accepted += 1;
        self.stats.accepted_late += u64::from(is_late);
        self.journal.push_back(JournalEntry::Accepted {
            at_us: now_us,
            nonce,
            tag,
            packet_type: command.packet_type(),
        });
        self.execute(now_us, tag, command);
    }

    fn understand(&self, contents: &OpenedContents) -> Option<(RequestTag, Telecommand)> {
        let tag = contents.tag()?;
        let command = contents.telecommand().ok()?;
        command.validate().ok()?;
        self.is_known(&command).then_some((tag, command))
    }

    fn refuse(&mut self, now_us: u64, reason: Refusal, nonce: Nonce) {
        self.stats.refused.add(reason);
        self.journal.push_back(JournalEntry::Refused { at_us: now_us, reason, nonce });
    }

    fn answer(&mut self, now_us: u64, tag: Option<RequestTag>, answer: Answer) {
        self.queue.push(now_us.saturating_add(self.config.answer_delay_us), tag, answer);
    }

    /// An Error nobody asked for: it follows the next heartbeat.
    fn complain(&mut self, code: ErrorCode) {
        if self.errors.len() < ERRORS_MAX && !self.errors.contains(&code) {
            self.errors.push_back(code);
        }
    }

    /// Writes to permanent memory.
    fn store(&mut self, now_us: u64, change: StateChange) {
        self.state.apply(&change);
        self.journal.push_back(JournalEntry::Stored { at_us: now_us, change });
    }

    /// A due heartbeat goes before everything else, also between two chunks.
    fn next_frame(&mut self, now_us: u64) -> Option<(Vec<u8>, Kind)> {
        if self.heartbeat_due_us <= now_us {
            self.keep_rhythm(now_us);
            let heartbeat = self.body.heartbeat(&self.reading(now_us));
            for code in std::mem::take(&mut self.errors) {
                self.queue.push_first(now_us, Answer::Error(code));
            }
            return Some((frame(&Downlink::Heartbeat(heartbeat), None), Kind::Heartbeat));
        }
        if let Some(repeated) = self.repeat.take() {
            return Some(repeated);
        }
        let (tag, answer) = self.queue.next(now_us, self.image.as_ref())?;
        let packet = self.packet(now_us, &answer);
        let kind = if matches!(packet, Downlink::ImageChunk(_)) { Kind::Chunk } else { Kind::Other };
        let made = (frame(&packet, tag), kind);
        if self.repeats_answers {
            self.repeat = Some(made.clone());
        }
        Some(made)
    }

    /// Contents of an answer are those of the moment it is sent.
    fn packet(&self, now_us: u64, answer: &Answer) -> Downlink {
        match answer {
            Answer::Pong => Downlink::Pong,
            Answer::Error(code) => Downlink::Error(*code),
            Answer::ImageInfo => {
                Downlink::ImageInfo(self.image.as_ref().map_or(NO_IMAGE, |image| image.info()))
            }
            Answer::AdcsInfo => Downlink::AdcsInfo(self.body.adcs_info(&self.reading(now_us))),
            Answer::ScheduleInfo => Downlink::ScheduleInfo(self.schedule_info()),
            Answer::Heartbeat => Downlink::Heartbeat(self.body.heartbeat(&self.reading(now_us))),
            Answer::Chunk(chunk) => Downlink::ImageChunk(**chunk),
        }
    }

    fn reading(&self, now_us: u64) -> Reading {
        let utc_ms = self.utc_ms(now_us);
        Reading {
            now_us,
            utc_ms,
            uptime_ms: self.uptime_ms(now_us),
            timestamp_ms: self.state.clock.map_or(0, |clock| clock.read_ms(utc_ms)),
            cam: self.image.is_some(),
            sensor_nan: self.is_sensor_nan,
        }
    }

    /// True time, ms since 1970 UTC.
    fn utc_ms(&self, now_us: u64) -> u64 {
        self.config.utc_at_zero_ms.wrapping_add(now_us / 1000)
    }
}

/// Short where that is shorter; a chunk fills its frame.
fn frame(packet: &Downlink, tag: Option<RequestTag>) -> Vec<u8> {
    let mut bytes = [0; FRAME_LEN];
    let len = encode_down(packet, tag, FrameForm::Short, &mut bytes);
    bytes[..len].to_vec()
}
