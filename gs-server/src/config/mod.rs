//! The configuration: one TOML file, one struct per section.
//!
//! Unknown keys are refused; every error names the key, what was found and what to do. Paths are relative to the
//! folder of the file. `docs/configuration.md` is the operator's page on it.
//!
//! ```
//! let text = r#"
//!     [station]
//!     name = "uni-roof"
//!     [[satellites]]
//!     name = "pixelsat-1"
//!     [[links]]
//!     name = "e22"
//!     satellite = "pixelsat-1"
//!     kind = "serial"
//!     port = "/dev/ttyUSB0"
//!     [storage]
//!     folder = "data"
//! "#;
//! let config = gs_server::config::Config::from_toml(text, std::path::Path::new("/srv/ground"))?;
//! config.check()?;
//! assert_eq!(config.storage.folder, std::path::Path::new("/srv/ground/data"));
//! # Ok::<(), gs_server::config::ConfigError>(())
//! ```

mod alerts;
mod antenna;
mod check;
mod ears;
mod elements;
mod environment;
mod error;
mod forward;
mod links;
mod ops;
mod reload;
mod reports;
mod satellites;
mod server;
mod station;
mod summary;

use std::path::{Path, PathBuf};

use serde::Deserialize;

pub(crate) use alerts::target_url;
pub use alerts::{
    AlertsSection, EscalationSection, RuleSection, TargetKind, TargetSection, TransportSecurity,
};
pub use antenna::{RigSection, RotatorSection};
pub use ears::{BoardLogin, EarKind, EarSection, TlsFilesSection};
pub(crate) use elements::is_loopback;
pub use elements::{ElementsSection, FetchSource, MIN_AGE_LEAST_H};
pub use environment::Environment;
pub(crate) use environment::secret as environment_secret;
pub use error::ConfigError;
pub use forward::{ForwardKind, ForwardSection};
pub use links::{AuxInput, LinkKind, LinkSection, ModePinWiring, Phy, UsbId};
pub use ops::{BackupSection, DiskSection, RetentionSection};
pub use reload::Changes;
pub use reports::ReportsSection;
pub use satellites::{CounterSetting, LimitSection, SatelliteSection, Thresholds};
pub use server::{
    ClockSetting, HttpSection, LogSection, PeopleSection, SimulationSection, StationSection, StorageSection,
    TlsSection, TwoPerson, WindowSection,
};
pub use station::{driver_config, station_config};

/// Everything that `serve` must know.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Who we are.
    pub station: StationSection,
    /// Whom we hear and command.
    #[serde(default)]
    pub satellites: Vec<SatelliteSection>,
    /// The ways to our radios.
    #[serde(default)]
    pub links: Vec<LinkSection>,
    /// Where everything is kept.
    pub storage: StorageSection,
    /// Where elements are fetched from; nowhere by default.
    #[serde(default)]
    pub elements: ElementsSection,
    /// Ways in over the network for what others heard; none by default.
    #[serde(default)]
    pub ears: Vec<EarSection>,
    /// What is an alert, and who is told.
    #[serde(default)]
    pub alerts: AlertsSection,
    /// Who else gets what we hear; nobody by default.
    #[serde(default)]
    pub forward: Vec<ForwardSection>,
    /// The antenna's rotator, when there is one.
    #[serde(default)]
    pub rotator: Option<RotatorSection>,
    /// A rig that is tuned with the Doppler shift, when there is one.
    #[serde(default)]
    pub rig: Option<RigSection>,
    /// What is written down without being asked.
    #[serde(default)]
    pub reports: ReportsSection,
    /// Who may talk to the server, and where.
    #[serde(default)]
    pub http: HttpSection,
    /// Rules among those who may come in.
    #[serde(default)]
    pub people: PeopleSection,
    /// What is logged.
    #[serde(default)]
    pub log: LogSection,
    /// Backups that the server takes by itself; none by default.
    #[serde(default)]
    pub backup: Option<BackupSection>,
    /// When the disk worries somebody.
    #[serde(default)]
    pub disk: DiskSection,
    /// What may go; nothing by default.
    #[serde(default)]
    pub retention: RetentionSection,
    /// How simulated time runs; only with simulated links.
    #[serde(default)]
    pub simulation: Option<SimulationSection>,
}

impl Config {
    /// Reads a file. Paths in it are taken relative to its folder; the environment is applied.
    ///
    /// # Errors
    /// [`ConfigError`] when it cannot be read or is not a configuration; see also [`Config::check`].
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ConfigError::Read { path: path.to_owned(), source })?;
        let base = path.parent().unwrap_or_else(|| Path::new(""));
        let mut config = Self::from_toml(&text, base).map_err(|error| error.in_file(path))?;
        config.apply(&Environment::read());
        Ok(config)
    }

    /// Reads TOML text; relative paths are taken relative to `base`. No check of what the values mean.
    ///
    /// # Errors
    /// [`ConfigError::Syntax`] with line and column.
    pub fn from_toml(text: &str, base: &Path) -> Result<Self, ConfigError> {
        let mut config: Self = toml::from_str(text).map_err(|error| ConfigError::syntax(&error))?;
        config.anchor_paths(base);
        Ok(config)
    }

    /// Puts what the environment says over what the file says.
    pub fn apply(&mut self, environment: &Environment) {
        if let Some(listen) = environment.listen {
            self.http.listen = listen;
        }
        if let Some(folder) = &environment.data {
            self.storage.folder.clone_from(folder);
        }
        if let Some(level) = &environment.log {
            self.log.filter.clone_from(level);
        }
    }

    fn anchor_paths(&mut self, base: &Path) {
        let keys = self.satellites.iter_mut().filter_map(|satellite| satellite.key_file.as_mut());
        let files = self.links.iter_mut().filter_map(|link| link.file.as_mut());
        let others = [&mut self.storage.folder]
            .into_iter()
            .chain(self.http.token_file.as_mut())
            .chain(self.reports.folder.as_mut());
        let password = self.storage.password_file.as_mut();
        let logins = self.elements.fetch.iter_mut().filter_map(|source| source.credentials_file.as_mut());
        let backup = self.backup.as_mut().map(|backup| &mut backup.folder);
        let tls = self.http.tls.iter_mut().flat_map(|tls| [&mut tls.certificate, &mut tls.key]);
        let secrets = self.alerts.targets.iter_mut().filter_map(|target| target.secret_file.as_mut());
        let forwards = self.forward.iter_mut().filter_map(|target| target.secret_file.as_mut());
        let ears = self.ears.iter_mut().flat_map(EarSection::paths);
        let others = others.chain(secrets).chain(forwards).chain(ears);
        for path in keys.chain(files).chain(others).chain(logins).chain(backup).chain(tls).chain(password) {
            if path.is_relative() {
                *path = base.join(&*path);
            }
        }
    }

    /// Everything is simulated: the links say so ([`Config::check`] makes sure that they agree).
    pub fn is_simulated(&self) -> bool {
        self.links.iter().any(|link| link.simulated)
    }

    /// The file with the token that every write needs: as configured, or `token` in the data folder.
    pub fn token_file(&self) -> PathBuf {
        self.http.token_file.clone().unwrap_or_else(|| self.storage.folder.join("token"))
    }
}

#[cfg(test)]
mod tests;
