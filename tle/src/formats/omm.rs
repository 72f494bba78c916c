//! The keys of an OMM (CCSDS 502.0) and their values, whatever form they came in, to elements.

use super::{Found, SetError, SetFault, Warning, excerpt};
use crate::elements::Elements;
use crate::formats::CATALOGUE_MAX;
use crate::propagator::SGP4_MU_KM3_S2;
use crate::time::UtcInstant;

/// One key of a set with its text, and where it stands.
#[derive(Debug)]
pub(super) struct Field {
    pub(super) key: String,
    pub(super) value: String,
    pub(super) line: usize,
}

/// Keys that are always the same in an OMM for SGP4: checked when read, written from here.
pub(super) const CONSTANT_KEYS: [(&str, &str); 5] = [
    ("CCSDS_OMM_VERS", "2.0"),
    ("CENTER_NAME", "EARTH"),
    ("REF_FRAME", "TEME"),
    ("TIME_SYSTEM", "UTC"),
    ("MEAN_ELEMENT_THEORY", "SGP4"),
];

/// Keys of the header, in their order.
pub(super) const HEADER_KEYS: [&str; 3] = ["COMMENT", "CREATION_DATE", "ORIGINATOR"];

/// Fields that a set may have: the richest message in the wild has about fifty.
const FIELDS_MAX: usize = 1000;

/// Collects the fields of a set and makes elements of them.
#[derive(Debug, Default)]
pub(super) struct Fields {
    /// The line on which the set begins.
    pub(super) line: usize,
    fields: Vec<Field>,
}

