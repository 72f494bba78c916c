//! Whom the antenna follows: a pure function of the station's status, the time, and whom it follows already.

use mission::schedule::{Contact, Window};
use mission::status::SkyStatus;
use mission::{ElementSet, SatelliteId, Status, UtcUs};

/// What is left of a pass is not worth turning for when it is shorter, microseconds.
const LEAST_US: i64 = 30_000_000;
/// Of a satellite that does not set this much is followed at a time, microseconds.
const STRETCH_US: i64 = 3_600_000_000;
/// A stretch is renewed when this much of it is left, microseconds.
const RENEW_US: i64 = 600_000_000;
/// Times that differ by less are the same, microseconds.
const SAME_US: i64 = 1_000_000;

/// Whom to follow, by which elements, from when until when.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Target {
    pub(super) satellite: SatelliteId,
    pub(super) set: ElementSet,
    pub(super) aos: UtcUs,
    pub(super) los: UtcUs,
    /// It ends before LOS because a higher pass is worth more: it is not kept for its own sake.
    pub(super) gives_way: bool,
}

impl Target {
    /// The antenna need not be told again.
    pub(super) fn is_as(&self, other: &Self, now: UtcUs) -> bool {
        let same = |a: UtcUs, b: UtcUs| a.0.abs_diff(b.0) < SAME_US.unsigned_abs();
        self.satellite == other.satellite
            && self.set.id == other.set.id
            && same(self.los, other.los)
            && same(self.aos.max(now), other.aos.max(now))
    }
}

/// What does not change while the station runs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rules {
    /// Nothing is followed in these: people may be on the roof.
    pub(super) blackouts: Vec<Window>,
    /// The antenna is told this much before AOS, and rests until then, microseconds.
    pub(super) lead_us: i64,
}

/// Whom the antenna follows now, or prepares for; `None`: nobody, it rests.
///
/// 1. In a blackout nobody.
/// 2. The scheduled contact that lasts, or begins within the lead.
/// 3. The pass that is followed already, until its LOS.
/// 4. The pass that lasts or comes next, whoever's it is; of those that overlap the highest, and a lower one as far as it
///    leaves time to turn.
///
/// Passes outside the schedule end a lead before the next contact, and where a blackout begins.
pub(super) fn target(status: &Status, rules: &Rules, now: UtcUs, current: Option<&Target>) -> Option<Target> {
    if rules.blackouts.iter().any(|window| window.start <= now && now < window.stop) {
        return None;
    }
    let contacts: Vec<&Contact> = status
        .schedule
        .contacts
        .iter()
        .filter(|contact| contact.station == status.station && now < contact.stop)
        .collect();
    let next =
        contacts.iter().filter_map(|contact| of_contact(status, contact)).min_by_key(|contact| contact.aos);
    let closes = next.as_ref().map(|contact| contact.aos.plus(-rules.lead_us));
    if let Some(closes) = closes
        && closes <= now
    {
        return next;
    }
    let mut free = Vec::new();
    for (satellite, sky) in skies(status) {
        for pass in sky.passes.iter().filter(|pass| !pass.is_over_at(now)) {
            let los = pass.los_at.unwrap_or_else(|| stretch(satellite, now, current));
            let is_contact = contacts.iter().any(|contact| {
                contact.satellite == *satellite && pass.is_same_as(contact.start, Some(contact.stop))
            });
            let target = Target {
                satellite: satellite.clone(),
                set: sky.elements.clone(),
                aos: pass.aos_at,
                los,
                gives_way: false,
            };
            // A pass whose contact is to come waits for it; after the contact its rest is heard like any other.
            if !is_contact && let Some(target) = clipped(target, rules, now, closes) {
                free.push((target, pass.max_elevation_deg, pass.los_at.is_some()));
            }
        }
    }
    let kept = current.filter(|current| !current.gives_way && current.aos <= now && now < current.los);
    if let Some(current) = kept
        && let Some((target, ..)) = free.iter().find(|(target, _, sets)| {
            *sets && target.satellite == current.satellite && target.aos < current.los && target.aos <= now
        })
    {
        return Some(target.clone());
    }
    choose(free.into_iter().map(|(target, elevation, _)| (target, elevation)).collect(), rules, now)
        .filter(|target| target.aos.plus(-rules.lead_us) <= now)
}

/// The first, or the highest of those that overlap it.
fn choose(free: Vec<(Target, f64)>, rules: &Rules, now: UtcUs) -> Option<Target> {
    let begins = |target: &Target| target.aos.max(now);
    let (first, _) = free.iter().min_by(|(a, high_a), (b, high_b)| {
        begins(a).cmp(&begins(b)).then_with(|| high_b.total_cmp(high_a))
    })?;
    let (highest, _) =
        free.iter().filter(|(other, _)| other.aos < first.los).max_by(|(a, high_a), (b, high_b)| {
            high_a.total_cmp(high_b).then_with(|| begins(b).cmp(&begins(a)))
        })?;
    let turns = highest.aos.plus(-rules.lead_us);
    if highest.satellite != first.satellite && turns.0.saturating_sub(begins(first).0) >= LEAST_US {
        let los = first.los.min(turns);
        return Some(Target { los, gives_way: true, ..first.clone() });
    }
    Some(highest.clone())
}

fn skies(status: &Status) -> impl Iterator<Item = (&SatelliteId, &SkyStatus)> {
    let known = |sky: &&SkyStatus| sky.fault.is_none();
    status
        .satellites
        .iter()
        .filter_map(move |satellite| Some((&satellite.satellite, satellite.sky.as_ref().filter(known)?)))
}

/// A whole contact has the times of its pass to the microsecond, one that was cut those of the schedule.
fn of_contact(status: &Status, contact: &Contact) -> Option<Target> {
    let (_, sky) = skies(status).find(|(satellite, _)| **satellite == contact.satellite)?;
    let pass = sky.passes.iter().find(|pass| pass.is_same_as(contact.start, Some(contact.stop)));
    let whole = pass.filter(|_| contact.whole).and_then(|pass| Some((pass.aos_at, pass.los_at?)));
    let (aos, los) = whole.unwrap_or((contact.start, contact.stop));
    let satellite = contact.satellite.clone();
    Some(Target { satellite, set: sky.elements.clone(), aos, los, gives_way: false })
}

/// Until when a satellite that does not set is followed.
fn stretch(satellite: &SatelliteId, now: UtcUs, current: Option<&Target>) -> UtcUs {
    let goes_on = current
        .filter(|current| current.satellite == *satellite && current.los > now.plus(RENEW_US))
        .map(|current| current.los);
    goes_on.unwrap_or(now.plus(STRETCH_US))
}

/// What contacts and blackouts leave of a pass; not called in a blackout.
fn clipped(whole: Target, rules: &Rules, now: UtcUs, closes: Option<UtcUs>) -> Option<Target> {
    let mut target = Target { los: whole.los.min(closes.unwrap_or(whole.los)), ..whole.clone() };
    for window in &rules.blackouts {
        if window.start <= target.aos || window.stop <= now {
            target.aos = target.aos.max(window.stop);
        } else {
            target.los = target.los.min(window.start);
        }
    }
    let is_cut = target.aos != whole.aos || target.los != whole.los;
    // One that lasts is followed to its end.
    let least_us = if is_cut && now < target.aos { LEAST_US } else { 1 };
    (target.los.0.saturating_sub(target.aos.max(now).0) >= least_us).then_some(target)
}
