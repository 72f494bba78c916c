//! What a fleet came to.

use std::collections::BTreeMap;

/// Counts of one fleet.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FleetReport {
    /// The seed.
    pub seed: u64,
    /// Simulated time in seconds.
    pub simulated_s: f64,
    /// Runs by how they stand: an end of a run, `missed`, `dropped`, or not over yet.
    pub runs: BTreeMap<&'static str, u64>,
    /// Why runs did not go through: how they ended and the reason, numbers as `#`.
    pub reasons: BTreeMap<String, u64>,
    /// What was told about plans, numbers as `#`.
    pub sentences: BTreeMap<String, u64>,
    /// True passes that some armed plan wanted.
    pub wanted: u64,
    /// Of these given to another satellite or closed, with the reason in the schedule.
    pub given_away: u64,
    /// Of these nobody could know: the station was dead for all of them, its clock was off by an hour, its elements told nothing.
    pub excused: u64,
    /// Commands by their last stage.
    pub commands: BTreeMap<&'static str, u64>,
    /// Frames that left an antenna.
    pub radiations: u64,
    /// Of these while the satellite was really below the horizon: the station's clock or its elements were wrong.
    pub into_the_ground: u64,
    /// Hand-overs while the elements told nothing: the satellite was heard.
    pub unbelieved: u64,
    /// Frames stored, at both stations.
    pub frames_heard: u64,
    /// Of these heard by the station that does not command the satellite.
    pub heard_along: u64,
    /// Images that became whole.
    pub images: u64,
    /// Times a process was killed.
    pub kills: u64,
    /// What happened to the stations, by name.
    pub incidents: BTreeMap<&'static str, u64>,
    /// Intents that were refused, numbers as `#`.
    pub refusals: BTreeMap<String, u64>,
    /// SHA-256 of everything that happened, as hex: equal for equal seeds.
    pub log_hash: String,
}

/// A sentence with its numbers as `#`, so that equal ones can be counted.
pub(super) fn shape(sentence: &str) -> String {
    let mut out = String::with_capacity(sentence.len());
    for c in sentence.chars() {
        if !c.is_ascii_digit() {
            out.push(c);
        } else if !out.ends_with('#') {
            out.push('#');
        }
    }
    out
}
