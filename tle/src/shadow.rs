//! The Earth's shadow: a cone of umbra and one of penumbra, behind a spherical Earth without air.

use crate::geodetic::WGS84_RADIUS_KM;
use crate::propagator::{PropagationError, Propagator};
use crate::sun::sun_teme_km;
use crate::time::UtcInstant;
use crate::vector::{Vec3, angle_rad, norm, scale, sub};

/// Radius of the Sun's disc, km.
pub const SUN_RADIUS_KM: f64 = 696_000.0;
/// An object is seen by eye while the Sun is lower than this at the station, degrees.
pub const DARK_SKY_SUN_ELEVATION_DEG: f64 = -6.0;

/// Sun and Earth as discs in an object's sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Discs {
    /// Angular radius of the Sun, rad.
    pub sun_rad: f64,
    /// Angular radius of the Earth, rad.
    pub earth_rad: f64,
    /// Angle between their centres, rad.
    pub apart_rad: f64,
}

/// How much of the Sun an object sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// All of it.
    Sunlit,
    /// The Earth covers a part of it.
    Penumbra {
        /// Uncovered part of the Sun's disc, 0 to 1.
        lit: f64,
    },
    /// Far away, the Earth's disc stands within the Sun's.
    Annular {
        /// Uncovered part of the Sun's disc, 0 to 1.
        lit: f64,
    },
    /// Nothing.
    Umbra,
}

impl Light {
    /// Uncovered part of the Sun's disc, 0 to 1.
    #[must_use]
    pub const fn lit(self) -> f64 {
        match self {
            Self::Sunlit => 1.0,
            Self::Penumbra { lit } | Self::Annular { lit } => lit,
            Self::Umbra => 0.0,
        }
    }
}

impl Discs {
    /// As seen from a position; both vectors from the Earth's centre, km, in one frame.
    #[must_use]
    pub fn seen_from(r_km: Vec3, sun_km: Vec3) -> Self {
        let to_sun = sub(sun_km, r_km);
        Self {
            sun_rad: (SUN_RADIUS_KM / norm(to_sun)).min(1.0).asin(),
            // Below the surface the Earth fills half the sky.
            earth_rad: (WGS84_RADIUS_KM / norm(r_km)).min(1.0).asin(),
            apart_rad: angle_rad(to_sun, scale(r_km, -1.0)),
        }
    }

    /// How far the discs are from touching, rad: negative while the Earth covers any of the Sun.
    #[must_use]
    pub fn penumbra_margin_rad(&self) -> f64 {
        self.apart_rad - (self.sun_rad + self.earth_rad)
    }

    /// How far the Sun's disc is from being covered, rad: negative in the umbra.
    #[must_use]
    pub fn umbra_margin_rad(&self) -> f64 {
        self.apart_rad - (self.earth_rad - self.sun_rad)
    }

    /// What is seen of the Sun.
    #[must_use]
    pub fn light(&self) -> Light {
        let (a, b, c) = (self.sun_rad, self.earth_rad, self.apart_rad);
        if c >= a + b {
            return Light::Sunlit;
        }
        if c <= b - a {
            return Light::Umbra;
        }
        if c <= a - b {
            return Light::Annular { lit: 1.0 - (b / a).powi(2) };
        }
        // Two flat discs that overlap: two circular segments along the chord that both share.
        let x = (c * c + a * a - b * b) / (2.0 * c);
        let y = (a * a - x * x).max(0.0).sqrt();
        let covered =
            a * a * (x / a).clamp(-1.0, 1.0).acos() + b * b * ((c - x) / b).clamp(-1.0, 1.0).acos() - c * y;
        Light::Penumbra { lit: (1.0 - covered / (std::f64::consts::PI * a * a)).clamp(0.0, 1.0) }
    }
}

/// What a satellite sees of the Sun.
#[must_use]
pub fn light(r_teme_km: Vec3, at: UtcInstant) -> Light {
    Discs::seen_from(r_teme_km, sun_teme_km(at)).light()
}

/// Whether a satellite above the horizon could be seen by eye: sunlit, under a dark sky.
#[must_use]
pub fn optically_visible(light: Light, sun_elevation_deg: f64) -> bool {
    light == Light::Sunlit && sun_elevation_deg < DARK_SKY_SUN_ELEVATION_DEG
}

/// An edge of the Earth's shadow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ShadowEdge {
    /// The Sun's disc begins to be covered.
    PenumbraEntered,
    /// The Sun is gone.
    UmbraEntered,
    /// The Sun's first ray.
    UmbraLeft,
    /// The whole Sun.
    PenumbraLeft,
}

/// An edge of the shadow, and when it is crossed, to a microsecond by this crate's own formulas.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowCrossing {
    /// When.
    pub at: UtcInstant,
    /// Which edge.
    pub edge: ShadowEdge,
}

/// Steps in one revolution between which the shadow is searched for.
const STEPS_A_REVOLUTION: f64 = 180.0;

/// Finds the crossings of the shadow's edges from `start` until `stop`, in order; nothing in a reversed window.
///
/// A lazy search: one step of 1/180 revolution costs one propagation, a step near the shadow some forty. A dip into the
/// shadow that is shorter than a step is found by its deepest point. Ends with the error where propagation ends.
pub fn shadow_crossings(
    propagator: &Propagator,
    start: UtcInstant,
    stop: UtcInstant,
) -> impl Iterator<Item = Result<ShadowCrossing, PropagationError>> + '_ {
    Search { propagator, from: start, stop, found: Vec::new(), failed: false }
}

