//! Receptions with a measured frequency, from files: what boards publish, packets of the API, our own export.

use std::fs::File;
use std::io::Read as _;
use std::path::PathBuf;

use serde_json::{Map, Value};
use tle::doppler_fit::Observation;
use tle::{Station, UtcInstant};

use super::Failure;

/// Bytes of a file of receptions.
const FILE_BYTES_MAX: u64 = 256 << 20;
/// Characters of a receiver's name that are kept.
const NAME_MAX: usize = 32;
/// Earlier than this a clock was never set: 2020.
const EARLIEST_US: i64 = 1_577_836_800_000_000;

/// What files hold.
#[derive(Debug, Default)]
pub(super) struct Heard {
    pub(super) receivers: Vec<(String, Station)>,
    pub(super) observations: Vec<Observation>,
    /// A sentence for each that was left out.
    pub(super) refused: Vec<String>,
}

pub(super) fn read(paths: &[PathBuf]) -> Result<Heard, Failure> {
    let mut heard = Heard::default();
    for path in paths {
        let name = path.display();
        let file =
            File::open(path).map_err(|error| Failure::doing(format!("{name} cannot be opened"), error))?;
        let mut text = String::new();
        file.take(FILE_BYTES_MAX + 1)
            .read_to_string(&mut text)
            .map_err(|error| Failure::doing(format!("{name} cannot be read"), error))?;
        if text.len() as u64 > FILE_BYTES_MAX {
            return Err(Failure::failed(format!("{name} is larger than {} MiB", FILE_BYTES_MAX >> 20)));
        }
        heard.add(&text).map_err(|error| Failure::doing(format!("{name} holds no JSON"), error))?;
    }
    Ok(heard)
}

/// One measurement before it has a receiver.
struct Measured {
    name: Option<String>,
    place: (f64, f64, f64),
    at_us: i64,
    nominal_hz: f64,
    applied_hz: f64,
    error_hz: f64,
}

impl Heard {
    fn add(&mut self, text: &str) -> Result<(), serde_json::Error> {
        let values: Vec<Value> = match serde_json::from_str::<Value>(text) {
            Ok(Value::Array(values)) => values,
            Ok(Value::Object(object)) => match object.get("packets") {
                Some(Value::Array(values)) => values.clone(),
                _ => vec![Value::Object(object)],
            },
            Ok(other) => vec![other],
            Err(whole) => {
                let lines = text.lines().filter(|line| !line.trim().is_empty());
                lines.map(serde_json::from_str).collect::<Result<_, _>>().map_err(|_| whole)?
            }
        };
        for (index, value) in values.iter().enumerate() {
            let Some(object) = value.as_object() else {
                self.refused.push(format!("reception {index} is no object"));
                continue;
            };
            for measured in measured(object) {
                if let Err(problem) = measured.and_then(|one| self.take(one)) {
                    self.refused.push(format!("reception {index} {problem}"));
                }
            }
        }
        Ok(())
    }

    fn take(&mut self, one: Measured) -> Result<(), String> {
        if one.at_us < EARLIEST_US {
            return Err("is of a clock that was never set".to_owned());
        }
        if !(1e5..=1e12).contains(&one.nominal_hz) {
            return Err("has no frequency".to_owned());
        }
        let (latitude, longitude, height_m) = one.place;
        let place = Station::new(latitude, longitude, height_m)
            .map_err(|error| format!("was heard nowhere: {error}"))?;
        let name: String = match &one.name {
            Some(name) => name.chars().filter(|c| !c.is_control()).take(NAME_MAX).collect(),
            None => format!("{latitude:.3},{longitude:.3}"),
        };
        let known = self.receivers.iter().position(|(other, at)| *other == name && *at == place);
        let receiver = known.unwrap_or_else(|| {
            self.receivers.push((name, place));
            self.receivers.len() - 1
        });
        self.observations.push(Observation {
            at: UtcInstant::from_unix_us(one.at_us),
            receiver,
            nominal_hz: one.nominal_hz,
            applied_hz: one.applied_hz,
            error_hz: one.error_hz,
        });
        Ok(())
    }
}

/// The measurements of one object, of whichever form it is.
fn measured(object: &Map<String, Value>) -> Vec<Result<Measured, String>> {
    if let Some(Value::Array(stations)) = object.get("stations") {
        let of = |station: &Value| of_api(object, station.as_object().ok_or("names a station that is none")?);
        return stations.iter().map(of).collect();
    }
    if object.contains_key("received_at") { vec![of_export(object)] } else { vec![of_board(object)] }
}

