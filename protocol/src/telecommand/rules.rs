//! What the ICD forbids beyond the layout, what answers a request, and how the machine may handle it.

use core::fmt;

use crate::{
    Answer, DownlinkSchedule, FieldValue, Guidance, PayloadError, ScheduleUpload, ScriptUpload, Telecommand,
    TorqueProfile, down_type,
};

impl Telecommand {
    /// Whether a receiver following the ICD takes this request.
    ///
    /// # Errors
    /// NaN or infinity anywhere (but *no attitude* in a schedule), a latitude or longitude outside its range, times that
    /// do not ascend, a torque profile over 600 s, a part at or beyond its number of parts, a polynomial without
    /// coefficients.
    pub fn validate(&self) -> Result<(), PayloadError> {
        match self {
            Self::SetDownlinkSchedule(schedule) => return validate_schedule(schedule),
            Self::ExecuteTorqueProfile(profile) => {
                let (total_ms, max_ms) = (profile.duration_ms(), TorqueProfile::DURATION_MAX_MS);
                if total_ms > max_ms {
                    return Err(PayloadError::Duration { total_ms, max_ms });
                }
            }
            Self::UploadSchedule(ScheduleUpload { part, parts, .. })
            | Self::UploadScript(ScriptUpload { part, parts, .. })
                if part >= parts =>
            {
                return Err(PayloadError::Range { field: "part" });
            }
            Self::UploadGuidance(Guidance { coefficients, .. }) if coefficients.is_empty() => {
                return Err(PayloadError::Range { field: "degree" });
            }
            _ => {}
        }
        let mut result = Ok(());
        self.visit_fields(&mut |field| {
            if let FieldValue::F32(value) = field.value
                && !value.is_finite()
                && result.is_ok()
            {
                result = Err(PayloadError::NotFinite { field: field.name });
            }
        });
        result?;
        if let Self::SetAdcsTarget { latitude_deg, longitude_deg } = self {
            if !(-90.0..=90.0).contains(latitude_deg) {
                return Err(PayloadError::Range { field: "latitude" });
            }
            if !(-180.0..=180.0).contains(longitude_deg) {
                return Err(PayloadError::Range { field: "longitude" });
            }
        }
        Ok(())
    }

    /// Whether sending it twice does no harm. The machine never repeats one that is not.
    #[must_use]
    pub const fn is_idempotent(&self) -> bool {
        !matches!(self, Self::Reset | Self::ExecuteTorqueProfile(_) | Self::CaptureImage { .. })
    }

    /// Whether it must be armed and then fired, by two people or devices where the team has them.
    #[must_use]
    pub const fn is_critical(&self) -> bool {
        matches!(
            self,
            Self::Reset
                | Self::SetTle(_)
                | Self::SetTimestamp { .. }
                | Self::ExecuteTorqueProfile(_)
                | Self::SetTransmitter { on: true }
                | Self::SetMode { .. }
                | Self::UploadSchedule(_)
        )
    }

    /// What the satellite sends when it succeeds; when it does not, an Error with this request's tag, or nothing.
    #[must_use]
    pub const fn answer(&self) -> Answer {
        match self {
            Self::Ping => Answer::One(down_type::PONG),
            Self::GetImageInfo | Self::CaptureImage { .. } => Answer::One(down_type::IMAGE_INFO),
            Self::GetImageChunk { .. } | Self::GetImageRanges(_) => Answer::Chunks,
            Self::Reset | Self::SetTransmitter { on: false } => Answer::None,
            Self::ExecuteTorqueProfile(_)
            | Self::GetAdcsInfo
            | Self::SetAdcsOmegaKill
            | Self::SetAdcsAttitude { .. }
            | Self::SetAdcsTarget { .. }
            | Self::SetAdcsAuto => Answer::One(down_type::ADCS_INFO),
            Self::SetDownlinkSchedule(_) => Answer::One(down_type::SCHEDULE_INFO),
            Self::SetTimestamp { .. } | Self::SetTle(_) | Self::SetTransmitter { on: true } => {
                Answer::One(down_type::HEARTBEAT)
            }
            Self::SetMode { .. }
            | Self::UploadSchedule(_)
            | Self::GetModeReport
            | Self::SetParameter { .. }
            | Self::UploadScript(_)
            | Self::UploadGuidance(_) => Answer::One(down_type::MODE_REPORT),
            Self::GetEvents { .. } => Answer::One(down_type::EVENT_REPORT),
        }
    }
}

fn validate_schedule(schedule: &DownlinkSchedule) -> Result<(), PayloadError> {
    for (entry, slot) in (0u8..).zip(&schedule.slots) {
        if slot.attitude_mrp.is_some_and(|attitude| attitude.iter().any(|x| !x.is_finite())) {
            return Err(PayloadError::NotFinite { field: "slot.attitude" });
        }
        let before = usize::from(entry).checked_sub(1).and_then(|i| schedule.slots.get(i));
        if before.is_some_and(|before| before.time_ms >= slot.time_ms) {
            return Err(PayloadError::Order { entry });
        }
    }
    Ok(())
}

/// `GetImageChunk first=1 count=2`; entries of lists follow as `[0] …`.
impl fmt::Display for Telecommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        if let Self::CaptureImage { resolution, grey, strong_compression } = self {
            return write!(f, " resolution={resolution} grey={grey} strong_compression={strong_compression}");
        }
        let mut result = Ok(());
        let mut index = None;
        self.visit_fields(&mut |field| {
            if result.is_err() {
                return;
            }
            if field.index != index {
                index = field.index;
                if let Some(index) = index {
                    result = write!(f, " [{index}]");
                }
            }
            // In a list the brackets already say what the entry is.
            let name = match (field.index, field.name.split_once('.')) {
                (Some(_), Some((_, rest))) => rest,
                _ => field.name,
            };
            result = result.and_then(|()| match field.value {
                FieldValue::F32(value) => write!(f, " {name}={value}"),
                FieldValue::U(value) => write!(f, " {name}={value}"),
                FieldValue::Bool(value) => write!(f, " {name}={value}"),
                FieldValue::Bytes(value) => write!(f, " {name}=\"{}\"", value.escape_ascii()),
            });
        });
        result
    }
}
