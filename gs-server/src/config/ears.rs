//! `[[ears]]`: ways in over the network for what others heard. Without one nothing is asked and nothing listens.

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::path::PathBuf;

use reqwest::Url;
use serde::Deserialize;

use super::{Config, ConfigError, is_loopback};

/// Ears of one server.
const MOST: usize = 16;
/// Boards that may log in to one broker, and names that one poller asks for.
const LIST_MOST: usize = 64;
/// Bytes that an address may have.
const URL_MAX: usize = 2000;
/// Headers that the poller writes itself.
const OWN_HEADERS: [&str; 6] =
    ["host", "authorization", "connection", "content-length", "transfer-encoding", "user-agent"];

/// What kind of ear it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EarKind {
    /// A client of somebody's MQTT broker that one's own TinyGS boards publish to.
    Mqtt,
    /// A broker of our own that boards are pointed at. It passes nothing on.
    Broker,
    /// The HTTP API of TinyGS, asked from time to time.
    TinygsApi,
    /// The database of SatNOGS, asked from time to time.
    SatnogsDb,
}

impl EarKind {
    /// The word in the configuration and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mqtt => "mqtt",
            Self::Broker => "broker",
            Self::TinygsApi => "tinygs-api",
            Self::SatnogsDb => "satnogs-db",
        }
    }

    /// The keys that mean something for it, besides name, kind and satellite.
    const fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Mqtt => &["url", "user", "password_file", "ca_file", "client_id", "topics"],
            Self::Broker => &["listen", "boards", "tls", "modem_file"],
            Self::TinygsApi => &[
                "url",
                "token_file",
                "headers",
                "names",
                "details",
                "paging",
                "every_min",
                "near_pass_every_min",
                "per_hour",
            ],
            Self::SatnogsDb => {
                &["url", "token_file", "norad", "every_min", "near_pass_every_min", "per_hour"]
            }
        }
    }
}

/// A board that may log in to the broker.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardLogin {
    /// Its user: it may publish under `tinygs/USER/…` and nowhere else.
    pub user: String,
    /// A file of mode 0600 with its password.
    pub password_file: PathBuf,
}

/// `[[ears]]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EarSection {
    /// Its name: 1 to 32 of a-z, 0-9, `-`, `_`.
    pub name: String,
    /// What it is.
    pub kind: EarKind,
    /// Whose frames are looked for. Default: the only satellite.
    #[serde(default)]
    pub satellite: Option<String>,
    /// MQTT: `mqtts://host:port` or, on this machine or a network of one's own, `mqtt://host:port`. TinyGS API: where its
    /// paths begin, e.g. `https://api.tinygs.com/v2/`. SatNOGS DB: default `https://db.satnogs.org/api/telemetry/`.
    #[serde(default)]
    pub url: Option<String>,
    /// MQTT: who logs in. Default: nobody.
    #[serde(default)]
    pub user: Option<String>,
    /// MQTT: a file of mode 0600 with the password.
    #[serde(default)]
    pub password_file: Option<PathBuf>,
    /// MQTT: the certificate, PEM, that the broker's own is signed with. Default: what this system trusts.
    #[serde(default)]
    pub ca_file: Option<PathBuf>,
    /// MQTT: how we call ourselves; never as a board does. Default `pixelsat-ground-STATION-NAME`.
    #[serde(default)]
    pub client_id: Option<String>,
    /// MQTT: what is subscribed to. Default: all that boards publish.
    #[serde(default)]
    pub topics: Option<Vec<String>>,
    /// Broker: where it listens. Default `127.0.0.1:1883`.
    #[serde(default)]
    pub listen: Option<SocketAddr>,
    /// Broker: who may log in. May be empty on loopback only: then anybody on this machine may.
    #[serde(default)]
    pub boards: Vec<BoardLogin>,
    /// Broker: certificate and key. Default: none, in the clear.
    #[serde(default)]
    pub tls: Option<TlsFilesSection>,
    /// Broker: a file with the modem JSON that each board is tuned with when it says hello (`begine`).
    #[serde(default)]
    pub modem_file: Option<PathBuf>,
    /// TinyGS API and SatNOGS DB: a file of mode 0600 with the token.
    #[serde(default)]
    pub token_file: Option<PathBuf>,
    /// TinyGS API: further headers of each request, as TinyGS allowed them; no secrets.
    #[serde(default)]
    pub headers: BTreeMap<String, String>,
    /// TinyGS API: names whose packets are asked for. Default: the satellite's aliases, or its name.
    #[serde(default)]
    pub names: Vec<String>,
    /// TinyGS API: each new packet is asked for once more, for the stations that heard it. Default true.
    #[serde(default)]
    pub details: Option<bool>,
    /// TinyGS API: it takes `before=` for older pages, as its version 3 does. Default false.
    #[serde(default)]
    pub paging: bool,
    /// SatNOGS DB: catalogue or temporary number. Default: the satellite's `norad_cat_id`.
    #[serde(default)]
    pub norad: Option<u32>,
    /// Pollers: minutes between two looks far from passes. Default 30 (TinyGS), 60 (SatNOGS).
    #[serde(default)]
    pub every_min: Option<u32>,
    /// Pollers: minutes between two looks while the satellite is over a station that heard it before, or over ours, and for
    /// 20 min after. Default 5 (TinyGS), 15 (SatNOGS).
    #[serde(default)]
    pub near_pass_every_min: Option<u32>,
    /// Pollers: requests in any hour, all together. Default 60 (TinyGS), 30 (SatNOGS).
    #[serde(default)]
    pub per_hour: Option<u32>,
}