/// What a board publishes.
fn of_board(object: &Map<String, Value>) -> Result<Measured, String> {
    let at_us = whole(object, "usec_time")
        .or_else(|| whole(object, "unix_GS_time")?.checked_mul(1_000_000))
        .ok_or("has no time")?;
    Ok(Measured {
        name: text(object, "station").or_else(|| text(object, "name")),
        place: pair(object, "station_location")?,
        at_us,
        nominal_hz: number(object, "frequency").ok_or("has no frequency")? * 1e6,
        applied_hz: number(object, "f_doppler").unwrap_or(0.0),
        error_hz: number(object, "frequency_error").ok_or("has no frequency_error")?,
    })
}

/// One station of a packet of the API.
fn of_api(packet: &Map<String, Value>, station: &Map<String, Value>) -> Result<Measured, String> {
    let empty = Map::new();
    let signal = station.get("receptionParams").and_then(Value::as_object).unwrap_or(&empty);
    Ok(Measured {
        name: text(station, "name"),
        place: pair(station, "location")?,
        at_us: whole(station, "usec_time").ok_or("has a station without a time")?,
        nominal_hz: number(packet, "freq").ok_or("has no frequency")? * 1e6,
        applied_hz: 0.0,
        error_hz: number(signal, "frequency_error").ok_or("has a station without a frequency_error")?,
    })
}

/// A line of our own export.
fn of_export(object: &Map<String, Value>) -> Result<Measured, String> {
    let receiver = object.get("receiver").and_then(Value::as_object).ok_or("has no receiver")?;
    let at: UtcInstant =
        text(object, "received_at").and_then(|at| at.parse().ok()).ok_or("has no time in received_at")?;
    let place = number(receiver, "latitude_deg")
        .zip(number(receiver, "longitude_deg"))
        .ok_or("is of a receiver whose place nobody knows")?;
    Ok(Measured {
        name: text(receiver, "name").or_else(|| text(receiver, "id")),
        place: (place.0, place.1, number(receiver, "altitude_m").unwrap_or(0.0)),
        at_us: at.unix_us(),
        nominal_hz: number(object, "frequency_hz").ok_or("has no frequency")?,
        applied_hz: number(object, "doppler_hz").unwrap_or(0.0),
        error_hz: number(object, "frequency_error_hz").ok_or("has no frequency_error_hz")?,
    })
}

fn number(object: &Map<String, Value>, key: &str) -> Option<f64> {
    object.get(key)?.as_f64().filter(|value| value.is_finite())
}

fn whole(object: &Map<String, Value>, key: &str) -> Option<i64> {
    object.get(key)?.as_i64()
}

fn text(object: &Map<String, Value>, key: &str) -> Option<String> {
    object.get(key)?.as_str().filter(|text| !text.is_empty()).map(str::to_owned)
}

fn pair(object: &Map<String, Value>, key: &str) -> Result<(f64, f64, f64), String> {
    let array = object.get(key).and_then(Value::as_array);
    let part = |index: usize| array?.get(index)?.as_f64();
    let (latitude, longitude) = part(0).zip(part(1)).ok_or_else(|| format!("has no {key}"))?;
    Ok((latitude, longitude, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_the_api_and_our_export_are_read_and_the_rest_is_told() {
        let mut heard = Heard::default();
        let text = r#"[
            {"station": "Bern", "station_location": [46.95, 7.44], "frequency": 435.0, "f_doppler": 12.5,
             "frequency_error": 1843.2, "usec_time": 1790000000123456, "crc_error": true},
            {"freq": 435.0, "stations": [
                {"name": "Bern", "location": [46.95, 7.44], "usec_time": 1790000001000000,
                 "receptionParams": {"frequency_error": -10.0}},
                {"name": "deaf", "location": [46.95, 7.44], "usec_time": 1790000001000000}]},
            {"pixelsat_reception": 1, "received_at": "2026-09-21T14:13:20.5Z", "frequency_hz": 435000000.0,
             "frequency_error_hz": 77.0, "doppler_hz": null,
             "receiver": {"id": "x@1", "name": null, "latitude_deg": 10.0, "longitude_deg": 20.0, "altitude_m": 300.0}},
            {"station_location": [46.95, 7.44], "frequency": 435.0, "frequency_error": 1.0, "usec_time": 86400000000},
            {"station_location": [99.0, 7.44], "frequency": 435.0, "frequency_error": 1.0, "usec_time": 1790000000123456},
            "text"
        ]"#;
        heard.add(text).unwrap();
        assert_eq!(heard.receivers.len(), 2, "{heard:?}");
        assert_eq!(heard.observations.len(), 3, "{heard:?}");
        assert_eq!(heard.refused.len(), 4, "{heard:?}");
        let first = heard.observations[0];
        assert_eq!((first.nominal_hz, first.applied_hz, first.error_hz), (435e6, 12.5, 1843.2));
        assert_eq!(first.at.unix_us(), 1_790_000_000_123_456);
        assert_eq!(heard.observations[2].error_hz, 77.0);
        assert_eq!(heard.receivers[1].0, "x@1");
    }
}
