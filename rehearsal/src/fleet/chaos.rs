//! What goes wrong, drawn beforehand from the seed: kills, outages, clocks, elements, rotators, disks, and what people do
//! at a desk meanwhile.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::scene::{COMMANDED_FROM, DAY_US, HOUR_US, MINUTE_US, SATELLITES, SECOND_US, STATIONS};

/// A pass as it really is, on the fleet's own scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TruePass {
    pub(super) aos_us: u64,
    pub(super) tca_us: u64,
    pub(super) los_us: u64,
    pub(super) max_elevation_deg: f64,
}

/// Passes of each satellite over each station.
pub(super) type TruePasses = [[Vec<TruePass>; SATELLITES]; STATIONS];

/// Something that happens to a station.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Incident {
    /// The process dies at once and comes back after this.
    Kill { down_us: u64 },
    /// The radio of this satellite is pulled out of its port.
    Unplug { s: usize },
    /// New elements arrive, this much wrong along the track, with an epoch so long ago.
    Elements { s: usize, late_s: f64, epoch_ago_us: u64 },
    /// Nobody reaches the station, and it reaches nobody; or again.
    Network(bool),
    /// The kernel says whether its clock is synchronised.
    Synchronised(bool),
    /// The clock steps.
    StepClock { by_us: i64 },
    /// The clock is set right.
    RightClock,
    /// The rotator dies, and nothing more is heard than a turned-away antenna hears; or it lives again.
    Rotator { fails: bool },
    /// The disk takes nothing for so long.
    Disk { for_us: u64 },
    /// The operator attaches the plan that is chosen by hand to a pass around this moment.
    Attach { s: usize, at_us: u64 },
    /// The operator takes over, or gives back.
    Hold { s: usize, held: bool },
    /// The transmitter is disarmed or armed.
    ArmLink { s: usize, armed: bool },
    /// A plan is disarmed or armed: the `status` plan of this satellite.
    ArmPlan { s: usize, armed: bool },
    /// The operator wants a ping whenever it is possible within six hours.
    Ping { s: usize },
}

/// An incident with its place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Happening {
    pub(super) at_us: u64,
    pub(super) station: usize,
    pub(super) what: Incident,
}

struct Draw {
    rng: ChaCha8Rng,
    station: usize,
    /// Outages of the network: from, until.
    outages: Vec<(u64, u64)>,
    all: Vec<Happening>,
}

/// Everything that goes wrong in so many days; with `calm`, only elements arrive and pings are wanted.
pub(super) fn happenings(seed: u64, days: u64, passes: &TruePasses, calm: bool) -> Vec<Happening> {
    let mut all = Vec::new();
    for (station, passes) in passes.iter().enumerate() {
        let rng = ChaCha8Rng::seed_from_u64(seed ^ (0xc4a0_5000 + station as u64));
        let mut draw = Draw { rng, station, outages: Vec::new(), all: Vec::new() };
        if !calm {
            draw.outages(days);
        }
        for s in 0..SATELLITES {
            draw.elements(s, days);
            let is_commanded = COMMANDED_FROM[s] == station;
            for pass in &passes[s] {
                if !calm {
                    draw.in_pass(s, pass, is_commanded);
                }
            }
            if is_commanded {
                draw.desk(s, days, &passes[s]);
            }
        }
        all.append(&mut draw.all);
    }
    all.sort_by_key(|happening| happening.at_us);
    all
}

impl Draw {
    fn add(&mut self, at_us: u64, what: Incident) {
        self.all.push(Happening { at_us, station: self.station, what });
    }

    fn is_off(&self, at_us: u64) -> bool {
        self.outages.iter().any(|(from, until)| (*from..*until).contains(&at_us))
    }

    /// What somebody does who needs the network.
    fn add_online(&mut self, at_us: u64, what: Incident) -> bool {
        let possible = !self.is_off(at_us);
        if possible {
            self.add(at_us, what);
        }
        possible
    }

    /// Around 0 with a deviation of 1.
    fn normal(&mut self) -> f64 {
        let (a, b) = (1.0 - self.rng.random::<f64>(), self.rng.random::<f64>());
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }

    fn chance(&mut self, probability: f64) -> bool {
        self.rng.random::<f64>() < probability
    }

    /// The network is gone for days, twice; without it the clock is nobody's, and may be wrong by an hour.
    fn outages(&mut self, days: u64) {
        let half_us = days * DAY_US / 2;
        for half in 0..2 {
            let length_us =
                self.rng.random_range(12 * HOUR_US..(5 * DAY_US).min(half_us * 3 / 4).max(13 * HOUR_US));
            let latest_us = half_us.saturating_sub(length_us).max(1);
            let from = half * half_us + HOUR_US + self.rng.random_range(0..latest_us);
            let until = from + length_us;
            self.outages.push((from, until));
            self.add(from, Incident::Network(false));
            self.add(from + 6 * HOUR_US, Incident::Synchronised(false));
            if self.chance(0.7) {
                let at = self.rng.random_range(from + 6 * HOUR_US..until);
                let by_us = HOUR_US.cast_signed() * if self.rng.random() { 1 } else { -1 };
                self.add(at, Incident::StepClock { by_us });
            }
            self.add(until, Incident::RightClock);
            self.add(until, Incident::Synchronised(true));
            self.add(until, Incident::Network(true));
        }
    }

