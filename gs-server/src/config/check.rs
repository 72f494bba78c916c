//! What the values mean together: ranges, names that must exist, and the wall between simulated and real.

use std::collections::BTreeSet;

use mission::id::NameError;
use mission::{Level, LinkId, SatelliteId, StationId};

use super::links::{AuxInput, LinkKind, LinkSection, ModePinWiring};
use super::satellites::{CounterSetting, LimitSection, SatelliteSection};
use super::station::driver_config;
use super::{Config, ConfigError};
use crate::storage::Postgres;

/// Satellites, and links, that one server takes.
const MOST: usize = 16;

type Checked = Result<(), ConfigError>;

fn name(key: String, result: Result<(), NameError>) -> Checked {
    result.map_err(|error| ConfigError::value(key, error.to_string(), "Choose another name."))
}

fn ensure(good: bool, key: impl Into<String>, problem: impl Into<String>, remedy: &str) -> Checked {
    if good { Ok(()) } else { Err(ConfigError::value(key, problem, remedy)) }
}

impl Config {
    /// Whether the values are possible, each by itself and together. Opens nothing and reads no key.
    ///
    /// # Errors
    /// [`ConfigError::Value`] with the key, what was found and what to do: the first one that is wrong.
    pub fn check(&self) -> Result<(), ConfigError> {
        name("station.name".into(), StationId::new(&self.station.name).map(drop))?;
        ensure(
            self.station.name != mission::reception::ELSEWHERE,
            "station.name",
            "'elsewhere' stands for what only others heard",
            "Choose another name.",
        )?;
        self.station.site()?;
        self.station.times()?;
        ensure(!self.satellites.is_empty(), "satellites", "there is none", "Add a [[satellites]] section.")?;
        ensure(!self.links.is_empty(), "links", "there is none", "Add a [[links]] section.")?;
        ensure(
            self.satellites.len() <= MOST,
            "satellites",
            format!("there are {}", self.satellites.len()),
            "16 fit.",
        )?;
        ensure(self.links.len() <= MOST, "links", format!("there are {}", self.links.len()), "16 fit.")?;
        let mut names = BTreeSet::new();
        for (at, satellite) in self.satellites.iter().enumerate() {
            let key = format!("satellites[{at}]");
            satellite.check(&key)?;
            ensure(
                names.insert(&satellite.name),
                format!("{key}.name"),
                format!("'{}' is there twice", satellite.name),
                "Names are unique.",
            )?;
        }
        let mut links = BTreeSet::new();
        let mut ends = BTreeSet::new();
        for (at, link) in self.links.iter().enumerate() {
            let key = format!("links[{at}]");
            link.check(&key)?;
            ensure(
                links.insert(&link.name),
                format!("{key}.name"),
                format!("'{}' is there twice", link.name),
                "Names are unique.",
            )?;
            ensure(
                names.contains(&link.satellite),
                format!("{key}.satellite"),
                format!("'{}' is not among the satellites", link.satellite),
                "Give the name of a [[satellites]] section.",
            )?;
            ensure(
                ends.insert(link.far_end()),
                key,
                format!("'{}' is used by two links", link.far_end()),
                "One link owns its port.",
            )?;
        }
        self.check_rssi()?;
        self.check_storage()?;
        self.check_elements()?;
        self.check_ears()?;
        self.check_ops()?;
        self.check_people()?;
        self.alerts.check()?;
        self.check_forward()?;
        self.rotator.as_ref().map_or(Ok(()), super::RotatorSection::check)?;
        self.rig.as_ref().map_or(Ok(()), super::RigSection::check)?;
        self.check_simulated()
    }

    /// The frame decoder is made once for a satellite, so its links must agree.
    fn check_rssi(&self) -> Checked {
        for satellite in &self.satellites {
            let mut of_links =
                self.links.iter().filter(|l| l.satellite == satellite.name).map(|l| l.rssi.unwrap_or(true));
            if let Some(first) = of_links.next() {
                ensure(
                    of_links.all(|other| other == first),
                    "links.rssi",
                    format!("the links of '{}' differ", satellite.name),
                    "Give all links of a satellite the same 'rssi'.",
                )?;
            }
        }
        Ok(())
    }

