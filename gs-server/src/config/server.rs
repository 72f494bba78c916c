//! Sections about the server itself: station, storage, http, log, simulation.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use mission::config::Times;
use mission::schedule::Window;
use mission::{Site, UtcUs};
use serde::Deserialize;
use tle::station::StationError;
use tle::{EarthOrientation, HorizonMask, Station};

use super::ConfigError;

/// `[station]`: who we are.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StationSection {
    /// Name of the station: 1 to 32 of a-z, 0-9, `-`, `_`.
    pub name: String,
    /// Who says that this machine's clock is right. Default `kernel`.
    #[serde(default)]
    pub clock: ClockSetting,
    /// Geodetic latitude (WGS84), degrees, north positive. With `longitude_deg`: passes are known.
    #[serde(default)]
    pub latitude_deg: Option<f64>,
    /// Longitude, degrees, east positive, -180 to 360.
    #[serde(default)]
    pub longitude_deg: Option<f64>,
    /// Height above the WGS84 ellipsoid, metres. Default 0.
    #[serde(default)]
    pub height_m: f64,
    /// The least elevation at which anything is heard, degrees. Default 0.
    #[serde(default)]
    pub min_elevation_deg: f64,
    /// What the horizon hides: pairs of azimuth and elevation in degrees, straight lines between them. Default: nothing.
    #[serde(default)]
    pub horizon_deg: Vec<[f64; 2]>,
    /// UT1-UTC, seconds (IERS Bulletin A). Default 0; 0.1 s is worth 46 m at the equator.
    #[serde(default)]
    pub dut1_s: f64,
    /// The station transmits within these windows only. Default: always.
    #[serde(default)]
    pub licence: Option<Vec<WindowSection>>,
    /// Nothing is planned and nothing is transmitted in these windows.
    #[serde(default)]
    pub blackouts: Vec<WindowSection>,
    /// The station's call sign: stands in the record of transmissions by whoever has none of his own. Default: none.
    #[serde(default)]
    pub call_sign: String,
    /// The licence that goes with it, in words. Default: none.
    #[serde(default)]
    pub licence_text: String,
    /// What the antenna needs from one satellite to the next, seconds. Default 30.
    #[serde(default = "half_a_minute")]
    pub switch_over_s: u32,
}

const fn half_a_minute() -> u32 {
    30
}

/// A stretch of time in the configuration.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindowSection {
    /// Its begin, RFC 3339.
    pub start: api::Time,
    /// Its end, RFC 3339.
    pub stop: api::Time,
    /// Why, in an operator's words.
    #[serde(default)]
    pub reason: String,
}

impl WindowSection {
    fn window(&self, key: &str) -> Result<Window, ConfigError> {
        let (start, stop) = (UtcUs(self.start.unix_us()), UtcUs(self.stop.unix_us()));
        if start < stop {
            return Ok(Window { start, stop });
        }
        Err(ConfigError::value(key, "it ends before it begins", "Exchange start and stop."))
    }
}

impl StationSection {
    /// When the station may transmit and when it is closed.
    ///
    /// # Errors
    /// [`ConfigError`] that names the key.
    pub fn times(&self) -> Result<Times, ConfigError> {
        let licence = self.licence.as_ref().map(|windows| {
            let one =
                |(at, window): (usize, &WindowSection)| window.window(&format!("station.licence[{at}]"));
            windows.iter().enumerate().map(one).collect::<Result<Vec<_>, _>>()
        });
        let blackout = |(at, window): (usize, &WindowSection)| {
            Ok((window.window(&format!("station.blackouts[{at}]"))?, window.reason.clone()))
        };
        Ok(Times {
            licence: licence.transpose()?,
            blackouts: self.blackouts.iter().enumerate().map(blackout).collect::<Result<_, ConfigError>>()?,
            switch_over_s: self.switch_over_s,
        })
    }

    /// Where the station stands and what it sees; `None` when nobody said.
    ///
    /// # Errors
    /// [`ConfigError`] that names the key.
    pub fn site(&self) -> Result<Option<Site>, ConfigError> {
        let (latitude_deg, longitude_deg) = match (self.latitude_deg, self.longitude_deg) {
            (Some(latitude), Some(longitude)) => (latitude, longitude),
            (None, None) => return Ok(None),
            (latitude, _) => {
                let missing = if latitude.is_none() { "latitude_deg" } else { "longitude_deg" };
                let remedy = "Give both latitude_deg and longitude_deg, or neither.";
                return Err(ConfigError::value(format!("station.{missing}"), "it is missing", remedy));
            }
        };
        let wrong = |key: &str, why: String| {
            ConfigError::value(format!("station.{key}"), why, "Give a value in this range.")
        };
        let mut place = Station::new(latitude_deg, longitude_deg, self.height_m).map_err(|error| {
            let key = match error {
                StationError::Latitude { .. } => "latitude_deg",
                StationError::Longitude { .. } => "longitude_deg",
                StationError::Height { .. } => "height_m",
            };
            wrong(key, error.to_string())
        })?;
        if !self.horizon_deg.is_empty() {
            let table: Vec<(f64, f64)> = self.horizon_deg.iter().map(|[az, el]| (*az, *el)).collect();
            let mask =
                HorizonMask::from_table(&table).map_err(|error| wrong("horizon_deg", error.to_string()))?;
            place = place.with_mask(mask);
        }
        if !(-90.0..=90.0).contains(&self.min_elevation_deg) {
            let found = self.min_elevation_deg;
            return Err(wrong("min_elevation_deg", format!("{found} is outside -90 to 90 degrees")));
        }
        let orientation =
            EarthOrientation::new(self.dut1_s).map_err(|error| wrong("dut1_s", error.to_string()))?;
        Ok(Some(Site { place, min_elevation_deg: self.min_elevation_deg, orientation }))
    }
}

