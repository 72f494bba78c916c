//! Names of passes that outlive new elements.

use std::fmt;

use crate::clock::UtcUs;
use crate::id::{SatelliteId, StationId};

/// A pass under a name that stays when newer elements move it by seconds or minutes: who, where, and the minute of
/// its middle when it was first foretold.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PassKey {
    /// Whose pass.
    pub satellite: SatelliteId,
    /// Over which station.
    pub station: StationId,
    /// Minutes since 1970-01-01T00:00Z of the pass's middle when it was first foretold.
    pub minute: i64,
}

impl fmt::Display for PassKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}:{}", self.satellite, self.station, self.minute)
    }
}

/// A pass as it was foretold, with the name it got.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Foretold {
    /// Its name.
    pub key: PassKey,
    /// Its AOS by the elements of then.
    pub aos: UtcUs,
    /// Its LOS by the elements of then.
    pub los: UtcUs,
}

/// Names the passes `found` (AOS, LOS) of one satellite over one station: a pass that overlaps one already `known` is that
/// one and keeps its name, the longest overlap first; others get a name of their own. In the order of `found`.
pub fn identify(
    satellite: &SatelliteId,
    station: &StationId,
    known: &[Foretold],
    found: &[(UtcUs, UtcUs)],
) -> Vec<PassKey> {
    let known: Vec<&Foretold> =
        known.iter().filter(|k| k.key.satellite == *satellite && k.key.station == *station).collect();
    let mut by_start: Vec<usize> = (0..known.len()).collect();
    by_start.sort_by_key(|&k| known[k].aos);
    let longest = known.iter().map(|k| k.los.0.saturating_sub(k.aos.0)).max().unwrap_or(0);
    let mut pairs = Vec::new();
    for (f, (aos, los)) in found.iter().enumerate() {
        let first = by_start.partition_point(|&k| known[k].aos.0.saturating_add(longest) <= aos.0);
        for &k in by_start[first..].iter().take_while(|&&k| known[k].aos < *los) {
            let overlap_us = los.0.min(known[k].los.0).saturating_sub(aos.0.max(known[k].aos.0));
            if overlap_us > 0 {
                pairs.push((std::cmp::Reverse(overlap_us), f, k));
            }
        }
    }
    pairs.sort_unstable();
    let mut keys: Vec<Option<PassKey>> = vec![None; found.len()];
    let mut taken = vec![false; known.len()];
    for (_, f, k) in pairs {
        if keys[f].is_none() && !taken[k] {
            taken[k] = true;
            keys[f] = Some(known[k].key.clone());
        }
    }
    let mut used: std::collections::BTreeSet<i64> = known.iter().map(|k| k.key.minute).collect();
    keys.into_iter()
        .zip(found)
        .map(|(key, (aos, los))| {
            key.unwrap_or_else(|| {
                let middle_us = aos.0 / 2 + los.0 / 2;
                let mut minute = middle_us.div_euclid(60_000_000);
                while !used.insert(minute) {
                    minute += 1;
                }
                PassKey { satellite: satellite.clone(), station: station.clone(), minute }
            })
        })
        .collect()
}