struct Search<'a> {
    propagator: &'a Propagator,
    from: UtcInstant,
    stop: UtcInstant,
    /// Crossings of the step just searched, the earliest last.
    found: Vec<ShadowCrossing>,
    failed: bool,
}

/// The margin of a cone of the shadow: negative within it.
type Margin = fn(&Discs) -> f64;

/// The two cones, each by its margin and the names of its edges.
const CONES: [(Margin, ShadowEdge, ShadowEdge); 2] = [
    (Discs::penumbra_margin_rad, ShadowEdge::PenumbraEntered, ShadowEdge::PenumbraLeft),
    (Discs::umbra_margin_rad, ShadowEdge::UmbraEntered, ShadowEdge::UmbraLeft),
];

impl Search<'_> {
    fn margin(&self, at: UtcInstant, cone: Margin) -> Result<f64, PropagationError> {
        let state = self.propagator.at(at)?;
        Ok(cone(&Discs::seen_from(state.r_teme_km, sun_teme_km(at))))
    }

    fn search_step(&mut self, to: UtcInstant) -> Result<(), PropagationError> {
        let from = self.from;
        for (cone, entered, left) in CONES {
            let (before, after) = (self.margin(from, cone)?, self.margin(to, cone)?);
            let mut turns = vec![(from, before)];
            if before > 0.0 && after > 0.0 {
                // The margin moves by no more than the orbital rate: further off than a step's turn, no dip.
                if before.min(after) < 2.0 * std::f64::consts::TAU / STEPS_A_REVOLUTION {
                    let (deepest, margin) = self.deepest(from, to, cone)?;
                    if margin < 0.0 {
                        turns.push((deepest, margin));
                    }
                }
            }
            turns.push((to, after));
            for pair in turns.windows(2) {
                let [(a, at_a), (b, at_b)] = [pair[0], pair[1]];
                if (at_a < 0.0) != (at_b < 0.0) {
                    let at = self.root(a, b, at_a < 0.0, cone)?;
                    self.found.push(ShadowCrossing { at, edge: if at_a < 0.0 { left } else { entered } });
                }
            }
        }
        self.found.sort_by_key(|crossing| std::cmp::Reverse(crossing.at));
        Ok(())
    }

    fn root(
        &self,
        mut a: UtcInstant,
        mut b: UtcInstant,
        inside_at_a: bool,
        cone: Margin,
    ) -> Result<UtcInstant, PropagationError> {
        while b.us_since(a) > 1 {
            let middle = a.plus_us(b.us_since(a) / 2);
            if (self.margin(middle, cone)? < 0.0) == inside_at_a { a = middle } else { b = middle }
        }
        Ok(b)
    }

    fn deepest(
        &self,
        mut a: UtcInstant,
        mut b: UtcInstant,
        cone: Margin,
    ) -> Result<(UtcInstant, f64), PropagationError> {
        while b.us_since(a) > 1000 {
            let third = b.us_since(a) / 3;
            let (left, right) = (a.plus_us(third), b.plus_us(-third));
            if self.margin(left, cone)? < self.margin(right, cone)? { b = right } else { a = left }
        }
        Ok((a, self.margin(a, cone)?))
    }
}

impl Iterator for Search<'_> {
    type Item = Result<ShadowCrossing, PropagationError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(crossing) = self.found.pop() {
                return Some(Ok(crossing));
            }
            if self.failed || self.from >= self.stop {
                return None;
            }
            // At least a second: elements with absurd periods must not make the steps vanish.
            let step_s = (self.propagator.period_min() * 60.0 / STEPS_A_REVOLUTION).clamp(1.0, 600.0);
            let to = self.from.plus_seconds(step_s).min(self.stop);
            if let Err(error) = self.search_step(to) {
                self.failed = true;
                return Some(Err(error));
            }
            self.from = to;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUN_KM: Vec3 = [149_597_870.7, 0.0, 0.0];

    #[test]
    fn day_side_is_lit_and_far_behind_the_earth_it_is_annular() {
        let at = |x, y| Discs::seen_from([x, y, 0.0], SUN_KM).light();
        assert_eq!(at(7000.0, 0.0), Light::Sunlit);
        assert_eq!(at(-7000.0, 0.0), Light::Umbra);
        assert_eq!(at(0.0, 7000.0), Light::Sunlit);
        let Light::Annular { lit } = at(-2_000_000.0, 0.0) else {
            panic!("the umbra ends at 1.4 million km")
        };
        assert!(lit > 0.3 && lit < 0.6, "{lit}");
    }

    #[test]
    fn penumbra_grows_darker_inwards() {
        let mut last = 1.0;
        for step in 0..4000 {
            let y = 6500.0 - f64::from(step) * 0.1;
            let light = Discs::seen_from([-2500.0, y, 0.0], SUN_KM).light();
            assert!(light.lit() <= last + 1e-12, "{y}");
            last = light.lit();
        }
        assert_eq!(last, 0.0);
    }
}