/// Who says that the clock is right before anything is sealed without a stored counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClockSetting {
    /// The kernel's synchronisation state, as systemd-timesyncd, timedated or chrony tell it.
    #[default]
    Kernel,
    /// An operator, after each start (`POST /clock/vouch`); the kernel is not asked.
    Operator,
    /// Whoever wrote the configuration: for machines whose clock is disciplined in a way that cannot be asked.
    Trust,
}

/// `[storage]`: where everything is kept.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StorageSection {
    /// The data folder; made with mode 0700 when it is not there.
    pub folder: PathBuf,
    /// A PostgreSQL that several servers share, e.g. `postgres://ground@db.example/ground`, instead of a file in the
    /// folder. Without a password: that comes from `password_file`, `PGPASSWORD` or `PGPASSFILE`.
    #[serde(default)]
    pub database: Option<String>,
    /// A file of mode 0600 with the password for `database`.
    #[serde(default)]
    pub password_file: Option<PathBuf>,
    /// Bytes set aside for raw frames while the database takes nothing. Default 4 MiB (8,190 frames: four and a half
    /// hours of a heartbeat every two seconds).
    #[serde(default = "default_reserve")]
    pub reserve_bytes: u64,
    /// Pages of 4096 bytes that the database may grow to; no limit without it.
    #[serde(default)]
    pub max_page_count: Option<u32>,
}

const fn default_reserve() -> u64 {
    4 << 20
}

/// `[http]`: who may talk to the server, and where.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HttpSection {
    /// Address and port. Default `127.0.0.1:8700`; port 0 takes any.
    pub listen: SocketAddr,
    /// Names under which browsers and programs may address the server, besides loopback (`Host` header).
    pub allowed_hosts: Vec<String>,
    /// The 0600 file with the server's own token: whoever can read it may do everything. Default `token` in the data
    /// folder.
    pub token_file: Option<PathBuf>,
    /// Browsers reach the server over TLS, through a proxy on this machine. Default false.
    pub https: bool,
    /// TLS of the server's own, on a second address; then browsers come over that one.
    pub tls: Option<TlsSection>,
    /// Whether one may look without logging in. Default: on loopback, as long as there is no user.
    pub open_reading: Option<bool>,
    /// Streams (WebSocket) that may be open at once; more are refused. Default 2048.
    pub streams: usize,
}

impl Default for HttpSection {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 8700)),
            allowed_hosts: Vec::new(),
            token_file: None,
            https: false,
            tls: None,
            open_reading: None,
            streams: 2048,
        }
    }
}

/// `[http.tls]`: TLS of the server's own.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TlsSection {
    /// Address and port, e.g. `0.0.0.0:8443`.
    pub listen: SocketAddr,
    /// PEM file with the server's certificate, then those that lead to its authority.
    pub certificate: PathBuf,
    /// PEM file with the certificate's key, mode 0600.
    pub key: PathBuf,
}

/// `[people]`: rules among those who may come in.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PeopleSection {
    /// What needs a second person. Default `off`.
    pub two_person: TwoPerson,
    /// How long the second person has, hours: 0.01 to 168. Default 1.
    pub approval_h: f64,
    /// A session that nobody uses ends after so many minutes: 10 to 1440. Default 30.
    pub session_idle_min: f64,
    /// Every session ends after so many hours: 0.5 to 168. Default 12.
    pub session_max_h: f64,
}

impl Default for PeopleSection {
    fn default() -> Self {
        Self { two_person: TwoPerson::Off, approval_h: 1.0, session_idle_min: 30.0, session_max_h: 12.0 }
    }
}

/// What needs a second person.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TwoPerson {
    /// Nothing.
    #[default]
    Off,
    /// Critical telecommands, and arming plans with such.
    Critical,
}

/// `[log]`: what is logged.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LogSection {
    /// A filter of `tracing`, e.g. `info` or `info,gs_server::links=debug`. Default `info`.
    pub filter: String,
    /// One JSON object a line instead of text. Default false.
    pub json: bool,
}

impl Default for LogSection {
    fn default() -> Self {
        Self { filter: "info".into(), json: false }
    }
}

/// `[simulation]`: how simulated time runs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulationSection {
    /// Simulated seconds per second: the same figure as the twin's. Default 1.
    #[serde(default = "default_speed")]
    pub speed: f64,
}

const fn default_speed() -> f64 {
    1.0
}
