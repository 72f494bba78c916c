//! What SGP4 computes once per object: the constants of drag and of the secular and periodic terms.

use std::f64::consts::{PI, TAU};

use crate::elements::Elements;
use crate::propagator::{DEEP_SPACE_PERIOD_MIN, SGP4_EARTH_RADIUS_KM};

/// Orbits with a smaller eccentricity than this are round: Kepler's equation takes two short steps for them.
pub const ECCENTRICITY_BOUND: f64 = 0.02;

/// Square root of the gravitational parameter (WGS72), Earth radii^1.5 / min.
pub(super) const KE: f64 = 0.074_366_916_133_173_42;
/// Zonal harmonics of WGS72.
pub(super) const J2: f64 = 0.001_082_616;
pub(super) const J3: f64 = -0.000_002_538_81;
const J4: f64 = -0.000_001_655_97;

/// SGP4's constants of one object (`T` is a number), of as many as the machine has lanes, or of a fleet (columns).
///
/// Names follow Vallado's code. Units are Earth radii, minutes, radians. Where the theory has a branch (perigee below
/// 220 km, eccentricity below 1e-4) the coefficients of the missing terms are 0, so that the kernel needs none.
#[derive(Debug, Clone, Default)]
pub(super) struct Coefficients<T> {
    /// Mean elements at the epoch, and their secular rates.
    pub(super) ecco: T,
    pub(super) mo: T,
    pub(super) mdot: T,
    pub(super) argpo: T,
    pub(super) argpdot: T,
    pub(super) nodeo: T,
    pub(super) nodedot: T,
    pub(super) nodecf: T,
    pub(super) ao: T,
    pub(super) no: T,
    pub(super) cosio: T,
    pub(super) sinio: T,
    /// Drag.
    pub(super) cc1: T,
    pub(super) cc4: T,
    pub(super) cc5: T,
    pub(super) d2: T,
    pub(super) d3: T,
    pub(super) d4: T,
    pub(super) t2cof: T,
    pub(super) t3cof: T,
    pub(super) t4cof: T,
    pub(super) t5cof: T,
    pub(super) eta: T,
    pub(super) sinmao: T,
    pub(super) delmo: T,
    pub(super) omgcof: T,
    pub(super) xmcof: T,
    /// Long and short period terms.
    pub(super) aycof: T,
    pub(super) xlcof: T,
    pub(super) con41: T,
    pub(super) x1mth2: T,
    pub(super) x7thm1: T,
}

impl<T> Coefficients<T> {
    /// The same set in another form: a number spread over lanes, a column cut to a few.
    #[inline(always)]
    pub(super) fn map<U>(&self, to: impl Fn(&T) -> U) -> Coefficients<U> {
        Coefficients {
            ecco: to(&self.ecco),
            mo: to(&self.mo),
            mdot: to(&self.mdot),
            argpo: to(&self.argpo),
            argpdot: to(&self.argpdot),
            nodeo: to(&self.nodeo),
            nodedot: to(&self.nodedot),
            nodecf: to(&self.nodecf),
            ao: to(&self.ao),
            no: to(&self.no),
            cosio: to(&self.cosio),
            sinio: to(&self.sinio),
            cc1: to(&self.cc1),
            cc4: to(&self.cc4),
            cc5: to(&self.cc5),
            d2: to(&self.d2),
            d3: to(&self.d3),
            d4: to(&self.d4),
            t2cof: to(&self.t2cof),
            t3cof: to(&self.t3cof),
            t4cof: to(&self.t4cof),
            t5cof: to(&self.t5cof),
            eta: to(&self.eta),
            sinmao: to(&self.sinmao),
            delmo: to(&self.delmo),
            omgcof: to(&self.omgcof),
            xmcof: to(&self.xmcof),
            aycof: to(&self.aycof),
            xlcof: to(&self.xlcof),
            con41: to(&self.con41),
            x1mth2: to(&self.x1mth2),
            x7thm1: to(&self.x7thm1),
        }
    }
}

