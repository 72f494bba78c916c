//! Error codes (ICD section 6). The names are the paper's, the numbers ours.

use core::fmt;

use crate::{
    PayloadError,
    wire::{Reader, Walk, Wire, Writer},
};

/// What an Error packet says. Any code is a value; one without a name is shown as `Unknown(n)`, never dropped.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct ErrorCode(pub u8);

macro_rules! codes {
    ($($(#[$meta:meta])* $konst:ident = $code:literal, $name:literal;)*) => {
        impl ErrorCode {
            $( $(#[$meta])* pub const $konst: Self = Self($code); )*

            /// Every code with a name, ascending.
            pub const NAMED: &'static [Self] = &[$(Self::$konst),*];

            /// The ICD's name, `None` for a code it does not list.
            #[must_use]
            pub const fn name(self) -> Option<&'static str> {
                match self.0 {
                    $( $code => Some($name), )*
                    _ => None,
                }
            }
        }
    };
}

codes! {
    /// A request the satellite does not understand or cannot fulfil.
    MALFORMED_PACKET = 1, "MalformedPacket";
    /// An authentic request whose checksum failed.
    CRC_FAILED = 2, "CrcFailed";
    /// A scheduled transmission could not be read.
    SCHEDULED_TRANSMISSION_READ_FAILURE = 3, "ScheduledTransmissionReadFailure";
    /// The transceiver did not answer in time.
    TRANSCEIVER_TIMEOUT = 4, "TransceiverTimeout";
    /// The inertial sensor failed.
    IMU_FAILURE = 16, "ImuFailure";
    /// The inertial sensor had a fault it survived.
    IMU_NONFATAL_FAILURE = 17, "ImuNonfatalFailure";
    /// A sun sensor failed.
    SUN_SENSOR_FAILURE = 18, "SunSensorFailure";
    /// The magnetometer is noisy.
    MAGNETOMETER_NOISY = 19, "MagnetometerNoisy";
    /// The magnetometer's pulse-width drive failed.
    MAGNETOMETER_PWM_FAILURE = 20, "MagnetometerPwmFailure";
    /// The model of the Earth's field could not be read.
    IGRF_READ_FAILURE = 21, "IgrfReadFailure";
    /// The attitude controller failed.
    ACS_PID_FAILURE = 22, "AcsPidFailure";
    /// The satellite turns faster than it should.
    ANGULAR_VELOCITY_ABNORMALLY_HIGH = 23, "AngularVelocityAbnormallyHigh";
    /// Sent after a reset of the system.
    POST_SYSTEM_RESET = 32, "PostSystemReset";
    /// The real-time clock failed.
    RTC_FAILURE = 33, "RtcFailure";
    /// The camera failed, or there is no image.
    CAMERA_FAILURE = 34, "CameraFailure";
    /// No orbital elements are stored.
    NO_TLE_STORED = 35, "NoTleStored";
    /// The battery is low.
    LOW_BATTERY = 36, "LowBattery";
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => f.write_str(name),
            None => write!(f, "Unknown({})", self.0),
        }
    }
}

impl Wire for ErrorCode {
    const LEN: usize = 1;
    fn read(reader: &mut Reader<'_>) -> Result<Self, PayloadError> {
        reader.read().map(Self)
    }
    fn write(&self, writer: &mut Writer<'_>) {
        writer.write(&self.0);
    }
    fn walk(&self, walk: &mut Walk<'_>, names: &[&'static str], unit: &'static str) {
        walk.value(&self.0, names, unit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn unnamed_codes_keep_their_number() {
        assert_eq!(ErrorCode(34).to_string(), "CameraFailure");
        assert_eq!(ErrorCode(200).to_string(), "Unknown(200)");
        assert_eq!(ErrorCode::NAMED.len(), 17);
        assert!(ErrorCode::NAMED.is_sorted());
    }
}
