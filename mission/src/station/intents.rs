//! What operators want: checked whole before anything is stored, durable before it is answered.

use protocol::{RANGE_MAX, Telecommand};

use super::satellite::{Command, Download, Exchange, Step};
use super::{About, Station};
use crate::clock::{MonoUs, Now};
use crate::id::{CommandId, DownloadId, LinkId, Principal, SatelliteId};
use crate::intent::{Accepted, CommandIntent, Intent, IntentEnvelope, IntentReceipt, Refusal};
use crate::level::Level;
use crate::port::Effect;
use crate::record::{CommandRecord, DownloadRecord, DownloadState, EventKind, Record, Subject};
use crate::stage::Stage;

/// So many commands may wait for one satellite.
const QUEUE_MAX: usize = 256;
/// How often an idempotent command is radiated at most when nobody says otherwise.
const ATTEMPTS: u16 = 5;
/// The most that anybody may ask for.
const ATTEMPTS_MAX: u16 = 100;

impl Station {
    pub(super) fn intent(&mut self, now: Now, envelope: IntentEnvelope) {
        let who = envelope.principal.clone();
        let result = match self.journal.failing() {
            Some(why) => Err(Refusal::Storage(why.to_owned())),
            None if self.stopping => Err(Refusal::Stopping),
            None if self.journal.is_full() => {
                Err(Refusal::Storage("it is too far behind to take anything more".to_owned()))
            }
            None => self.carry_out(now, &who, envelope.intent),
        };
        match result {
            Ok(accepted) => {
                self.journal.push(Record::Intent(IntentReceipt {
                    principal: who,
                    idempotency_key: envelope.idempotency_key,
                    digest: envelope.digest,
                    accepted: accepted.clone(),
                    at: now.utc,
                }));
                self.journal.when_durable(Effect::Reply { intent: envelope.id, result: Ok(accepted) });
            }
            Err(refusal) => {
                self.effects.push_back(Effect::Reply { intent: envelope.id, result: Err(refusal) });
            }
        }
    }

    fn carry_out(&mut self, now: Now, who: &Principal, intent: Intent) -> Result<Accepted, Refusal> {
        match intent {
            Intent::Command(command) => self.command_intent(now, who, command).map(Accepted::Command),
            Intent::Cancel(command) => self.cancel(now, who, command),
            Intent::Download { satellite, link } => self.download_intent(now, who, &satellite, link.as_ref()),
            Intent::CancelDownload(download) => self.cancel_download(now, who, download),
            Intent::VouchClock => {
                self.vouched = true;
                self.audit(now.utc, who, "clock.vouch", String::new());
                let message = format!("{who} vouches for the clock of this machine");
                self.event(now.utc, EventKind::Sealing, Level::Normal, About::default(), message);
                Ok(Accepted::Done)
            }
            Intent::ConfirmCounter { key, above } => {
                let s = self
                    .satellites
                    .iter()
                    .position(|sat| sat.sealer.as_ref().is_some_and(|sealer| sealer.id == key))
                    .ok_or(Refusal::UnknownKey(key))?;
                let vouched = self.is_vouched();
                let Some(sealer) = self.satellites[s].sealer.as_ref() else {
                    return Err(Refusal::UnknownKey(key));
                };
                if !sealer.is_locked_by_witness() {
                    return Err(Refusal::NotLocked(key));
                }
                if sealer.needs_the_clock_to_unlock() && !vouched {
                    return Err(Refusal::ClockNotVouched(key));
                }
                let floor = sealer.floor_above(now.utc, vouched, above)?;
                let above = above.map_or_else(String::new, |above| format!(", above {above}"));
                self.audit(now.utc, who, "key.confirm-counter", format!("key {key}{above}"));
                self.confirm_counter(now, s, who, floor);
                Ok(Accepted::Done)
            }
            Intent::AddElements { satellite, elements, source } => {
                self.add_elements(now, who, &satellite, elements, &source)
            }
            Intent::AddPlan { plan, text } => self.add_plan(now, who, plan, text),
            Intent::WithdrawPlan(plan) => self.withdraw_plan(now, who, &plan),
            Intent::ArmPlan { plan, armed } => self.arm_plan(now, who, &plan, armed),
            Intent::AttachPlan { plan, at, attach } => self.attach_plan(now, who, &plan, at, attach),
            Intent::TakeOver { satellite, held } => self.take_over(now, who, &satellite, held),
            Intent::ArmLink { link, armed } => {
                let l = self.link_index(&link).ok_or_else(|| Refusal::UnknownLink(link.to_string()))?;
                if armed && self.links[l].config.receive_only {
                    return Err(Refusal::Argument(format!("link {link} only receives")));
                }
                self.links[l].armed = armed;
                let verb = if armed { "armed" } else { "disarmed" };
                self.audit(
                    now.utc,
                    who,
                    if armed { "link.arm" } else { "link.disarm" },
                    format!("link {link}"),
                );
                let about = About { route: Some(self.route(l)), ..About::default() };
                let message = format!("{who} {verb} the transmitter of link {link}");
                self.event(now.utc, EventKind::Link, Level::Normal, about, message);
                Ok(Accepted::Done)
            }
        }
    }

