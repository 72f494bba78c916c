//! The way back: elements as text.

use super::omm::{CONSTANT_KEYS, HEADER_KEYS};
use super::{Form, write_card};
use crate::elements::Elements;
use std::fmt::Write as _;

/// Elements that a form cannot hold.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// A catalogue number beyond Alpha-5.
    #[error(
        "{object}: the catalogue number {found} is greater than {max}, the last that a TLE can hold: write an OMM"
    )]
    NumberTooGreat {
        /// What the object is called.
        object: String,
        /// Its number.
        found: u32,
        /// The greatest that fits.
        max: u32,
    },
    /// A value that has no place in its columns.
    #[error("{object}: {field} does not fit the columns of a TLE, which hold {wanted}: write an OMM")]
    DoesNotFit {
        /// What the object is called.
        object: String,
        /// The field, by its name in an OMM.
        field: &'static str,
        /// What fits.
        wanted: &'static str,
    },
}

/// Writes sets in a form.
///
/// The OMM forms keep every number to its last bit, and further keys; in CSV a comment becomes one line. A TLE holds
/// four decimals of an angle, eight of the mean motion and of the day, no further keys, and the last four and five digits
/// of the element set and revolution numbers.
///
/// # Errors
/// When a TLE cannot hold a set.
pub fn write(form: Form, sets: &[Elements]) -> Result<String, WriteError> {
    match form {
        Form::OmmJson => Ok(json(sets)),
        Form::OmmCsv => Ok(csv(sets)),
        Form::OmmXml => Ok(xml(sets)),
        Form::OmmKvn => Ok(kvn(sets)),
        Form::ThreeLine | Form::TwoLine => {
            let mut text = String::new();
            for set in sets {
                let [first, second] = write_card::pair(set)?;
                if let Some(name) = set.name.as_ref().filter(|_| form == Form::ThreeLine) {
                    // At most 24 characters, and never mistaken for an element line.
                    let name: String = name.chars().filter(|c| !c.is_control()).take(24).collect();
                    let mark = if name.starts_with("0 ") || name.starts_with('#') { "0 " } else { "" };
                    text.push_str(mark);
                    text.push_str(&name);
                    text.push('\n');
                }
                for line in [first, second] {
                    text.push_str(&line);
                    text.push('\n');
                }
            }
            Ok(text)
        }
    }
}

/// Keys of the metadata and of the elements in CelesTrak's order, and their text. `None` where the message did not tell.
fn fields(set: &Elements) -> [(&'static str, Option<String>, Kind); 17] {
    let number = |value: f64| Some(value.to_string());
    [
        ("OBJECT_NAME", set.name.clone(), Kind::Text),
        ("OBJECT_ID", set.object_id.clone(), Kind::Text),
        ("EPOCH", Some(set.epoch.to_string().trim_end_matches('Z').to_owned()), Kind::Text),
        ("MEAN_MOTION", number(set.mean_motion_rev_day), Kind::Number),
        ("ECCENTRICITY", number(set.eccentricity), Kind::Number),
        ("INCLINATION", number(set.inclination_deg), Kind::Number),
        ("RA_OF_ASC_NODE", number(set.raan_deg), Kind::Number),
        ("ARG_OF_PERICENTER", number(set.arg_of_perigee_deg), Kind::Number),
        ("MEAN_ANOMALY", number(set.mean_anomaly_deg), Kind::Number),
        ("EPHEMERIS_TYPE", set.ephemeris_type.map(|kind| kind.to_string()), Kind::Number),
        ("CLASSIFICATION_TYPE", set.classification.map(String::from), Kind::Text),
        ("NORAD_CAT_ID", set.norad_cat_id.map(|id| id.to_string()), Kind::Number),
        ("ELEMENT_SET_NO", set.element_set_no.map(|number| number.to_string()), Kind::Number),
        ("REV_AT_EPOCH", set.rev_at_epoch.map(|number| number.to_string()), Kind::Number),
        ("BSTAR", number(set.bstar), Kind::Number),
        ("MEAN_MOTION_DOT", number(set.mean_motion_dot), Kind::Number),
        ("MEAN_MOTION_DDOT", number(set.mean_motion_ddot), Kind::Number),
    ]
}

/// Which of [`fields`] belong to the XML's `metadata`, to its `meanElements` and to its `tleParameters`.
const METADATA: std::ops::Range<usize> = 0..2;
const MEAN_ELEMENTS: std::ops::Range<usize> = 2..9;
const TLE_PARAMETERS: std::ops::Range<usize> = 9..17;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Text,
    Number,
}

fn json(sets: &[Elements]) -> String {
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    let objects: Vec<String> = sets
        .iter()
        .map(|set| {
            let known = fields(set).into_iter().filter_map(|(key, value, kind)| {
                let value = value?;
                let value = if kind == Kind::Number { value } else { quoted(&value) };
                Some(format!("  {}: {value}", quoted(key)))
            });
            let further =
                set.further.iter().map(|(key, value)| format!("  {}: {}", quoted(key), quoted(value)));
            format!("{{\n{}\n}}", known.chain(further).collect::<Vec<_>>().join(",\n"))
        })
        .collect();
    format!("[{}]\n", objects.join(",\n"))
}

