//! The antenna: where it looks, what a rig is tuned to, and what the radio bears.

use serde::{Deserialize, Serialize};

use crate::Time;

/// The antenna now.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AntennaView {
    /// The rotator; `null` when there is none.
    pub rotator: Option<RotatorView>,
    /// The rig that is tuned with the Doppler shift; `null` when there is none.
    pub rig: Option<RigView>,
    /// Each radio that is not tuned, in the pass that lasts or comes next; without those whose satellite has none.
    pub doppler: Vec<DopplerView>,
}

/// A position of the rotator's two axes.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AxesView {
    /// As the rotator's dial has it: below 0 and above 360 in an overlap.
    pub azimuth_deg: f64,
    /// Above 90 when it leans over the zenith.
    pub elevation_deg: f64,
}

/// A rotator now.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RotatorView {
    /// Host and port of its daemon.
    pub address: String,
    /// The daemon answers.
    pub connected: bool,
    /// What it calls itself.
    pub info: Option<String>,
    /// `idle`, `waiting` (for when it must leave), `preparing` (on its way to where the pass begins, or there), `tracking`,
    /// `parking`, `parked`, or `stopped`.
    pub state: String,
    /// Since when.
    pub state_since: Option<Time>,
    /// Since when it rests; `null` when it does not.
    pub parked_since: Option<Time>,
    /// Where it stands; `null` when that cannot be read.
    pub position: Option<AxesView>,
    /// When that was read.
    pub position_at: Option<Time>,
    /// Where it was last told to be.
    pub target: Option<AxesView>,
    /// Its position changes.
    pub moving: bool,
    /// It is where it was told to be.
    pub on_target: bool,
    /// The pass that it follows or prepares for.
    pub pass: Option<RotatorPass>,
    /// What is wrong, as a sentence with the remedy; `null` when all is well.
    pub fault: Option<String>,
    /// Since when something is wrong without a break.
    pub fault_since: Option<Time>,
    /// Positions that were commanded and accepted since the start.
    pub commands: u64,
}

/// The way through a pass.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RotatorPass {
    /// Satellite.
    pub satellite: String,
    /// Acquisition of signal, or when the antenna was told if that was later.
    pub aos: Time,
    /// Loss of signal.
    pub los: Time,
    /// When it must leave to be in place at AOS, or had to.
    pub leaves_at: Time,
    /// Where it must stand at AOS.
    pub start: AxesView,
    /// How often it must turn round in the middle of the pass.
    pub unwindings: u64,
    /// How often the satellite is too fast or out of reach for it.
    pub keyholes: u64,
}

/// A rig now.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RigView {
    /// Host and port of its daemon.
    pub address: String,
    /// The daemon answers.
    pub connected: bool,
    /// What it calls itself.
    pub info: Option<String>,
    /// Whose Doppler shift it follows.
    pub satellite: Option<String>,
    /// What its receiver was read to be set to.
    pub receive_hz: Option<f64>,
    /// What its transmitter was read to be set to.
    pub transmit_hz: Option<f64>,
    /// The downlink's Doppler shift now.
    pub shift_hz: Option<f64>,
    /// What the receiver is off by.
    pub residual_hz: Option<f64>,
    /// What is wrong, as a sentence with the remedy; `null` when all is well.
    pub fault: Option<String>,
    /// Since when something is wrong without a break.
    pub fault_since: Option<Time>,
    /// Frequencies that were set and read back since the start.
    pub commands: u64,
}

/// How much of what a LoRa receiver bears one pass uses up, for a radio that is not tuned within it.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DopplerView {
    /// Link.
    pub link: String,
    /// Satellite that it hears.
    pub satellite: String,
    /// Its carrier.
    pub frequency_hz: f64,
    /// Acquisition of signal of the pass.
    pub aos: Time,
    /// Loss of signal; `null` for an object that does not set.
    pub los: Option<Time>,
    /// The shift now; `null` before AOS.
    pub shift_hz: Option<f64>,
    /// The greatest offset in this pass: Doppler shift, and 1 kHz for the oscillators.
    pub offset_hz: f64,
    /// What a receiver bears: a quarter of the bandwidth.
    pub allowed_offset_hz: f64,
    /// Share of it, 1 being all of it.
    pub offset_share: f64,
    /// How far the carrier drifts at most within the longest packet.
    pub drift_hz: f64,
    /// What a packet bears: a third of a bin, sixteen times that with low data rate optimisation. A rule of thumb.
    pub allowed_drift_hz: f64,
    /// Share of it, 1 being all of it.
    pub drift_share: f64,
}
