//! What our satellites are called elsewhere, and since when they fly.

use mission::reception::Admission;
use mission::{SatelliteId, UtcUs};

use crate::config::Config;

/// The names of all satellites of a configuration.
#[derive(Debug, Clone, Default)]
pub struct Aliases(Vec<(SatelliteId, Vec<String>, Option<UtcUs>)>);

impl Aliases {
    /// Of a configuration that was checked.
    pub fn of(config: &Config) -> Self {
        let known = config.satellites.iter().filter_map(|satellite| {
            let id = SatelliteId::new(&satellite.name).ok()?;
            let mut labels: Vec<String> =
                satellite.aliases.iter().map(|alias| alias.to_lowercase()).collect();
            labels.push(satellite.name.to_lowercase());
            labels.extend(satellite.object_name.iter().map(|name| name.to_lowercase()));
            labels.extend(satellite.norad_cat_id.iter().map(u32::to_string));
            Some((id, labels, satellite.launched_at()))
        });
        Self(known.collect())
    }

    /// What is admitted as this satellite's now. A packet without bytes is, under one of its names.
    pub fn admission(&self, satellite: &SatelliteId, now: UtcUs) -> Admission {
        let known = self.0.iter().find(|(id, ..)| id == satellite);
        Admission {
            now,
            earliest: known.and_then(|(.., launched_at)| *launched_at),
            labels: known.map(|(_, labels, _)| labels.clone()).unwrap_or_default(),
        }
    }

    /// The satellites.
    pub fn satellites(&self) -> impl Iterator<Item = &SatelliteId> {
        self.0.iter().map(|(id, ..)| id)
    }
}
