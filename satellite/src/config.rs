//! What kind of satellite the twin is, and what may go wrong with it on purpose.

use std::sync::Arc;

use protocol::Key;
use tle::UtcInstant;

use crate::orbit::Orbit;

/// What the satellite does about counters it has seen (ICD, *Nonce and replay*): the real one may do any of these.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ReplayPolicy {
    /// Everything authentic is obeyed, recordings too.
    None,
    /// Only a counter above the highest accepted.
    StrictlyGreater,
    /// The ICD's rule: any counter above the highest; a lower one only if it is at most 10^7 lower and its nonce is
    /// not among the last 64 accepted.
    ///
    /// One thing is added: a counter at or below the highest one that has fallen out of those 64 is refused, or with
    /// `counter = sequence`, where 10^7 is no 10 s but a lifetime, an old recording would be accepted again.
    #[default]
    Icd,
    /// A counter above the highest by at most 10; needs a ground that counts by one.
    ForwardWindow10,
}

/// The image the satellite stores when it is first switched on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ImageSource {
    /// None until CaptureImage.
    None,
    /// A picture in CIF and colour that the camera took before.
    #[default]
    Camera,
    /// These bytes.
    Bytes {
        /// The file.
        bytes: Arc<[u8]>,
        /// Width it claims, pixels.
        width_px: u16,
        /// Height it claims, pixels.
        height_px: u16,
    },
}

/// What the camera makes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Camera {
    /// A JPEG of the Earth's limb; takes tens of milliseconds of real time to draw.
    #[default]
    Picture,
    /// Random bytes from the seed, no JPEG: for simulations of thousands of passes.
    Pattern {
        /// Size of each image.
        size_bytes: u32,
    },
    /// Every capture ends with Error CameraFailure.
    Broken,
}

/// Something that goes wrong, or right again, at a stated moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The computer restarts.
    Reset,
    /// The transmitter radiates nothing, without knowing it.
    Mute(bool),
    /// Inertial, magnetic and sun sensors answer NaN.
    SensorNan(bool),
    /// The clock is lost: timestamp 0 until SetTimestamp.
    ClockUnset,
    /// The clock falls behind by this much. Without a clock nothing happens.
    ClockStale {
        /// How far, ms.
        behind_ms: u64,
    },
    /// Each answer goes out twice.
    DuplicateAnswers(bool),
    /// Heartbeats become rare and the satellite complains once.
    LowBattery(bool),
}

/// What the twin is. Times are microseconds on the caller's monotonic scale.
#[derive(Clone, Debug)]
pub struct TwinConfig {
    /// Attitude, noise and pictures follow from this, and the orbit if there is none.
    pub seed: u64,
    /// Shared with ground.
    pub key: Key,
    /// Moment at which the twin is made: switched on if its state is new, else found running.
    pub start_us: u64,
    /// True time when the monotonic scale is 0, ms since 1970 UTC. The satellite knows it only by SetTimestamp.
    pub utc_at_zero_ms: u64,
    /// What it flies; `None`: [`Orbit::fictional`] by the seed, from the time when the monotonic scale was 0.
    pub orbit: Option<Orbit>,
    /// From one heartbeat to the next.
    pub heartbeat_period_us: u64,
    /// The same while the battery is low.
    pub heartbeat_period_low_us: u64,
    /// From the end of a boot to the first heartbeat.
    pub first_heartbeat_us: u64,
    /// How long a boot takes; meanwhile the satellite neither hears nor sends.
    pub boot_us: u64,
    /// From the last byte of a request at the computer to its answer.
    pub answer_delay_us: u64,
    /// How long CaptureImage takes.
    pub capture_us: u64,
    /// Whether GetImageRanges is known.
    pub ranges: bool,
    /// What it does about repeated counters.
    pub replay: ReplayPolicy,
    /// The image it has at first.
    pub image: ImageSource,
    /// What its camera makes.
    pub camera: Camera,
    /// What goes wrong and when, in any order.
    pub faults: Vec<(u64, Fault)>,
}

impl TwinConfig {
    /// PixelSat I as the ICD has it: a heartbeat each minute, ranges known, the ICD's replay rule, one image stored.
    #[must_use]
    pub fn new(seed: u64, key: Key) -> Self {
        const SECOND_US: u64 = 1_000_000;
        Self {
            seed,
            key,
            start_us: 0,
            // 2027-03-20T12:00:00Z
            utc_at_zero_ms: 1_805_544_000_000,
            orbit: None,
            heartbeat_period_us: 60 * SECOND_US,
            heartbeat_period_low_us: 240 * SECOND_US,
            first_heartbeat_us: 3 * SECOND_US,
            boot_us: 2 * SECOND_US,
            answer_delay_us: 20_000,
            capture_us: 4 * SECOND_US,
            ranges: true,
            replay: ReplayPolicy::Icd,
            image: ImageSource::Camera,
            camera: Camera::Picture,
            faults: Vec::new(),
        }
    }

    /// True time when the monotonic scale is 0.
    #[must_use]
    pub fn utc_at_zero(&self) -> UtcInstant {
        UtcInstant::from_unix_us(i64::try_from(self.utc_at_zero_ms).unwrap_or(i64::MAX).saturating_mul(1000))
    }
}
