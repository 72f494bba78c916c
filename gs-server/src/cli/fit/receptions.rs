//! Receptions with a measured frequency, from files: what boards publish, packets of the API, our own export.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use mission::UtcUs;
use mission::reception::{Admission, Said};
use tle::doppler_fit::Observation;
use tle::{Station, UtcInstant};

use super::Failure;
use crate::ingest::formats::{Context, Format, claims};

/// Bytes of a file of receptions.
const FILE_BYTES_MAX: u64 = 256 << 20;
/// Characters of a receiver's name that are kept.
const NAME_MAX: usize = 32;
/// Earlier than this a clock was never set: 2020.
const EARLIEST: UtcUs = UtcUs(1_577_836_800_000_000);

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
        heard
            .add(&open(path)?)
            .map_err(|error| Failure::doing(format!("{} cannot be read", path.display()), error))?;
    }
    Ok(heard)
}

fn open(path: &Path) -> Result<File, Failure> {
    let name = path.display();
    let failed = |error| Failure::doing(format!("{name} cannot be opened"), error);
    let file = File::open(path).map_err(failed)?;
    if file.metadata().map_err(failed)?.len() > FILE_BYTES_MAX {
        return Err(Failure::failed(format!("{name} is larger than {} MiB", FILE_BYTES_MAX >> 20)));
    }
    Ok(file)
}

impl Heard {
    /// Whose the bytes are is not asked: the elements that are fitted say which satellite it is about.
    fn add(&mut self, reader: impl std::io::Read) -> std::io::Result<()> {
        let reader = BufReader::new(reader.take(FILE_BYTES_MAX));
        claims(Format::Json, reader, &Context::file(Admission::at(EARLIEST)), |said| {
            if let Err(problem) =
                said.map_err(|refused| format!("at {refused}")).and_then(|said| self.take(&said))
            {
                self.refused.push(format!("reception {problem}"));
            }
        })
    }

    fn take(&mut self, said: &Said) -> Result<(), String> {
        let at = said.times.board.or(said.times.stated).ok_or("has no time")?;
        if at < EARLIEST {
            return Err("is of a clock that was never set".to_owned());
        }
        let nominal_hz = said.signal.frequency_hz.filter(|hz| (1e5..=1e12).contains(hz));
        let nominal_hz = nominal_hz.ok_or("has no frequency")?;
        let error_hz = said.signal.frequency_error_hz.ok_or("has no measured frequency error")?;
        let receiver = &said.receiver;
        let (latitude, longitude) = receiver
            .latitude_deg
            .zip(receiver.longitude_deg)
            .ok_or("is of a receiver whose place nobody knows")?;
        let place = Station::new(latitude, longitude, receiver.altitude_m.unwrap_or(0.0))
            .map_err(|error| format!("was heard nowhere: {error}"))?;
        let name: String = match receiver.name.as_ref().or(receiver.id.as_ref()) {
            Some(name) => name.chars().filter(|c| !c.is_control()).take(NAME_MAX).collect(),
            None => format!("{latitude:.3},{longitude:.3}"),
        };
        let known = self.receivers.iter().position(|(other, at)| *other == name && *at == place);
        let receiver = known.unwrap_or_else(|| {
            self.receivers.push((name, place));
            self.receivers.len() - 1
        });
        self.observations.push(Observation {
            at: UtcInstant::from_unix_us(at.0),
            receiver,
            nominal_hz,
            applied_hz: said.signal.doppler_hz.unwrap_or(0.0),
            error_hz,
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_the_api_and_our_export_are_read_and_the_rest_is_told() {
        let mut heard = Heard::default();
        let text = r#"tinygs/me/Bern/tele/rx {"station_location": [46.95, 7.44], "frequency": 435.0, "f_doppler": 12.5, "frequency_error": 1843.2, "usec_time": 1790000000123456, "crc_error": true}
{"freq": 435.0, "raw": "AAAA", "stations": [
                {"name": "Bern", "location": [46.95, 7.44], "usec_time": 1790000001000000,
                 "receptionParams": {"frequency_error": -10.0}},
                {"name": "deaf", "location": [46.95, 7.44], "usec_time": 1790000001000000}]}
[{"pixelsat_reception": 1, "source": "file", "source_id": "1", "received_at": "2026-09-21T14:13:20.5Z", "frequency_hz": 435000000.0,
             "frequency_error_hz": 77.0, "doppler_hz": null,
             "receiver": {"id": "x@1", "name": null, "latitude_deg": 10.0, "longitude_deg": 20.0, "altitude_m": 300.0}},
 {"station_location": [46.95, 7.44], "frequency": 435.0, "frequency_error": 1.0, "usec_time": 86400000000, "data": "AAAA"},
 {"station_location": [99.0, 7.44], "frequency": 435.0, "frequency_error": 1.0, "usec_time": 1790000000123456, "data": "AAAA"}]
text
"#;
        heard.add(text.as_bytes()).unwrap();
        assert_eq!(heard.receivers.len(), 2, "{heard:?}");
        assert_eq!(heard.observations.len(), 3, "{heard:?}");
        assert_eq!(heard.refused.len(), 4, "{heard:?}");
        let first = heard.observations[0];
        assert_eq!((first.nominal_hz, first.applied_hz, first.error_hz), (435e6, 12.5, 1843.2));
        assert_eq!(first.at.unix_us(), 1_790_000_000_123_456);
        assert_eq!(heard.observations[2].error_hz, 77.0);
        assert_eq!((heard.receivers[0].0.as_str(), heard.receivers[1].0.as_str()), ("Bern", "x@1"));
    }

    /// What the program writes of a reception it reads again, with the same measurement.
    #[test]
    fn our_own_export_is_read() {
        let line = r#"{"pixelsat_reception":1,"source":"own-mqtt","source_id":"a","received_at":"2026-09-21T14:13:20.500000Z","frequency_hz":435000000.0,"frequency_error_hz":-3.5,"receiver":{"latitude_deg":10.0,"longitude_deg":20.0}}"#;
        let mut heard = Heard::default();
        heard.add(line.as_bytes()).unwrap();
        assert_eq!((heard.observations[0].error_hz, heard.receivers[0].0.as_str()), (-3.5, "10.000,20.000"));
    }
}
