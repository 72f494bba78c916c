//! `[elements]`: where elements are fetched from, and how often. Without it nothing is ever fetched.

use std::fmt;
use std::path::PathBuf;

use reqwest::Url;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::{Config, ConfigError};

/// Sources that one server asks.
const MOST: usize = 16;
/// Sources change every two hours at most, and block who asks more often.
pub const MIN_AGE_LEAST_H: f64 = 2.0;
/// Longer waits are mistakes: elements are useless by then.
const LONGEST_H: f64 = 720.0;
/// Bytes that an address may have.
const URL_MAX: usize = 2000;

/// `[elements]`: how elements come over the network.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ElementsSection {
    /// The sources, none by default: the server asks nobody unless it is told to.
    pub fetch: Vec<FetchSource>,
    /// Hours between two requests to one source, whoever wants them. Default and least 2.
    pub min_age_h: f64,
    /// Hours between two requests that the server makes by itself, not less than `min_age_h`. Default 6.
    pub every_h: f64,
}

impl Default for ElementsSection {
    fn default() -> Self {
        Self { fetch: Vec::new(), min_age_h: MIN_AGE_LEAST_H, every_h: 6.0 }
    }
}

/// One source: an address as text, or a table with `url` and `credentials_file`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FetchSource {
    /// The query, e.g. `https://celestrak.org/NORAD/elements/gp.php?GROUP=cubesat&FORMAT=json`.
    pub url: String,
    /// A 0600 file with two lines, identity and password, for sources where one logs in as at Space-Track.
    pub credentials_file: Option<PathBuf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    url: String,
    #[serde(default)]
    credentials_file: Option<PathBuf>,
}

