//! Nothing radiates outside a window: each hand-over to a radio is held against what the engine was told, computed anew.
//!
//! The window is a matter of the station's own clock and of the elements that it holds at that moment: a station that was told a
//! wrong time or wrong elements keeps to them. Computed here from `tle` alone, by other code than the engine's.

use std::sync::Arc;

use mission::run::RunState;
use mission::sky::{ElementSet, ElementsAge, instant, passes_of};
use mission::{ElementsId, Transmit, UtcUs};
use radio::airtime::LinkTiming;
use satellite::Orbit;
use tle::{Elements, Propagator, ecef_from_teme, gmst_rad};

use super::chaos::{TruePass, TruePasses};
use super::scene::{DAY_US, SATELLITES, STATIONS, ZERO, satellite_name, site};
use super::world::Fleet;
use crate::checks::{Invariant, Violation};

/// A pass is found to about a millisecond, and near the horizon a satellite climbs by 0.05° to 0.1° in a second: so much may the
/// engine's AOS and LOS differ from an elevation computed directly, and a tenth of a second besides.
const ELEVATION_TOLERANCE_DEG: f64 = 0.01;
/// What a satellite flies in half a minute, km.
const MISLED_KM: f64 = 228.0;
/// The radio has the bytes on the air within this after the hand-over, microseconds: 240 bytes at 9600 baud take 0.25 s, and a
/// module that is busy with a received frame waits for its end.
const HAND_OVER_US: u64 = 2_500_000;

/// All passes over the stations by the orbits that are flown.
#[expect(clippy::expect_used, reason = "orbits that were made to be flown")]
pub(super) fn true_passes(orbits: &[Orbit; SATELLITES], days: u64) -> TruePasses {
    let until = UtcUs(ZERO.unix_us() + (days * DAY_US).cast_signed());
    let since = |at: UtcUs| u64::try_from(at.0 - ZERO.unix_us()).unwrap_or(0);
    std::array::from_fn::<_, STATIONS, _>(|g| {
        std::array::from_fn(|s| {
            let set = ElementSet { id: ElementsId(1), elements: Arc::new(orbits[s].elements().clone()) };
            let found =
                passes_of(&set, &site(g), UtcUs(ZERO.unix_us()), until).expect("an orbit that is flown");
            let pass = |pass: &mission::PassAhead| {
                Some(TruePass {
                    aos_us: since(pass.aos_at),
                    tca_us: since(pass.tca_at),
                    los_us: since(pass.los_at?),
                    max_elevation_deg: pass.max_elevation_deg,
                })
            };
            found.iter().filter_map(pass).collect()
        })
    })
}

/// Of the sets the one in force at a moment of the station's clock: the newest that is not of the future, else the nearest; of
/// two of one epoch the one that came later.
fn in_force(sets: &[Arc<Elements>], at: UtcUs) -> Option<&Arc<Elements>> {
    let at = instant(at);
    let mut best: Option<&Arc<Elements>> = None;
    for set in sets.iter().filter(|set| set.epoch <= at) {
        if best.is_none_or(|found| found.epoch <= set.epoch) {
            best = Some(set);
        }
    }
    for set in sets.iter().filter(|set| set.epoch > at) {
        if best.is_none_or(|found| found.epoch > at && set.epoch <= found.epoch) {
            best = Some(set);
        }
    }
    best
}

impl Fleet {
    /// How high the satellite stands by the elements that the engine holds; `None` where they tell nothing.
    fn told_elevation_deg(&self, g: usize, s: usize, at: UtcUs) -> Option<f64> {
        let set = in_force(&self.grounds[g].sets[s], at)?;
        if !ElementsAge::at(set, at).is_useful() {
            return None;
        }
        let site = &self.grounds[g].site;
        let state = Propagator::new(set).ok()?.at(instant(at)).ok()?;
        let object = ecef_from_teme(&state, gmst_rad(instant(at), site.orientation));
        Some(site.place.look(&object).elevation_deg)
    }

    /// The elements that the engine holds tell another orbit than is flown: half a minute of it, and more.
    pub(super) fn is_misled(&self, g: usize, s: usize, at: UtcUs) -> bool {
        let place =
            |elements: &Elements| Some(Propagator::new(elements).ok()?.at(instant(at)).ok()?.r_teme_km);
        let told = in_force(&self.grounds[g].sets[s], at).and_then(|set| place(set));
        let (Some(told), Some(flown)) = (told, place(self.orbits[s].elements())) else { return false };
        let off_km = (0..3).map(|i| (told[i] - flown[i]).powi(2)).sum::<f64>().sqrt();
        off_km > MISLED_KM
    }

