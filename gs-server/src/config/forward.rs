//! `[[forward]]`: who else gets what we hear.

use std::collections::BTreeSet;
use std::path::PathBuf;

use reqwest::Url;
use serde::Deserialize;

use super::alerts::target_url;
use super::elements::is_loopback;
use super::{Config, ConfigError};

/// Characters that SatNOGS keeps of a receiver's name.
const RECEIVER_MAX: usize = 45;
/// Targets that one server takes.
const MOST: usize = 16;

/// The form in which a target is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ForwardKind {
    /// Simple Downlink Share Convention: SatNOGS DB and others.
    Sids,
    /// A POST of JSON, signed.
    Webhook,
}

/// `[[forward]]`: one target.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForwardSection {
    /// Its name: 1 to 32 of a-z, 0-9, `-`, `_`.
    pub name: String,
    /// How it is told.
    pub kind: ForwardKind,
    /// Where it is.
    pub url: String,
    /// Frames are really sent. Default false: a dry run writes down what would be.
    #[serde(default)]
    pub live: bool,
    /// Of these satellites. Default: all.
    #[serde(default)]
    pub satellites: Vec<String>,
    /// Who heard it, as the target is told. Default: the station's call sign.
    #[serde(default)]
    pub receiver: Option<String>,
    /// What one's own boards heard is sent, too, under the boards' names. Default false.
    #[serde(default)]
    pub own_boards: bool,
    /// Nothing that was received before goes out. Default: from the first start with this target.
    #[serde(default)]
    pub since: Option<String>,
    /// At most so many a minute, 1 to 600. Default 30.
    #[serde(default = "half_a_second_pace")]
    pub per_minute: u32,
    /// File with the secret: the token of SatNOGS, or what signs a webhook.
    #[serde(default)]
    pub secret_file: Option<PathBuf>,
    /// Variable of the environment with it, instead.
    #[serde(default)]
    pub secret_env: Option<String>,
}

const fn half_a_second_pace() -> u32 {
    30
}

impl ForwardSection {
    /// Nothing before this goes out; `None` when nobody said, or said it so that it is no time.
    pub fn since(&self) -> Option<mission::UtcUs> {
        let at: jiff::Timestamp = self.since.as_deref()?.parse().ok()?;
        Some(mission::UtcUs(at.as_microsecond()))
    }

    /// The address, if it is one that may be used: what is wrong with it, and the remedy, otherwise.
    pub(crate) fn parsed(&self) -> Result<Url, (String, &'static str)> {
        target_url(&self.url)
    }

    /// Where it leads; of a webhook not the path, which may be all its secret.
    pub fn shown(&self) -> String {
        self.parsed().map_or_else(
            |_| "?".to_owned(),
            |mut url| {
                url.set_query(None);
                url.set_fragment(None);
                if self.kind == ForwardKind::Webhook {
                    url.set_path("/");
                }
                url.to_string()
            },
        )
    }

    fn check(&self, key: &str, config: &Config) -> Result<(), ConfigError> {
        let wrong = |field: &str, problem: String, remedy: &str| {
            Err(ConfigError::value(format!("{key}.{field}"), problem, remedy))
        };
        if let Err(error) = mission::LinkId::new(&self.name) {
            return wrong("name", error.to_string(), "Choose another name.");
        }
        let url = match self.parsed() {
            Ok(url) => url,
            Err((problem, remedy)) => return wrong("url", problem, remedy),
        };
        if config.is_simulated() && self.live && !is_loopback(&url) {
            let remedy = "Leave 'live' out: what is made up goes to nobody else.";
            return wrong("live", "the links are simulated".into(), remedy);
        }
        for (at, name) in self.satellites.iter().enumerate() {
            if !config.satellites.iter().any(|satellite| satellite.name == *name) {
                let problem = format!("'{}' is not among the satellites", name.escape_default());
                return wrong(
                    &format!("satellites[{at}]"),
                    problem,
                    "Give the name of a [[satellites]] section.",
                );
            }
        }
        if self.since.is_some() && self.since().is_none() {
            let found = self.since.as_deref().unwrap_or_default().escape_default().to_string();
            return wrong("since", format!("'{found}' is no time"), "Write it as 2027-03-01T04:00:00Z.");
        }
        if !(1..=600).contains(&self.per_minute) {
            return wrong("per_minute", format!("found {}", self.per_minute), "Give 1 to 600.");
        }
        if self.secret_file.is_some() && self.secret_env.is_some() {
            return wrong("secret_env", "there is a secret_file, too".into(), "Give one of them.");
        }
        match self.kind {
            ForwardKind::Sids => self.check_sids(key, config),
            ForwardKind::Webhook if self.secret_file.is_none() && self.secret_env.is_none() => {
                let remedy = "Give the file with what signs the messages (openssl rand -hex 32).";
                wrong("secret_file", "there is none".into(), remedy)
            }
            ForwardKind::Webhook => Ok(()),
        }
    }

