//! Packets to the satellite (ICD sections 3, 7), what answers them and how they may be handled.

mod codec;
mod lists;
mod rules;
mod text;

pub use lists::{
    ChunkRange, ChunkRanges, DownlinkSchedule, DownlinkSlot, Guidance, Resolution, ScheduleEntry,
    ScheduleUpload, ScriptStep, ScriptUpload, TorqueProfile, TorqueStep,
};
pub use text::TwoLines;

/// Packet types to the satellite.
pub mod up_type {
    /// Are you there?
    pub const PING: u8 = 0;
    /// What image do you store?
    pub const GET_IMAGE_INFO: u8 = 1;
    /// Send a range of chunks.
    pub const GET_IMAGE_CHUNK: u8 = 2;
    /// Restart.
    pub const RESET: u8 = 3;
    /// Run a profile of torques.
    pub const EXECUTE_TORQUE_PROFILE: u8 = 4;
    /// State of attitude control?
    pub const GET_ADCS_INFO: u8 = 5;
    /// Take a picture.
    pub const CAPTURE_IMAGE: u8 = 6;
    /// Replace the list of scheduled transmissions.
    pub const SET_DOWNLINK_SCHEDULE: u8 = 7;
    /// Damp every rotation.
    pub const SET_ADCS_OMEGA_KILL: u8 = 8;
    /// Hold an attitude.
    pub const SET_ADCS_ATTITUDE: u8 = 9;
    /// Point at a place on the ground.
    pub const SET_ADCS_TARGET: u8 = 10;
    /// Let the satellite choose.
    pub const SET_ADCS_AUTO: u8 = 11;
    /// Set the clock.
    pub const SET_TIMESTAMP: u8 = 12;
    /// Store orbital elements.
    pub const SET_TLE: u8 = 13;
    /// Send several ranges of chunks.
    pub const GET_IMAGE_RANGES: u8 = 14;
    /// Cease or resume transmissions.
    pub const SET_TRANSMITTER: u8 = 15;
    /// Change the mode (autonomy extension, as all below).
    pub const SET_MODE: u8 = 0x40;
    /// Store a part of a schedule.
    pub const UPLOAD_SCHEDULE: u8 = 0x41;
    /// State of the mode machine?
    pub const GET_MODE_REPORT: u8 = 0x42;
    /// Set a parameter.
    pub const SET_PARAMETER: u8 = 0x43;
    /// Store a part of a script.
    pub const UPLOAD_SCRIPT: u8 = 0x44;
    /// Send recorded events.
    pub const GET_EVENTS: u8 = 0x45;
    /// Store a guidance polynomial.
    pub const UPLOAD_GUIDANCE: u8 = 0x46;
}

/// One request to the satellite.
#[derive(Clone, PartialEq, Debug)]
pub enum Telecommand {
    /// Answered by Pong.
    Ping,
    /// Answered by ImageInfo.
    GetImageInfo,
    /// Answered by the chunks `first..min(first + count, chunks)`, ascending.
    GetImageChunk {
        /// First chunk.
        first: u16,
        /// Number of chunks; ground asks for at most [`RANGE_MAX`](crate::RANGE_MAX).
        count: u16,
    },
    /// No answer; the next heartbeat shows a small uptime.
    Reset,
    /// Answered by AdcsInfo after the profile has run.
    ExecuteTorqueProfile(TorqueProfile),
    /// Answered by AdcsInfo.
    GetAdcsInfo,
    /// Answered by ImageInfo after the capture.
    CaptureImage {
        /// Size of the picture.
        resolution: Resolution,
        /// Without colour.
        grey: bool,
        /// Smaller file, worse picture.
        strong_compression: bool,
    },
    /// Replaces the list; answered by ScheduleInfo.
    SetDownlinkSchedule(DownlinkSchedule),
    /// Answered by AdcsInfo.
    SetAdcsOmegaKill,
    /// Answered by AdcsInfo.
    SetAdcsAttitude {
        /// Attitude to hold, modified Rodrigues parameters.
        attitude_mrp: [f32; 3],
    },
    /// Answered by AdcsInfo.
    SetAdcsTarget {
        /// Geodetic latitude, degrees, -90..=90, north positive.
        latitude_deg: f32,
        /// Longitude, degrees, -180..=180, east positive.
        longitude_deg: f32,
    },
    /// Answered by AdcsInfo.
    SetAdcsAuto,
    /// Answered by a Heartbeat with this request's tag.
    SetTimestamp {
        /// Time, ms since 1970 UTC.
        utc_ms: u64,
    },
    /// Answered by a Heartbeat with this request's tag.
    SetTle(TwoLines),
    /// Answered by the chunks of all ranges, in the listed order; only with profile `ranges = true`.
    GetImageRanges(ChunkRanges),
    /// Answered by a Heartbeat when on, by nothing when off.
    SetTransmitter {
        /// Whether the satellite may transmit.
        on: bool,
    },
    /// Answered by ModeReport.
    SetMode {
        /// Mode code of the satellite's machine.
        mode: u8,
        /// Sub-state; 255 = none.
        substate: u8,
    },
    /// Answered by ModeReport.
    UploadSchedule(ScheduleUpload),
    /// Answered by ModeReport.
    GetModeReport,
    /// Answered by ModeReport.
    SetParameter {
        /// Which parameter.
        parameter: u8,
        /// Its value, in the parameter's own unit.
        value: f32,
    },
    /// Answered by ModeReport.
    UploadScript(ScriptUpload),
    /// Answered by EventReport.
    GetEvents {
        /// First sequence number wanted.
        first: u32,
    },
    /// Answered by ModeReport.
    UploadGuidance(Guidance),
}

