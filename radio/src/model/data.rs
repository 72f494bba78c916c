//! The data path: bursts from the host become radio packets, packets from the air become output.

use super::timeline::Event;
use super::{BUFFER_BYTES, ModelOutput, Module, Power};
use crate::airtime::{BURST_GAP_BYTES, FIXED_HEADER_BYTES, MAX_FRAME_BYTES, uart_us};
use crate::command::Mode;

/// A write is followed in pieces of this size: a whole frame with its header is one.
const PIECE_BYTES: usize = MAX_FRAME_BYTES + FIXED_HEADER_BYTES;
/// Bytes on their way that are kept; a host that writes more at once loses the rest.
const MOST_INCOMING: usize = 64;

/// Bytes from the host that no silence has ended yet.
#[derive(Debug, Default)]
pub(super) struct Burst {
    pub(super) number: u32,
    pub(super) bytes: Vec<u8>,
    /// A packet was already cut off: what follows has no header of its own.
    target: Option<(u16, u8)>,
    last_us: u64,
}

impl Burst {
    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty() && self.target.is_none()
    }
}

#[derive(Debug)]
pub(super) struct RadioPacket {
    target: u16,
    channel: u8,
    payload: Vec<u8>,
}

impl Module {
    pub(super) fn incoming_bytes(&mut self, pause_us: u64, bytes: &[u8]) {
        let mut start_us =
            self.host_line_free_us.max(self.now_us) + if bytes.is_empty() { 0 } else { pause_us };
        for piece in bytes.chunks(PIECE_BYTES) {
            if self.incoming.len() >= MOST_INCOMING {
                self.counters.lost_input_bytes += piece.len() as u64;
                continue;
            }
            let end_us = start_us + uart_us(piece.len(), self.config.host_baud);
            self.incoming.push_back((start_us, piece.to_vec()));
            self.timeline.push(end_us, Event::Arrived);
            if self.config.quirks.echo {
                self.timeline.push(end_us, Event::Output { bytes: piece.to_vec() });
            }
            self.host_line_free_us = end_us;
            start_us = end_us;
        }
    }

    pub(super) fn arrived(&mut self) {
        let Some((_, bytes)) = self.incoming.pop_front() else { return };
        let deaf = self.power != Power::Running
            || self.mode_coming.is_some()
            || self.mode == Mode::Sleep
            || self.config.quirks.mute;
        if deaf {
            self.counters.lost_input_bytes += bytes.len() as u64;
            return;
        }
        let held = self.burst.bytes.len() + self.queue.iter().map(|p| p.payload.len()).sum::<usize>();
        let room = BUFFER_BYTES.saturating_sub(held).min(bytes.len());
        self.counters.lost_input_bytes += (bytes.len() - room) as u64;
        let garbled = !self.baud_matches();
        self.burst
            .bytes
            .extend(bytes[..room].iter().map(|&b| if garbled { b.wrapping_mul(0x6D) ^ 0x2A } else { b }));
        self.burst.last_us = self.now_us;
        if self.mode == Mode::Normal || self.mode == Mode::Wor {
            self.cut_sub_packets();
        }
        let gap_us = uart_us(BURST_GAP_BYTES, self.config.host_baud);
        self.timeline.push(self.now_us + gap_us, Event::BurstEnd { burst: self.burst.number });
    }

    pub(super) fn burst_end(&mut self, number: u32) {
        let gap_us = uart_us(BURST_GAP_BYTES, self.config.host_baud);
        let goes_on = self.incoming.front().is_some_and(|(start_us, _)| *start_us < self.now_us);
        if number != self.burst.number || goes_on || self.now_us < self.burst.last_us + gap_us {
            return;
        }
        let burst =
            std::mem::replace(&mut self.burst, Burst { number: number.wrapping_add(1), ..Burst::default() });
        if burst.is_empty() {
            return;
        }
        if self.is_switch(&burst.bytes) {
            self.software_switch(&burst.bytes);
        } else if self.mode == Mode::Configuration {
            self.configure(&burst.bytes);
        } else {
            let (target, payload) = self.address(burst.target, &burst.bytes);
            self.enqueue(target, payload);
        }
    }