    /// Satellite and link by name; when no link is named, the first that could transmit now, else the first that ever
    /// could.
    fn places(&self, satellite: &SatelliteId, link: Option<&LinkId>) -> Result<(usize, usize), Refusal> {
        let s = self
            .satellite_index(satellite)
            .ok_or_else(|| Refusal::UnknownSatellite(satellite.to_string()))?;
        let serves = |l: &usize| self.links[*l].satellite == s;
        let l = match link {
            Some(id) => {
                self.link_index(id).filter(serves).ok_or_else(|| Refusal::UnknownLink(id.to_string()))?
            }
            None => (0..self.links.len())
                .filter(serves)
                .filter(|&l| !self.links[l].config.receive_only)
                .max_by_key(|&l| (self.links[l].may_transmit(), std::cmp::Reverse(l)))
                .ok_or_else(|| Refusal::UnknownLink("(none that transmits)".to_owned()))?,
        };
        if self.links[l].config.receive_only {
            return Err(Refusal::Argument(format!("link {} only receives", self.links[l].config.id)));
        }
        Ok((s, l))
    }

    pub(super) fn command_intent(
        &mut self,
        now: Now,
        who: &Principal,
        wanted: CommandIntent,
    ) -> Result<CommandId, Refusal> {
        let (s, l) = self.places(&wanted.satellite, wanted.link.as_ref())?;
        let sat = &self.satellites[s];
        let key =
            sat.sealer.as_ref().map(|sealer| sealer.id).ok_or_else(|| Refusal::NoKey(sat.id.clone()))?;
        let telecommand = wanted.telecommand;
        telecommand.validate().map_err(|error| Refusal::Argument(error.to_string()))?;
        if matches!(telecommand, Telecommand::GetImageRanges(_)) && !sat.profile.ranges {
            return Err(Refusal::NotInProfile(telecommand.name()));
        }
        let asked: u32 = match &telecommand {
            Telecommand::GetImageChunk { count, .. } => u32::from(*count),
            Telecommand::GetImageRanges(ranges) => ranges.ranges.iter().map(|r| u32::from(r.count)).sum(),
            _ => 0,
        };
        if asked > u32::from(RANGE_MAX) {
            let why = format!("count: at most {RANGE_MAX} chunks at a time, the satellite is deaf meanwhile");
            return Err(Refusal::Argument(why));
        }
        if telecommand.is_critical() && wanted.confirmation.as_deref() != Some(telecommand.name()) {
            return Err(Refusal::NeedsConfirmation(telecommand.name()));
        }
        if wanted.expires_at.is_some_and(|at| at <= now.utc) {
            return Err(Refusal::AlreadyExpired);
        }
        let allowed = match (telecommand.is_idempotent(), wanted.attempts_allowed) {
            (_, Some(0)) => return Err(Refusal::Argument("attempts: at least 1".to_owned())),
            (true, Some(n)) if n > ATTEMPTS_MAX => {
                return Err(Refusal::Argument(format!("attempts: at most {ATTEMPTS_MAX}")));
            }
            (true, given) => given.unwrap_or(ATTEMPTS),
            (false, Some(n)) if n > 1 => {
                let name = telecommand.name();
                return Err(Refusal::Argument(format!(
                    "attempts: {name} is not idempotent, it is radiated once"
                )));
            }
            (false, _) => 1,
        };
        let waiting = sat.commands.values().filter(|c| !c.stage.is_final()).count();
        if waiting >= QUEUE_MAX {
            return Err(Refusal::QueueFull(waiting));
        }
        self.ids.command += 1;
        let id = CommandId(self.ids.command);
        let record = CommandRecord {
            id,
            route: self.route(l),
            key,
            principal: who.clone(),
            download: None,
            telecommand,
            priority: wanted.priority,
            gate: wanted.gate,
            attempts_allowed: allowed,
            created_at: now.utc,
            expires_at: wanted.expires_at,
            when: wanted.when.filter(|when| !when.is_empty()),
        };
        self.audit(now.utc, who, "command.create", format!("command {id}: {}", record.telecommand));
        self.add_command(now, s, record, &format!("{who} wants it"));
        Ok(id)
    }