/// What the satellite sends when a request succeeds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Answer {
    /// Nothing; the outcome shows in telemetry or not at all.
    None,
    /// One packet of this downlink type.
    One(u8),
    /// Image chunks, as many as were asked for and exist.
    Chunks,
}

impl Telecommand {
    /// Type in the header.
    #[must_use]
    pub const fn packet_type(&self) -> u8 {
        match self {
            Self::Ping => up_type::PING,
            Self::GetImageInfo => up_type::GET_IMAGE_INFO,
            Self::GetImageChunk { .. } => up_type::GET_IMAGE_CHUNK,
            Self::Reset => up_type::RESET,
            Self::ExecuteTorqueProfile(_) => up_type::EXECUTE_TORQUE_PROFILE,
            Self::GetAdcsInfo => up_type::GET_ADCS_INFO,
            Self::CaptureImage { .. } => up_type::CAPTURE_IMAGE,
            Self::SetDownlinkSchedule(_) => up_type::SET_DOWNLINK_SCHEDULE,
            Self::SetAdcsOmegaKill => up_type::SET_ADCS_OMEGA_KILL,
            Self::SetAdcsAttitude { .. } => up_type::SET_ADCS_ATTITUDE,
            Self::SetAdcsTarget { .. } => up_type::SET_ADCS_TARGET,
            Self::SetAdcsAuto => up_type::SET_ADCS_AUTO,
            Self::SetTimestamp { .. } => up_type::SET_TIMESTAMP,
            Self::SetTle(_) => up_type::SET_TLE,
            Self::GetImageRanges(_) => up_type::GET_IMAGE_RANGES,
            Self::SetTransmitter { .. } => up_type::SET_TRANSMITTER,
            Self::SetMode { .. } => up_type::SET_MODE,
            Self::UploadSchedule(_) => up_type::UPLOAD_SCHEDULE,
            Self::GetModeReport => up_type::GET_MODE_REPORT,
            Self::SetParameter { .. } => up_type::SET_PARAMETER,
            Self::UploadScript(_) => up_type::UPLOAD_SCRIPT,
            Self::GetEvents { .. } => up_type::GET_EVENTS,
            Self::UploadGuidance(_) => up_type::UPLOAD_GUIDANCE,
        }
    }

    /// The ICD's name of this request.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match Self::name_of(self.packet_type()) {
            Some(name) => name,
            None => "Unknown",
        }
    }

    /// The ICD's name of a packet type.
    #[must_use]
    pub const fn name_of(packet_type: u8) -> Option<&'static str> {
        Some(match packet_type {
            up_type::PING => "Ping",
            up_type::GET_IMAGE_INFO => "GetImageInfo",
            up_type::GET_IMAGE_CHUNK => "GetImageChunk",
            up_type::RESET => "Reset",
            up_type::EXECUTE_TORQUE_PROFILE => "ExecuteTorqueProfile",
            up_type::GET_ADCS_INFO => "GetAdcsInfo",
            up_type::CAPTURE_IMAGE => "CaptureImage",
            up_type::SET_DOWNLINK_SCHEDULE => "SetDownlinkSchedule",
            up_type::SET_ADCS_OMEGA_KILL => "SetAdcsOmegaKill",
            up_type::SET_ADCS_ATTITUDE => "SetAdcsAttitude",
            up_type::SET_ADCS_TARGET => "SetAdcsTarget",
            up_type::SET_ADCS_AUTO => "SetAdcsAuto",
            up_type::SET_TIMESTAMP => "SetTimestamp",
            up_type::SET_TLE => "SetTle",
            up_type::GET_IMAGE_RANGES => "GetImageRanges",
            up_type::SET_TRANSMITTER => "SetTransmitter",
            up_type::SET_MODE => "SetMode",
            up_type::UPLOAD_SCHEDULE => "UploadSchedule",
            up_type::GET_MODE_REPORT => "GetModeReport",
            up_type::SET_PARAMETER => "SetParameter",
            up_type::UPLOAD_SCRIPT => "UploadScript",
            up_type::GET_EVENTS => "GetEvents",
            up_type::UPLOAD_GUIDANCE => "UploadGuidance",
            _ => return None,
        })
    }
}
