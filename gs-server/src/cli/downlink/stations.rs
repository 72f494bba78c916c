//! Stations of the public network, from a file.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use mission::UtcUs;
use mission::downlink::{LISTENERS_MAX, Listener};
use serde_json::{Map, Value};
use tle::Station;

use super::Failure;

/// Bytes of a file of stations.
const FILE_BYTES_MAX: u64 = 64 << 20;
/// Characters of a station's name that are kept.
const NAME_MAX: usize = 64;

/// What a file holds.
#[derive(Debug, Default)]
pub(super) struct Listed {
    pub(super) listeners: Vec<Listener>,
    /// A sentence for each that was left out.
    pub(super) refused: Vec<String>,
}

pub(super) fn read(path: &Path) -> Result<Listed, Failure> {
    let name = path.display();
    let file = File::open(path).map_err(|error| Failure::doing(format!("{name} cannot be opened"), error))?;
    let mut text = String::new();
    file.take(FILE_BYTES_MAX + 1)
        .read_to_string(&mut text)
        .map_err(|error| Failure::doing(format!("{name} cannot be read"), error))?;
    if text.len() as u64 > FILE_BYTES_MAX {
        return Err(Failure::failed(format!("{name} is larger than {} MiB", FILE_BYTES_MAX >> 20)));
    }
    let listed = of_text(&text).map_err(|error| Failure::doing(format!("{name} holds no JSON"), error))?;
    if listed.listeners.is_empty() {
        return Err(Failure::failed(format!("{name} has no station with a place")));
    }
    if listed.listeners.len() > LISTENERS_MAX {
        return Err(Failure::usage(format!(
            "{name} has {} stations, more than {LISTENERS_MAX}: choose those below the ground track",
            listed.listeners.len()
        )));
    }
    Ok(listed)
}

/// An array, an object with the array in it, or an object a line.
fn of_text(text: &str) -> Result<Listed, serde_json::Error> {
    let values: Vec<Value> = match serde_json::from_str::<Value>(text) {
        Ok(Value::Array(values)) => values,
        Ok(Value::Object(object)) => match object.get("stations") {
            Some(Value::Array(values)) => values.clone(),
            _ => vec![Value::Object(object)],
        },
        Ok(other) => vec![other],
        Err(whole) => {
            let lines = text.lines().filter(|line| !line.trim().is_empty());
            lines.map(serde_json::from_str).collect::<Result<_, _>>().map_err(|_| whole)?
        }
    };
    let mut listed = Listed::default();
    for (index, value) in values.iter().enumerate() {
        match value.as_object().ok_or("is no object".to_owned()).and_then(listener) {
            Ok(listener) => listed.listeners.push(listener),
            Err(problem) => listed.refused.push(format!("station {index} {problem}")),
        }
    }
    Ok(listed)
}

fn listener(object: &Map<String, Value>) -> Result<Listener, String> {
    let number = |key: &str| object.get(key).and_then(Value::as_f64);
    let pair = object.get("location").or_else(|| object.get("station_location")).and_then(Value::as_array);
    let part = |index: usize| pair?.get(index)?.as_f64();
    let (latitude, longitude) = part(0)
        .zip(part(1))
        .or_else(|| number("latitude_deg").zip(number("longitude_deg")))
        .ok_or("has no location: give [latitude, longitude] in degrees")?;
    let height_m = number("altitude_m").unwrap_or(0.0);
    let place =
        Station::new(latitude, longitude, height_m).map_err(|error| format!("stands nowhere: {error}"))?;
    let name = object.get("name").and_then(Value::as_str).unwrap_or("unnamed");
    let success = number("success");
    if success.is_some_and(|share| !(0.0..=1.0).contains(&share)) {
        return Err("has a success outside 0 to 1".to_owned());
    }
    Ok(Listener {
        name: name.chars().filter(|c| !c.is_control()).take(NAME_MAX).collect(),
        place,
        last_seen: object.get("lastSeen").and_then(Value::as_i64).map(|ms| UtcUs(ms.saturating_mul(1000))),
        success,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn list_of_tinygs_is_read_and_what_has_no_place_is_left_out() {
        let text = r#"[
            {"name": "Bern_1", "userId": 5, "status": 1, "location": [46.95, 7.44], "lastSeen": 1790000000000,
             "confirmedPackets": 12000, "test": false},
            {"name": "nowhere", "location": [95.0, 7.44]},
            {"name": "lost"},
            {"name": "own", "latitude_deg": 47.0, "longitude_deg": 8.0, "altitude_m": 420, "success": 0.8},
            7
        ]"#;
        let listed = of_text(text).unwrap();
        assert_eq!(listed.listeners.len(), 2, "{listed:?}");
        assert_eq!(listed.refused.len(), 3, "{listed:?}");
        assert_eq!(listed.listeners[0].last_seen, Some(UtcUs(1_790_000_000_000_000)));
        assert_eq!((listed.listeners[0].success, listed.listeners[1].success), (None, Some(0.8)));
        let lines = "{\"name\":\"a\",\"location\":[1,2]}\n\n{\"name\":\"b\",\"location\":[3,4]}\n";
        assert_eq!(of_text(lines).unwrap().listeners.len(), 2);
        assert!(of_text("[1,").is_err());
    }
}
