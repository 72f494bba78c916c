//! People: what they want, when, at random but seeded.

use mission::{
    CommandId, CommandIntent, Gate, Intent, IntentEnvelope, IntentId, LinkId, Principal, SatelliteId, UtcUs,
};
use protocol::{Resolution, Telecommand, TorqueProfile, TorqueStep, heapless};
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;

use crate::config::Operator;

/// The person at the desk.
pub(crate) struct Desk {
    style: Operator,
    rng: ChaCha8Rng,
    next_us: Option<u64>,
    asked: u64,
    recent: Vec<CommandId>,
    satellite: SatelliteId,
    link: LinkId,
}

impl Desk {
    pub(crate) fn new(style: Operator, rng: ChaCha8Rng, satellite: SatelliteId, link: LinkId) -> Self {
        let next_us = (style != Operator::Absent).then_some(1_000_000);
        Self { style, rng, next_us, asked: 0, recent: Vec::new(), satellite, link }
    }

    /// When something is wanted next.
    pub(crate) fn next_us(&self) -> Option<u64> {
        self.next_us
    }

    /// A command was accepted.
    pub(crate) fn accepted(&mut self, command: CommandId) {
        self.recent.push(command);
        if self.recent.len() > 8 {
            self.recent.remove(0);
        }
    }

    /// What is wanted now. `in_view`: people work when the satellite is there.
    pub(crate) fn want(
        &mut self,
        now_us: u64,
        utc: UtcUs,
        in_view: bool,
        downloading: bool,
    ) -> Option<IntentEnvelope> {
        let intent = match self.style {
            Operator::Absent => return None,
            Operator::WantsImage => {
                self.next_us = None;
                Intent::Download { satellite: self.satellite.clone(), link: Some(self.link.clone()) }
            }
            Operator::Busy => {
                let mean_s = if in_view { 25.0 } else { 900.0 };
                let pause_s = -mean_s * (1.0 - self.rng.random::<f64>()).ln();
                self.next_us = Some(now_us + (pause_s * 1e6) as u64 + 1);
                if !downloading && in_view {
                    Intent::Download { satellite: self.satellite.clone(), link: None }
                } else {
                    self.something(utc)
                }
            }
        };
        self.asked += 1;
        let mut digest = [0; 32];
        self.rng.fill_bytes(&mut digest);
        Some(IntentEnvelope {
            id: IntentId(self.asked),
            principal: Principal::new("operator"),
            idempotency_key: self.asked.to_string(),
            digest,
            intent,
        })
    }

    fn something(&mut self, utc: UtcUs) -> Intent {
        let pick = self.rng.random_range(0..100u32);
        if pick < 8
            && let Some(&command) = self.recent.last()
        {
            return Intent::Cancel(command);
        }
        let telecommand = match pick {
            0..30 => Telecommand::Ping,
            30..45 => Telecommand::GetAdcsInfo,
            45..55 => Telecommand::GetImageInfo,
            55..62 => Telecommand::GetImageChunk {
                first: self.rng.random_range(0..40),
                count: self.rng.random_range(1..20),
            },
            62..72 => Telecommand::CaptureImage {
                resolution: Resolution::Cif,
                grey: self.rng.random(),
                strong_compression: false,
            },
            72..78 => Telecommand::Reset,
            78..84 => Telecommand::SetTimestamp { utc_ms: u64::try_from(utc.0 / 1_000).unwrap_or(0) },
            84..88 => self.torque(),
            88..91 => Telecommand::SetAdcsAuto,
            91..94 => Telecommand::SetAdcsTarget { latitude_deg: 48.1, longitude_deg: 11.6 },
            94..97 => Telecommand::SetAdcsOmegaKill,
            _ => Telecommand::SetAdcsAttitude { attitude_mrp: [0.1, 0.0, -0.2] },
        };
        let expires = self.rng.random_bool(0.3);
        let confirmation = telecommand.is_critical().then(|| telecommand.name().to_owned());
        Intent::Command(CommandIntent {
            satellite: self.satellite.clone(),
            link: None,
            telecommand,
            priority: self.rng.random_range(-2..3),
            gate: if self.rng.random_bool(0.03) { Gate::Blind } else { Gate::Heard },
            expires_at: expires.then(|| utc.plus(self.rng.random_range(5_000_000..600_000_000))),
            when: None,
            attempts_allowed: None,
            confirmation,
        })
    }

    fn torque(&mut self) -> Telecommand {
        let mut steps = heapless::Vec::new();
        for _ in 0..self.rng.random_range(1..3) {
            let step = TorqueStep {
                torque_n_m: [1e-6, 0.0, -1e-6],
                duration_ms: self.rng.random_range(100..30_000),
            };
            if steps.push(step).is_err() {
                break;
            }
        }
        Telecommand::ExecuteTorqueProfile(TorqueProfile { steps })
    }
}
