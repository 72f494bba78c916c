//! The station as watchers see it.

use std::sync::Arc;

use super::{About, Station};
use crate::clock::{Now, UtcUs};
use crate::level::Level;
use crate::record::EventKind;
use crate::run::PlanRecord;
use crate::status::{
    AntennaStatus, ImageStatus, LinkStatus, PlanStatus, SatelliteStatus, SealingStatus, Status,
};

impl Station {
    /// Says so when the satellite comes into contact or is lost.
    pub(super) fn note_contact(&mut self, now: Now, s: usize) {
        let sat = &mut self.satellites[s];
        let open = sat.contact.is_open(now.mono);
        if open && let Some(at) = sat.contact.closes_at() {
            sat.wake_at(at);
        }
        if open == std::mem::replace(&mut sat.contact.told, open) {
            return;
        }
        let id = sat.id.clone();
        // Over the link that heard it last.
        let serving = (0..self.links.len()).filter(|&l| self.links[l].satellite == s);
        let route = serving.max_by_key(|&l| self.links[l].last_bytes).map(|l| self.route(l));
        let message =
            if open { format!("{id} is in contact") } else { format!("{id} was not heard for a while") };
        let about = About { route, ..About::default() };
        self.event(now.utc, EventKind::Contact, Level::Normal, about, message);
    }

    pub(super) fn view(&self, now: Now) -> Status {
        let links = self.links.iter().map(|link| {
            let counters = link.decoder.counters();
            LinkStatus {
                link: link.config.id.clone(),
                satellite: self.satellites[link.satellite].id.clone(),
                state: link.state.clone(),
                armed: link.armed,
                on_air: link.on_air.is_some(),
                frames: counters.frames,
                skipped_bytes: counters.skipped_bytes,
                bad: counters.bad_crc + counters.bad_header,
                radiated: link.radiated,
                airtime_us: link.airtime_us,
                rssi_dbm: link.rssi_dbm,
            }
        });
        let satellites = self.satellites.iter().map(|sat| SatelliteStatus {
            satellite: sat.id.clone(),
            heard_at: sat.contact.heard_at(),
            heartbeat_at: sat.contact.heartbeat_at(),
            next_heartbeat_at: sat.contact.next_heartbeat(now.mono).map(|at| {
                let ahead = i64::try_from(at.since(now.mono)).unwrap_or(i64::MAX);
                let behind = i64::try_from(now.mono.since(at)).unwrap_or(i64::MAX);
                UtcUs(now.utc.0.saturating_add(ahead).saturating_sub(behind))
            }),
            in_contact: sat.contact.is_open(now.mono),
            in_view: sat.contact.in_view(),
            los_at: sat.contact.los(),
            expectation: sat.expectation(now),
            sky: sat.sky.status(now.utc),
            uplink: sat.note.clone(),
            wants_lease: sat.wants_lease,
            outstanding: sat.outstanding(),
            queued: sat.queue().len(),
            image: sat.image.as_ref().map(|image| ImageStatus {
                image: image.record.id,
                held: image.record.held,
                chunks: image.record.chunks,
                conflicts: image.record.conflicts,
            }),
            download: sat.download.as_ref().map(|download| download.record.id),
        });
        let vouched = self.is_vouched();
        let sealing = self.satellites.iter().filter_map(|sat| {
            let sealer = sat.sealer.as_ref()?;
            let locked = sealer.lock(vouched).map(|lock| lock.to_string());
            Some(SealingStatus { key: sealer.id, satellite: sat.id.clone(), locked })
        });
        Status {
            station: self.station.clone(),
            at: now,
            links: links.collect(),
            satellites: satellites.collect(),
            sealing: sealing.collect(),
            storage: self.journal.status(),
            plans: self.plans.iter().map(plan_status).collect(),
            schedule: Arc::clone(&self.agenda.schedule),
            runs: self.runs.iter().map(|run| run.record.clone()).collect(),
            antenna: self.antenna_fault.clone().map(|fault| AntennaStatus { fault }),
        }
    }
}

fn plan_status(held: &PlanRecord) -> PlanStatus {
    PlanStatus {
        id: held.id,
        plan: Arc::clone(&held.plan),
        armed: held.armed,
        picks: held.picks.clone(),
        who: held.who.clone(),
        added_at: held.added_at,
    }
}
