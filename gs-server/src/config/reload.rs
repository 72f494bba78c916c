//! What a changed file means for a server that runs: what can be applied, and what needs a restart.

use super::Config;

/// The difference between the configuration in force and a new one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Changes {
    /// Links whose `armed` changed, and what it is now.
    pub armed: Vec<(String, bool)>,
    /// The new log filter.
    pub log_filter: Option<String>,
    /// Keys that changed and are only read at start.
    pub need_restart: Vec<String>,
}

impl Changes {
    /// What differs between `old` and `new`.
    pub fn between(old: &Config, new: &Config) -> Self {
        let mut changes = Self::default();
        let mut need_restart = Vec::new();
        let mut note = |differs: bool, key: &str| {
            if differs {
                need_restart.push(key.to_owned());
            }
        };
        note(old.station != new.station, "station");
        note(old.satellites != new.satellites, "satellites");
        note(old.storage != new.storage, "storage");
        note(old.rotator != new.rotator, "rotator");
        note(old.rig != new.rig, "rig");
        note(old.http != new.http, "http");
        note(old.elements != new.elements, "elements");
        note(old.ears != new.ears, "ears");
        note(old.backup != new.backup, "backup");
        note(old.disk != new.disk, "disk");
        note(old.retention != new.retention, "retention");
        note(old.alerts != new.alerts, "alerts");
        note(old.forward != new.forward, "forward");
        note(old.reports != new.reports, "reports");
        note(old.simulation != new.simulation, "simulation");
        note(old.log.json != new.log.json, "log.json");
        note(old.links.len() != new.links.len(), "links");
        for link in &new.links {
            match old.links.iter().find(|l| l.name == link.name) {
                None => note(true, &format!("links '{}'", link.name)),
                Some(before) => {
                    let mut same_otherwise = before.clone();
                    same_otherwise.armed = link.armed;
                    note(same_otherwise != *link, &format!("links '{}'", link.name));
                    if before.armed != link.armed {
                        changes.armed.push((link.name.clone(), link.armed));
                    }
                }
            }
        }
        changes.need_restart = need_restart;
        if old.log.filter != new.log.filter {
            changes.log_filter = Some(new.log.filter.clone());
        }
        changes
    }

    /// Nothing differs.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
