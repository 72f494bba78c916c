//! How a new life begins: from what was stored, and honestly about what was not.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use super::agenda::{Agenda, is_unfinished};
use super::contact::Contact;
use super::image::Assembly;
use super::journal::Journal;
use super::link::Link;
use super::outcome::mono_of;
use super::recent::{Recent, Recents};
use super::runner::{LastEnd, Run};
use super::satellite::{Before, Command, Download, Exchange, Satellite, Settling};
use super::sealing::Sealer;
use super::sky::Sky;
use super::{About, Entropy, Station};
use crate::clock::{MonoUs, Now};
use crate::config::{SatelliteConfig, StationConfig};
use crate::id::{CommandId, Principal};
use crate::level::Level;
use crate::limits::LimitState;
use crate::port::Effect;
use crate::record::EventKind;
use crate::run::RunState;
use crate::snapshot::{CommandSnapshot, SatelliteSnapshot, Snapshot};
use crate::stage::Stage;

/// Bytes of a heartbeat frame, which sets how long its slot is.
const HEARTBEAT_BYTES: usize = 133;

/// The station as the last life left it.
pub(super) fn station(
    config: StationConfig,
    snapshot: Snapshot,
    entropy: Box<dyn Entropy>,
    now: Now,
) -> Station {
    let satellites: Vec<Satellite> = config
        .satellites
        .iter()
        .map(|sat| {
            let left = snapshot.satellites.iter().find(|found| found.satellite == sat.id);
            satellite(&config, sat, left, &snapshot, now)
        })
        .collect();
    let mut recent = Recents::default();
    for left in &snapshot.recent {
        if let Some(s) = satellites.iter().position(|sat| sat.id == left.satellite) {
            recent.remember(Recent::of(left, s));
        }
    }
    let links = config
        .links
        .iter()
        .filter_map(|link| {
            let s = satellites.iter().position(|sat| sat.id == link.satellite)?;
            Some(Link::new(link.clone(), s, satellites[s].profile.rssi))
        })
        .collect();
    let mut station = Station {
        agenda: Agenda::at_start(),
        antenna: Agenda::antenna(&config.station),
        station: config.station,
        me: Principal::engine(),
        entropy,
        journal: Journal::default(),
        effects: VecDeque::new(),
        satellites,
        links,
        site: config.site,
        times: config.times,
        antenna_fault: None,
        runs: runs(&snapshot),
        unfinished: snapshot.runs.iter().filter(|run| is_unfinished(&run.progress)).cloned().collect(),
        last_ends: snapshot.runs.iter().filter(|run| run.state == RunState::Ended).map(LastEnd::of).collect(),
        plans: snapshot.plans,
        ids: snapshot.last_ids,
        last_tx: 0,
        recent,
        kept_raw: 0,
        synchronised: false,
        vouched: false,
        stopping: false,
        wake: None,
    };
    station.begin_life(now);
    station
}

/// The runs that were not over, with their plans.
fn runs(snapshot: &Snapshot) -> Vec<Run> {
    let open = snapshot.runs.iter().filter(|run| !run.state.is_final());
    open.filter_map(|run| {
        let held = snapshot.plans.iter().find(|held| held.id == run.plan)?;
        Some(Run::new(run.clone(), Arc::clone(&held.plan)))
    })
    .collect()
}

fn satellite(
    config: &StationConfig,
    sat: &SatelliteConfig,
    left: Option<&SatelliteSnapshot>,
    snapshot: &Snapshot,
    now: Now,
) -> Satellite {
    let timing =
        config.links.iter().find(|link| link.satellite == sat.id).map(|l| l.timing).unwrap_or_default();
    let frame_us = timing.frame_us(HEARTBEAT_BYTES);
    let mut contact = Contact::new(sat.profile.heartbeat_period_us, frame_us);
    if let Some((_, heard_at, _)) = left.and_then(|l| l.heartbeat) {
        contact.restore(heard_at, now, timing.delivery_us(HEARTBEAT_BYTES) + frame_us);
    }
    let level_of = |parameter: &str| {
        let found = left.and_then(|l| l.limits.iter().find(|limit| limit.parameter == parameter));
        found.map_or(Level::Normal, |limit| limit.level)
    };
    let limits =
        sat.limits.iter().map(|rule| LimitState::new(rule.clone(), level_of(&rule.parameter))).collect();
    let commands: BTreeMap<CommandId, Command> =
        left.into_iter().flat_map(|l| &l.commands).map(|c| (c.record.id, command(c))).collect();
    let image = left.and_then(|l| l.image.as_ref()).map(Assembly::restore);
    let may_have_captured = |c: &&Command| {
        matches!(c.record.telecommand, protocol::Telecommand::CaptureImage { .. })
            && matches!(c.stage, Stage::Radiating | Stage::Radiated | Stage::Unknown)
            && c.on_air_at.is_some_and(|at| image.as_ref().is_none_or(|image| image.record.declared_at < at))
    };
    let captures = commands.values().filter(may_have_captured).map(|c| c.record.id).collect();
    let download = left.and_then(|l| l.downloads.last()).map(|record| Download {
        ask_info: record.image.is_none() || record.image != image.as_ref().map(|image| image.record.id),
        record: record.clone(),
        not_before: MonoUs(0),
        no_image: 0,
    });
    Satellite {
        id: sat.id.clone(),
        profile: sat.profile,
        sealer: sat.key.clone().map(|key| {
            let id = key.id();
            Sealer::new(key, sat.profile.counter, snapshot.keys.iter().find(|found| found.key == id))
        }),
        witness_retry_at: None,
        limits,
        contact,
        commands,
        exchange: Exchange::Idle,
        settling: Vec::new(),
        image,
        captures,
        download,
        last_tag: left.and_then(|l| l.last_tag),
        uptime: left.and_then(|l| l.heartbeat).map(|(_, at, uptime)| (at, uptime)),
        readings: BTreeMap::new(),
        sky: Sky::restore(left),
        note: "starting".to_owned(),
        wants_lease: false,
        wake: None,
    }
}