/// Certificate and key of the broker.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TlsFilesSection {
    /// The chain, PEM.
    pub certificate: PathBuf,
    /// The key, PEM, mode 0600.
    pub key: PathBuf,
}

type Checked<T = ()> = Result<T, ConfigError>;

fn fail<T>(key: impl Into<String>, problem: impl Into<String>, remedy: &str) -> Checked<T> {
    Err(ConfigError::value(key, problem, remedy))
}

/// 1 to `most` printable characters, none of which means something in a topic or a path.
fn is_plain(text: &str, most: usize) -> bool {
    !text.is_empty()
        && text.chars().count() <= most
        && !text.chars().any(|c| c.is_control() || matches!(c, '/' | '+' | '#'))
}

/// A host of this machine or of a network of one's own: nobody else carries what goes there.
fn is_near(url: &Url) -> bool {
    if is_loopback(url) {
        return true;
    }
    let host = url.host_str().unwrap_or_default();
    match host.parse::<std::net::Ipv4Addr>() {
        Ok(address) => address.is_private() || address.is_link_local(),
        Err(_) => !host.contains(['.', ':']) || host.ends_with(".local") || host.ends_with(".lan"),
    }
}

impl EarSection {
    /// The satellite whose frames are looked for.
    pub fn satellite<'a>(&'a self, config: &'a Config) -> Option<&'a str> {
        match (&self.satellite, config.satellites.as_slice()) {
            (Some(named), _) => Some(named),
            (None, [only]) => Some(&only.name),
            _ => None,
        }
    }

    /// Where it listens.
    pub fn listen(&self) -> SocketAddr {
        self.listen.unwrap_or_else(|| SocketAddr::from(([127, 0, 0, 1], 1883)))
    }

    /// Whom it asks or listens to: an address without anything secret. Empty for a broker.
    pub fn url(&self) -> &str {
        match (&self.url, self.kind) {
            (Some(url), _) => url,
            (None, EarKind::SatnogsDb) => "https://db.satnogs.org/api/telemetry/",
            (None, _) => "",
        }
    }

    /// Where it leads, for people.
    pub fn shown(&self) -> String {
        match self.kind {
            EarKind::Broker => self.listen().to_string(),
            _ => self.url().to_owned(),
        }
    }

    /// Minutes between two looks: far from passes, and near one.
    pub fn rhythm_min(&self) -> (u32, u32) {
        let (far, near) = if self.kind == EarKind::SatnogsDb { (60, 15) } else { (30, 5) };
        let far = self.every_min.unwrap_or(far);
        (far, self.near_pass_every_min.unwrap_or(near).min(far))
    }

    /// Requests in any hour.
    pub fn per_hour(&self) -> u32 {
        self.per_hour.unwrap_or(if self.kind == EarKind::SatnogsDb { 30 } else { 60 })
    }

    pub(super) fn paths(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let tls = self.tls.iter_mut().flat_map(|tls| [&mut tls.certificate, &mut tls.key]);
        let files = [&mut self.password_file, &mut self.ca_file, &mut self.modem_file, &mut self.token_file];
        let boards = self.boards.iter_mut().map(|board| &mut board.password_file);
        files.into_iter().filter_map(Option::as_mut).chain(boards).chain(tls)
    }

