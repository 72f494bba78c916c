//! Whether the uplink may be used now; and if not, why, and when to look again.
//!
//! Listen first: a transmission starts only when the satellite is silent by its schedule, nothing is being received,
//! and nothing of ours is on the air.

use std::borrow::Cow;

use super::contact::Slot;
use super::outcome::mono_of;
use super::satellite::Satellite;
use super::{Link, Station};
use crate::clock::{MonoUs, Now};
use crate::port::{Lease, LinkState};
use crate::record::Gate;
use crate::sky::clock_time;

/// Without contact, listen for this long before a blind transmission.
const LISTEN_FIRST_US: u64 = 5_000_000;

/// Satellites take turns on the air of one station; whoever waits looks again after this.
const TAKE_TURNS_US: u64 = 250_000;

/// A lease that ends sooner than this is not worth beginning with: time on the air and a slow commit fit in.
const LEASE_MARGIN_US: u64 = 8_000_000;

/// Not now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Wait {
    pub(super) why: Cow<'static, str>,
    /// `None`: something must happen first.
    pub(super) until: Option<MonoUs>,
}

fn wait(why: &'static str, until: Option<MonoUs>) -> Wait {
    Wait { why: Cow::Borrowed(why), until }
}

/// What a transmission and its answer need.
#[derive(Debug, Clone, Copy)]
pub(super) struct Need {
    pub(super) gate: Gate,
    /// From the end of our transmission to the expected end of the answer, in microseconds.
    pub(super) answer_us: u64,
}

impl Station {
    /// May a frame be radiated over this link now?
    pub(super) fn gate(&self, now: Now, s: usize, l: usize, need: Need) -> Result<(), Wait> {
        let (sat, link) = (&self.satellites[s], &self.links[l]);
        if self.stopping {
            return Err(wait("the station is stopping", None));
        }
        if let Some(why) = self.journal.failing() {
            return Err(Wait { why: format!("storage fails: {why}").into(), until: None });
        }
        // A station that transmits hears nothing, over whichever of its radios.
        if self.links.iter().any(|link| link.on_air.is_some()) {
            return Err(wait("something of ours is on the air", None));
        }
        if self.satellites.iter().enumerate().any(|(other, sat)| other != s && sat.is_on_air_or_awaits()) {
            return Err(wait("another satellite's answer is awaited", Some(now.mono.plus(TAKE_TURNS_US))));
        }
        self.licence_gate(now, link.config.timing.uplink_us())?;
        self.blackout_gate(now, link.config.timing.uplink_us())?;
        self.seal_gate(sat)?;
        link_gate(link, now, need.gate)?;
        contact_gate(sat, now, need.gate)?;
        silence_gate(sat, link, now)?;
        los_gate(sat, link, now, need.answer_us)?;
        // Last: who could send nothing anyhow must not keep the key from others.
        lease_gate(sat, now)
    }

    /// Only the lease of the key is missing.
    pub(super) fn is_for_lease(&self, now: Now, s: usize, wait: &Wait) -> bool {
        self.satellites.get(s).is_some_and(|sat| lease_gate(sat, now).is_err_and(|lease| lease == *wait))
    }

    /// The licence covers the whole transmission.
    fn licence_gate(&self, now: Now, uplink_us: u64) -> Result<(), Wait> {
        let Some(windows) = &self.times.licence else { return Ok(()) };
        let end = now.utc.plus(i64::try_from(uplink_us).unwrap_or(i64::MAX));
        if windows.iter().any(|window| window.start <= now.utc && end <= window.stop) {
            return Ok(());
        }
        let next = windows.iter().map(|window| window.start).filter(|start| *start > now.utc).min();
        match next {
            Some(start) => {
                let why = format!("the licence allows no transmission until {}", clock_time(start, now.utc));
                Err(Wait { why: why.into(), until: Some(mono_of(now, start)) })
            }
            None => Err(wait("the licence allows no transmission any more", None)),
        }
    }

