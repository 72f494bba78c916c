//! One frame: wait until the air and the UART are free, write once, find out when it has left the antenna.

use super::event::{DriverOutput, DriverState, Radiated, TxFailure};
use super::{Diagnostic, Driver, ModePins};
use crate::airtime::{BURST_GAP_BYTES, MAX_FRAME_BYTES, uart_us};

/// How long the module may stay busy before a frame is refused.
const IDLE_LIMIT_US: u64 = 6_000_000;
/// Silence on the receive side before we write, where AUX cannot tell: above twice the latency of an FTDI adapter.
pub(super) const QUIET_US: u64 = 40_000;
/// The same with a trusted AUX.
const QUIET_WITH_AUX_US: u64 = 10_000;
/// AUX may be low this long at least, whatever the computed airtime: the maker's own figures are slow.
const AUX_LOW_LIMIT_US: u64 = 5_000_000;
/// AUX goes low with the first byte or with the radio; seen through USB it may be this late.
const AUX_LATE_US: u64 = 100_000;
/// One transmission makes two edges; more than these and AUX measures nothing.
const BELIEVABLE_EDGES: u32 = 4;

/// The frame in hand.
#[derive(Debug)]
pub(super) struct Sending {
    id: u64,
    packet: Vec<u8>,
    air_us: u64,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    /// Nothing handed over yet.
    Waiting { limit_us: u64 },
    /// Handed over.
    Written(OnAir),
}

#[derive(Debug)]
struct OnAir {
    written_us: u64,
    /// Computed start of the radiation.
    air_start_us: u64,
    /// Computed end, ten per cent later than the figures say; without the ten per cent once AUX has measured.
    end_us: u64,
    /// What AUX showed, if it rose before the computed end. It is reported, but the air counts as taken until that
    /// end: a pin that moves by itself must not put two frames on the air.
    measured_us: Option<u64>,
    low_us: Option<u64>,
    saw_low: bool,
    edges: u32,
}

impl Driver {
    pub(super) fn transmit(&mut self, id: u64, target: u16, frame: &[u8]) {
        let refusal = self.transmit_refusal().or_else(|| {
            (frame.is_empty() || frame.len() > MAX_FRAME_BYTES)
                .then_some(TxFailure::Length { found: frame.len() })
        });
        if let Some(reason) = refusal {
            self.counters.tx_refused += 1;
            self.push(DriverOutput::TxFailed { id, radiated: Radiated::No, reason });
            self.look_again();
            return;
        }
        let [high, low] = target.to_be_bytes();
        let mut packet = Vec::with_capacity(frame.len() + 3);
        packet.extend_from_slice(&[high, low, self.config.channel]);
        packet.extend_from_slice(frame);
        self.sending = Some(Sending {
            id,
            packet,
            air_us: self.config.timing.frame_us(frame.len()),
            stage: Stage::Waiting { limit_us: self.now_us + IDLE_LIMIT_US },
        });
        self.set_state(DriverState::Sending);
    }

    pub(super) fn drained(&mut self) {
        let gap_us = uart_us(BURST_GAP_BYTES, self.config.timing.baud);
        if let Some(Sending { stage: Stage::Written(on_air), air_us, .. }) = &mut self.sending {
            on_air.air_start_us = on_air.air_start_us.max(self.now_us + gap_us);
            on_air.end_us = on_air.end_us.max(on_air.air_start_us + *air_us + *air_us / 10);
            self.air_until_us = self.air_until_us.max(on_air.end_us);
        }
    }

    pub(super) fn aux_while_sending(&mut self, idle: bool) {
        let now_us = self.now_us;
        let trusted = self.aux.trusted();
        let Some(Sending { stage: Stage::Written(on_air), air_us, .. }) = &mut self.sending else { return };
        on_air.edges += 1;
        if !idle {
            on_air.low_us = Some(now_us);
            on_air.saw_low = true;
            on_air.measured_us = None;
            return;
        }
        let Some(low_us) = on_air.low_us.take() else { return };
        // Without UAUX the pin rises when the radio has taken the bytes, long before the end.
        let believable = trusted
            && on_air.edges <= BELIEVABLE_EDGES
            && low_us <= on_air.air_start_us + AUX_LATE_US
            && now_us >= on_air.air_start_us + *air_us / 2;
        if believable {
            let nominal_end_us = on_air.air_start_us + *air_us;
            on_air.measured_us = Some(now_us - low_us.max(on_air.air_start_us));
            on_air.end_us = on_air.end_us.min(nominal_end_us.max(now_us));
        }
    }

    pub(super) fn advance_sending(&mut self) -> bool {
        let now_us = self.now_us;
        let Some(sending) = &self.sending else { return false };
        match &sending.stage {
            Stage::Waiting { limit_us } => {
                if !self.aux.busy() && now_us >= self.free_us() {
                    self.hand_over();
                } else if now_us >= *limit_us {
                    if self.aux.busy() {
                        self.aux_stuck_low();
                    }
                    self.transmission_failed(Radiated::No, TxFailure::ModuleBusy);
                    self.set_state(DriverState::Ready);
                } else {
                    return false;
                }
            }
            Stage::Written(on_air) => {
                if now_us < on_air.end_us {
                    return false;
                }
                let believable = on_air.edges <= BELIEVABLE_EDGES;
                if self.aux.busy() && believable {
                    if now_us < self.low_limit_us(on_air, sending.air_us) {
                        return false;
                    }
                    self.aux_stuck_low();
                    self.transmission_failed(Radiated::Maybe, TxFailure::AuxStuckLow);
                    self.recover();
                } else if self.facts.uaux == Some(true) && self.aux.trusted() && !on_air.saw_low {
                    self.counters.aux_timeouts += 1;
                    self.aux.distrust();
                    self.facts.aux_trusted = false;
                    self.push(DriverOutput::Diagnostic(Diagnostic::AuxSilent));
                    self.transmission_failed(Radiated::Maybe, TxFailure::AuxSilent);
                    self.recover();
                } else {
                    let measured_us = on_air.measured_us;
                    let airtime_us = measured_us.unwrap_or(sending.air_us);
                    self.transmission_done(airtime_us, measured_us.is_some());
                }
            }
        }
        true
    }