    fn cancel(&mut self, now: Now, who: &Principal, id: CommandId) -> Result<Accepted, Refusal> {
        self.cancel_because(now, who, id, &format!("{who} withdrew it"))
    }

    pub(super) fn cancel_because(
        &mut self,
        now: Now,
        who: &Principal,
        id: CommandId,
        why: &str,
    ) -> Result<Accepted, Refusal> {
        let found = self.satellites.iter().position(|sat| sat.commands.contains_key(&id));
        let s = found.ok_or(Refusal::UnknownCommand(id))?;
        let sat = &mut self.satellites[s];
        let command = sat.commands.get(&id).ok_or(Refusal::UnknownCommand(id))?;
        let stage = command.stage;
        let too_late = Refusal::TooLate { command: id, stage: stage.name() };
        match stage {
            Stage::Queued => {}
            Stage::Sealed => {
                // In preparation: the bytes have not been handed over, and now they never are.
                if sat.outstanding() == Some(id) {
                    match &sat.exchange {
                        Exchange::Preparing(_, Step::Sealing(_) | Step::Witnessing(_)) => {
                            sat.exchange = Exchange::Idle;
                        }
                        _ => return Err(too_late),
                    }
                }
            }
            _ => return Err(too_late),
        }
        self.audit(now.utc, who, "command.cancel", format!("command {id}"));
        self.give_up(now, s, id, Stage::Cancelled, who, why);
        Ok(Accepted::Cancelled(id))
    }

    pub(super) fn download_intent(
        &mut self,
        now: Now,
        who: &Principal,
        satellite: &SatelliteId,
        link: Option<&LinkId>,
    ) -> Result<Accepted, Refusal> {
        let (s, l) = self.places(satellite, link)?;
        let sat = &self.satellites[s];
        if sat.sealer.is_none() {
            return Err(Refusal::NoKey(sat.id.clone()));
        }
        if let Some(active) = &sat.download {
            return Ok(Accepted::Download(active.record.id));
        }
        self.ids.download += 1;
        let id = DownloadId(self.ids.download);
        let record = DownloadRecord {
            id,
            route: self.route(l),
            image: None,
            principal: who.clone(),
            state: DownloadState::Active,
            created_at: now.utc,
            requests: 0,
            chunks_requested: 0,
            chunks_bridged: 0,
        };
        self.journal.push(Record::Download(record.clone()));
        self.audit(now.utc, who, "download.create", format!("download {id}"));
        let subject = Subject { download: Some(id), ..Subject::default() };
        let about = About { route: Some(record.route.clone()), key: None, subject };
        let message = format!("{who} wants the image of {satellite} brought home (download {id})");
        self.event(now.utc, EventKind::Download, Level::Normal, about, message);
        self.satellites[s].download =
            Some(Download { record, ask_info: true, not_before: MonoUs(0), no_image: 0 });
        Ok(Accepted::Download(id))
    }

    pub(super) fn cancel_download(
        &mut self,
        now: Now,
        who: &Principal,
        id: DownloadId,
    ) -> Result<Accepted, Refusal> {
        let is_it = |d: &Download| d.record.id == id;
        let found = self.satellites.iter().position(|sat| sat.download.as_ref().is_some_and(is_it));
        let s = found.ok_or(Refusal::UnknownDownload(id))?;
        self.audit(now.utc, who, "download.cancel", format!("download {id}"));
        // What it asked for and is not marked yet is not radiated any more; what is marked stops at the hand-over.
        let sat = &mut self.satellites[s];
        let of_it =
            |c: &Command| c.record.download == Some(id) && matches!(c.stage, Stage::Queued | Stage::Sealed);
        let requests: Vec<CommandId> =
            sat.commands.values().filter(|c| of_it(c)).map(|c| c.record.id).collect();
        for request in requests {
            if self.satellites[s].outstanding() == Some(request) {
                self.satellites[s].exchange = Exchange::Idle;
            }
            self.give_up(now, s, request, Stage::Cancelled, who, "its download was withdrawn");
        }
        self.end_download(now, s, DownloadState::Cancelled, &format!("{who} withdrew it"));
        Ok(Accepted::DownloadCancelled(id))
    }
}