fn csv(sets: &[Elements]) -> String {
    let mut further: Vec<&str> = Vec::new();
    for (key, _) in sets.iter().flat_map(|set| &set.further) {
        if !further.contains(&key.as_str()) {
            further.push(key);
        }
    }
    let cell = |text: &str| {
        let text = text.replace(['\n', '\r'], " ");
        if text.contains([',', '"']) || text.starts_with([' ', '#']) {
            format!("\"{}\"", text.replace('"', "\"\""))
        } else {
            text
        }
    };
    let mut text = String::new();
    let names: Vec<String> = match sets.first() {
        Some(set) => fields(set).iter().map(|(key, ..)| (*key).to_owned()).collect(),
        None => return text,
    };
    let header: Vec<String> = names.into_iter().chain(further.iter().map(|key| cell(key))).collect();
    text.push_str(&header.join(","));
    text.push('\n');
    for set in sets {
        let known = fields(set).into_iter().map(|(_, value, _)| cell(value.as_deref().unwrap_or_default()));
        let own = further.iter().map(|key| further_value(set, key).map(cell).unwrap_or_default());
        text.push_str(&known.chain(own).collect::<Vec<_>>().join(","));
        text.push('\n');
    }
    text
}

fn further_value<'a>(set: &'a Elements, key: &str) -> Option<&'a str> {
    set.further.iter().find(|(own, _)| own == key).map(|(_, value)| value.as_str())
}

fn kvn(sets: &[Elements]) -> String {
    let mut text = String::new();
    let line = |text: &mut String, key: &str, value: &str| {
        let _ = writeln!(text, "{key} = {}", value.replace(['\n', '\r'], " "));
    };
    for set in sets {
        let [version, frames @ ..] = CONSTANT_KEYS;
        line(&mut text, version.0, version.1);
        for comment in further_value(set, "COMMENT").unwrap_or_default().lines() {
            let _ = writeln!(text, "COMMENT {comment}");
        }
        for key in ["CREATION_DATE", "ORIGINATOR"] {
            line(&mut text, key, further_value(set, key).unwrap_or_default());
        }
        let known = fields(set);
        for (index, (key, value, _)) in known.iter().enumerate() {
            if index == METADATA.end {
                for (key, value) in frames {
                    line(&mut text, key, value);
                }
            }
            if let Some(value) = value {
                line(&mut text, key, value);
            }
        }
        for (key, value) in set.further.iter().filter(|(key, _)| !HEADER_KEYS.contains(&key.as_str())) {
            line(&mut text, &format!("USER_DEFINED_{key}"), value);
        }
    }
    text
}

fn xml(sets: &[Elements]) -> String {
    let escape = |text: &str| quick_xml::escape::escape(text).into_owned();
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<ndm>\n");
    for set in sets {
        let known = fields(set);
        let leaves = |range: std::ops::Range<usize>| {
            known.get(range).unwrap_or_default().iter().fold(String::new(), |mut leaves, (key, value, _)| {
                if let Some(value) = value {
                    let _ = write!(leaves, "<{key}>{}</{key}>", escape(value));
                }
                leaves
            })
        };
        let header = HEADER_KEYS.iter().fold(String::new(), |mut header, key| {
            for line in further_value(set, key).unwrap_or_default().lines() {
                let _ = write!(header, "<{key}>{}</{key}>", escape(line));
            }
            header
        });
        let constants = CONSTANT_KEYS[1..].iter().fold(String::new(), |mut constants, (key, value)| {
            let _ = write!(constants, "<{key}>{value}</{key}>");
            constants
        });
        let own = set.further.iter().filter(|(key, _)| !HEADER_KEYS.contains(&key.as_str()));
        let own = own.fold(String::new(), |mut own, (key, value)| {
            let _ =
                write!(own, "<USER_DEFINED parameter=\"{}\">{}</USER_DEFINED>", escape(key), escape(value));
            own
        });
        let own = if own.is_empty() {
            own
        } else {
            format!("<userDefinedParameters>{own}</userDefinedParameters>")
        };
        let _ = write!(
            text,
            "<omm id=\"CCSDS_OMM_VERS\" version=\"{}\"><header>{header}</header><body><segment>\n\
             <metadata>{}{constants}</metadata>\n<data><meanElements>{}</meanElements>\n\
             <tleParameters>{}</tleParameters>{own}</data></segment></body></omm>\n",
            CONSTANT_KEYS[0].1,
            leaves(METADATA),
            leaves(MEAN_ELEMENTS),
            leaves(TLE_PARAMETERS),
        );
    }
    text.push_str("</ndm>\n");
    text
}
