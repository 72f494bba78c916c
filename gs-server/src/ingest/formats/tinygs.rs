//! TinyGS: what a board publishes for each packet, and packets as the HTTP API tells them.

use std::fmt;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use mission::UtcUs;
use mission::reception::{Ear, RadioCrc, Receiver, Refusal, Said, Signal};

use super::tree::{Object, Value};
use super::value::{Fields, hz_of_mhz};
use super::{Context, digest};

/// Stations of one packet that are read.
const STATIONS_MAX: usize = 1_024;

/// A topic of a board: `tinygs/<user>/<station>/<kind>/<name>`. User and station are free text of strangers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// The MQTT user.
    pub user: String,
    /// What its owner calls the station.
    pub station: String,
    /// `tele` or `stat`.
    pub kind: String,
    /// `rx`, `ping`, `welcome`, `status`.
    pub name: String,
}

impl Topic {
    /// The parts of a topic; `None` when it is none of a board.
    pub fn parse(text: &str) -> Option<Self> {
        let parts: Vec<&str> = text.trim().split('/').collect();
        let ["tinygs", user, station, kind @ ("tele" | "stat"), name] = parts[..] else { return None };
        let sound = |part: &str| !part.is_empty() && part.len() <= 64 && !part.contains(['+', '#', '\0']);
        let whole = [user, station, name].into_iter().all(sound);
        whole.then(|| Self {
            user: user.into(),
            station: station.into(),
            kind: kind.into(),
            name: name.into(),
        })
    }
}

impl fmt::Display for Topic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tinygs/{}/{}/{}/{}", self.user, self.station, self.kind, self.name)
    }
}

/// One received packet, as a board publishes it.
pub(super) fn rx(
    topic: Option<&str>,
    object: &Object<'_>,
    body: &[u8],
    context: &Context,
) -> Result<Said, Refusal> {
    let mut said = context.said(Ear::OwnMqtt, digest(&[body]));
    if let Some(topic) = topic.and_then(Topic::parse) {
        if (topic.kind.as_str(), topic.name.as_str()) != ("tele", "rx") {
            return Err(Refusal::NotAReport);
        }
        said.receiver.id.get_or_insert_with(|| format!("{}/{}", topic.user, topic.station));
        said.receiver.name.get_or_insert(topic.station);
    }
    let mut fields = Fields::of(object, said.doubts);
    if let Some((latitude, longitude)) = fields.place("station_location") {
        (said.receiver.latitude_deg, said.receiver.longitude_deg) = (Some(latitude), Some(longitude));
    }
    said.times.board =
        fields.whole("usec_time").or_else(|| fields.whole("unix_GS_time")?.checked_mul(1_000_000)).map(UtcUs);
    if let Some(UtcUs(us)) = said.times.board {
        // With the time first, what came one after another stands together in the archive's index.
        said.source_id = format!("{us:016x}-{}", said.source_id);
    }
    said.signal = Signal {
        frequency_hz: fields.number("frequency").map(hz_of_mhz),
        frequency_offset_hz: fields.number("frequency_offset"),
        doppler_hz: fields.number("f_doppler"),
        frequency_error_hz: fields.number("frequency_error"),
        spreading_factor: fields.small("sf"),
        bandwidth_hz: fields.number("bw").map(|khz| khz * 1e3),
        coding_rate: fields.small("cr"),
        rssi_dbm: fields.number("rssi"),
        snr_db: fields.number("snr"),
    };
    said.radio_crc = crc(fields.truth("crc_error"));
    said.noisy = fields.truth("noisy").unwrap_or(false);
    said.label = fields.text("satellite").map(str::to_owned);
    said.norad = fields.catalogue("NORAD");
    let data = fields.text("data").or_else(|| fields.text("data_raw"));
    said.doubts = fields.doubts;
    said.bytes = match (data, said.radio_crc) {
        (Some(data), _) => Some(unbase64(data)?),
        (None, RadioCrc::Wrong) => None,
        (None, _) => return Err(Refusal::NoBytes),
    };
    said.original = Some(body.into());
    Ok(said)
}