    pub(super) fn sending_wakeup_us(&self) -> Option<u64> {
        let sending = self.sending.as_ref()?;
        Some(match &sending.stage {
            Stage::Waiting { limit_us } if self.aux.busy() => *limit_us,
            Stage::Waiting { limit_us } => self.free_us().min(*limit_us),
            Stage::Written(on_air) if self.aux.busy() && on_air.edges <= BELIEVABLE_EDGES => {
                on_air.end_us.max(self.low_limit_us(on_air, sending.air_us))
            }
            Stage::Written(on_air) => on_air.end_us,
        })
    }

    /// The port is gone, or the driver is stopped: settles the frame in hand, by whether its write was handed over.
    pub(super) fn abandon_transmission(&mut self, reason: TxFailure) {
        // What the shell has not taken yet must not reach a port that is opened later. The frame's write is the last
        // one pushed, so it is unread if any write is.
        let write_unread = self.outputs.iter().any(|output| matches!(output, DriverOutput::Write(_)));
        self.outputs.retain(|output| {
            !matches!(
                output,
                DriverOutput::Write(_) | DriverOutput::SetPins { .. } | DriverOutput::PurgeInput
            )
        });
        let Some(sending) = &self.sending else { return };
        let radiated = match &sending.stage {
            Stage::Waiting { .. } => Radiated::No,
            Stage::Written(_) if write_unread => Radiated::No,
            Stage::Written(_) => Radiated::Maybe,
        };
        if radiated == Radiated::No && matches!(sending.stage, Stage::Written(_)) {
            self.air_until_us = self.now_us;
        }
        self.transmission_failed(radiated, reason);
    }

    /// When neither our last frame nor incoming bytes stand in the way.
    pub(super) fn free_us(&self) -> u64 {
        let quiet_us = if self.aux.trusted() { QUIET_WITH_AUX_US } else { QUIET_US };
        self.last_rx_us.map_or(0, |at| at + quiet_us).max(self.air_until_us)
    }

    fn low_limit_us(&self, on_air: &OnAir, air_us: u64) -> u64 {
        let since_us = on_air.low_us.unwrap_or(on_air.written_us).max(on_air.written_us);
        since_us + AUX_LOW_LIMIT_US.max(2 * air_us)
    }

    fn hand_over(&mut self) {
        let timing = self.config.timing;
        let now_us = self.now_us;
        let Some(sending) = &mut self.sending else { return };
        let lead_in_us = timing.lead_in_us(sending.packet.len().saturating_sub(3));
        let total_us = lead_in_us + sending.air_us;
        let end_us = now_us + total_us + total_us / 10;
        sending.stage = Stage::Written(OnAir {
            written_us: now_us,
            air_start_us: now_us + lead_in_us,
            end_us,
            measured_us: None,
            low_us: None,
            saw_low: false,
            edges: 0,
        });
        let (id, packet) = (sending.id, std::mem::take(&mut sending.packet));
        self.air_until_us = end_us;
        self.echo_expected.clear();
        if self.facts.echo {
            self.echo_expected.extend(&packet);
        }
        self.push(DriverOutput::TxStarted { id });
        self.push(DriverOutput::Write(packet));
    }

    fn transmission_done(&mut self, airtime_us: u64, measured: bool) {
        let Some(sending) = self.sending.take() else { return };
        self.air_until_us = self.now_us;
        self.counters.tx_done += 1;
        self.counters.airtime_us += airtime_us;
        self.push(DriverOutput::TxDone { id: sending.id, airtime_us, measured });
        self.set_state(DriverState::Ready);
    }

    fn transmission_failed(&mut self, radiated: Radiated, reason: TxFailure) {
        let Some(sending) = self.sending.take() else { return };
        match radiated {
            Radiated::No => self.counters.tx_refused += 1,
            Radiated::Maybe => {
                self.counters.tx_unknown += 1;
                self.counters.airtime_us += sending.air_us;
            }
        }
        self.push(DriverOutput::TxFailed { id: sending.id, radiated, reason });
    }

    pub(super) fn aux_stuck_low(&mut self) {
        self.counters.aux_timeouts += 1;
        self.aux.declare_stuck();
        self.facts.aux_trusted = false;
        self.push(DriverOutput::Diagnostic(Diagnostic::AuxStuckLow { during: self.state }));
    }

    /// The module misbehaved on a transmission: reset and verify it, where it can be.
    fn recover(&mut self) {
        if self.config.mode_pins == ModePins::Strapped {
            self.set_state(DriverState::Ready);
        } else {
            self.reset_wanted = true;
            self.begin_recovery();
        }
    }
}