fn command(found: &CommandSnapshot) -> Command {
    // What waits and must not be repeated was never radiated: a `radiating` before that was taken back by the radio.
    let waits = matches!(found.stage, Stage::Queued | Stage::Sealed);
    let is_first =
        !found.record.telecommand.is_idempotent() || (found.stage == Stage::Sealed && found.attempt <= 1);
    let on_air_at = found.on_air_at.filter(|_| !(waits && is_first));
    Command {
        record: found.record.clone(),
        stage: found.stage,
        stage_at: found.stage_at,
        attempt: found.attempt,
        tag: found.sealed.as_ref().map(|sealed| sealed.tag),
        on_air_at,
        on_air_mono: None,
        before: Before { on_air_at, ..Before::default() },
        sealed: found.sealed.clone().filter(|_| found.stage == Stage::Sealed),
        not_before: MonoUs(0),
    }
}

impl Station {
    fn begin_life(&mut self, now: Now) {
        self.event(
            now.utc,
            EventKind::Station,
            Level::Normal,
            About::default(),
            "the station starts".to_owned(),
        );
        for s in 0..self.satellites.len() {
            self.begin_sealing(now, s);
            let ids: Vec<CommandId> = self.satellites[s].commands.keys().copied().collect();
            for id in ids {
                self.take_up(now, s, id);
            }
        }
        self.take_up_runs(now);
        self.journal.flush(now.mono, &mut self.effects);
    }

    fn begin_sealing(&mut self, now: Now, s: usize) {
        let Some(sealer) = &self.satellites[s].sealer else { return };
        let key = sealer.id;
        if let Some(counter) = sealer.witness_to_raise() {
            self.effects.push_back(Effect::Witness { key, counter });
        }
        if sealer.is_locked_by_witness()
            && let Some(lock) = sealer.lock(true)
        {
            let about = About { key: Some(key), ..About::default() };
            let message = format!("nothing is sealed with key {key}: {lock}");
            self.event(now.utc, EventKind::Sealing, Level::Critical, about, message);
        }
    }

    /// A command of the last life goes on: `sealed` with the same bytes, `radiating` as unknown, `radiated` waiting.
    fn take_up(&mut self, now: Now, s: usize, id: CommandId) {
        let Some(command) = self.satellites[s].commands.get(&id) else { return };
        let (stage, stage_at, tag) = (command.stage, command.stage_at, command.tag);
        let telecommand = command.record.telecommand.clone();
        let is_idempotent = telecommand.is_idempotent();
        let (is_request, is_sealed) = (command.record.download.is_some(), stage == Stage::Sealed);
        if matches!(stage, Stage::Queued | Stage::Sealed) {
            let went_back = self.satellites[s].sealer.as_ref().is_some_and(Sealer::database_went_back);
            if went_back && !is_idempotent {
                let why = "the database went back: it may have been radiated in the time that was lost";
                self.stage(now, s, id, Stage::Unknown, why, None);
            } else if is_request && !is_sealed {
                let me = self.me.clone();
                self.give_up(now, s, id, Stage::Cancelled, &me, "what is missing is asked for anew");
            }
            return;
        }
        if !matches!(stage, Stage::Radiating | Stage::Radiated) {
            return;
        }
        let Some(l) = self.link_index(&command.record.route.link) else {
            // Its link has left the configuration: nothing of it will be heard.
            self.unanswered(now, s, id, "its link is not in the configuration any more");
            return;
        };
        // The satellite may be answering at this moment.
        let answer_us = self.answer_us(s, l, &telecommand) + self.links[l].margin_us();
        let send_us = if stage == Stage::Radiating { self.links[l].config.timing.uplink_us() } else { 0 };
        let total = i64::try_from(answer_us + send_us).unwrap_or(i64::MAX);
        // However the clock stepped meanwhile: no later than if it had been radiated now.
        let latest = |us: u64| now.mono.plus(us);
        let deadline = mono_of(now, stage_at.plus(total)).min(latest(answer_us + send_us));
        let sat = &mut self.satellites[s];
        sat.contact.quiet_until = sat.contact.quiet_until.max(deadline.min(now.mono.plus(180_000_000)));
        if stage == Stage::Radiating {
            self.unanswered(now, s, id, "the station stopped while it was handed to the radio");
            return;
        }
        let Some(tag) = tag else { return };
        let answer = telecommand.answer();
        let settle = latest(sat.profile.heartbeat_period_us.saturating_mul(3));
        let deadline = if answer == protocol::Answer::None { settle } else { deadline };
        sat.settling.push(Settling { command: id, tag, answer, busy_until: None, deadline });
    }
}
