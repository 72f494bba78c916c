//! Mean elements of one object, as an OMM or a TLE gives them.

use crate::time::UtcInstant;

/// SGP4 mean elements: one OMM (CCSDS 502.0) with the theory SGP4, the frame TEME and UTC, or one TLE.
///
/// Numbers are those of the message, in its units, so that reading, writing and reading again keeps every one of them.
/// `None` means that the message did not tell.
#[derive(Debug, Clone, PartialEq)]
pub struct Elements {
    /// OBJECT_NAME; a TLE has it on the line before, without the leading `0 `.
    pub name: Option<String>,
    /// OBJECT_ID, the international designator with the full year: `1998-067A`.
    pub object_id: Option<String>,
    /// NORAD_CAT_ID, up to nine digits.
    pub norad_cat_id: Option<u32>,
    /// EPOCH of the elements.
    pub epoch: UtcInstant,
    /// MEAN_MOTION in revolutions per day, by Kozai's definition.
    pub mean_motion_rev_day: f64,
    /// ECCENTRICITY, at least 0 and below 1.
    pub eccentricity: f64,
    /// INCLINATION in degrees, 0 to 180.
    pub inclination_deg: f64,
    /// RA_OF_ASC_NODE in degrees.
    pub raan_deg: f64,
    /// ARG_OF_PERICENTER in degrees.
    pub arg_of_perigee_deg: f64,
    /// MEAN_ANOMALY in degrees.
    pub mean_anomaly_deg: f64,
    /// BSTAR in 1/Earth radii: the drag term that SGP4 uses.
    pub bstar: f64,
    /// MEAN_MOTION_DOT as it stands in the message: half the first derivative, rev/day^2. SGP4 does not use it.
    pub mean_motion_dot: f64,
    /// MEAN_MOTION_DDOT as it stands in the message: a sixth of the second derivative, rev/day^3. SGP4 does not use it.
    pub mean_motion_ddot: f64,
    /// EPHEMERIS_TYPE: 0 or absent in public sets. 4 (SGP4-XP) is refused when read.
    pub ephemeris_type: Option<u8>,
    /// CLASSIFICATION_TYPE: U, C or S.
    pub classification: Option<char>,
    /// ELEMENT_SET_NO, counted by the publisher.
    pub element_set_no: Option<u32>,
    /// REV_AT_EPOCH, revolutions since launch.
    pub rev_at_epoch: Option<u32>,
    /// Whatever else the message said (COMMENT, CREATION_DATE, ORIGINATOR, RCS_SIZE ...), key and text as found, in
    /// the order found. The forms of OMM carry it; a TLE cannot.
    pub further: Vec<(String, String)>,
}

impl Elements {
    /// What to call the object: its name, else its catalogue number, else its designator. Control characters, with which
    /// a name could write anything on a terminal, are left out.
    #[must_use]
    pub fn label(&self) -> String {
        match (&self.name, self.norad_cat_id, &self.object_id) {
            (Some(name), ..) => name.chars().filter(|c| !c.is_control()).collect(),
            (None, Some(id), _) => format!("object {id}"),
            (None, None, Some(id)) => id.clone(),
            (None, None, None) => "unnamed object".to_owned(),
        }
    }

    /// One revolution in minutes.
    #[must_use]
    pub fn period_min(&self) -> f64 {
        1440.0 / self.mean_motion_rev_day
    }

    /// How old the elements are at an instant, in days; negative before their epoch.
    #[must_use]
    pub fn age_days(&self, at: UtcInstant) -> f64 {
        at.seconds_since(self.epoch) / 86_400.0
    }
}

/// Of several sets of one object, the one to use for an instant: the newest whose epoch is not after it, else the one
/// with the nearest epoch. Of two with the same epoch, the later in the list.
#[must_use]
pub fn best_for(sets: &[Elements], at: UtcInstant) -> Option<&Elements> {
    let newest_before = sets.iter().filter(|set| set.epoch <= at).max_by_key(|set| set.epoch);
    newest_before.or_else(|| sets.iter().rev().min_by_key(|set| set.epoch))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(epoch_s: i64, name: &str) -> Elements {
        Elements {
            name: Some(name.to_owned()),
            object_id: None,
            norad_cat_id: None,
            epoch: UtcInstant::from_unix_us(epoch_s * 1_000_000),
            mean_motion_rev_day: 15.0,
            eccentricity: 0.0,
            inclination_deg: 97.0,
            raan_deg: 0.0,
            arg_of_perigee_deg: 0.0,
            mean_anomaly_deg: 0.0,
            bstar: 0.0,
            mean_motion_dot: 0.0,
            mean_motion_ddot: 0.0,
            ephemeris_type: None,
            classification: None,
            element_set_no: None,
            rev_at_epoch: None,
            further: Vec::new(),
        }
    }

    #[test]
    fn newest_set_at_or_before_the_instant_is_used_else_the_nearest() {
        let sets = [set(300, "c"), set(100, "a"), set(200, "b"), set(100, "a again")];
        let used =
            |at_s: i64| best_for(&sets, UtcInstant::from_unix_us(at_s * 1_000_000)).map(Elements::label);
        assert_eq!(used(50).as_deref(), Some("a again"));
        assert_eq!(used(100).as_deref(), Some("a again"));
        assert_eq!(used(250).as_deref(), Some("b"));
        assert_eq!(used(999).as_deref(), Some("c"));
        assert_eq!(best_for(&[], UtcInstant::from_unix_us(0)), None);
    }
}