    /// Keys that were given, besides name, kind and satellite.
    fn given(&self) -> Vec<&'static str> {
        let mut given = Vec::new();
        let mut note = |is_there: bool, key| {
            if is_there {
                given.push(key);
            }
        };
        note(self.url.is_some(), "url");
        note(self.user.is_some(), "user");
        note(self.password_file.is_some(), "password_file");
        note(self.ca_file.is_some(), "ca_file");
        note(self.client_id.is_some(), "client_id");
        note(self.topics.is_some(), "topics");
        note(self.listen.is_some(), "listen");
        note(!self.boards.is_empty(), "boards");
        note(self.tls.is_some(), "tls");
        note(self.modem_file.is_some(), "modem_file");
        note(self.token_file.is_some(), "token_file");
        note(!self.headers.is_empty(), "headers");
        note(!self.names.is_empty(), "names");
        note(self.details.is_some(), "details");
        note(self.paging, "paging");
        note(self.norad.is_some(), "norad");
        note(self.every_min.is_some(), "every_min");
        note(self.near_pass_every_min.is_some(), "near_pass_every_min");
        note(self.per_hour.is_some(), "per_hour");
        given
    }

    fn check(&self, key: &str, config: &Config) -> Checked {
        if let Err(error) = mission::LinkId::new(&self.name) {
            return fail(format!("{key}.name"), error.to_string(), "Give 1 to 32 of a-z, 0-9, - and _.");
        }
        let remedy = "Give the name of a [[satellites]] section.";
        match self.satellite(config) {
            None => return fail(format!("{key}.satellite"), "there are several satellites", remedy),
            Some(named) if !config.satellites.iter().any(|known| known.name == named) => {
                return fail(format!("{key}.satellite"), format!("'{named}' is not among them"), remedy);
            }
            Some(_) => {}
        }
        if let Some(stray) = self.given().into_iter().find(|given| !self.kind.keys().contains(given)) {
            return fail(
                format!("{key}.{stray}"),
                format!("it means nothing for kind = \"{}\"", self.kind.name()),
                &format!("Remove it; there are {}.", self.kind.keys().join(", ")),
            );
        }
        match self.kind {
            EarKind::Mqtt => self.check_mqtt(key),
            EarKind::Broker => self.check_broker(key),
            EarKind::TinygsApi | EarKind::SatnogsDb => self.check_poller(key, config),
        }
    }

    fn parsed(&self, key: &str) -> Checked<Url> {
        let key = format!("{key}.url");
        if self.url().is_empty() || self.url().len() > URL_MAX {
            return fail(
                key,
                format!("{} bytes long", self.url().len()),
                "Give an address, at most 2000 bytes.",
            );
        }
        let Ok(url) = Url::parse(self.url()) else {
            // It is not repeated: what is no address may be a secret.
            return fail(
                key,
                "it is no address",
                "Write e.g. mqtts://broker.example.org:8883 or https://host/path/.",
            );
        };
        if !url.username().is_empty() || url.password().is_some() {
            return fail(
                key,
                "a name or password stands in the address",
                "Give user and password_file, or token_file.",
            );
        }
        if url.host_str().unwrap_or_default().is_empty() || url.fragment().is_some() {
            return fail(key, "no host, or a fragment (#…)", "Write e.g. https://host/path/.");
        }
        Ok(url)
    }

    fn check_mqtt(&self, key: &str) -> Checked {
        let url = self.parsed(key)?;
        match url.scheme() {
            "mqtts" => {}
            "mqtt" if is_near(&url) => {}
            "mqtt" => {
                return fail(
                    format!("{key}.url"),
                    "a broker elsewhere is asked without encryption",
                    "Write mqtts://, or run the broker on this machine or in a network of your own.",
                );
            }
            other => {
                return fail(
                    format!("{key}.url"),
                    format!("'{other}' is not MQTT"),
                    "Write mqtts:// or mqtt://.",
                );
            }
        }
        if self.password_file.is_some() != self.user.is_some() {
            return fail(
                format!("{key}.user"),
                "user and password_file go together",
                "Give both or neither.",
            );
        }
        if let Some(id) = self.client_id.as_ref().filter(|id| !is_plain(id, 64)) {
            let found = format!("'{}'", id.chars().take(64).collect::<String>());
            return fail(format!("{key}.client_id"), found, "Give 1 to 64 printable characters.");
        }
        if let Some(topics) = &self.topics {
            let is_one = |topic: &String| topic.starts_with("tinygs/") && topic.len() <= 256;
            if topics.is_empty() || topics.len() > LIST_MOST || !topics.iter().all(is_one) {
                return fail(
                    format!("{key}.topics"),
                    "it must hold 1 to 64 topics that begin with tinygs/",
                    "Leave it out for tinygs/+/+/tele/+ and tinygs/+/+/stat/+.",
                );
            }
        }
        Ok(())
    }

    fn check_broker(&self, key: &str) -> Checked {
        let is_loopback = self.listen().ip().to_canonical().is_loopback();
        if !is_loopback && self.boards.is_empty() {
            return fail(
                format!("{key}.boards"),
                format!("{} is reached from other machines, and anybody there could send", self.listen()),
                "Name who may log in: boards = [{ user = \"…\", password_file = \"…\" }].",
            );
        }
        let mut users = BTreeSet::new();
        for (at, board) in self.boards.iter().enumerate() {
            let key = format!("{key}.boards[{at}].user");
            if !is_plain(&board.user, 30) {
                return fail(
                    key,
                    "it is no name",
                    "Give 1 to 30 characters without / + #, as on the board's page.",
                );
            }
            if !users.insert(&board.user) {
                return fail(key, format!("'{}' is there twice", board.user), "Names are unique.");
            }
        }
        if self.boards.len() > LIST_MOST {
            return fail(format!("{key}.boards"), format!("there are {}", self.boards.len()), "64 fit.");
        }
        Ok(())
    }

    fn check_poller(&self, key: &str, config: &Config) -> Checked {
        let url = self.parsed(key)?;
        match url.scheme() {
            "https" => {}
            "http" if is_loopback(&url) => {}
            scheme => {
                return fail(format!("{key}.url"), format!("'{scheme}' is not encrypted"), "Write https://.");
            }
        }
        if self.kind == EarKind::TinygsApi && (!url.path().ends_with('/') || url.query().is_some()) {
            let remedy = "Give where its paths begin, with the version: https://api.tinygs.com/v2/.";
            return fail(format!("{key}.url"), "it does not end in /", remedy);
        }
        if config.simulation.is_some() && !is_loopback(&url) {
            let problem = "simulated time would ask a real source more often than it allows";
            return fail(format!("{key}.url"), problem, "Remove the section, and import files.");
        }
        for (name, value) in &self.headers {
            let key = format!("{key}.headers.{name}");
            let sound = reqwest::header::HeaderName::try_from(name.as_str()).is_ok()
                && reqwest::header::HeaderValue::try_from(value.as_str()).is_ok();
            if !sound || OWN_HEADERS.contains(&name.to_ascii_lowercase().as_str()) {
                let remedy = "Give headers that TinyGS told you to send; a token goes into token_file.";
                return fail(key, "it cannot be sent", remedy);
            }
        }
        if self.names.len() > LIST_MOST || !self.names.iter().all(|name| is_plain(name, 64)) {
            return fail(
                format!("{key}.names"),
                "a name is empty, too long or has / + #",
                "Give names as TinyGS has them.",
            );
        }
        let known =
            config.satellites.iter().find(|known| Some(known.name.as_str()) == self.satellite(config));
        let number = self.norad.or_else(|| known?.norad_cat_id);
        if self.kind == EarKind::SatnogsDb && number.is_none_or(|number| number == 0 || number > 999_999_999)
        {
            let remedy =
                "Give the number that SatNOGS gave the satellite, also a temporary one such as 98765.";
            return fail(format!("{key}.norad"), "there is no number to ask for", remedy);
        }
        let (far, near) = self.rhythm_min();
        if !(2..=1440).contains(&far) || !(2..=1440).contains(&near) {
            return fail(
                format!("{key}.every_min"),
                format!("{far} and {near} min"),
                "Give 2 to 1440 minutes.",
            );
        }
        if !(2..=240).contains(&self.per_hour()) {
            return fail(
                format!("{key}.per_hour"),
                format!("{}", self.per_hour()),
                "Give 2 to 240 requests.",
            );
        }
        Ok(())
    }
}