impl<'de> Deserialize<'de> for FetchSource {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = FetchSource;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an address, or { url = \"…\", credentials_file = \"…\" }")
            }

            fn visit_str<E>(self, url: &str) -> Result<FetchSource, E> {
                Ok(FetchSource { url: url.to_owned(), credentials_file: None })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FetchSource, A::Error> {
                let Table { url, credentials_file } = Table::deserialize(MapAccessDeserializer::new(map))?;
                Ok(FetchSource { url, credentials_file })
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// The address leads to this machine: no stranger is asked.
pub(crate) fn is_loopback(url: &Url) -> bool {
    match url.host_str() {
        Some("localhost" | "[::1]") => true,
        Some(host) => host.parse::<std::net::Ipv4Addr>().is_ok_and(|address| address.is_loopback()),
        None => false,
    }
}

impl FetchSource {
    /// The address, if it is one that may be asked: what is wrong with it, and the remedy, otherwise.
    pub(crate) fn parsed(&self) -> Result<Url, (String, &'static str)> {
        if self.url.len() > URL_MAX {
            return Err((format!("{} bytes long", self.url.len()), "Give at most 2000 bytes."));
        }
        let url = Url::parse(&self.url).map_err(|error| {
            (format!("'{}' is no address ({error})", self.shown()), "Give https://host/path?query.")
        })?;
        // Before anything is shown: what stands here is a secret.
        let names_login = |name: &str| {
            ["identity", "username", "password"].iter().any(|login| name.eq_ignore_ascii_case(login))
        };
        if !url.username().is_empty()
            || url.password().is_some()
            || url.query_pairs().any(|(name, _)| names_login(&name))
        {
            return Err((
                "a name or password stands in the address".into(),
                "Put them into a file of mode 0600, two lines, and name it: { url = \"…\", credentials_file = \"…\" }.",
            ));
        }
        let host = url.host_str().unwrap_or_default();
        match url.scheme() {
            "https" => {}
            "http"
                if is_loopback(&url) || (self.credentials_file.is_none() && !host.contains("celestrak")) => {}
            "http" => {
                return Err((
                    format!("'{host}' is asked without encryption"),
                    "Write https: this source redirects, or the password would be readable on its way.",
                ));
            }
            scheme => return Err((format!("'{scheme}' is no way to ask"), "Give an https address.")),
        }
        if host.ends_with("celestrak.com") || host == "www.celestrak.org" {
            return Err((
                format!("'{host}' only redirects, and counts each request as an error"),
                "Write celestrak.org, without www.",
            ));
        }
        if host.is_empty() || url.fragment().is_some() {
            return Err(("no host, or a fragment (#…)".into(), "Give https://host/path?query."));
        }
        Ok(url)
    }

    /// The address for a message: cut, and without what may be a password before an `@`.
    fn shown(&self) -> String {
        let after = self.url.rsplit_once('@').map_or(self.url.as_str(), |(_, after)| after);
        after.chars().take(80).collect()
    }
}

impl Config {
    pub(super) fn check_elements(&self) -> Result<(), ConfigError> {
        let section = &self.elements;
        let fail = |key: String, problem: String, remedy: &str| Err(ConfigError::value(key, problem, remedy));
        if section.fetch.len() > MOST {
            return fail(
                "elements.fetch".into(),
                format!("there are {}", section.fetch.len()),
                "16 fit; fetch groups.",
            );
        }
        for (at, source) in section.fetch.iter().enumerate() {
            let key = format!("elements.fetch[{at}]");
            let url = match source.parsed() {
                Ok(url) => url,
                Err((problem, remedy)) => return fail(key, problem, remedy),
            };
            if section.fetch[..at].iter().any(|earlier| earlier.url == source.url) {
                return fail(
                    key,
                    "the same address stands there twice".into(),
                    "Remove one: a source is asked once.",
                );
            }
            if self.simulation.is_some() && !is_loopback(&url) {
                return fail(
                    key,
                    "simulated time would ask a real source more often than it allows".into(),
                    "Remove it, and give elements with `gs-server elements add`.",
                );
            }
        }
        if !(MIN_AGE_LEAST_H..=LONGEST_H).contains(&section.min_age_h) {
            return fail(
                "elements.min_age_h".into(),
                format!("{}", section.min_age_h),
                "Give 2 to 720 hours: sources change every 2 hours at most, and block who asks more often.",
            );
        }
        if !(section.min_age_h..=LONGEST_H).contains(&section.every_h) {
            return fail(
                "elements.every_h".into(),
                format!("{}", section.every_h),
                "Give min_age_h to 720 hours; 6 is plenty.",
            );
        }
        for (at, satellite) in self.satellites.iter().enumerate() {
            if let Some(number) = satellite.norad_cat_id
                && !(1..=tle::formats::CATALOGUE_MAX).contains(&number)
            {
                return fail(
                    format!("satellites[{at}].norad_cat_id"),
                    format!("{number}"),
                    "Give the catalogue number, 1 to 999999999, or leave it out.",
                );
            }
            if let Some(name) = &satellite.object_name
                && (name.trim().is_empty() || name.chars().count() > 80)
            {
                return fail(
                    format!("satellites[{at}].object_name"),
                    format!("'{}'", name.chars().take(80).collect::<String>()),
                    "Give the name as element sets have it, 1 to 80 characters, or leave it out.",
                );
            }
            let before = &self.satellites[..at];
            if let Some(twin) = before
                .iter()
                .find(|other| other.norad_cat_id.is_some() && other.norad_cat_id == satellite.norad_cat_id)
            {
                return fail(
                    format!("satellites[{at}].norad_cat_id"),
                    format!("satellite '{}' has it, too", twin.name),
                    "Two satellites are two objects.",
                );
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const BASE: &str = "[station]\nname = \"roof\"\n[[satellites]]\nname = \"a\"\nnorad_cat_id = 100001\n[[satellites]]\nname = \"b\"\n\
        [[links]]\nname = \"e22\"\nsatellite = \"a\"\nkind = \"serial\"\nport = \"/dev/ttyUSB0\"\n[storage]\nfolder = \"data\"\n";

    fn with(more: &str) -> Result<Config, ConfigError> {
        let config = Config::from_toml(&format!("{BASE}{more}"), Path::new("/srv"))?;
        config.check()?;
        Ok(config)
    }

    #[test]
    fn nothing_is_fetched_by_default_and_sources_are_addresses_or_tables() {
        assert_eq!(with("").unwrap().elements, ElementsSection::default());
        let config = with(
            "[elements]\nmin_age_h = 3\nfetch = [\"https://celestrak.org/NORAD/elements/gp.php?CATNR=1\", \
             { url = \"https://www.space-track.org/x\", credentials_file = \"login\" }]\n",
        )
        .unwrap();
        assert_eq!(config.elements.fetch[0].credentials_file, None);
        assert_eq!(config.elements.fetch[1].credentials_file.as_deref(), Some(Path::new("/srv/login")));
        let shown = config.to_string();
        assert!(shown.contains("celestrak.org") && shown.contains("3 h"), "{shown}");
    }

    #[test]
    fn impolite_or_leaking_sources_are_refused_with_their_key_and_a_remedy() {
        for (more, says) in [
            ("min_age_h = 1.9", "elements.min_age_h"),
            ("min_age_h = nan", "elements.min_age_h"),
            ("min_age_h = 8", "elements.every_h"),
            ("fetch = [\"celestrak\"]", "elements.fetch[0]"),
            ("fetch = [\"https://me:hunter2@x.org/\"]", "credentials_file"),
            ("fetch = [\"https://www.celestrak.org/x\"]", "without www"),
            ("fetch = [\"https://celestrak.com/x\"]", "celestrak.org"),
            ("fetch = [\"http://celestrak.org/x\"]", "https"),
            ("fetch = [\"ftp://x.org/x\"]", "https"),
            ("fetch = [{ url = \"http://x.org/\", credentials_file = \"l\" }]", "https"),
            ("fetch = [\"https://x.org/\", \"https://x.org/\"]", "elements.fetch[1]"),
            ("fetch = [{ url = \"https://x.org/\", password = \"hunter2\" }]", "password"),
            ("fetch = [7]", "credentials_file"),
        ] {
            let error = with(&format!("[elements]\n{more}\n")).unwrap_err().to_string();
            assert!(error.contains(says), "{more}: {error}");
        }
        let error = with("[elements]\nfetch = [\"https://me:hunter2@x.org/\"]").unwrap_err().to_string();
        assert!(error.contains("0600") && !error.to_lowercase().contains("hunter"), "{error}");
        let error = with("[elements]\nfetch = [\"//me:hunter2@x.org/\"]").unwrap_err().to_string();
        assert!(!error.to_lowercase().contains("hunter2@"), "{error}");
    }

    #[test]
    fn catalogue_numbers_are_possible_and_unique() {
        let doubled = BASE.replace("name = \"b\"", "name = \"b\"\nnorad_cat_id = 100001");
        let error = Config::from_toml(&doubled, Path::new("/")).unwrap().check().unwrap_err().to_string();
        assert!(error.contains("satellites[1].norad_cat_id"), "{error}");
        for bad in ["norad_cat_id = 0", "norad_cat_id = 1000000000", "object_name = \" \""] {
            let text = BASE.replace("name = \"b\"", &format!("name = \"b\"\n{bad}"));
            let error = Config::from_toml(&text, Path::new("/")).unwrap().check().unwrap_err().to_string();
            assert!(error.contains("satellites[1]."), "{error}");
        }
    }
}
