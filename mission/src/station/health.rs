//! Whether the station can be relied on in passes to come: with what has not worked for minutes nothing is planned, and as
//! soon as it works again everything is.

use super::Station;
use crate::clock::{MonoUs, Now};
use crate::id::SatelliteId;
use crate::port::LinkState;
use crate::schedule::{Blackout, Health, Scope, Window};

/// What has not worked for so long is not planned with, microseconds. A cable that is plugged anew and a daemon that
/// starts again move no pass.
const UNFIT_AFTER_US: u64 = 300_000_000;
/// Passes are planned for two days; nothing is planned beyond this, microseconds.
const HORIZON_US: i64 = 7 * 86_400_000_000;

/// One thing that may not work.
#[derive(Debug, Clone, Default)]
struct Trouble {
    since: Option<MonoUs>,
    /// What counts, once it has lasted; the first reason stays.
    unfit: Option<String>,
}

impl Trouble {
    /// Takes note of how it is now. True when that changes what may be planned; `wake` is when to look again.
    fn note(&mut self, now: MonoUs, wrong: Option<String>, wake: &mut Option<MonoUs>) -> bool {
        let was = self.unfit.is_some();
        match wrong {
            None => *self = Self::default(),
            Some(why) => {
                let since = *self.since.get_or_insert(now);
                if now.since(since) >= UNFIT_AFTER_US {
                    self.unfit.get_or_insert(why);
                } else {
                    let at = since.plus(UNFIT_AFTER_US);
                    *wake = Some(wake.map_or(at, |before| before.min(at)));
                }
            }
        }
        was != self.unfit.is_some()
    }
}

/// What works and what does not.
#[derive(Debug, Default)]
pub(super) struct Fitness {
    rotator: Trouble,
    /// The links of each satellite.
    links: Vec<Trouble>,
}

impl Station {
    /// Looks at what works. True when that changes what may be planned.
    pub(super) fn fitness_step(&mut self, now: Now) -> bool {
        let rotator = self.antenna_fault.clone().flatten().map(|why| format!("the rotator: {why}"));
        let links: Vec<Option<String>> = (0..self.satellites.len()).map(|s| self.dead_links(s)).collect();
        let fitness = &mut self.agenda.fitness;
        fitness.links.resize(links.len(), Trouble::default());
        let mut wake = None;
        let mut changed = fitness.rotator.note(now.mono, rotator, &mut wake);
        for (trouble, wrong) in fitness.links.iter_mut().zip(links) {
            changed |= trouble.note(now.mono, wrong, &mut wake);
        }
        if let (Some(at), Some(sat)) = (wake, self.satellites.first_mut()) {
            sat.wake_at(at);
        }
        changed
    }

    /// Why no link of a satellite works; `None`: one does, or it has none.
    fn dead_links(&self, s: usize) -> Option<String> {
        let links = || self.links.iter().filter(move |link| link.satellite == s);
        if links().any(|link| link.state == LinkState::Ok) {
            return None;
        }
        // A file that is played is an ear, and says nothing about the radio.
        let has_radio = links().any(|link| !link.config.receive_only);
        let told = links().filter(|link| !(has_radio && link.config.receive_only)).map(|link| {
            let why = match &link.state {
                LinkState::Ok | LinkState::Disabled => String::new(),
                LinkState::Unavailable { reason } | LinkState::Failed { reason } => format!(": {reason}"),
            };
            format!("link {} is {}{why}", link.config.id, link.state.name())
        });
        let told: Vec<String> = told.collect();
        (!told.is_empty()).then(|| told.join("; "))
    }
}

impl Fitness {
    /// Of the whole station.
    pub(super) fn health(&self) -> Health {
        self.rotator.unfit.clone().map_or(Health::Fit, Health::Unfit)
    }

    /// Of a satellite whose links are dead: the others keep the antenna.
    pub(super) fn blackout(&self, s: usize, satellite: &SatelliteId, now: Now) -> Option<Blackout> {
        let reason = self.links.get(s)?.unfit.clone()?;
        let window = Window { start: now.utc.plus(-HORIZON_US), stop: now.utc.plus(HORIZON_US) };
        Some(Blackout { scope: Scope::Satellite(satellite.clone()), window, reason })
    }
}
