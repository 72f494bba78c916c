//! The data folder: whose it is, whether it holds what is written to it, and what the archive and the witness say.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::Path;

use mission::snapshot::Witness;
use mission::{Clock as _, UtcUs};
use protocol::Counter;

use super::{Finding, days, with_reasons};
use crate::clock::SystemClock;
use crate::config::{Config, CounterSetting};
use crate::keys;
use crate::ops::metrics::machine::Folder;
use crate::storage::{Archive, DATABASE, Inspection, inspect_database};
use crate::witness::WitnessFolder;

/// A disk that takes longer to make a small file durable holds up every frame and every command.
const SLOW_MS: u64 = 200;

/// The process that works in the data folder; its number is `None` when it did not leave one.
pub(super) fn holder(config: &Config) -> Option<Option<u32>> {
    let mut file = File::open(config.storage.folder.join("lock")).ok()?;
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => {
            let mut text = String::new();
            let _ = file.read_to_string(&mut text);
            Some(text.trim().parse().ok())
        }
        _ => None,
    }
}

pub(super) fn folder(config: &Config) -> Vec<Finding> {
    let folder = &config.storage.folder;
    let check = "data folder";
    let Ok(meta) = folder.metadata() else {
        let told = format!("{} does not exist yet", folder.display());
        return vec![Finding::watch(
            check,
            told,
            "The first start makes it, if its parent may be written to.",
        )];
    };
    let (mode, owner) = (meta.mode() & 0o777, meta.uid());
    let user = rustix::process::geteuid().as_raw();
    let mut findings = Vec::new();
    findings.push(if owner != user {
        Finding::warning(
            check,
            format!("{} belongs to user {owner}, this is user {user}", folder.display()),
            "Run doctor as the user of the server; or give the folder to that user (`chown -R`).",
        )
    } else if mode & 0o077 != 0 {
        let remedy = format!("Run `chmod 700 {}`: the token and the archive are in it.", folder.display());
        Finding::warning(
            check,
            format!("{} has mode {mode:04o}: others may look in", folder.display()),
            remedy,
        )
    } else {
        Finding::ok(check, format!("{}, mode {mode:04o}", folder.display()))
    });
    findings.push(space(config));
    findings.push(sync(folder));
    findings
}

fn space(config: &Config) -> Finding {
    let check = "disk";
    let found = Folder::look(&config.storage.folder);
    let Some(free) = found.free_bytes else {
        return Finding::watch(check, "nobody says how much is free", "Look with `df`.");
    };
    let told = format!(
        "{:.2} GB free, database {:.3} GB, log {:.3} GB",
        free as f64 / 1e9,
        found.database_bytes.unwrap_or(0) as f64 / 1e9,
        found.log_bytes.unwrap_or(0) as f64 / 1e9,
    );
    let remedy = "Make room, or move the folder to a larger disk.";
    if free < config.disk.warning_bytes {
        Finding::warning(check, told, remedy)
    } else if free < config.disk.watch_bytes {
        Finding::watch(check, told, remedy)
    } else {
        Finding::ok(check, told)
    }
}

/// Writes a small file, makes it durable, and removes it.
fn sync(folder: &Path) -> Finding {
    let check = "durable writes";
    let path = folder.join(".doctor");
    let clock = SystemClock::new();
    let began = clock.now().mono;
    let result = OpenOptions::new()
        .write(true)
        .create(true)
        .truncate(true)
        .mode(0o600)
        .open(&path)
        .and_then(|mut file| file.write_all(&[0; 4096]).and_then(|()| file.sync_all()));
    let took_ms = clock.now().mono.since(began) / 1000;
    let _ = std::fs::remove_file(&path);
    match result {
        Err(error) => Finding::warning(
            check,
            format!("{} cannot be written: {error}", folder.display()),
            "Look at the owner, the mount (`mount | grep ro`) and the disk (`dmesg`).",
        ),
        Ok(()) if took_ms > SLOW_MS => Finding::watch(
            check,
            format!("4 KB took {took_ms} ms"),
            "Every frame and command waits for that: use a better disk than a worn SD card or a network share.",
        ),
        Ok(()) => Finding::ok(check, format!("4 KB took {took_ms} ms")),
    }
}

