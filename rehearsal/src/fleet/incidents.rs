//! Incidents, carried out.

use mission::{CommandIntent, Gate, Input, Intent};
use protocol::Telecommand;
use radio::driver::DriverInput;

use super::chaos::Incident;
use super::scene::{COMMANDED_FROM, HOUR_US, SATELLITES, issued, link_name, satellite_name, utc_at};
use super::world::Fleet;

/// What a turned-away antenna hears less, dB.
const TURNED_AWAY_DB: f64 = -12.0;

impl Fleet {
    pub(super) fn happen(&mut self, g: usize, what: Incident) {
        let now_us = self.now_us;
        self.note(format!("{what:?}").as_bytes());
        *self.report.incidents.entry(what.name()).or_default() += 1;
        match what {
            Incident::Kill { down_us } => self.kill(g, down_us),
            Incident::Unplug { s } => {
                if self.grounds[g].station.is_some()
                    && let Some(r) = self.grounds[g].radios.iter().position(|radio| radio.s == s)
                {
                    self.grounds[g].radios[r].driver.handle(now_us, DriverInput::Closed);
                    self.driver_out(g, r);
                }
            }
            Incident::Elements { s, late_s, epoch_ago_us } => {
                let epoch = mission::sky::instant(utc_at(now_us).plus(-(epoch_ago_us.cast_signed())));
                let elements = vec![issued(&self.orbits[s], epoch, late_s)];
                let (satellite, source) = (satellite_name(s), "the fleet".to_owned());
                self.grounds[g].want(Intent::AddElements { satellite, elements, source });
            }
            // The engine itself needs no network; what comes over it stays away.
            Incident::Network(_) => {}
            Incident::Synchronised(synchronised) => self.grounds[g].synchronised = synchronised,
            Incident::StepClock { by_us } => {
                self.grounds[g].offset_us += by_us;
                self.clock_moved(g);
            }
            Incident::RightClock => {
                self.grounds[g].offset_us = 0;
                self.clock_moved(g);
            }
            Incident::Rotator { fails } => {
                let fault = fails.then_some("it refuses to move");
                self.grounds[g].rotator_fault = fault;
                self.grounds[g].tell(now_us, Input::Antenna { fault });
                let level_db = if fails { TURNED_AWAY_DB } else { 0.0 };
                for s in (0..SATELLITES).filter(|s| COMMANDED_FROM[*s] == g) {
                    self.space[s].channel_mut().config_mut().level_db = level_db;
                }
                for ear in &mut self.grounds[g].ears {
                    ear.channel.config_mut().level_db = level_db;
                }
            }
            Incident::Disk { for_us } => self.grounds[g].disk_until = now_us + for_us,
            Incident::Attach { s, at_us } => {
                let by_hand = self.plans[g][s].iter().find(|planned| planned.by_hand);
                if let Some(plan) = by_hand.map(|planned| planned.plan.name.clone()) {
                    self.grounds[g].want(Intent::AttachPlan { plan, at: utc_at(at_us), attach: true });
                }
            }
            Incident::Hold { s, held } => {
                self.grounds[g].want(Intent::TakeOver { satellite: satellite_name(s), held });
            }
            Incident::ArmLink { s, armed } => {
                self.grounds[g].want(Intent::ArmLink { link: link_name(s), armed });
            }
            Incident::ArmPlan { s, armed } => {
                let name = format!("{}-status", satellite_name(s));
                let found = self.plans[g][s].iter().find(|planned| planned.plan.name.as_str() == name);
                if let Some(plan) = found.map(|planned| planned.plan.name.clone()) {
                    self.grounds[g].want(Intent::ArmPlan { plan, armed });
                }
            }
            Incident::Ping { s } => self.grounds[g].want(Intent::Command(CommandIntent {
                satellite: satellite_name(s),
                link: None,
                telecommand: Telecommand::Ping,
                priority: 0,
                gate: Gate::Heard,
                expires_at: Some(utc_at(now_us + 6 * HOUR_US)),
                when: None,
                attempts_allowed: None,
                confirmation: None,
            })),
        }
    }

    fn clock_moved(&mut self, g: usize) {
        self.ledger.clock(g, self.now_us, self.grounds[g].offset_us);
    }
}

impl Incident {
    /// As reports call it.
    const fn name(&self) -> &'static str {
        match self {
            Self::Kill { .. } => "process killed",
            Self::Unplug { .. } => "radio unplugged",
            Self::Elements { late_s, .. } if late_s.abs() >= 60.0 => "elements wrong by minutes",
            Self::Elements { epoch_ago_us: 0, .. } => "elements in mid-pass",
            Self::Elements { .. } => "elements",
            Self::Network(false) => "network lost",
            Self::Network(true) => "network back",
            Self::Synchronised(false) => "clock unsynchronised",
            Self::Synchronised(true) => "clock synchronised",
            Self::StepClock { by_us } if by_us.abs() > 60_000_000 => "clock wrong by an hour",
            Self::StepClock { .. } => "clock stepped by about a second",
            Self::RightClock => "clock set right",
            Self::Rotator { fails: true } => "rotator dead",
            Self::Rotator { fails: false } => "rotator back",
            Self::Disk { .. } => "disk full",
            Self::Attach { .. } => "pass chosen by hand",
            Self::Hold { held: true, .. } => "taken over",
            Self::Hold { held: false, .. } => "given back",
            Self::ArmLink { armed: false, .. } => "transmitter disarmed",
            Self::ArmLink { armed: true, .. } => "transmitter armed",
            Self::ArmPlan { armed: false, .. } => "plan disarmed",
            Self::ArmPlan { armed: true, .. } => "plan armed",
            Self::Ping { .. } => "ping wanted",
        }
    }
}
