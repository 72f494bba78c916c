//! The request for a reception, byte for byte.

use mission::SatelliteId;
use reqwest::Url;
use serde_json::json;

use crate::config::ForwardKind;
use crate::storage::{ForwardRow, ForwardSubject};

/// What we call ourselves.
const VERSION: &str = concat!("PixelSat Ground ", env!("CARGO_PKG_VERSION"));

/// A time that is not known so well is no time of a reception for SiDS, microseconds.
const TIME_ERROR_MAX_US: i64 = 5_000_000;

/// What stands in every request of a target.
#[derive(Debug, Clone)]
pub(crate) struct Sender {
    pub(crate) kind: ForwardKind,
    /// Where our own radio stands.
    pub(crate) place: Option<Place>,
    /// Catalogue numbers.
    pub(crate) numbers: Vec<(SatelliteId, u32)>,
    /// Time, satellite or radio are made up.
    pub(crate) simulated: bool,
}

/// Where something was heard, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    pub(crate) latitude_deg: f64,
    pub(crate) longitude_deg: f64,
}

/// A request without its secrets.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Form {
    pub(crate) content_type: &'static str,
    pub(crate) body: String,
}

impl Sender {
    /// What is sent for this reception; or why nothing can be.
    pub(crate) fn form(&self, row: &ForwardRow, subject: &ForwardSubject) -> Result<Form, String> {
        let number =
            self.numbers.iter().find(|(id, _)| id.as_str() == row.satellite).map(|(_, number)| *number);
        let place = self.place(subject);
        match self.kind {
            ForwardKind::Sids => {
                let number = number.ok_or_else(|| format!("{} has no norad_cat_id", row.satellite))?;
                let place = place.ok_or("nobody said where its receiver stands")?;
                let error_us = subject.outside.as_deref().map_or(Some(0), |outside| outside.time_error_us);
                if error_us.is_none_or(|error_us| error_us > TIME_ERROR_MAX_US) {
                    return Err("its time is not known to 5 s".to_owned());
                }
                Ok(sids(row, subject, number, place))
            }
            ForwardKind::Webhook => Ok(self.webhook(row, subject, number, place)),
        }
    }

    fn place(&self, subject: &ForwardSubject) -> Option<Place> {
        match &subject.outside {
            None => self.place,
            Some(outside) => outside
                .latitude_deg
                .zip(outside.longitude_deg)
                .map(|(latitude_deg, longitude_deg)| Place { latitude_deg, longitude_deg }),
        }
    }

    fn webhook(
        &self,
        row: &ForwardRow,
        subject: &ForwardSubject,
        number: Option<u32>,
        place: Option<Place>,
    ) -> Form {
        let outside = subject.outside.as_deref();
        let body = json!({
            "type": "frame.received",
            "id": row.message_id,
            "timestamp": api::Time::from_unix_us(row.made_at_us),
            "data": {
                "satellite": row.satellite,
                "norad_cat_id": number,
                "frame": hex(&subject.frame.bytes),
                "packet_type": subject.frame.packet_type,
                "received_at": api::Time::from_unix_us(row.received_at_us),
                "time_basis": outside.map_or("station", |outside| outside.time_basis.as_str()),
                "time_error_s": outside.and_then(|outside| Some(outside.time_error_us? as f64 / 1e6)),
                "receiver": row.receiver,
                "source": row.source,
                "station": row.station,
                "latitude_deg": place.map(|place| place.latitude_deg),
                "longitude_deg": place.map(|place| place.longitude_deg),
                "rssi_dbm": subject.rssi_dbm,
                "snr_db": outside.and_then(|outside| outside.snr_db),
                "frequency_error_hz": outside.and_then(|outside| outside.frequency_error_hz),
                "simulated": self.simulated,
            },
        });
        Form { content_type: "application/json", body: body.to_string() }
    }
}

impl Place {
    /// `12.97100N` and `77.59400E`.
    fn words(self) -> (String, String) {
        // East of 180 degrees is west.
        let longitude_deg = (self.longitude_deg + 180.0).rem_euclid(360.0) - 180.0;
        let letter = |deg: f64, positive, negative| if deg < 0.0 { negative } else { positive };
        (
            format!("{:.5}{}", self.latitude_deg.abs(), letter(self.latitude_deg, 'N', 'S')),
            format!("{:.5}{}", longitude_deg.abs(), letter(longitude_deg, 'E', 'W')),
        )
    }
}

/// The fields of the convention, in its order.
fn sids(row: &ForwardRow, subject: &ForwardSubject, number: u32, place: Place) -> Form {
    let (latitude, longitude) = place.words();
    let at = jiff::Timestamp::from_microsecond(row.received_at_us).unwrap_or_default();
    let fields = [
        ("noradID", number.to_string()),
        ("source", row.receiver.chars().take(45).collect()),
        ("timestamp", format!("{at:.3}")),
        ("frame", hex(&subject.frame.bytes)),
        ("locator", "longLat".to_owned()),
        ("longitude", longitude),
        ("latitude", latitude),
        ("version", VERSION.to_owned()),
    ];
    // A query is written as a form is.
    let query = Url::parse_with_params("http://form/", fields).ok();
    let body = query.as_ref().and_then(Url::query).unwrap_or_default().to_owned();
    Form { content_type: "application/x-www-form-urlencoded", body }
}

fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write as _;
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
        let _ = write!(text, "{byte:02X}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_written_with_letters() {
        let words = |latitude_deg, longitude_deg| Place { latitude_deg, longitude_deg }.words();
        assert_eq!(words(12.971, 77.594), ("12.97100N".into(), "77.59400E".into()));
        assert_eq!(words(-33.9, 288.5), ("33.90000S".into(), "71.50000W".into()));
        assert_eq!(words(0.0, 360.0), ("0.00000N".into(), "0.00000E".into()));
    }
}
