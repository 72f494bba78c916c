//! `[backup]`, `[disk]` and `[retention]`: what keeps a server running for years.

use std::path::PathBuf;

use serde::Deserialize;

use super::{Config, ConfigError};

/// `[backup]`: backups that the server takes by itself.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BackupSection {
    /// Where they go; not in the data folder. Made with mode 0700.
    pub folder: PathBuf,
    /// Hours between two. Default 24.
    #[serde(default = "a_day")]
    pub every_h: u32,
    /// How many are kept, the newest. Default 14.
    #[serde(default = "two_weeks")]
    pub keep: u32,
}

const fn a_day() -> u32 {
    24
}

const fn two_weeks() -> u32 {
    14
}

/// `[disk]`: when the disk of the data folder worries somebody, by what is left and by days at the present rate.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DiskSection {
    /// Worth an eye below this, bytes. Default 5 GiB.
    pub watch_bytes: u64,
    /// Worth a thought below this, bytes. Default 1 GiB.
    pub warning_bytes: u64,
    /// Soon nothing will be stored: below this, bytes. Default 256 MiB.
    pub critical_bytes: u64,
    /// Days left. Default 60.
    pub watch_days: f64,
    /// Days left. Default 14.
    pub warning_days: f64,
    /// Days left. Default 2.
    pub critical_days: f64,
}

impl Default for DiskSection {
    fn default() -> Self {
        Self {
            watch_bytes: 5 << 30,
            warning_bytes: 1 << 30,
            critical_bytes: 256 << 20,
            watch_days: 60.0,
            warning_days: 14.0,
            critical_days: 2.0,
        }
    }
}

/// `[retention]`: what may go. Raw frames never do.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RetentionSection {
    /// Values derived from frames that are older than so many days are removed; `redecode` makes them again. Default: none.
    pub telemetry_days: Option<u32>,
}

impl Config {
    pub(super) fn check_ops(&self) -> Result<(), ConfigError> {
        if let Some(backup) = &self.backup {
            if backup.folder.starts_with(&self.storage.folder) {
                return Err(ConfigError::value(
                    "backup.folder",
                    format!("{} lies in the data folder", backup.folder.display()),
                    "Name a folder on another disk, or at least elsewhere: what takes one away must not take both.",
                ));
            }
            if !(1..=8760).contains(&backup.every_h) {
                let found = format!("{} hours", backup.every_h);
                return Err(ConfigError::value("backup.every_h", found, "Give 1 to 8760."));
            }
            if backup.keep == 0 {
                return Err(ConfigError::value(
                    "backup.keep",
                    "0",
                    "Give 1 or more: the newest is always kept.",
                ));
            }
        }
        let disk = &self.disk;
        let ordered = |watch: f64, warning: f64, critical: f64| {
            watch >= warning && warning >= critical && critical >= 0.0
        };
        if !ordered(disk.watch_days, disk.warning_days, disk.critical_days) {
            let found = format!("{}, {}, {} days", disk.watch_days, disk.warning_days, disk.critical_days);
            let remedy =
                "Give watch_days at least warning_days, and that at least critical_days; 0 switches one off.";
            return Err(ConfigError::value("disk.watch_days", found, remedy));
        }
        if !(disk.watch_bytes >= disk.warning_bytes && disk.warning_bytes >= disk.critical_bytes) {
            let found =
                format!("{}, {}, {} bytes", disk.watch_bytes, disk.warning_bytes, disk.critical_bytes);
            let remedy = "Give watch_bytes at least warning_bytes, and that at least critical_bytes; 0 switches one off.";
            return Err(ConfigError::value("disk.watch_bytes", found, remedy));
        }
        match self.retention.telemetry_days {
            Some(days) if days < 30 => Err(ConfigError::value(
                "retention.telemetry_days",
                format!("{days} days"),
                "Give 30 or more, or nothing: values are small, and raw frames are kept in any case.",
            )),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn checked(more: &str) -> Result<Config, ConfigError> {
        let text = format!(
            "[station]\nname = \"a\"\n[[satellites]]\nname = \"s\"\n[[links]]\nname = \"l\"\nsatellite = \"s\"\n\
             kind = \"serial\"\nport = \"/dev/ttyUSB0\"\n[storage]\nfolder = \"data\"\n{more}"
        );
        let config = Config::from_toml(&text, Path::new("/srv"))?;
        config.check().map(|()| config)
    }

    #[test]
    fn they_are_optional_and_have_defaults() {
        let config = checked("").unwrap();
        assert_eq!((config.backup, config.disk), (None, DiskSection::default()));
        assert_eq!(config.retention.telemetry_days, None, "nothing goes unless somebody says so");
        let backup = checked("[backup]\nfolder = \"../backup\"").unwrap().backup.unwrap();
        assert_eq!(
            (backup.folder.as_path(), backup.every_h, backup.keep),
            (Path::new("/srv/../backup"), 24, 14)
        );
    }

    #[test]
    fn what_cannot_be_is_refused_with_its_key() {
        for (text, key) in [
            ("[backup]\nfolder = \"data/backup\"", "backup.folder"),
            ("[backup]\nfolder = \"b\"\nevery_h = 0", "backup.every_h"),
            ("[backup]\nfolder = \"b\"\nkeep = 0", "backup.keep"),
            ("[disk]\nwatch_days = 1", "disk.watch_days"),
            ("[disk]\ncritical_bytes = 2000000000", "disk.watch_bytes"),
            ("[retention]\ntelemetry_days = 3", "retention.telemetry_days"),
        ] {
            let error = checked(text).unwrap_err().to_string();
            assert!(error.contains(key), "{text}: {error}");
        }
    }
}