    fn check_storage(&self) -> Checked {
        ensure(
            (1 << 16..=1 << 32).contains(&self.storage.reserve_bytes),
            "storage.reserve_bytes",
            format!("{} bytes", self.storage.reserve_bytes),
            "Give 65,536 to 4,294,967,296.",
        )?;
        let Some(database) = &self.storage.database else {
            return ensure(
                self.storage.password_file.is_none(),
                "storage.password_file",
                "there is no storage.database that asks for a password",
                "Give storage.database as well, or remove it.",
            );
        };
        // The value is not repeated: it may hold a password.
        Postgres::new(database).map(drop).map_err(|problem| {
            let remedy = "Write postgres://user@host/database; the password goes into storage.password_file, PGPASSWORD or PGPASSFILE.";
            ConfigError::value("storage.database", problem, remedy)
        })?;
        // Put back from a dump, the database forgets what any station sealed after it; a station whose own witness stands lower
        // could not tell, and would seal again with a counter that another has used.
        for (at, satellite) in self.satellites.iter().enumerate() {
            ensure(
                satellite.key_file.is_none() || satellite.counter == CounterSetting::Time,
                format!("satellites[{at}].counter"),
                "it counts one by one, and stations share the database",
                "Use counter = \"time\", or an archive of the station's own.",
            )?;
        }
        ensure(
            self.backup.is_none(),
            "backup",
            "it copies a file, and the archive is a PostgreSQL",
            "Remove the section, and back the database up with pg_dump on its server.",
        )?;
        ensure(
            self.storage.max_page_count.is_none(),
            "storage.max_page_count",
            "it limits a file, and the archive is a PostgreSQL",
            "Remove it, and watch the disk of the database's server.",
        )
    }

    fn check_people(&self) -> Checked {
        ensure(
            (0.01..=168.0).contains(&self.people.approval_h),
            "people.approval_h",
            format!("{} hours", self.people.approval_h),
            "Give 0.01 to 168.",
        )?;
        ensure(
            (10.0..=1440.0).contains(&self.people.session_idle_min),
            "people.session_idle_min",
            format!("{} minutes", self.people.session_idle_min),
            "Give 10 to 1440.",
        )?;
        ensure(
            (0.5..=168.0).contains(&self.people.session_max_h),
            "people.session_max_h",
            format!("{} hours", self.people.session_max_h),
            "Give 0.5 to 168.",
        )?;
        for (key, text) in [
            ("station.call_sign", &self.station.call_sign),
            ("station.licence_text", &self.station.licence_text),
        ] {
            ensure(
                text.chars().count() <= 64 && !text.chars().any(char::is_control),
                key,
                "it is too long, or not printable",
                "Give at most 64 printable characters.",
            )?;
        }
        Ok(())
    }

    fn check_simulated(&self) -> Checked {
        let simulated = self.is_simulated();
        for (at, link) in self.links.iter().enumerate() {
            ensure(
                link.simulated == simulated,
                format!("links[{at}].simulated"),
                format!(
                    "link '{}' is {}, another is not",
                    link.name,
                    if link.simulated { "simulated" } else { "real" }
                ),
                "Simulated and real links never share a server: use two configurations with two data folders.",
            )?;
        }
        if let Some(simulation) = &self.simulation {
            ensure(
                simulated,
                "simulation",
                "simulated time with real links",
                "Remove the section, or say 'simulated = true' on every link if all of them end in a twin.",
            )?;
            ensure(
                simulation.speed.is_finite() && (0.01..=10_000.0).contains(&simulation.speed),
                "simulation.speed",
                format!("{}", simulation.speed),
                "Give 0.01 to 10000.",
            )?;
        }
        Ok(())
    }
}

impl SatelliteSection {
    fn check(&self, key: &str) -> Checked {
        name(format!("{key}.name"), SatelliteId::new(&self.name).map(drop))?;
        ensure(
            self.heartbeat_period_s.is_finite() && (1.0..=86_400.0).contains(&self.heartbeat_period_s),
            format!("{key}.heartbeat_period_s"),
            format!("{}", self.heartbeat_period_s),
            "Give 1 to 86400 seconds.",
        )?;
        ensure(
            self.launched_at.is_none() || self.launched_at().is_some(),
            format!("{key}.launched_at"),
            format!("'{}' is no time", self.launched_at.as_deref().unwrap_or_default()),
            "Write e.g. 2027-03-01T04:00:00Z.",
        )?;
        let mut parameters = BTreeSet::new();
        for (at, limit) in self.limits.iter().enumerate() {
            let key = format!("{key}.limits[{at}]");
            limit.check(&key)?;
            ensure(
                parameters.insert(&limit.parameter),
                format!("{key}.parameter"),
                format!("'{}' is there twice", limit.parameter),
                "Put all levels of a parameter into one section.",
            )?;
        }
        Ok(())
    }
}