    /// SiDS wants a number, a name and a place.
    fn check_sids(&self, key: &str, config: &Config) -> Result<(), ConfigError> {
        let wanted = |name: &str| self.satellites.is_empty() || self.satellites.iter().any(|one| one == name);
        for (at, satellite) in config.satellites.iter().enumerate() {
            if wanted(&satellite.name) && satellite.norad_cat_id.is_none() {
                return Err(ConfigError::value(
                    format!("satellites[{at}].norad_cat_id"),
                    format!("there is none, and '{}' is forwarded by {key}", satellite.name),
                    "Give the number; SatNOGS DB gives temporary ones (98xxx, 99xxx) before the launch.",
                ));
            }
        }
        let receiver = self.receiver.as_deref().unwrap_or(&config.station.call_sign);
        if receiver.trim().is_empty() || receiver.chars().count() > RECEIVER_MAX {
            return Err(ConfigError::value(
                format!("{key}.receiver"),
                format!("'{}'", receiver.escape_default()),
                "Give station.call_sign, or a name of 1 to 45 characters for who heard it.",
            ));
        }
        if config.station.latitude_deg.is_none() || config.station.longitude_deg.is_none() {
            return Err(ConfigError::value(
                "station.latitude_deg",
                format!("there is none, and {key} must say where a frame was heard"),
                "Give latitude_deg and longitude_deg.",
            ));
        }
        Ok(())
    }
}

impl Config {
    pub(super) fn check_forward(&self) -> Result<(), ConfigError> {
        if self.forward.len() > MOST {
            return Err(ConfigError::value(
                "forward",
                format!("there are {}", self.forward.len()),
                "16 fit.",
            ));
        }
        let mut names = BTreeSet::new();
        for (at, target) in self.forward.iter().enumerate() {
            let key = format!("forward[{at}]");
            target.check(&key, self)?;
            if !names.insert(&target.name) {
                let problem = format!("'{}' is there twice", target.name);
                return Err(ConfigError::value(format!("{key}.name"), problem, "Names are unique."));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(station: &str, satellite: &str, forward: &str) -> Result<(), String> {
        let text = format!(
            "[station]\nname = \"roof\"\n{station}\n[[satellites]]\nname = \"pixelsat-1\"\n{satellite}\n[[links]]\nname = \"e22\"
             satellite = \"pixelsat-1\"\nkind = \"serial\"\nport = \"/dev/ttyUSB0\"\n[storage]\nfolder = \"data\"\n[[forward]]\nname = \"db\"\n{forward}"
        );
        let config =
            Config::from_toml(&text, std::path::Path::new("/srv")).map_err(|error| error.to_string())?;
        config.check().map_err(|error| error.to_string())
    }

    #[test]
    fn a_target_says_which_key_is_wrong_and_what_to_do() {
        let place = "latitude_deg = 47.0\nlongitude_deg = 8.5\ncall_sign = \"HB9XYZ\"";
        let sids = "kind = \"sids\"\nurl = \"https://db.satnogs.org/api/telemetry/\"";
        let number = "norad_cat_id = 99999";
        assert_eq!(check(place, number, sids), Ok(()));
        for (station, satellite, forward, key) in [
            (place, "", sids.to_owned(), "satellites[0].norad_cat_id"),
            ("", number, sids.to_owned(), "forward[0].receiver"),
            ("call_sign = \"HB9XYZ\"", number, sids.to_owned(), "station.latitude_deg"),
            (place, number, sids.replace("https", "http"), "forward[0].url"),
            (place, number, format!("{sids}\nsince = \"soon\""), "forward[0].since"),
            (place, number, format!("{sids}\nper_minute = 0"), "forward[0].per_minute"),
            (place, number, format!("{sids}\nsatellites = [\"other\"]"), "forward[0].satellites[0]"),
            (place, number, sids.replace("sids", "webhook"), "forward[0].secret_file"),
        ] {
            let error = check(station, satellite, &forward).unwrap_err();
            assert!(error.contains(&format!("key {key}:")), "{key}: {error}");
        }
        let error = check(place, number, &format!("{sids}\nsecret_token = \"x\"")).unwrap_err();
        assert!(error.contains("unknown field `secret_token`"), "{error}");
    }

    #[test]
    fn what_is_made_up_goes_to_nobody_else() {
        let text = |url: &str| {
            format!(
                "[station]\nname = \"roof\"\n[[satellites]]\nname = \"pixelsat-1\"\n[[links]]\nname = \"e22\"\nsatellite = \"pixelsat-1\"
                 kind = \"serial\"\nport = \"/dev/pts/9\"\nsimulated = true\n[storage]\nfolder = \"data\"
                 [[forward]]\nname = \"hook\"\nkind = \"webhook\"\nurl = \"{url}\"\nlive = true\nsecret_env = \"S\""
            )
        };
        let check = |url: &str| {
            Config::from_toml(&text(url), std::path::Path::new("/srv"))
                .unwrap()
                .check()
                .map_err(|error| error.to_string())
        };
        assert!(check("https://example.org/hook").unwrap_err().contains("key forward[0].live"));
        assert_eq!(check("http://127.0.0.1:9/hook"), Ok(()));
    }
}