    /// Elements at the start, then about twice a day.
    fn elements(&mut self, s: usize, days: u64) {
        let mut at = 0;
        while at < days * DAY_US {
            let late_s = self.normal();
            let epoch_ago_us = self.rng.random_range(0..HOUR_US);
            self.add_online(at, Incident::Elements { s, late_s, epoch_ago_us });
            at += self.rng.random_range(8 * HOUR_US..16 * HOUR_US);
        }
    }

    /// A moment of a pass.
    fn within(&mut self, pass: &TruePass) -> u64 {
        self.rng.random_range(pass.aos_us..pass.los_us.max(pass.aos_us + 1))
    }

    fn in_pass(&mut self, s: usize, pass: &TruePass, is_commanded: bool) {
        if self.chance(0.3) {
            let at = self.within(pass);
            let down_us = match self.rng.random_range(0..20) {
                0 => self.rng.random_range(10 * MINUTE_US..6 * HOUR_US),
                1..4 => self.rng.random_range(20 * SECOND_US..10 * MINUTE_US),
                _ => self.rng.random_range(100_000..6 * SECOND_US),
            };
            self.add(at, Incident::Kill { down_us });
        }
        if self.chance(0.2) {
            let (at, late_s) = (self.within(pass), 3.0 * self.normal());
            self.add_online(at, Incident::Elements { s, late_s, epoch_ago_us: 0 });
        }
        if self.chance(0.02) {
            // Wrong by minutes, and right again later.
            let at = self.within(pass);
            let late_s = self.rng.random_range(60.0..200.0) * if self.rng.random() { 1.0 } else { -1.0 };
            self.add_online(at, Incident::Elements { s, late_s, epoch_ago_us: 0 });
            let later = at + self.rng.random_range(MINUTE_US..3 * HOUR_US);
            self.add_online(later, Incident::Elements { s, late_s: 0.2, epoch_ago_us: 0 });
        }
        if self.chance(0.06) {
            let by_us = self.rng.random_range(300_000..1_100_000) * if self.rng.random() { 1 } else { -1 };
            let at = self.within(pass);
            self.add(at, Incident::StepClock { by_us });
        }
        if self.chance(0.06) {
            let at = self.within(pass);
            let length_us = match self.rng.random_range(0..4) {
                0 => self.rng.random_range(HOUR_US..8 * HOUR_US),
                _ => self.rng.random_range(20 * SECOND_US..5 * MINUTE_US),
            };
            self.add(at, Incident::Rotator { fails: true });
            self.add(at + length_us, Incident::Rotator { fails: false });
        }
        if self.chance(0.05) {
            let (at, for_us) = (self.within(pass), self.rng.random_range(SECOND_US..4 * MINUTE_US));
            self.add(at, Incident::Disk { for_us });
        }
        if !is_commanded {
            return;
        }
        if self.chance(0.1) {
            let at = self.within(pass);
            self.add(at, Incident::Unplug { s });
        }
        if self.chance(0.05) {
            let (at, length_us) = (self.within(pass), self.rng.random_range(20 * SECOND_US..3 * MINUTE_US));
            if self.add_online(at, Incident::Hold { s, held: true }) {
                self.add(at + length_us, Incident::Hold { s, held: false });
            }
        }
        if self.chance(0.03) {
            let (at, length_us) = (self.within(pass), self.rng.random_range(SECOND_US..10 * MINUTE_US));
            if self.add_online(at, Incident::ArmLink { s, armed: false }) {
                self.add(at + length_us, Incident::ArmLink { s, armed: true });
            }
        }
        if self.chance(0.06) {
            let (at, length_us) = (self.within(pass), self.rng.random_range(MINUTE_US..4 * HOUR_US));
            if self.add_online(at, Incident::ArmPlan { s, armed: false }) {
                self.add(at + length_us, Incident::ArmPlan { s, armed: true });
            }
        }
    }

    /// Passes chosen by hand, and now and then a ping.
    fn desk(&mut self, s: usize, days: u64, passes: &[TruePass]) {
        for day in 0..days {
            let at = day * DAY_US + self.rng.random_range(MINUTE_US..DAY_US);
            let ahead = at + 2 * HOUR_US..at + 40 * HOUR_US;
            let good = |pass: &&TruePass| ahead.contains(&pass.aos_us) && pass.max_elevation_deg > 20.0;
            let good: Vec<u64> = passes.iter().filter(good).map(|pass| pass.tca_us).collect();
            if !good.is_empty() && day % 2 == 0 {
                let at_us = good[self.rng.random_range(0..good.len())];
                self.add_online(at, Incident::Attach { s, at_us });
            }
            if self.chance(0.5) {
                let at = day * DAY_US + self.rng.random_range(0..DAY_US);
                self.add_online(at, Incident::Ping { s });
            }
        }
    }
}