impl Coefficients<f64> {
    /// From mean elements: all that near-earth orbits need, and what deep space shares with them. `None` where they describe
    /// no closed orbit.
    ///
    /// Spacetrack Report No. 3 and AIAA 2006-6753, `sgp4init`.
    pub(super) fn new(elements: &Elements) -> Option<Self> {
        let ecco = elements.eccentricity;
        let kozai = elements.mean_motion_rev_day * (PI / 720.0);
        let finite = [
            elements.inclination_deg,
            elements.raan_deg,
            elements.arg_of_perigee_deg,
            elements.mean_anomaly_deg,
            elements.bstar,
            kozai,
        ];
        if !(0.0..1.0).contains(&ecco) || kozai <= 0.0 || finite.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let (sinio, cosio) = elements.inclination_deg.to_radians().sin_cos();
        let argpo = elements.arg_of_perigee_deg.to_radians();
        let mo = elements.mean_anomaly_deg.to_radians();
        let (bstar, cosio2) = (elements.bstar, cosio * cosio);
        let con41 = 3.0 * cosio2 - 1.0;
        let omeosq = 1.0 - ecco * ecco;
        let rteosq = omeosq.sqrt();

        // The mean motion freed from Kozai's terms.
        let a1 = (KE / kozai).powf(2.0 / 3.0);
        let p = 0.75 * J2 * con41 / (rteosq * omeosq);
        let del = p / (a1 * a1);
        let adel = a1 * (1.0 - del * del - del * (1.0 / 3.0 + 134.0 * del * del / 81.0));
        let no = kozai / (1.0 + p / (adel * adel));
        if no.is_nan() || no <= 0.0 {
            return None;
        }

        let ao = (KE / no).powf(2.0 / 3.0);
        let rp = ao * (1.0 - ecco);
        let perigee_km = SGP4_EARTH_RADIUS_KM * (rp - 1.0);
        let s_km = if perigee_km < 98.0 { 20.0 } else { (perigee_km - 78.0).min(78.0) };
        let sfour = s_km / SGP4_EARTH_RADIUS_KM + 1.0;
        let qzms24 = ((120.0 - s_km) / SGP4_EARTH_RADIUS_KM).powi(4);
        let tsi = 1.0 / (ao - sfour);
        let eta = ao * ecco * tsi;
        let (etasq, eeta) = (eta * eta, ecco * eta);
        let psisq = (1.0 - etasq).abs();
        let coef = qzms24 * tsi.powi(4);
        let coef1 = coef / psisq.powf(3.5);
        let cc1 = bstar
            * coef1
            * no
            * (ao * (1.0 + 1.5 * etasq + eeta * (4.0 + etasq))
                + 0.375 * J2 * tsi / psisq * con41 * (8.0 + 3.0 * etasq * (8.0 + etasq)));
        let x1mth2 = 1.0 - cosio2;
        let cc4 = 2.0
            * bstar
            * no
            * coef1
            * ao
            * omeosq
            * (eta * (2.0 + 0.5 * etasq) + ecco * (0.5 + 2.0 * etasq)
                - J2 * tsi / (ao * psisq)
                    * (-3.0 * con41 * (1.0 - 2.0 * eeta + etasq * (1.5 - 0.5 * eeta))
                        + 0.75 * x1mth2 * (2.0 * etasq - eeta * (1.0 + etasq)) * (2.0 * argpo).cos()));

        let pinvsq = 1.0 / (ao * omeosq).powi(2);
        let cosio4 = cosio2 * cosio2;
        let temp1 = 1.5 * J2 * pinvsq * no;
        let temp2 = 0.5 * temp1 * J2 * pinvsq;
        let temp3 = -0.46875 * J4 * pinvsq * pinvsq * no;
        let mdot = no
            + 0.5 * temp1 * rteosq * con41
            + 0.0625 * temp2 * rteosq * (13.0 - 78.0 * cosio2 + 137.0 * cosio4);
        let argpdot = -0.5 * temp1 * (1.0 - 5.0 * cosio2)
            + 0.0625 * temp2 * (7.0 - 114.0 * cosio2 + 395.0 * cosio4)
            + temp3 * (3.0 - 36.0 * cosio2 + 49.0 * cosio4);
        let nodedot = -temp1 * cosio
            + (0.5 * temp2 * (4.0 - 19.0 * cosio2) + 2.0 * temp3 * (3.0 - 7.0 * cosio2)) * cosio;
        let xlcof = -0.25 * (J3 / J2) * sinio * (3.0 + 5.0 * cosio)
            / if (1.0 + cosio).abs() > 1.5e-12 { 1.0 + cosio } else { 1.5e-12 };

        let mut set = Self {
            ecco,
            mo,
            mdot,
            argpo,
            argpdot,
            nodeo: elements.raan_deg.to_radians(),
            nodedot,
            nodecf: -3.5 * omeosq * temp1 * cosio * cc1,
            ao,
            no,
            cosio,
            sinio,
            cc1,
            cc4,
            t2cof: 1.5 * cc1,
            eta,
            sinmao: mo.sin(),
            aycof: -0.5 * (J3 / J2) * sinio,
            xlcof,
            con41,
            x1mth2,
            x7thm1: 7.0 * cosio2 - 1.0,
            ..Self::default()
        };
        if perigee_km >= 220.0 && !set.is_deep_space() {
            let cc1sq = cc1 * cc1;
            set.cc5 = 2.0 * bstar * coef1 * ao * omeosq * (1.0 + 2.75 * (etasq + eeta) + eeta * etasq);
            set.d2 = 4.0 * ao * tsi * cc1sq;
            let temp = set.d2 * tsi * cc1 / 3.0;
            set.d3 = (17.0 * ao + sfour) * temp;
            set.d4 = 0.5 * temp * ao * tsi * (221.0 * ao + 31.0 * sfour) * cc1;
            set.t3cof = set.d2 + 2.0 * cc1sq;
            set.t4cof = 0.25 * (3.0 * set.d3 + cc1 * (12.0 * set.d2 + 10.0 * cc1sq));
            set.t5cof = 0.2
                * (3.0 * set.d4
                    + 12.0 * cc1 * set.d3
                    + 6.0 * set.d2 * set.d2
                    + 15.0 * cc1sq * (2.0 * set.d2 + cc1sq));
            if ecco > 1.0e-4 {
                set.delmo = (1.0 + eta * mo.cos()).powi(3);
                set.omgcof = -2.0 * bstar * coef * tsi * (J3 / J2) * no * sinio / ecco * argpo.cos();
                set.xmcof = -2.0 / 3.0 * coef * bstar / eeta;
            }
        }
        Some(set)
    }

