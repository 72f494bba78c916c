//! Frequencies for a rig that can be tuned, and the margin of a radio that cannot.

use radio::airtime::LoraPhy;

use crate::clock::MonoUs;

/// How a rig is tuned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RigSteps {
    /// What the rig's synthesiser resolves: frequencies are multiples of it.
    pub resolution_hz: u32,
    /// A smaller change is not worth a command.
    pub threshold_hz: u32,
    /// Commands are at least this far apart, microseconds.
    pub interval_us: u64,
}

impl Default for RigSteps {
    /// 10 Hz, 100 Hz, a second.
    fn default() -> Self {
        Self { resolution_hz: 10, threshold_hz: 100, interval_us: 1_000_000 }
    }
}

/// One frequency of a rig, followed in steps.
#[derive(Debug, Clone)]
pub struct Tuner {
    steps: RigSteps,
    commanded: Option<(MonoUs, u64)>,
}

/// Frequencies that are believed, Hz.
const FREQUENCIES_HZ: std::ops::RangeInclusive<f64> = 1e4..=300e9;

impl Tuner {
    /// Nothing is commanded yet.
    #[must_use]
    pub fn new(steps: RigSteps) -> Self {
        Self { steps, commanded: None }
    }

    /// The frequency to command now, if one is worth it. Never for what is no frequency.
    pub fn next(&mut self, now: MonoUs, wanted_hz: f64) -> Option<u64> {
        let rounded = self.rounded(wanted_hz)?;
        if let Some((at, commanded)) = self.commanded
            && (now.since(at) < self.steps.interval_us
                || rounded == commanded
                || rounded.abs_diff(commanded) < u64::from(self.steps.threshold_hz))
        {
            return None;
        }
        self.commanded = Some((now, rounded));
        Some(rounded)
    }

    /// Forgets what was commanded: after a reconnection nobody knows what the rig holds.
    pub fn forget(&mut self) {
        self.commanded = None;
    }

    /// What the rig is off by, Hz; `None` before the first command.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "frequencies are far below 2^53 Hz")]
    pub fn residual_hz(&self, wanted_hz: f64) -> Option<f64> {
        self.commanded.map(|(_, commanded)| wanted_hz - commanded as f64)
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 10 kHz and 300 GHz")]
    fn rounded(&self, wanted_hz: f64) -> Option<u64> {
        let resolution = f64::from(self.steps.resolution_hz.max(1));
        FREQUENCIES_HZ.contains(&wanted_hz).then(|| ((wanted_hz / resolution).round() * resolution) as u64)
    }
}

/// How much of what a LoRa receiver bears is used up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DopplerMargin {
    /// Offset between carrier and receiver: Doppler that is not tuned away, and the oscillators' error, Hz.
    pub offset_hz: f64,
    /// What a modem bears: a quarter of the bandwidth, Hz (SX127x datasheet).
    pub allowed_offset_hz: f64,
    /// Share of it, 1 being all of it.
    pub offset_share: f64,
    /// How far the carrier drifts within one packet, Hz.
    pub drift_hz: f64,
    /// What a packet bears: a third of a bin, sixteen times that with low data rate optimisation, Hz. A rule of thumb.
    pub allowed_drift_hz: f64,
    /// Share of it.
    pub drift_share: f64,
}

/// The margin of a LoRa link against Doppler.
///
/// `residual_hz` is the shift that is not tuned away (all of it for the E22, which cannot follow within a pass),
/// `rate_hz_s` how it changes, `packet_s` how long a packet is on the air, `oscillator_hz` what both ends' oscillators may
/// be off by together. Unknown (NaN) stays unknown.
#[must_use]
pub fn doppler_margin(
    phy: &LoraPhy,
    residual_hz: f64,
    rate_hz_s: f64,
    packet_s: f64,
    oscillator_hz: f64,
) -> DopplerMargin {
    let bandwidth_hz = f64::from(phy.bandwidth_hz);
    let bin_hz = bandwidth_hz / 2f64.powi(i32::from(phy.spreading_factor));
    let offset_hz = residual_hz.abs() + oscillator_hz.abs();
    let allowed_offset_hz = bandwidth_hz / 4.0;
    let drift_hz = (rate_hz_s * packet_s).abs();
    let allowed_drift_hz = bin_hz / 3.0 * if phy.low_data_rate { 16.0 } else { 1.0 };
    DopplerMargin {
        offset_hz,
        allowed_offset_hz,
        offset_share: offset_hz / allowed_offset_hz,
        drift_hz,
        allowed_drift_hz,
        drift_share: drift_hz / allowed_drift_hz,
    }
}
