//! A named station, and how one is written in an argument.

use std::str::FromStr;

use tle::Station;
use tle::station::StationError;

/// A station with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// What it is called.
    pub name: String,
    /// Where it stands, and its horizon.
    pub station: Station,
}

/// Text that is no station.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlaceError {
    /// Not three numbers.
    #[error(
        "'{found}' is no station: write LATITUDE,LONGITUDE,HEIGHT in decimal degrees and metres, such as 46.5191,6.5668,410, or \
         NAME=46.5191,6.5668,410"
    )]
    Form {
        /// The text.
        found: String,
    },
    /// No place on Earth.
    #[error("station '{found}': {error}")]
    Coordinates {
        /// The text.
        found: String,
        /// Which coordinate, and what it may be.
        error: StationError,
    },
}

impl FromStr for Place {
    type Err = PlaceError;

    /// Reads `LAT,LON,HEIGHT_M` or `NAME=LAT,LON,HEIGHT_M`. Without a name the coordinates are the name.
    fn from_str(text: &str) -> Result<Self, PlaceError> {
        let no_station = || PlaceError::Form { found: text.chars().take(80).collect() };
        let (name, numbers) = match text.rsplit_once('=') {
            Some((name, numbers)) => (name.trim(), numbers.trim()),
            None => (text.trim(), text.trim()),
        };
        let mut values = numbers.split(',').map(|number| number.trim().parse::<f64>());
        let mut next = || values.next().and_then(Result::ok).ok_or_else(no_station);
        let (latitude, longitude, height) = (next()?, next()?, next()?);
        let too_long = name.chars().count() > 80 || name.chars().any(char::is_control);
        if values.next().is_some() || name.is_empty() || too_long {
            return Err(no_station());
        }
        let station = Station::new(latitude, longitude, height)
            .map_err(|error| PlaceError::Coordinates { found: text.to_owned(), error })?;
        Ok(Self { name: name.to_owned(), station })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn station_is_three_numbers_with_or_without_a_name() {
        let place: Place = "Lausanne=46.5191, 6.5668,410".parse().unwrap();
        assert_eq!((place.name.as_str(), place.station.height_m()), ("Lausanne", 410.0));
        let place: Place = "-33.9,151.2,0".parse().unwrap();
        assert_eq!((place.name.as_str(), place.station.latitude_deg()), ("-33.9,151.2,0", -33.9));
        for wrong in ["", "46.5,6.5", "46.5,6.5,410,1", "46,5 6,5 410", "=1,2,3", "46.5N,6.5E,410"] {
            let error = wrong.parse::<Place>().unwrap_err();
            assert!(matches!(error, PlaceError::Form { .. }), "{wrong}: {error}");
        }
        let error = "91,0,0".parse::<Place>().unwrap_err().to_string();
        assert!(error.contains("latitude 91") && error.contains("-90 to 90"), "{error}");
        assert!("nan,0,0".parse::<Place>().is_err());
    }
}