    /// Whether the deep-space part of the theory is at work.
    pub(super) fn is_deep_space(&self) -> bool {
        self.no <= TAU / DEEP_SPACE_PERIOD_MIN
    }

    /// Whether the kernel for round orbits will do.
    pub(super) fn is_round(&self) -> bool {
        self.ecco < ECCENTRICITY_BOUND
    }
}

impl Coefficients<Vec<f64>> {
    /// Adds one object to the columns.
    pub(super) fn push(&mut self, one: &Coefficients<f64>) {
        self.ecco.push(one.ecco);
        self.mo.push(one.mo);
        self.mdot.push(one.mdot);
        self.argpo.push(one.argpo);
        self.argpdot.push(one.argpdot);
        self.nodeo.push(one.nodeo);
        self.nodedot.push(one.nodedot);
        self.nodecf.push(one.nodecf);
        self.ao.push(one.ao);
        self.no.push(one.no);
        self.cosio.push(one.cosio);
        self.sinio.push(one.sinio);
        self.cc1.push(one.cc1);
        self.cc4.push(one.cc4);
        self.cc5.push(one.cc5);
        self.d2.push(one.d2);
        self.d3.push(one.d3);
        self.d4.push(one.d4);
        self.t2cof.push(one.t2cof);
        self.t3cof.push(one.t3cof);
        self.t4cof.push(one.t4cof);
        self.t5cof.push(one.t5cof);
        self.eta.push(one.eta);
        self.sinmao.push(one.sinmao);
        self.delmo.push(one.delmo);
        self.omgcof.push(one.omgcof);
        self.xmcof.push(one.xmcof);
        self.aycof.push(one.aycof);
        self.xlcof.push(one.xlcof);
        self.con41.push(one.con41);
        self.x1mth2.push(one.x1mth2);
        self.x7thm1.push(one.x7thm1);
    }
}