impl Config {
    pub(super) fn check_ears(&self) -> Checked {
        if self.ears.len() > MOST {
            return fail("ears", format!("there are {}", self.ears.len()), "16 fit.");
        }
        for (at, ear) in self.ears.iter().enumerate() {
            let key = format!("ears[{at}]");
            ear.check(&key, self)?;
            let before = &self.ears[..at];
            if before.iter().any(|other| other.name == ear.name) {
                return fail(
                    format!("{key}.name"),
                    format!("'{}' is there twice", ear.name),
                    "Names are unique.",
                );
            }
            if ear.kind != EarKind::Broker
                && before.iter().any(|other| {
                    other.kind == ear.kind && other.url() == ear.url() && other.satellite == ear.satellite
                })
            {
                return fail(
                    format!("{key}.url"),
                    "another ear has it, too",
                    "One ear asks for all of a satellite.",
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

    fn with(more: &str) -> Result<Config, ConfigError> {
        let text = format!(
            "[station]\nname = \"roof\"\n[[satellites]]\nname = \"a\"\nnorad_cat_id = 98765\n[[links]]\nname = \"e22\"\nsatellite = \"a\"\n\
             kind = \"serial\"\nport = \"/dev/ttyUSB0\"\n[storage]\nfolder = \"data\"\n{more}"
        );
        let config = Config::from_toml(&text, Path::new("/srv"))?;
        config.check()?;
        Ok(config)
    }

    #[test]
    fn each_kind_has_its_keys_and_paths_are_relative_to_the_file() {
        assert!(with("").unwrap().ears.is_empty(), "nothing unless somebody says so");
        let config = with(
            "[[ears]]\nname = \"club\"\nkind = \"mqtt\"\nurl = \"mqtts://broker.example.org\"\nuser = \"team\"\npassword_file = \"pw\"\n\
             [[ears]]\nname = \"own\"\nkind = \"broker\"\nlisten = \"0.0.0.0:1883\"\nboards = [{ user = \"team\", password_file = \"b\" }]\n\
             [[ears]]\nname = \"net\"\nkind = \"tinygs-api\"\nurl = \"https://api.tinygs.com/v2/\"\nheaders = { \"x-team\" = \"us\" }\n\
             [[ears]]\nname = \"db\"\nkind = \"satnogs-db\"\ntoken_file = \"token\"\n",
        )
        .unwrap();
        assert_eq!(config.ears[0].password_file.as_deref(), Some(Path::new("/srv/pw")));
        assert_eq!(config.ears[1].boards[0].password_file, Path::new("/srv/b"));
        assert_eq!(config.ears[3].url(), "https://db.satnogs.org/api/telemetry/");
        assert_eq!((config.ears[2].rhythm_min(), config.ears[2].satellite(&config)), ((30, 5), Some("a")));
        let shown = config.to_string();
        assert!(shown.contains("ear own (broker): 0.0.0.0:1883"), "{shown}");
    }

    #[test]
    fn what_is_open_to_strangers_impolite_or_leaks_is_refused_with_its_key() {
        let api = "kind = \"tinygs-api\"\nurl = \"https://api.tinygs.com/v2/\"";
        for (more, says) in [
            ("kind = \"broker\"\nlisten = \"0.0.0.0:1883\"".to_owned(), "ears[0].boards"),
            ("kind = \"broker\"\nurl = \"mqtt://x\"".into(), "means nothing"),
            ("kind = \"mqtt\"".into(), "ears[0].url"),
            ("kind = \"mqtt\"\nurl = \"mqtt://broker.example.org\"".into(), "mqtts"),
            ("kind = \"mqtt\"\nurl = \"mqtts://me:hunter2@x.org\"".into(), "password_file"),
            ("kind = \"mqtt\"\nurl = \"mqtts://x.org\"\nuser = \"me\"".into(), "ears[0].user"),
            ("kind = \"mqtt\"\nurl = \"mqtts://x.org\"\ntopics = [\"#\"]".into(), "ears[0].topics"),
            ("kind = \"tinygs-api\"\nurl = \"http://api.tinygs.com/v2/\"".into(), "https"),
            ("kind = \"tinygs-api\"\nurl = \"https://api.tinygs.com/v2\"".into(), "end in /"),
            (format!("{api}\nheaders = {{ authorization = \"x\" }}"), "token_file"),
            (format!("{api}\nevery_min = 1"), "ears[0].every_min"),
            (format!("{api}\nper_hour = 1000"), "ears[0].per_hour"),
            (format!("{api}\nsatellite = \"b\""), "ears[0].satellite"),
            (format!("{api}\npassword = \"hunter2\""), "password"),
        ] {
            let error = with(&format!("[[ears]]\nname = \"x\"\n{more}\n")).unwrap_err().to_string();
            assert!(error.contains(says), "{more}: {error}");
            assert!(says == "password" || !error.contains("hunter2"), "{error}");
        }
        for near in ["mqtt://localhost", "mqtt://192.168.1.7:1883", "mqtt://broker", "mqtt://pi.local"] {
            with(&format!("[[ears]]\nname = \"x\"\nkind = \"mqtt\"\nurl = \"{near}\"\n")).unwrap();
        }
    }
}
