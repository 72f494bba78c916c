//! Who looks only when something has changed or is due sees all that one who looks every second sees, when it is.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::super::Escalation;
use super::*;

const SECONDS: u64 = 20_000;

/// What holds from now on, or what somebody does.
enum Step {
    Holds(Vec<Condition>),
    Acknowledge,
    Shelve(i64),
    Happened,
}

fn link() -> Condition {
    Condition::new(AlertKind::Link, "e22", Level::Warning, "link e22 is unavailable")
}

fn steps(seed: u64) -> Vec<(u64, Step)> {
    let mut dice = ChaCha8Rng::seed_from_u64(seed);
    let mut at = 1;
    let mut steps = Vec::new();
    while at < SECONDS {
        let step = match dice.random_range(0..10) {
            0 => Step::Acknowledge,
            1 => Step::Shelve(dice.random_range(1..2000)),
            2 => Step::Happened,
            _ => {
                let mut found = Vec::new();
                if dice.random() {
                    found.push(link());
                }
                if dice.random() {
                    found.push(condition(Level::ALL[dice.random_range(1..Level::ALL.len())]));
                }
                Step::Holds(found)
            }
        };
        steps.push((at, step));
        at += dice.random_range(1..1500);
    }
    steps
}

/// All changes with their times, and how often it looked.
fn seen(seed: u64, every_second: bool) -> (Vec<(u64, Changes)>, usize) {
    let escalate = vec![
        Escalation { after_min: 10, to: vec!["lead".into()] },
        Escalation { after_min: 25, to: vec!["phone".into()] },
    ];
    let mut policy = Policy { escalate, ..policy() };
    for rule in &mut policy.rules {
        rule.latch = rule.kind == AlertKind::Limit;
    }
    let mut alerts = machine(policy);
    let mut steps = steps(seed).into_iter().peekable();
    let (mut holds, mut all, mut looks, mut due) = (Vec::new(), Vec::new(), 0, None);
    for second in 0..SECONDS {
        let now = at(second);
        let step = steps.next_if(|(at, _)| *at == second).map(|(_, step)| step);
        if !every_second && step.is_none() && due.is_none_or(|due| now.utc < due) {
            continue;
        }
        let mut note = |changes: Changes| all.extend((!changes.is_empty()).then_some((second, changes)));
        let open = alerts.open().next().map(|alert| alert.id);
        match (step, open) {
            (Some(Step::Holds(found)), _) => holds = found,
            (Some(Step::Happened), _) => {
                let failed =
                    Condition::new(AlertKind::Plan, "ear", Level::Warning, "plan ear missed its pass");
                note(alerts.happened(now, &failed));
            }
            (Some(Step::Acknowledge), Some(id)) => {
                note(alerts.acknowledge(now, id, &anna(), None).unwrap());
            }
            (Some(Step::Shelve(s)), Some(id)) => {
                note(alerts.shelve(now, id, &anna(), now.utc.plus(s * 1_000_000), None).unwrap());
            }
            _ => {}
        }
        note(alerts.observe(now, &holds));
        looks += 1;
        due = alerts.next_due(now);
        assert!(due.is_none_or(|due| due > now.utc));
    }
    (all, looks)
}

#[test]
fn looks_at_changes_and_dues_miss_nothing_and_are_few() {
    for seed in 0..40 {
        let (all, _) = seen(seed, true);
        let (few, looks) = seen(seed, false);
        for (one, other) in all.iter().zip(&few) {
            assert_eq!(one, other, "seed {seed}");
        }
        assert_eq!(all.len(), few.len(), "seed {seed}");
        assert!(all.len() > 20 && looks < SECONDS as usize / 50, "seed {seed}: {} {looks}", all.len());
    }
}