    /// No part of the transmission falls into a blackout: people may be on the roof.
    fn blackout_gate(&self, now: Now, uplink_us: u64) -> Result<(), Wait> {
        let end = now.utc.plus(i64::try_from(uplink_us).unwrap_or(i64::MAX));
        let mut closed = self.times.blackouts.iter();
        let Some((window, reason)) = closed.find(|(window, _)| window.start < end && now.utc < window.stop)
        else {
            return Ok(());
        };
        let until = clock_time(window.stop, now.utc);
        let why = match reason.trim() {
            "" => format!("the station is closed until {until}"),
            reason => format!("the station is closed until {until} ({reason})"),
        };
        Err(Wait { why: why.into(), until: Some(mono_of(now, window.stop)) })
    }

    fn seal_gate(&self, sat: &Satellite) -> Result<(), Wait> {
        match &sat.sealer {
            None => Err(wait("this satellite has no key", None)),
            Some(sealer) => match sealer.lock(self.is_vouched()) {
                Some(lock) => Err(Wait { why: lock.to_string().into(), until: None }),
                None => Ok(()),
            },
        }
    }
}

/// A key that several servers share is ours for long enough to seal, store and radiate.
fn lease_gate(sat: &Satellite, now: Now) -> Result<(), Wait> {
    match sat.sealer.as_ref().and_then(|sealer| sealer.lease.as_ref()) {
        None => Ok(()),
        Some(Lease::Ours { until, .. }) if now.mono.plus(LEASE_MARGIN_US) < *until => Ok(()),
        Some(Lease::Ours { .. }) => Err(wait("the lease of the key ends", None)),
        Some(Lease::NotOurs { why }) => Err(Wait { why: why.clone().into(), until: None }),
    }
}

fn link_gate(link: &Link, now: Now, gate: Gate) -> Result<(), Wait> {
    if link.config.receive_only {
        return Err(wait("this link only receives", None));
    }
    if !link.armed {
        return Err(wait("the transmitter is not armed", None));
    }
    if link.state != LinkState::Ok {
        return Err(Wait { why: format!("the link is {}", link.state.name()).into(), until: None });
    }
    let listened = link.up_since.map_or(0, |since| now.mono.since(since));
    if gate == Gate::Blind && listened < LISTEN_FIRST_US {
        return Err(wait("listening first", Some(now.mono.plus(LISTEN_FIRST_US - listened))));
    }
    Ok(())
}

fn contact_gate(sat: &Satellite, now: Now, gate: Gate) -> Result<(), Wait> {
    // Outside a pass nothing is radiated, blind commands neither.
    if sat.contact.in_view() == Some(false) {
        return Err(match sat.sky.next_aos(now.utc) {
            Some(aos) => Wait {
                why: format!("below the horizon until {}", clock_time(aos, now.utc)).into(),
                until: Some(mono_of(now, aos)),
            },
            None => wait("the satellite is below the horizon", None),
        });
    }
    if gate == Gate::Blind || sat.contact.is_open(now.mono) {
        return Ok(());
    }
    Err(wait("listening: the satellite was not heard lately", None))
}

fn silence_gate(sat: &Satellite, link: &Link, now: Now) -> Result<(), Wait> {
    if link.is_receiving(now.mono) {
        return Err(wait("a frame is being received", Some(link.receiving_until())));
    }
    if now.mono < sat.contact.quiet_until {
        return Err(wait("the satellite is answering somebody", Some(sat.contact.quiet_until)));
    }
    let timing = link.config.timing;
    let on_air = Slot { start: now.mono, end: now.mono.plus(timing.uplink_us() + timing.uplink_us() / 10) };
    if let Some(slot) = sat.contact.next_slot(now.mono)
        && slot.overlaps(on_air.start, on_air.end)
    {
        return Err(wait("a heartbeat is due", Some(slot.end)));
    }
    let busy = sat.settling.iter().filter_map(|w| w.busy_until);
    if let Some((_, end)) =
        busy.filter(|&(start, end)| on_air.overlaps(start, end)).max_by_key(|(_, end)| *end)
    {
        return Err(wait("a late answer is due", Some(end)));
    }
    Ok(())
}

fn los_gate(sat: &Satellite, link: &Link, now: Now, answer_us: u64) -> Result<(), Wait> {
    let Some(los) = sat.contact.los() else { return Ok(()) };
    let end = now.mono.plus(link.config.timing.uplink_us() + answer_us);
    if end <= mono_of(now, los) {
        Ok(())
    } else {
        Err(wait("the answer would not end before loss of signal", None))
    }
}