impl LimitSection {
    fn check(&self, key: &str) -> Checked {
        ensure(
            self.parameter.contains('.'),
            format!("{key}.parameter"),
            format!("'{}' is no parameter", self.parameter),
            "Write packet.field, e.g. heartbeat.temp.",
        )?;
        for (side, thresholds) in [("below", &self.below), ("above", &self.above)] {
            for (level, value) in thresholds {
                let key = format!("{key}.{side}.{level}");
                let parsed: Level = level.parse().map_err(|_| {
                    ConfigError::value(
                        &key,
                        "no such level",
                        "Use watch, warning, distress, critical or severe.",
                    )
                })?;
                ensure(parsed != Level::Normal, &key, "'normal' needs no limit", "Remove it.")?;
                ensure(value.is_finite(), &key, format!("{value}"), "Give a number.")?;
            }
        }
        ensure(
            !self.below.is_empty() || !self.above.is_empty(),
            key,
            "no limit at all",
            "Give 'below' or 'above', e.g. above = { warning = 40.0 }.",
        )?;
        ensure(
            self.deadband.is_finite() && self.deadband >= 0.0,
            format!("{key}.deadband"),
            format!("{}", self.deadband),
            "Give 0 or more.",
        )?;
        ensure(self.persistence >= 1, format!("{key}.persistence"), "0", "Give 1 or more.")
    }
}

impl LinkSection {
    fn check(&self, key: &str) -> Checked {
        name(format!("{key}.name"), LinkId::new(&self.name).map(drop))?;
        self.check_far_end(key)?;
        if self.kind == LinkKind::Replay {
            return ensure(!self.armed, format!("{key}.armed"), "a file cannot transmit", "Remove it.");
        }
        if self.kind == LinkKind::Tcp {
            let wireless = !matches!(self.mode_pins(), ModePinWiring::Lines | ModePinWiring::LinesInverted);
            ensure(
                wireless && self.aux() == AuxInput::Absent,
                format!("{key}.mode_pins"),
                "a TCP connection has no modem lines",
                "Use mode_pins = \"software\" or \"strapped\" and aux = \"absent\".",
            )?;
        }
        ensure(
            matches!(self.power_dbm, 21 | 24 | 27 | 30),
            format!("{key}.power_dbm"),
            format!("{} dBm", self.power_dbm),
            "The module has 21, 24, 27 and 30.",
        )?;
        ensure(
            (1200..=115_200).contains(&self.baud),
            format!("{key}.baud"),
            format!("{}", self.baud),
            "Give 1200 to 115200; 9600 is the safest.",
        )?;
        ensure(
            self.turn_round_ms <= 60_000,
            format!("{key}.turn_round_ms"),
            format!("{} ms", self.turn_round_ms),
            "Give at most 60000.",
        )?;
        driver_config(self).check().map_err(|error| {
            ConfigError::value(key, error.to_string(), "See docs/configuration.md, section links.")
        })
    }

    /// Exactly what the kind needs is there, and nothing else.
    fn check_far_end(&self, key: &str) -> Checked {
        let given = [
            ("port", self.port.as_ref().is_some_and(|p| !p.is_empty()), LinkKind::Serial),
            ("usb", self.usb.is_some(), LinkKind::Serial),
            ("connect", self.connect.as_ref().is_some_and(|c| c.contains(':')), LinkKind::Tcp),
            ("file", self.file.is_some(), LinkKind::Replay),
        ];
        for (field, there, kind) in given {
            ensure(
                !there || kind == self.kind,
                format!("{key}.{field}"),
                "does not go with this kind of link",
                "serial takes port or usb, tcp takes connect, replay takes file.",
            )?;
        }
        let (field, remedy) = match self.kind {
            LinkKind::Serial => (
                "port",
                "Give port = \"/dev/ttyUSB0\" or usb = { vid = …, pid = … }; `gs-server radio list` shows what there is.",
            ),
            LinkKind::Tcp => ("connect", "Give connect = \"host:port\"."),
            LinkKind::Replay => ("file", "Give file = \"recording.bin\"."),
        };
        ensure(given.iter().any(|(_, there, _)| *there), format!("{key}.{field}"), "is missing", remedy)
    }
}