/// A packet as the HTTP API tells it: one reception without a receiver, or one for each station that is listed.
pub(super) fn packet(
    object: &Object<'_>,
    body: &[u8],
    context: &Context,
    take: &mut dyn FnMut(Result<Said, Refusal>),
) {
    let mut fields = Fields::of(object, mission::reception::Doubts::default());
    let bytes = match fields.text("raw").map(unbase64) {
        Some(Ok(bytes)) => bytes,
        Some(Err(reason)) => return take(Err(reason)),
        None => return take(Err(Refusal::NoBytes)),
    };
    let id = fields.text("id").map(str::to_owned);
    let server_ms = fields.whole("serverTime");
    let at = server_ms.unwrap_or(0).to_le_bytes();
    let mut said = context.said(Ear::TinygsApi, id.unwrap_or_else(|| digest(&[&bytes, &at])));
    said.times.server = server_ms.and_then(|ms| ms.checked_mul(1_000)).map(UtcUs);
    said.signal = Signal {
        frequency_hz: fields.number("freq").map(hz_of_mhz),
        spreading_factor: fields.small("sf"),
        bandwidth_hz: fields.number("bw").map(|khz| khz * 1e3),
        coding_rate: fields.small("cr"),
        ..Signal::default()
    };
    said.label = fields.text("satellite").map(str::to_owned);
    said.norad = fields.catalogue("norad");
    said.doubts = fields.doubts;
    said.bytes = Some(bytes);
    let stations = object.get("stations").and_then(Value::as_array).unwrap_or_default();
    if stations.is_empty() {
        if body.len() > super::RECEPTION_MAX {
            return take(Err(Refusal::TooLong));
        }
        said.original = Some(body.into());
        return take(Ok(said));
    }
    let mut original = Some(body.into());
    for station in stations.iter().take(STATIONS_MAX) {
        match station {
            Value::Object(station) => {
                let heard = Said { original: original.take(), ..said.clone() };
                take(Ok(by_station(heard, station)));
            }
            _ => take(Err(Refusal::Malformed)),
        }
    }
}

/// The reception of one of the stations that a packet lists.
fn by_station(mut said: Said, station: &Object<'_>) -> Said {
    let mut fields = Fields::of(station, said.doubts);
    let name = fields.text("name").map(str::to_owned);
    let user = fields.whole("userId");
    let place = fields.place("location");
    said.receiver = Receiver {
        id: name.as_ref().map(|name| user.map_or_else(|| name.clone(), |user| format!("{name}@{user}"))),
        name,
        latitude_deg: place.map(|place| place.0),
        longitude_deg: place.map(|place| place.1),
        altitude_m: None,
    };
    said.times.board = fields.whole("usec_time").map(UtcUs);
    said.radio_crc = crc(fields.truth("crc_error"));
    if said.radio_crc == RadioCrc::Wrong {
        // The bytes are another station's; this one only noticed the packet.
        said.bytes = None;
    }
    said.doubts = fields.doubts;
    if let Some(Value::Object(told)) = station.get("receptionParams") {
        let mut fields = Fields::of(told, said.doubts);
        said.signal.rssi_dbm = fields.number("rssi");
        said.signal.snr_db = fields.number("snr");
        said.signal.frequency_error_hz = fields.number("frequency_error");
        said.doubts = fields.doubts;
    }
    said
}

fn crc(error: Option<bool>) -> RadioCrc {
    match error {
        Some(true) => RadioCrc::Wrong,
        Some(false) => RadioCrc::Right,
        None => RadioCrc::Unknown,
    }
}

fn unbase64(text: &str) -> Result<Vec<u8>, Refusal> {
    // A packet of 256 bytes has 344 characters; nothing longer is decoded.
    if text.len() > 4_096 {
        return Err(Refusal::PacketTooLong);
    }
    STANDARD.decode(text.trim()).map_err(|_| Refusal::BadBytes)
}
