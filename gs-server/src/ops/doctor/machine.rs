//! The program, keys, the clock, backups, serial ports.

use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

use mission::UtcUs;
use rustix::fs::Access;
use serialport::SerialPortType;

use super::{Finding, days, with_reasons};
use crate::clock::{clock_offset_s, kernel_says_synchronised};
use crate::config::{ClockSetting, Config, LinkKind, LinkSection};
use crate::keys;
use crate::links::serial;
use crate::ops::upkeep;

pub(super) fn version() -> Finding {
    let (os, arch) = (std::env::consts::OS, std::env::consts::ARCH);
    let told = format!(
        "gs-server {} on {os} {arch}, schema {}",
        env!("CARGO_PKG_VERSION"),
        migrations::newest_sqlite()
    );
    Finding::ok("program", told)
}

pub(super) fn keys(config: &Config) -> Vec<Finding> {
    let each = config.satellites.iter().map(|satellite| {
        let check = format!("key of {}", satellite.name);
        let Some(path) = &satellite.key_file else {
            return Finding::ok(check, "none: it is heard, not commanded");
        };
        match keys::load(path) {
            Err(error) => {
                Finding::warning(check, with_reasons(&error), "Do what it says; `serve` would not start.")
            }
            Ok(file) if file.simulated != config.is_simulated() => Finding::warning(
                check,
                format!(
                    "{} is {}, the links are not",
                    path.display(),
                    if file.simulated { "simulated" } else { "real" }
                ),
                "Take a key of the links' kind; `gs-server key new --simulated` makes one for a twin.",
            ),
            Ok(file) => Finding::ok(check, format!("{}, id {}", path.display(), file.id())),
        }
    });
    each.collect()
}

pub(super) async fn clock(config: &Config) -> Finding {
    let check = "clock";
    if config.simulation.is_some() {
        return Finding::ok(check, "simulated");
    }
    match config.station.clock {
        ClockSetting::Trust => return Finding::ok(check, "trusted by the configuration"),
        ClockSetting::Operator => return Finding::ok(check, "an operator vouches for it after each start"),
        ClockSetting::Kernel => {}
    }
    if !kernel_says_synchronised().await {
        return Finding::warning(
            check,
            "nobody says that it is synchronised: a key without a counter seals nothing",
            "Run chrony or systemd-timesyncd (`timedatectl set-ntp true`), or see station.clock in docs/configuration.md.",
        );
    }
    match clock_offset_s().await {
        Some(offset_s) if offset_s.abs() > 0.5 => Finding::watch(
            check,
            format!("synchronised, and off by {offset_s:.3} s"),
            "Passes and Doppler are off by as much: look at the sources (`chronyc sources`).",
        ),
        Some(offset_s) => Finding::ok(check, format!("synchronised, off by {:.3} ms", offset_s * 1e3)),
        None => Finding::ok(check, "synchronised"),
    }
}

pub(super) fn backups(config: &Config, now: UtcUs) -> Option<Finding> {
    let check = "backup";
    if let Some(database) = &config.storage.database {
        let remedy =
            format!("Let the database's server take them, e.g. `pg_dump --format=custom {database}`.");
        return Some(Finding::watch(
            check,
            "the archive is a PostgreSQL: its backups are not seen here",
            remedy,
        ));
    }
    let Some(section) = &config.backup else {
        let remedy = "Add a [backup] section, or take one by `gs-server backup` from a timer of your own.";
        return Some(Finding::watch(check, "the server takes none", remedy));
    };
    let newest = upkeep::newest_backup(&section.folder, &config.station.name);
    let folder = section.folder.display();
    Some(match newest {
        None => Finding::watch(
            check,
            format!("there is none in {folder} yet"),
            "Start the server: the first is taken at once.",
        ),
        Some(at) if days(at, now) * 24.0 > 2.0 * f64::from(section.every_h) => Finding::warning(
            check,
            format!("the newest in {folder} is {:.1} days old", days(at, now)),
            "Look in the log why none was taken since.",
        ),
        Some(at) => Finding::ok(check, format!("the newest in {folder} is {:.1} days old", days(at, now))),
    })
}

pub(super) fn ports(config: &Config, in_use: bool) -> Vec<Finding> {
    let wired = config.links.iter().filter(|link| link.kind == LinkKind::Serial);
    wired.map(|link| port(link, in_use)).collect()
}

fn port(link: &LinkSection, in_use: bool) -> Finding {
    let check = format!("port of {}", link.name);
    let Some(path) = path_of(link) else {
        let remedy = "Plug it in; `gs-server radio list` shows what there is.";
        return Finding::warning(check, format!("{} is not there", link.far_end()), remedy);
    };
    let path = Path::new(&path);
    let Ok(meta) = path.metadata() else {
        let remedy = "Plug it in; `gs-server radio list` shows what there is.";
        return Finding::warning(check, format!("{} is not there", path.display()), remedy);
    };
    if rustix::fs::access(path, Access::READ_OK | Access::WRITE_OK).is_err() {
        return Finding::warning(
            check,
            format!(
                "{} may not be opened: it belongs to group {}, mode {:04o}",
                path.display(),
                meta.gid(),
                meta.mode() & 0o7777
            ),
            "Add the user of the server to that group (often `usermod -aG dialout USER`), and log in again.",
        );
    }
    let by = if in_use { ", used by the server" } else { "" };
    Finding::ok(check, format!("{} is there and may be opened{by}", path.display()))
}

fn path_of(link: &LinkSection) -> Option<String> {
    let Some(wanted) = &link.usb else { return link.port.clone() };
    serial::ports().ok()?.into_iter().find_map(|port| match &port.port_type {
        SerialPortType::UsbPort(usb)
            if (usb.vid, usb.pid) == (wanted.vid, wanted.pid)
                && wanted
                    .serial_number
                    .as_ref()
                    .is_none_or(|serial| usb.serial_number.as_ref() == Some(serial)) =>
        {
            Some(port.port_name)
        }
        _ => None,
    })
}
