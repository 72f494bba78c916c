//! Which sets of a text belong to which of our satellites: by catalogue number, then by name, never by a guess.

use std::collections::BTreeSet;
use std::fmt;

use mission::SatelliteId;
use tle::Elements;
use tle::Propagator;
use tle::formats::{self, Checksums, Form, Found, SourceError};

use crate::config::Config;

/// How a satellite is found among others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wanted {
    /// The satellite.
    pub satellite: SatelliteId,
    /// Its catalogue number.
    pub norad_cat_id: Option<u32>,
    /// Its name as element sets have it.
    pub object_name: Option<String>,
}

impl Wanted {
    /// Those of a configuration that was checked.
    pub fn of(config: &Config) -> Vec<Self> {
        let satellites = config.satellites.iter().filter_map(|section| {
            Some(Self {
                satellite: SatelliteId::new(&section.name).ok()?,
                norad_cat_id: section.norad_cat_id,
                object_name: section.object_name.clone(),
            })
        });
        satellites.collect()
    }

    fn name(&self) -> &str {
        self.object_name.as_deref().unwrap_or(self.satellite.as_str())
    }
}

/// A text that was read: what is in it and what could not be used.
#[derive(Debug, Clone, PartialEq)]
pub struct SetsOfText {
    /// The form that was recognised.
    pub form: Form,
    /// Good sets, in their order.
    pub sets: Vec<Found>,
    /// Those that could not be used.
    pub refused: Vec<Refused>,
}

/// A set that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// The line of the text, from 1: where the fault is, or where the set begins.
    pub line: usize,
    /// The object, when it could be read.
    pub object: Option<String>,
    /// What is wrong, and the remedy.
    pub error: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}", self.line)?;
        if let Some(object) = &self.object {
            write!(f, " ({object})")?;
        }
        write!(f, ": {}", self.error)
    }
}

impl SetsOfText {
    /// Reads a text. A set that SGP4 does not take is a broken one.
    ///
    /// # Errors
    /// The text as a whole is no elements.
    pub fn read(bytes: &[u8], checksums: Checksums) -> Result<Self, SourceError> {
        let text = formats::text_of(bytes)?;
        let found = formats::sets(&text, checksums)?;
        let mut this = Self { form: found.form(), sets: Vec::new(), refused: Vec::new() };
        for set in found {
            match set {
                Ok(found) => match Propagator::new(&found.elements) {
                    Ok(_) => this.sets.push(found),
                    Err(error) => this.refused.push(Refused {
                        line: found.line,
                        object: Some(found.elements.label()),
                        error: error.to_string(),
                    }),
                },
                Err(error) => this.refused.push(Refused {
                    line: error.line,
                    object: error.object,
                    error: error.fault.to_string(),
                }),
            }
        }
        Ok(this)
    }
}

/// Why a satellite got nothing from a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoMatch {
    /// Nothing with its number or name.
    Absent {
        /// What was sought.
        sought: String,
        /// Sets that were looked at.
        sets: usize,
    },
    /// Several objects have its name.
    Ambiguous {
        /// The name.
        name: String,
        /// Their numbers.
        numbers: Vec<u32>,
    },
    /// Its name, another number.
    OtherNumber {
        /// The name.
        name: String,
        /// The number found.
        found: u32,
        /// The number of the configuration.
        wanted: u32,
    },
}

impl fmt::Display for NoMatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Absent { sought, sets } => {
                write!(f, "{sought} is not among the {sets} sets: look at norad_cat_id and object_name")
            }
            Self::Ambiguous { name, numbers } => {
                write!(f, "several objects are called '{name}' (")?;
                for (at, number) in numbers.iter().take(8).enumerate() {
                    write!(f, "{}{number}", if at == 0 { "" } else { ", " })?;
                }
                write!(f, "): write norad_cat_id into the satellite's section")
            }
            Self::OtherNumber { name, found, wanted } => write!(
                f,
                "'{name}' is object {found} here and norad_cat_id is {wanted}: if the number has changed, write it into the \
                 satellite's section"
            ),
        }
    }
}

fn same_name(a: &str, b: &str) -> bool {
    a.trim().eq_ignore_ascii_case(b.trim())
}