pub(super) async fn database(config: &Config, now: UtcUs) -> Vec<Finding> {
    let check = "database";
    if config.storage.database.is_some() {
        let (mut findings, inspection) = super::postgres::database(config).await;
        if let Some(inspection) = &inspection {
            findings.extend(witness(config, inspection));
            findings.extend(elements(config, inspection, now));
        }
        return findings;
    }
    let folder = &config.storage.folder;
    if !folder.join(DATABASE).is_file() {
        return vec![Finding::ok(check, "there is none yet: the first start makes it")];
    }
    let inspection = match inspect_database(&Archive::in_folder(folder)).await {
        Ok(inspection) => inspection,
        Err(error) => {
            let remedy = "Do what it says; docs/storage.md tells how to restore a backup.";
            return vec![Finding::warning(check, with_reasons(&error), remedy)];
        }
    };
    let facts = &inspection.facts;
    let known = migrations::newest_sqlite();
    let told = format!(
        "whole ({} rows looked at): {} frames, {} events, schema {}, {}",
        inspection.rows_checked, facts.last_frame, facts.last_event, facts.schema, inspection.engine
    );
    let first = if facts.schema > known {
        let told = format!("it has schema {}, this program knows up to {known}", facts.schema);
        Finding::warning(check, told, "Start the newer program that made it.")
    } else if facts.simulated != config.is_simulated() {
        let told =
            format!("it was made by a {}", if facts.simulated { "simulation" } else { "real station" });
        Finding::warning(
            check,
            told,
            "Use another data folder (storage.folder): simulated and real never meet.",
        )
    } else if facts.station != config.station.name {
        let told =
            format!("it is of station {}, the configuration is of {}", facts.station, config.station.name);
        Finding::watch(check, told, "The next start gives it the new name; is it the right folder?")
    } else if facts.schema < known {
        Finding::watch(
            check,
            told,
            format!("The next start brings it to schema {known}: take a backup before."),
        )
    } else {
        Finding::ok(check, told)
    };
    let mut findings = vec![first];
    findings.extend(witness(config, &inspection));
    findings.extend(elements(config, &inspection, now));
    findings
}

fn witness(config: &Config, inspection: &Inspection) -> Vec<Finding> {
    let Ok(folder) = WitnessFolder::open(&config.storage.folder.join("witness")) else { return Vec::new() };
    let keys = config.satellites.iter().filter_map(|satellite| {
        let key = keys::load(satellite.key_file.as_ref()?).ok()?.id();
        Some((satellite, key))
    });
    let confirm = "Find out why before you confirm the counter (docs/storage.md, Restore): a nonce that is used twice gives the key away.";
    let each = keys.map(|(satellite, key)| {
        let check = format!("counter of {}", satellite.name);
        let database = inspection.counters.get(&key.to_string()).copied();
        let told =
            |counter: Option<Counter>| counter.map_or("none".to_owned(), |counter| counter.0.to_string());
        match (database, folder.read(key)) {
            (None, Witness::Missing) => Finding::ok(check, "none was used yet"),
            (Some(database), Witness::At(at)) if at <= database => {
                Finding::ok(check, format!("{}, the witness agrees", database.0))
            }
            (database, Witness::At(at)) => Finding::warning(
                check,
                format!(
                    "the witness stands at {}, the database at {}: it went back. Nothing is sealed",
                    at.0,
                    told(database)
                ),
                confirm,
            ),
            (_, Witness::Missing) => Finding::warning(
                check,
                "counters were used, and the witness is gone. Nothing is sealed",
                confirm,
            ),
            (_, Witness::Damaged(why)) => Finding::warning(
                check,
                format!("the witness cannot be read ({why}). Nothing is sealed"),
                confirm,
            ),
            (_, Witness::Restored(_)) => Finding::warning(
                check,
                "the folder was restored from a backup. Nothing is sealed",
                match satellite.counter {
                    CounterSetting::Time => {
                        "See that the clock is right, then confirm the counter: `gs-server key confirm`."
                    }
                    CounterSetting::Sequence => {
                        "Find out the last counter that was used (the satellite may tell), then: `gs-server key confirm --above N`."
                    }
                },
            ),
        }
    });
    each.collect()
}

fn elements(config: &Config, inspection: &Inspection, now: UtcUs) -> Vec<Finding> {
    if config.station.latitude_deg.is_none() {
        return vec![Finding::watch(
            "elements",
            "the station does not know where it stands: nothing is known of passes",
            "Give station.latitude_deg and longitude_deg.",
        )];
    }
    let add = "Give new ones: `gs-server elements add`, or [elements] in the configuration.";
    let each = config.satellites.iter().map(|satellite| {
        let check = format!("elements of {}", satellite.name);
        match inspection.epochs_us.get(&satellite.name) {
            None => Finding::watch(check, "there are none: nothing is known of its passes", add),
            Some(epoch) => {
                let age = days(UtcUs(*epoch), now);
                let told = format!("{age:.1} days old");
                match age {
                    14.0.. => Finding::warning(check, told, add),
                    7.0.. => Finding::watch(check, told, add),
                    _ => Finding::ok(check, told),
                }
            }
        }
    });
    each.collect()
}
