//! What the archive knows of those who heard the satellite before.

use std::collections::BTreeMap;
use std::ops::Range;

use tle::passes::{PassFinder, PassSearch};
use tle::{EarthOrientation, Elements, Station};

use super::task::{Listener, TaskError};
use crate::clock::UtcUs;
use crate::sky::{instant, utc};

/// A pass lower than this at its highest says nothing of a listener, degrees.
const PASS_DEG: f64 = 10.0;
/// How many passes the usual share is worth against what was seen.
const PRIOR_PASSES: f64 = 3.0;
/// The usual share.
const PRIOR: f64 = 0.3;
/// Off by this the elements may be, and a receiver's clock, microseconds.
const SLACK_US: i64 = 90_000_000;
/// Receivers that are looked at: those that were heard from most often. Names can be made up without end.
const RECEIVERS_MAX: usize = 1_000;

/// Somebody heard the satellite.
#[derive(Debug, Clone, PartialEq)]
pub struct HeardBy {
    /// What tells the receiver from all others.
    pub id: String,
    /// What it is called.
    pub name: String,
    /// Where it stands.
    pub place: Station,
    /// When it heard something.
    pub at: UtcUs,
}

/// Everybody who heard the satellite, with the share of its passes over them in which they did, and when they did last.
///
/// Passes count from the first one heard until `until`, those above 10° at their highest. The pass by which a receiver became
/// known is left out of both, and three passes of the usual 0.3 are added: one lucky pass makes nobody reliable.
///
/// # Errors
/// [`TaskError`] when the orbit cannot be followed.
pub fn listeners(
    elements: &Elements,
    orientation: EarthOrientation,
    heard: &[HeardBy],
    until: UtcUs,
) -> Result<Vec<Listener>, TaskError> {
    let mut receivers: BTreeMap<&str, Vec<&HeardBy>> = BTreeMap::new();
    for one in heard.iter().filter(|one| one.at <= until) {
        receivers.entry(&one.id).or_default().push(one);
    }
    let mut receivers: Vec<Vec<&HeardBy>> = receivers.into_values().collect();
    receivers.sort_by_key(|heard| std::cmp::Reverse(heard.len()));
    receivers.truncate(RECEIVERS_MAX);
    let finder = PassFinder::new(elements)?;
    let mut listeners = Vec::with_capacity(receivers.len());
    for heard in receivers {
        let times = || heard.iter().map(|one| one.at);
        let (Some(first), Some(last)) = (times().min(), heard.iter().max_by_key(|one| one.at)) else {
            continue;
        };
        let search = PassSearch {
            orientation,
            ..PassSearch::new(instant(first.plus(-SLACK_US)), instant(until), 0.0)
        };
        let found = finder.find(std::slice::from_ref(&last.place), &search)?;
        let passes: Vec<Range<UtcUs>> = found
            .stations
            .iter()
            .flatten()
            .filter(|pass| pass.tca.look.elevation_deg >= PASS_DEG)
            .map(|pass| utc(pass.aos.at).plus(-SLACK_US)..utc(pass.los.at).plus(SLACK_US))
            .collect();
        let in_which = passes.iter().filter(|pass| times().any(|at| pass.contains(&at))).count();
        // The pass by which it became known, if it was one that counts.
        let known_by = usize::from(passes.iter().any(|pass| pass.contains(&first)));
        let share = ((in_which - known_by) as f64 + PRIOR * PRIOR_PASSES)
            / ((passes.len() - known_by) as f64 + PRIOR_PASSES);
        listeners.push(Listener {
            name: last.name.clone(),
            place: last.place.clone(),
            last_seen: Some(last.at),
            success: Some(share),
        });
    }
    Ok(listeners)
}

/// Listed stations, and those of the archive that no list has. Who is in both keeps the listed place, gets the share of the
/// archive where the list has none, and counts as seen when either saw it last.
#[must_use]
pub fn joined(listed: Vec<Listener>, archive: Vec<Listener>) -> Vec<Listener> {
    let mut archive: BTreeMap<String, Listener> =
        archive.into_iter().map(|listener| (listener.name.to_lowercase(), listener)).collect();
    let mut all: Vec<Listener> = listed
        .into_iter()
        .map(|listed| match archive.remove(&listed.name.to_lowercase()) {
            None => listed,
            Some(known) => Listener {
                last_seen: listed.last_seen.max(known.last_seen),
                success: listed.success.or(known.success),
                ..listed
            },
        })
        .collect();
    all.extend(archive.into_values());
    all
}
