//! Small questions: the answer is the best one.

use mission::schedule::{Role, plan};

use crate::brute;
use crate::cases::{tight, tight_pair};
use crate::rules::check;

#[test]
fn one_station_equals_brute_force() {
    let (mut cut, mut refused) = (0, 0);
    for seed in 0..500 {
        let problem = tight(seed);
        let schedule = plan(&problem, &[]);
        check(&problem, &schedule, &format!("seed {seed}"));
        assert_eq!(schedule.worth.0, brute::best(&problem), "seed {seed}: {problem:#?} {schedule:#?}");
        assert!(schedule.is_proved(), "seed {seed}: {schedule:#?}");
        cut += schedule.contacts.iter().filter(|c| !c.whole).count();
        refused += schedule.refused.len();
    }
    // The cases are worth asking: many contacts are cut, many passes refused.
    assert!(cut > 200 && refused > 500, "{cut} cut, {refused} refused");
}

#[test]
fn the_order_of_the_question_does_not_matter() {
    for seed in 500..560 {
        let problem = tight(seed);
        let mut turned = problem.clone();
        turned.candidates.reverse();
        assert_eq!(plan(&problem, &[]).worth, plan(&turned, &[]).worth, "seed {seed}");
    }
}

#[test]
fn two_stations_that_share_passages_equal_brute_force() {
    let mut ears = 0;
    for seed in 0..300 {
        let problem = tight_pair(seed);
        let schedule = plan(&problem, &[]);
        check(&problem, &schedule, &format!("seed {seed}"));
        assert_eq!(schedule.worth.0, brute::best(&problem), "seed {seed}: {problem:#?} {schedule:#?}");
        assert!(schedule.is_proved(), "seed {seed}: {schedule:#?}");
        ears += schedule.contacts.iter().filter(|c| c.role != Role::Lead).count();
    }
    assert!(ears > 20, "{ears}");
}
