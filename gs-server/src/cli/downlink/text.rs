//! What a person reads: the table, and the plan that uploads the schedule.

use std::fmt::Write as _;

use mission::downlink::DownlinkPlan;
use mission::sky::instant;
use mission::{PlanName, SatelliteId, UtcUs};

use super::Answer;

/// Stations of an entry that are named.
const NAMED_MAX: usize = 4;

pub(super) fn table(answer: &Answer) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{} missing chunks of {}, {} stations, {} passes over them; one of them sees the satellite {:.0} % of the time\n",
        answer.missing_chunks,
        answer.satellite,
        answer.stations,
        answer.passes,
        100.0 * answer.covered_share
    );
    let _ = writeln!(text, "{:<20}  {:>11}  {:>5}  {:>8}  stations", "begins, UTC", "chunks", "heard", "new");
    for entry in &answer.entries {
        let begins: String = entry.time.to_string().chars().take(19).collect();
        let chunks = format!("{}-{}", entry.first, entry.first + entry.count.max(1) - 1);
        let named: Vec<String> = entry
            .stations
            .iter()
            .take(NAMED_MAX)
            .map(|ear| {
                format!(
                    "{} ({:.0} frames, up to {:.0}°)",
                    ear.name, ear.expected_frames, ear.max_elevation_deg
                )
            })
            .collect();
        let more = entry.stations.len().saturating_sub(NAMED_MAX);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let _ = writeln!(
            text,
            "{begins}Z  {chunks:>11}  {:>4.0}%  {:>8.1}  {}{more}",
            100.0 * entry.heard_share,
            entry.expected_chunks,
            named.join(", ")
        );
    }
    let _ = writeln!(
        text,
        "\nexpected {:.1} of {} chunks; at most {:.1} with any schedule; {:.1} when sent in turn from the beginning",
        answer.expected_chunks, answer.missing_chunks, answer.upper_bound_chunks, answer.round_robin_chunks
    );
    if let Some(had) = &answer.rehearsed {
        let _ = writeln!(
            text,
            "on the twin, {} runs with elements {:.1} s off (1 sigma): {:.1} chunks on average, eight of ten runs {} to {}",
            had.runs,
            had.elements_timing_error_s,
            had.mean_chunks,
            had.least_of_nine_in_ten,
            had.most_of_nine_in_ten
        );
    }
    text
}

/// A plan in TOML with one step.
pub(super) fn plan(found: &DownlinkPlan, name: &PlanName, satellite: &SatelliteId) -> String {
    let mut text = format!(
        "# Blind downlinks over the public network: {:.1} of {} missing chunks expected.\n\
         # The satellite's clock must be set, and the schedule on board before its first entry.\n\
         name = \"{name}\"\nsatellite = \"{satellite}\"\ntransmit = true\n\n[[steps]]\ndo = \"upload-schedule\"\nslots = [\n",
        found.expected_chunks, found.missing
    );
    for entry in &found.entries {
        // Whole milliseconds, as the telecommand has them.
        let at = instant(UtcUs(entry.at.0.div_euclid(1000) * 1000));
        let attitude = entry
            .attitude_mrp
            .map(|[a, b, c]| format!(", attitude_mrp = [{a:?}, {b:?}, {c:?}]"))
            .unwrap_or_default();
        let _ = writeln!(
            text,
            "  {{ time = \"{at}\", first = {}, count = {}{attitude} }}, # {:.1} new chunks expected",
            entry.first, entry.count, entry.expected_chunks
        );
    }
    text.push_str("]\n");
    text
}