    /// Sends what a burst has filled already.
    fn cut_sub_packets(&mut self) {
        loop {
            let sub = self.ram.sub_packet_bytes();
            let header =
                if self.ram.fixed_point() && self.burst.target.is_none() { FIXED_HEADER_BYTES } else { 0 };
            let counted = self.config.quirks.header_counts_towards_subpacket;
            let full = if counted { sub } else { sub + header };
            if self.burst.bytes.len() < full {
                return;
            }
            let rest = self.burst.bytes.split_off(full);
            let cut = std::mem::replace(&mut self.burst.bytes, rest);
            let (target, payload) = self.address(self.burst.target, &cut);
            self.burst.target = target;
            self.enqueue(target, payload);
        }
    }

    /// Takes the fixed-point header off, unless an earlier part of the burst had it.
    fn address(&self, known: Option<(u16, u8)>, bytes: &[u8]) -> (Option<(u16, u8)>, Vec<u8>) {
        if known.is_some() {
            return (known, bytes.to_vec());
        }
        if !self.ram.fixed_point() {
            return (Some((self.ram.address(), self.ram.channel())), bytes.to_vec());
        }
        match bytes {
            [high, low, channel, payload @ ..] => {
                (Some((u16::from_be_bytes([*high, *low]), *channel)), payload.to_vec())
            }
            _ => (None, Vec::new()),
        }
    }

    fn enqueue(&mut self, target: Option<(u16, u8)>, payload: Vec<u8>) {
        if let Some((target, channel)) = target
            && !payload.is_empty()
        {
            self.queue.push_back(RadioPacket { target, channel, payload });
        }
    }

    pub(super) fn start_radio(&mut self) {
        let can = self.sending_until_us.is_none()
            && self.mode_coming.is_none()
            && matches!(self.mode, Mode::Normal | Mode::Wor);
        if !can {
            return;
        }
        let Some(packet) = self.queue.pop_front() else { return };
        self.transmissions += 1;
        if self.config.quirks.hangs_at_transmission == Some(self.transmissions) {
            self.power = Power::Hung;
            return;
        }
        let end_us = self.now_us + self.config.phy.time_on_air_us(packet.payload.len());
        self.sending_until_us = Some(end_us);
        self.last_sent_us = (self.now_us, end_us);
        self.counters.sent_packets += 1;
        self.timeline.push(end_us, Event::RadioDone { life: self.life });
        // The header's channel selects the carrier on the module's grid.
        let own = u32::from(self.ram.channel());
        let step_hz = self.extras.ufreq.map_or(1_000_000, |grid| grid.step_hz);
        let base_hz = self.frequency_hz().saturating_sub(own.saturating_mul(step_hz));
        let frequency_hz = base_hz.saturating_add(u32::from(packet.channel).saturating_mul(step_hz));
        self.ready.push_back(ModelOutput::AirSent {
            start_us: self.now_us,
            end_us,
            target: packet.target,
            channel: packet.channel,
            frequency_hz,
            packet: packet.payload,
        });
    }

    pub(super) fn radio_done(&mut self) {
        self.sending_until_us = None;
    }

    pub(super) fn hear(&mut self, start_us: u64, target: u16, channel: u8, packet: &[u8], rssi_dbm: i16) {
        let (_, sent_end_us) = self.last_sent_us;
        let was_sending = self.sending_until_us.is_some() || sent_end_us > start_us;
        let listening = self.power == Power::Running
            && !self.config.quirks.mute
            && matches!(self.mode, Mode::Normal | Mode::Wor)
            && self.mode_coming.is_none()
            && self.mode_since_us <= start_us;
        let own = self.ram.address();
        let for_us = channel == self.ram.channel() && (target == own || target == 0xFFFF || own == 0xFFFF);
        let mut heard = listening && !was_sending && for_us && !packet.is_empty();
        if heard {
            let mut bytes = packet.to_vec();
            if self.ram.rssi_byte() && !self.config.quirks.missing_rssi_byte {
                bytes.push(u8::try_from((256 + i32::from(rssi_dbm)).clamp(1, 255)).unwrap_or(1));
            }
            heard = self.output(0, &bytes);
        }
        if heard {
            self.counters.received_packets += 1;
        } else {
            self.counters.missed_packets += 1;
        }
    }
}