impl Fields {
    pub(super) fn new(line: usize) -> Self {
        Self { line, fields: Vec::new() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.fields.is_empty()
    }

    /// Adds a field. Empty values tell nothing and are left out.
    pub(super) fn push(&mut self, key: &str, value: &str, line: usize) {
        let (key, value) = (key.trim(), value.trim());
        if !value.is_empty() {
            self.fields.push(Field { key: key.to_owned(), value: value.to_owned(), line });
        }
    }

    /// The object of these fields, for messages.
    pub(super) fn object(&self) -> Option<String> {
        let of =
            |key: &str| self.fields.iter().find(|field| field.key == key).map(|field| excerpt(&field.value));
        of("OBJECT_NAME").or_else(|| of("NORAD_CAT_ID")).or_else(|| of("OBJECT_ID"))
    }

    pub(super) fn error(&self, line: usize, fault: SetFault) -> SetError {
        SetError { line, object: self.object(), fault }
    }

    /// Makes elements of the fields.
    pub(super) fn assemble(mut self) -> Result<Found, SetError> {
        let line = self.line;
        let object = self.object();
        let mut at = line;
        if self.fields.len() > FIELDS_MAX {
            let said = format!("the set has more than {FIELDS_MAX} fields");
            return Err(self.error(line, SetFault::Syntax { form: "OMM", said }));
        }
        self.take_all(&mut at).map_err(|fault| SetError { line: at, object, fault })
    }

    fn take_all(&mut self, at: &mut usize) -> Result<Found, SetFault> {
        self.refuse_other_theories(at)?;
        let ephemeris_type = self.whole("EPHEMERIS_TYPE", 255, "a number from 0 to 255", at)?;
        if ephemeris_type == Some(4) {
            return Err(SetFault::Theory { found: "SGP4-XP (EPHEMERIS_TYPE 4)".to_owned() });
        }
        let epoch = self.take("EPOCH", at)?.ok_or(SetFault::Missing { field: "EPOCH" })?;
        let epoch: UtcInstant = epoch.parse().map_err(|_| SetFault::Value {
            field: "EPOCH".to_owned(),
            found: excerpt(&epoch),
            wanted: "an instant in UTC such as 2026-11-22T05:19:25.123456",
        })?;
        let mean_motion_rev_day = match self.number("MEAN_MOTION", at)? {
            Some(mean_motion) => mean_motion,
            None => self
                .number("SEMI_MAJOR_AXIS", at)?
                .map(mean_motion_of_axis)
                .ok_or(SetFault::Missing { field: "MEAN_MOTION" })?,
        };
        let mut elements = Elements {
            epoch,
            mean_motion_rev_day,
            eccentricity: self.wanted("ECCENTRICITY", at)?,
            inclination_deg: self.wanted("INCLINATION", at)?,
            raan_deg: self.wanted("RA_OF_ASC_NODE", at)?,
            arg_of_perigee_deg: self.wanted("ARG_OF_PERICENTER", at)?,
            mean_anomaly_deg: self.wanted("MEAN_ANOMALY", at)?,
            bstar: self.wanted("BSTAR", at)?,
            mean_motion_dot: self.number("MEAN_MOTION_DOT", at)?.unwrap_or(0.0),
            mean_motion_ddot: self.number("MEAN_MOTION_DDOT", at)?.unwrap_or(0.0),
            norad_cat_id: self.whole("NORAD_CAT_ID", CATALOGUE_MAX, "up to nine digits", at)?,
            element_set_no: self.whole("ELEMENT_SET_NO", u32::MAX, "a whole number", at)?,
            rev_at_epoch: self.whole("REV_AT_EPOCH", u32::MAX, "a whole number", at)?,
            ephemeris_type: ephemeris_type.and_then(|number| u8::try_from(number).ok()),
            classification: self.classification(at)?,
            name: self.take("OBJECT_NAME", at)?,
            object_id: self.take("OBJECT_ID", at)?,
            further: Vec::new(),
        };
        *at = self.line;
        refuse_out_of_range(&elements)?;
        elements.further = self.rest(at)?;
        let warnings = elements.ephemeris_type.filter(|&number| number != 0);
        let warnings = warnings.map(|found| Warning::EphemerisType { found }).into_iter().collect();
        Ok(Found { elements, line: self.line, warnings })
    }

    /// Whatever is left, the header's keys first, several comments as the lines of one.
    fn rest(&mut self, at: &mut usize) -> Result<Vec<(String, String)>, SetFault> {
        let mut further: Vec<(String, String)> = Vec::new();
        for field in self.fields.drain(..) {
            match further.iter_mut().find(|(key, _)| *key == field.key) {
                None => further.push((field.key, field.value)),
                Some((key, text)) if key == "COMMENT" => {
                    text.push('\n');
                    text.push_str(&field.value);
                }
                Some((key, _)) => {
                    *at = field.line;
                    return Err(SetFault::Twice { field: excerpt(key) });
                }
            }
        }
        let rank =
            |key: &str| HEADER_KEYS.iter().position(|header| *header == key).unwrap_or(HEADER_KEYS.len());
        further.sort_by_key(|(key, _)| rank(key));
        Ok(further)
    }

    /// Frames, time systems and theories that must not be given to SGP4.
    fn refuse_other_theories(&mut self, at: &mut usize) -> Result<(), SetFault> {
        self.take("CCSDS_OMM_VERS", at)?;
        for (key, wanted) in [("CENTER_NAME", "EARTH"), ("REF_FRAME", "TEME"), ("TIME_SYSTEM", "UTC")] {
            if let Some(found) = self.take(key, at)?
                && !found.eq_ignore_ascii_case(wanted)
            {
                return Err(SetFault::Value { field: key.to_owned(), found: excerpt(&found), wanted });
            }
        }
        if let Some(theory) = self.take("MEAN_ELEMENT_THEORY", at)? {
            let known = ["SGP4", "SGP/SGP4", "SGP4/SDP4", "SDP4"];
            if !known.iter().any(|name| theory.eq_ignore_ascii_case(name)) {
                return Err(SetFault::Theory { found: excerpt(&theory) });
            }
        }
        let has = |fields: &[Field], key: &str| fields.iter().any(|field| field.key == key);
        for key in ["BTERM", "AGOM"] {
            if has(&self.fields, key) && !has(&self.fields, "BSTAR") {
                return Err(SetFault::Theory { found: format!("SGP4-XP ({key} instead of BSTAR)") });
            }
        }
        Ok(())
    }

    /// Takes a field out; it must stand there once.
    fn take(&mut self, key: &str, at: &mut usize) -> Result<Option<String>, SetFault> {
        let Some(index) = self.fields.iter().position(|field| field.key == key) else {
            *at = self.line;
            return Ok(None);
        };
        let field = self.fields.remove(index);
        *at = field.line;
        if let Some(again) = self.fields.iter().find(|field| field.key == key) {
            *at = again.line;
            return Err(SetFault::Twice { field: key.to_owned() });
        }
        Ok(Some(field.value))
    }

    fn number(&mut self, key: &str, at: &mut usize) -> Result<Option<f64>, SetFault> {
        let Some(text) = self.take(key, at)? else { return Ok(None) };
        // "inf" and "nan" parse too, and are no elements.
        let plain = text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E'));
        match text.parse::<f64>() {
            // + 0.0 makes -0 a plain 0.
            Ok(number) if plain && number.is_finite() => Ok(Some(number + 0.0)),
            _ => Err(SetFault::Value { field: key.to_owned(), found: excerpt(&text), wanted: "a number" }),
        }
    }

    fn wanted(&mut self, key: &'static str, at: &mut usize) -> Result<f64, SetFault> {
        self.number(key, at)?.ok_or(SetFault::Missing { field: key })
    }

    fn whole(
        &mut self,
        key: &str,
        max: u32,
        wanted: &'static str,
        at: &mut usize,
    ) -> Result<Option<u32>, SetFault> {
        let Some(text) = self.take(key, at)? else { return Ok(None) };
        let number = text.parse::<u32>().ok().filter(|&number| number <= max && !text.starts_with('+'));
        match number {
            Some(number) => Ok(Some(number)),
            None => Err(SetFault::Value { field: key.to_owned(), found: excerpt(&text), wanted }),
        }
    }

    fn classification(&mut self, at: &mut usize) -> Result<Option<char>, SetFault> {
        let Some(text) = self.take("CLASSIFICATION_TYPE", at)? else { return Ok(None) };
        match text.as_str() {
            "U" => Ok(Some('U')),
            "C" => Ok(Some('C')),
            "S" => Ok(Some('S')),
            _ => Err(SetFault::Value {
                field: "CLASSIFICATION_TYPE".to_owned(),
                found: excerpt(&text),
                wanted: "U, C or S",
            }),
        }
    }
}

/// Mean motion in rev/day of a semi-major axis in km, as the OMM standard relates them.
fn mean_motion_of_axis(axis_km: f64) -> f64 {
    (SGP4_MU_KM3_S2 / axis_km.powi(3)).sqrt() * 86_400.0 / std::f64::consts::TAU
}

/// Numbers that describe no orbit.
pub(super) fn refuse_out_of_range(elements: &Elements) -> Result<(), SetFault> {
    let turn = |key, degrees: f64| (key, degrees, (-360.0..=360.0).contains(&degrees), "an angle in degrees");
    let checks = [
        (
            "MEAN_MOTION",
            elements.mean_motion_rev_day,
            elements.mean_motion_rev_day.is_finite() && elements.mean_motion_rev_day > 0.0,
            "more than 0 rev/day",
        ),
        ("ECCENTRICITY", elements.eccentricity, (0.0..1.0).contains(&elements.eccentricity), "0 to below 1"),
        (
            "INCLINATION",
            elements.inclination_deg,
            (0.0..=180.0).contains(&elements.inclination_deg),
            "0 to 180 degrees",
        ),
        turn("RA_OF_ASC_NODE", elements.raan_deg),
        turn("ARG_OF_PERICENTER", elements.arg_of_perigee_deg),
        turn("MEAN_ANOMALY", elements.mean_anomaly_deg),
    ];
    for (field, value, fits, wanted) in checks {
        if !fits {
            return Err(SetFault::Value { field: field.to_owned(), found: value.to_string(), wanted });
        }
    }
    Ok(())
}
