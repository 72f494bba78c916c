//! A fortnight unattended: three satellites, two stations, and everything that goes wrong.

use std::collections::BTreeMap;
use std::thread;

use rehearsal::fleet::{Fleet, FleetReport};

const DAYS: u64 = 14;

fn fly(seed: u64, days: u64, calm: bool) -> FleetReport {
    let mut fleet = Fleet::new(seed, days, calm);
    match fleet.run() {
        Ok(report) => report,
        Err(violation) => {
            let story: Vec<&str> = fleet.story().collect();
            unreachable!("{violation}\nhow it came about:\n{}", story.join("\n"))
        }
    }
}

/// Adds up what is counted by name, and prints it, the greatest first.
fn tell(what: &str, reports: &[FleetReport], of: impl Fn(&FleetReport) -> Vec<(String, u64)>) -> u64 {
    let mut sums: BTreeMap<String, u64> = BTreeMap::new();
    for (name, count) in reports.iter().flat_map(of) {
        *sums.entry(name).or_default() += count;
    }
    let mut sorted: Vec<(&String, &u64)> = sums.iter().collect();
    sorted.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
    println!("{what}:");
    for (name, count) in sorted {
        println!("{count:7} {name}");
    }
    sums.values().sum()
}

fn named(counts: &BTreeMap<&'static str, u64>) -> Vec<(String, u64)> {
    counts.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect()
}

/// Without the names of satellites: the reasons are the same for all.
fn nameless(counts: &BTreeMap<String, u64>) -> Vec<(String, u64)> {
    let strip = |text: &str| text.replace("alpha", "X").replace("bravo", "X").replace("charlie", "X");
    counts.iter().map(|(text, count)| (strip(text), *count)).collect()
}

#[test]
fn fortnights_in_which_everything_goes_wrong_hold_every_invariant() {
    let fleets: u64 = std::env::var("FORTNIGHTS").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    let first: u64 = std::env::var("FORTNIGHTS_FROM").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    let half = |odd: u64| {
        let seeds = (first..first + fleets).filter(move |seed| seed % 2 == odd);
        seeds.map(|seed| fly(seed, DAYS, false)).collect::<Vec<_>>()
    };
    let reports: Vec<FleetReport> = thread::scope(|scope| {
        let halves = [0, 1].map(|odd| scope.spawn(move || half(odd)));
        halves.into_iter().flat_map(|half| half.join().unwrap()).collect()
    });
    let sum = |of: fn(&FleetReport) -> u64| reports.iter().map(of).sum::<u64>();
    let of_runs = |name: &str| reports.iter().filter_map(|report| report.runs.get(name)).sum::<u64>();
    tell("incidents", &reports, |report| named(&report.incidents));
    let runs = tell("runs", &reports, |report| named(&report.runs));
    tell("reasons", &reports, |report| nameless(&report.reasons));
    tell("told of plans", &reports, |report| nameless(&report.sentences));
    tell("commands", &reports, |report| named(&report.commands));
    tell("intents refused", &reports, |report| nameless(&report.refusals));
    println!(
        "{fleets} fleets, {:.0} days each: {runs} runs, {} radiations ({} with the satellite below the true horizon, {} without \
         elements to be believed), {} kills, {} images, {} frames heard ({} by the station that does not command)",
        reports[0].simulated_s / 86_400.0,
        sum(|r| r.radiations),
        sum(|r| r.into_the_ground),
        sum(|r| r.unbelieved),
        sum(|r| r.kills),
        sum(|r| r.images),
        sum(|r| r.frames_heard),
        sum(|r| r.heard_along),
    );
    println!(
        "{} passes wanted by an armed plan: {} given away with a reason, {} that nobody could know",
        sum(|r| r.wanted),
        sum(|r| r.given_away),
        sum(|r| r.excused)
    );
    // A test in which nothing happens could not fail.
    assert!(of_runs("completed") > 80 * fleets, "{}", of_runs("completed"));
    for name in ["aborted", "unfinished", "missed", "dropped"] {
        assert!(of_runs(name) > 0, "no run was {name}");
    }
    assert!(sum(|r| r.radiations) > 100 * fleets && sum(|r| r.kills) > 40 * fleets);
    assert!(sum(|r| r.images) > 10 * fleets && sum(|r| r.heard_along) > 1_000 * fleets);
    // Who can know nothing is a rare exception.
    assert!(sum(|r| r.excused) * 10 < sum(|r| r.wanted));
}

#[test]
fn same_seed_gives_the_same_fortnight() {
    let (first, again) = (fly(1, DAYS, false), fly(1, DAYS, false));
    assert_eq!(first, again);
    assert_ne!(first.log_hash, fly(2, 2, false).log_hash);
}

#[test]
fn calm_fortnight_misses_nothing() {
    let report = fly(5, DAYS, true);
    let of = |name: &str| report.runs.get(name).copied().unwrap_or(0);
    println!("{:?}\n{:#?}", report.runs, report.reasons);
    assert_eq!(
        (of("missed"), of("stopped"), report.kills, report.excused, report.into_the_ground),
        (0, 0, 0, 0, 0)
    );
    assert!(of("completed") * 10 > report.runs.values().sum::<u64>() * 7, "{:?}", report.runs);
}