/// The sets of one satellite. With `chosen`, an operator said that they are its: one object alone is taken whatever it is
/// called, unless its number contradicts the configuration.
pub fn sets_of<'a>(wanted: &Wanted, sets: &'a [Found], chosen: bool) -> Result<Vec<&'a Elements>, NoMatch> {
    let all = || sets.iter().map(|found| &found.elements);
    if let Some(number) = wanted.norad_cat_id {
        let by_number: Vec<_> = all().filter(|set| set.norad_cat_id == Some(number)).collect();
        if !by_number.is_empty() {
            return Ok(by_number);
        }
    }
    let by_name: Vec<_> =
        all().filter(|set| set.name.as_deref().is_some_and(|name| same_name(name, wanted.name()))).collect();
    let numbers: BTreeSet<u32> = by_name.iter().filter_map(|set| set.norad_cat_id).collect();
    if let (Some(number), Some(&found)) = (wanted.norad_cat_id, numbers.first()) {
        return Err(NoMatch::OtherNumber { name: wanted.name().to_owned(), found, wanted: number });
    }
    if numbers.len() > 1 {
        let name = wanted.name().to_owned();
        return Err(NoMatch::Ambiguous { name, numbers: numbers.into_iter().collect() });
    }
    if !by_name.is_empty() {
        return Ok(by_name);
    }
    let objects: BTreeSet<_> = all().map(|set| (set.norad_cat_id, set.name.as_deref())).collect();
    // Before it has a number: an object without one, or any when no number is configured.
    let contradicts = |number: Option<u32>| number.is_some() && wanted.norad_cat_id.is_some();
    if chosen && objects.len() == 1 && objects.iter().all(|(number, _)| !contradicts(*number)) {
        return Ok(all().collect());
    }
    let sought = match wanted.norad_cat_id {
        Some(number) => format!("object {number} ('{}')", wanted.name()),
        None => format!("'{}'", wanted.name()),
    };
    Err(NoMatch::Absent { sought, sets: sets.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(objects: &[(&str, Option<u32>)]) -> Vec<Found> {
        let iss = "ISS (ZARYA)\n1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
            2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";
        let one = SetsOfText::read(iss.as_bytes(), Checksums::Strict).unwrap().sets.remove(0);
        objects
            .iter()
            .map(|(name, number)| {
                let mut found = one.clone();
                found.elements.name = Some((*name).to_owned());
                found.elements.norad_cat_id = *number;
                found
            })
            .collect()
    }

    fn wanted(number: Option<u32>, name: Option<&str>) -> Wanted {
        Wanted {
            satellite: SatelliteId::new("sat").unwrap(),
            norad_cat_id: number,
            object_name: name.map(str::to_owned),
        }
    }

    fn taken(wanted: &Wanted, sets: &[Found], chosen: bool) -> Result<Vec<Option<u32>>, NoMatch> {
        Ok(sets_of(wanted, sets, chosen)?.iter().map(|set| set.norad_cat_id).collect())
    }

    #[test]
    fn the_number_goes_before_the_name() {
        let sets = text(&[("SAT", Some(7)), ("OTHER", Some(8)), ("OTHER", Some(8))]);
        assert_eq!(taken(&wanted(Some(8), Some("SAT")), &sets, false), Ok(vec![Some(8), Some(8)]));
        assert_eq!(taken(&wanted(None, None), &sets, false), Ok(vec![Some(7)]), "its own name will do");
        let error = taken(&wanted(Some(9), Some("SAT")), &sets, true).unwrap_err();
        assert_eq!(error, NoMatch::OtherNumber { name: "SAT".into(), found: 7, wanted: 9 });
    }

    #[test]
    fn what_fits_twice_or_not_at_all_is_told_and_not_guessed() {
        let sets = text(&[("OBJECT A", Some(7)), ("OBJECT A", Some(8)), ("OBJECT B", None)]);
        let error = taken(&wanted(None, Some("object a")), &sets, true).unwrap_err();
        assert!(error.to_string().contains("7, 8") && error.to_string().contains("norad_cat_id"), "{error}");
        assert_eq!(taken(&wanted(Some(9), Some("OBJECT B")), &sets, false), Ok(vec![None]));
        let error = taken(&wanted(None, None), &sets, true).unwrap_err();
        assert!(error.to_string().contains("'sat' is not among the 3 sets"), "{error}");
    }

    #[test]
    fn one_object_that_an_operator_chose_is_taken_unless_its_number_contradicts() {
        let sets = text(&[("OBJECT A", Some(7)), ("OBJECT A", Some(7))]);
        assert!(taken(&wanted(None, None), &sets, false).is_err());
        assert_eq!(taken(&wanted(None, None), &sets, true), Ok(vec![Some(7), Some(7)]));
        assert!(taken(&wanted(Some(8), None), &sets, true).is_err());
        assert_eq!(taken(&wanted(Some(8), None), &text(&[("X", None)]), true), Ok(vec![None]));
    }
}