    /// The engine hands bytes to a radio: may it?
    pub(super) fn check_hand_over(
        &mut self,
        g: usize,
        r: usize,
        transmit: &Transmit,
    ) -> Result<(), Violation> {
        let why_not = self.why_not(g, r, transmit);
        match why_not {
            None => Ok(()),
            Some(why) => {
                let (station, utc) = (&self.grounds[g], self.grounds[g].now(self.now_us).utc);
                let detail = format!(
                    "{} hands command {} to {} at {} of its clock: {why}",
                    super::scene::station_name(g),
                    transmit.command,
                    station.radios[r].link,
                    instant(utc)
                );
                Err(self.violation(Invariant::InWindow, detail))
            }
        }
    }

    fn why_not(&mut self, g: usize, r: usize, transmit: &Transmit) -> Option<String> {
        let ground = &self.grounds[g];
        let s = ground.radios[r].s;
        let now = ground.now(self.now_us);
        let on_air_us = i64::try_from(LinkTiming::default().uplink_us()).unwrap_or(i64::MAX);
        let end = now.utc.plus(on_air_us);
        if !ground.radios[r].armed {
            return Some("the transmitter is not armed".to_owned());
        }
        if !ground.radios[r].is_ok {
            return Some("the radio is not there".to_owned());
        }
        for at in [now.utc, end] {
            match self.told_elevation_deg(g, s, at) {
                Some(deg) if deg < ground.site.min_elevation_deg - ELEVATION_TOLERANCE_DEG => {
                    return Some(format!("the satellite stands at {deg:.2}° at {}", instant(at)));
                }
                Some(_) => {}
                None => self.report.unbelieved += 1,
            }
        }
        if let Some(windows) = &ground.times.licence
            && !windows.iter().any(|window| window.start <= now.utc && end <= window.stop)
        {
            return Some("outside the licence".to_owned());
        }
        let closed = ground.times.blackouts.iter().find(|(w, _)| w.start < end && now.utc < w.stop);
        if let Some((_, reason)) = closed {
            return Some(format!("in a blackout ({reason})"));
        }
        let store = ground.stores.get(&satellite_name(s))?;
        let Some(command) = store.commands.get(&transmit.command) else {
            return Some("the command is not stored".to_owned());
        };
        if !command.record.principal.as_str().starts_with("plan:") {
            return None;
        }
        // What a plan wants is radiated while the plan runs, within the contact that the schedule gave it.
        let running = store.runs.values().find(|run| matches!(run.state, RunState::Running | RunState::Held));
        let Some(run) = running else { return Some("its plan does not run".to_owned()) };
        // A run's record is stored when it changes; its end is what it was then, or what newer elements say.
        if now.utc < run.aos_at.plus(-on_air_us) {
            return Some(format!("before its run begins, at {}", instant(run.aos_at)));
        }
        let armed = store.plans.get(&run.plan).is_some_and(|plan| plan.armed && plan.withdrawn_at.is_none());
        (!armed).then(|| "its plan is not armed".to_owned())
    }

    /// Something left the antenna: it was handed over shortly before, and nothing else of the station is on the air.
    pub(super) fn check_radiation(
        &mut self,
        g: usize,
        s: usize,
        packet: &[u8],
        (start_us, end_us): (u64, u64),
    ) -> Result<(), Violation> {
        let ground = &self.grounds[g];
        let handed = ground.handed.iter().rev().find(|handed| handed.s == s && handed.frame[..] == *packet);
        let Some(handed) = handed else {
            let detail = "something was radiated that was not handed over".to_owned();
            return Err(self.violation(Invariant::InWindow, detail));
        };
        let late_us = start_us.saturating_sub(handed.at_us);
        if late_us > HAND_OVER_US {
            let detail = format!("radiated {late_us} us after the hand-over");
            return Err(self.violation(Invariant::InWindow, detail));
        }
        if start_us < ground.on_air[1].1 {
            let detail = format!("two radios of a station at once, at {start_us}");
            return Err(self.violation(Invariant::OneOnAir, detail));
        }
        let Some(store) = ground.stores.get(&satellite_name(s)) else { return Ok(()) };
        let check = self.airs[s].radiated(store, packet, start_us, end_us);
        check.map_err(|(invariant, detail)| self.violation(invariant, detail))?;
        if !self.space[s].in_view(start_us) {
            self.report.into_the_ground += 1;
        }
        Ok(())
    }
}
