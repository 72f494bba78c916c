//! One world of a rehearsal: what is known stays, what is uncertain follows the seed.

use std::ops::RangeInclusive;

use mission::sky::ElementsAge;
use mission::{Intent, UtcUs};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use satellite::{ChannelConfig, Orbit, PassProfile};
use tle::Elements;

use super::outcome::Outcome;
use super::{Rehearsal, RehearsalError};
use crate::config::Known;
use crate::{Operator, World, WorldConfig};

/// The world begins this long before AOS, microseconds: the checks before a pass come five minutes before it.
const BEFORE_US: i64 = 360_000_000;
/// It ends this long after LOS, and after all that the elements may be wrong, microseconds.
const AFTER_US: i64 = 60_000_000;
/// Elements are never taken to be further off than this, s.
const TIMING_MAX_S: f64 = 120.0;

/// What nobody knows beforehand; each seed draws its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// Size of the satellite's images, bytes; any within is as likely as any other.
    pub image_bytes: RangeInclusive<u32>,
    /// One sigma of the link's level against the budget, dB: pointing, polarisation, cables, noise.
    pub level_db: f64,
    /// Frames that are lost in any case, up to this share of all; any share up to it is as likely.
    pub loss: f64,
    /// One sigma of the time of AOS and LOS, s; `None`: by the age of the elements ([`ElementsAge`]).
    pub timing_s: Option<f64>,
}

impl Default for Uncertainty {
    /// Images of 15 to 45 kB (CIF, JPEG), 2 dB, up to 8 % of the frames, and what the elements' age lets expect.
    fn default() -> Self {
        Self { image_bytes: 15_000..=45_000, level_db: 2.0, loss: 0.08, timing_s: None }
    }
}

/// What a seed drew.
struct Drawn {
    image_bytes: u32,
    level_db: f64,
    loss: f64,
    timing_s: f64,
    first_heartbeat_us: u64,
}

impl Drawn {
    fn of(what: &Rehearsal, seed: u64) -> Self {
        // Another sequence than the world's own, which begins at the same seed.
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x7265_6865_6172_7365);
        let Uncertainty { image_bytes, level_db, loss, timing_s } = &what.uncertainty;
        let age = ElementsAge::at(&what.elements, what.pass.aos_at);
        let sigma_s = timing_s.unwrap_or(age.timing_error_s).clamp(0.0, TIMING_MAX_S);
        let (low, high) = (*image_bytes.start(), (*image_bytes.end()).max(*image_bytes.start()));
        Self {
            image_bytes: rng.random_range(low..=high).max(1),
            level_db: level_db * normal(&mut rng),
            loss: loss.clamp(0.0, 1.0) * rng.random::<f64>(),
            timing_s: (sigma_s * normal(&mut rng)).clamp(-TIMING_MAX_S, TIMING_MAX_S),
            first_heartbeat_us: rng.random_range(0..what.profile.heartbeat_period_us.max(1)),
        }
    }
}

/// Around 0 with a deviation of 1, after Box and Muller.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (a, b) = (1.0 - rng.random::<f64>(), rng.random::<f64>());
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// The same orbit, so much later in it than the elements say.
fn late(elements: &Elements, seconds: f64) -> Elements {
    let degrees = elements.mean_motion_rev_day * 360.0 / 86_400.0 * seconds;
    Elements { mean_anomaly_deg: (elements.mean_anomaly_deg - degrees).rem_euclid(360.0), ..elements.clone() }
}

/// Goes through the pass once.
pub(super) fn fly(what: &Rehearsal, seed: u64) -> Result<Outcome, RehearsalError> {
    let drawn = Drawn::of(what, seed);
    let los = what.pass.los_at.ok_or(RehearsalError::TooLong)?;
    let zero_ms = u64::try_from(what.pass.aos_at.plus(-BEFORE_US).0.div_euclid(1000)).unwrap_or(0);
    let orbit = Orbit::new(late(&what.elements, drawn.timing_s))?;
    let passes =
        PassProfile::Orbit { station: Box::new(what.site.place.clone()), orientation: what.site.orientation };
    let config = WorldConfig {
        channel: ChannelConfig {
            passes,
            loss: drawn.loss,
            level_db: drawn.level_db,
            ..ChannelConfig::default()
        },
        orbit: Some(orbit),
        utc_at_zero_ms: zero_ms,
        image_bytes: drawn.image_bytes,
        view_is_known: true,
        operator: Operator::Absent,
        known: Some(Box::new(Known {
            satellite: what.plan.satellite.clone(),
            profile: what.profile,
            timing: what.timing,
            site: what.site.clone(),
            times: what.times.clone(),
            elements: what.elements.clone(),
            first_heartbeat_us: drawn.first_heartbeat_us,
            intents: intents(what),
        })),
        ..WorldConfig::seeded(seed)
    };
    let late_us = (drawn.timing_s.max(0.0) * 1e6) as i64;
    let lasts_us = los.plus(AFTER_US + late_us).0 - i64::try_from(zero_ms).unwrap_or(0) * 1000;
    let mut world = World::new(config);
    while world.now_s() * 1e6 < lasts_us as f64 {
        world.step().map_err(|violation| RehearsalError::Violation(Box::new(violation)))?;
    }
    if !world.refusals().is_empty() {
        return Err(RehearsalError::Refused(world.refusals().join("; ")));
    }
    Ok(Outcome::of(what, seed, &world))
}

/// The plan, armed, for this pass.
fn intents(what: &Rehearsal) -> Vec<Intent> {
    let plan = what.plan.name.clone();
    let at: UtcUs = what.pass.tca_at;
    vec![
        Intent::AddPlan { plan: what.plan.clone(), text: what.text.clone() },
        Intent::AttachPlan { plan: plan.clone(), at, attach: true },
        Intent::ArmPlan { plan, armed: true },
    ]
}
