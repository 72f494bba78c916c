//! Reasons as operators read them.

use mission::schedule::{
    Blackout, Cut, Foretold, Health, Partial, Policy, Problem, Reason, Role, Scope, Site, identify, plan,
    points,
};

use crate::cases::{at, mast, pass, satellite, station, window};

fn home(candidates: Vec<mission::schedule::Candidate>) -> Problem {
    Problem { candidates, antennas: vec![mast("yagi", "home", 60)], ..Problem::default() }
}

/// 08:31Z.
const MORNING_S: i64 = 8 * 3600 + 31 * 60;

#[test]
fn the_loser_is_told_to_whom_and_for_how_much() {
    let mut problem = home(vec![
        pass("pixelsat-1", "home", MORNING_S, MORNING_S + 660, 300),
        pass("chess", "home", MORNING_S + 30, MORNING_S + 600, 120),
    ]);
    for candidate in &mut problem.candidates {
        candidate.partial = Partial::Worthless;
    }
    let schedule = plan(&problem, &[]);
    assert_eq!(schedule.refused[0].to_string(), "loses to pixelsat-1 08:31-08:42Z, worth 300 against 120");
    assert_eq!(schedule.contacts[0].over, [schedule.refused[0].key.clone()]);
    assert!(schedule.is_proved());
}

#[test]
fn a_pass_is_cut_where_another_begins() {
    let problem = home(vec![
        pass("pixelsat-1", "home", MORNING_S, MORNING_S + 660, 300),
        pass("chess", "home", MORNING_S + 400, MORNING_S + 1000, 1000),
    ]);
    let schedule = plan(&problem, &[]);
    let [first, second] = schedule.contacts.as_slice() else { panic!("{schedule:#?}") };
    assert_eq!(first.cut_stop, Some(Cut::Contact(second.key.clone())));
    // 60 s to switch over, and twice the 5 s in hand.
    assert_eq!((first.stop, second.start), (at(MORNING_S + 330), at(MORNING_S + 400)));
    assert!(!first.whole && second.whole && schedule.refused.is_empty());
}

#[test]
fn the_station_says_why_it_is_not_used() {
    let mut problem = home(vec![pass("pixelsat-1", "home", 0, 600, 300)]);
    let site = Site {
        station: station("home"),
        health: Health::Unfit("silent since 3 passes".to_owned()),
        licence: None,
    };
    problem.sites.push(site.clone());
    let said = |problem: &Problem| plan(problem, &[]).refused[0].to_string();
    assert_eq!(said(&problem), "home is not used: silent since 3 passes");

    problem.sites[0] = Site { health: Health::Fit, licence: Some(vec![window(550, 4000)]), ..site };
    assert!(plan(&problem, &[]).refused.is_empty(), "who only listens needs no licence");
    problem.candidates[0].transmit = true;
    assert_eq!(said(&problem), "closed (outside the licence's window): 45 s are left of the 130 s it needs");

    problem.sites.clear();
    let blackout = |from_s, to_s| Blackout {
        scope: Scope::Station(station("home")),
        window: window(from_s, to_s),
        reason: "storm".to_owned(),
    };
    problem.blackouts.push(blackout(100, 5000));
    assert_eq!(said(&problem), "closed (storm): 95 s are left of the 130 s it needs");
    problem.blackouts[0] = blackout(400, 5000);
    assert_eq!(plan(&problem, &[]).contacts[0].cut_stop, Some(Cut::Closed("storm".to_owned())));
    problem.antennas.clear();
    assert_eq!(said(&problem), "no antenna of home serves it");
}

#[test]
fn nonsense_is_named() {
    let good = pass("pixelsat-1", "home", 0, 600, 300);
    let with = |change: &dyn Fn(&mut mission::schedule::Candidate)| {
        let mut candidate = good.clone();
        change(&mut candidate);
        plan(&home(vec![candidate]), &[]).refused[0].to_string()
    };
    assert_eq!(with(&|c| c.los = c.aos), "not a pass: LOS must be at least a second after AOS");
    assert_eq!(with(&|c| c.value = 0), "not a pass: value is 0; give it at least 1 point");
    assert_eq!(with(&|c| c.min_duration_s = 700), "too short: 600 s of the 700 s it needs");
    assert!(with(&|c| c.los = mission::UtcUs(i64::MAX)).contains("more than a day"));
    assert!(with(&|c| c.aos = mission::UtcUs(i64::MIN)).contains("more than a day"));
    assert!(with(&|c| c.value = u32::MAX).contains("1,000,000"));
    let far = plan(&home(vec![good.clone(), pass("chess", "home", 40 * 86_400, 40 * 86_400 + 600, 9)]), &[]);
    assert!(far.refused[0].to_string().contains("plan it when it is nearer"), "{}", far.refused[0]);
    let twice = plan(&home(vec![good.clone(), good.clone()]), &[]);
    assert_eq!(twice.contacts.len(), 1);
    assert!(matches!(twice.refused[0].reason, Reason::Invalid(what) if what.contains("key")));
    assert_eq!(plan(&Problem::default(), &[]), mission::schedule::Schedule::default());
}

#[test]
fn a_passage_counts_once_then_idle_antennas_listen_along() {
    let mut problem = home(vec![
        pass("pixelsat-1", "home", 0, 600, 300),
        pass("pixelsat-1", "hill", 40, 640, 280),
        pass("chess", "home", 20, 620, 100),
        pass("chess", "hill", 60, 660, 100),
        pass("pixelsat-1", "home", 6000, 6600, 300),
        pass("pixelsat-1", "hill", 6040, 6640, 280),
    ]);
    problem.antennas.push(mast("dish", "hill", 60));
    for candidate in &mut problem.candidates {
        (candidate.transmit, candidate.partial) = (true, Partial::Worthless);
    }
    let schedule = plan(&problem, &[]);
    // The two stations take one satellite each, not both the better one.
    let early: Vec<_> = schedule.contacts.iter().filter(|c| c.start < at(3000)).collect();
    assert_eq!(early.len(), 2);
    assert!(early[0].satellite != early[1].satellite && early.iter().all(|c| c.role == Role::Lead));
    assert_eq!(schedule.worth.points().round(), 700.0);
    // Later there is only one satellite: the second antenna listens, and does not transmit.
    let late: Vec<_> = schedule.contacts.iter().filter(|c| c.start > at(3000)).collect();
    assert_eq!(late.len(), 2);
    assert_eq!((&late[0].role, late[0].transmit.is_some()), (&Role::Lead, true));
    assert_eq!((&late[1].role, late[1].transmit), (&Role::Ear(late[0].key.clone()), None));
    assert!(schedule.refused.iter().all(|r| r.to_string().starts_with("heard by ")));
}

#[test]
fn names_of_passes_outlive_new_elements() {
    let (who, place) = (satellite("pixelsat-1"), station("home"));
    let found = [(at(0), at(600)), (at(5700), at(6200))];
    let keys = identify(&who, &place, &[], &found);
    let known: Vec<Foretold> =
        keys.iter().zip(found).map(|(key, (aos, los))| Foretold { key: key.clone(), aos, los }).collect();
    let later = [(at(-200), at(420)), (at(5691), at(6300)), (at(11_000), at(11_500))];
    let again = identify(&who, &place, &known, &later);
    assert_eq!(again[..2], keys[..]);
    assert!(!keys.contains(&again[2]));
    // One that is gone leaves its name unused; a new one in the same minute gets another.
    let elsewhere = identify(&who, &place, &known, &[(at(601), at(602)), (at(0), at(0))]);
    assert!(elsewhere.iter().all(|k| !keys.contains(k)), "{elsewhere:?}");
    assert_ne!(elsewhere[0], elsewhere[1]);
}

#[test]
fn points_double_with_each_priority() {
    assert_eq!([points(1, 600, 90.0), points(2, 600, 90.0), points(1, 600, 0.0)], [200, 400, 100]);
    assert_eq!(points(1, 0, f64::NAN), 1);
    assert_eq!(points(255, u32::MAX, f64::INFINITY), 1_000_000);
}

#[test]
fn no_work_is_still_an_answer() {
    let mut problem = crate::cases::days(3, 30, 2, 2, 1);
    problem.policy = Policy { max_states: 0, ..Policy::default() };
    let schedule = plan(&problem, &[]);
    crate::rules::check(&problem, &schedule, "no states at all");
    assert!(schedule.gap() < 0.2, "{}", schedule.gap());
}

#[test]
fn extremes_break_nothing() {
    let month_s = 31 * 86_400;
    let mut candidates = vec![pass("long", "home", 0, 86_400, 1_000_000)];
    for n in 0..40 {
        let aos_s = n * month_s / 40;
        candidates.push(pass("short", "home", aos_s, aos_s + 1, 1_000_000));
        candidates.push(pass("other", "home", aos_s, aos_s + 86_000, 1_000_000));
    }
    for (n, candidate) in candidates.iter_mut().enumerate() {
        (candidate.min_duration_s, candidate.key.minute) = (1, n as i64);
    }
    let mut problem = home(candidates);
    problem.antennas[0].switch_over_s = u32::MAX;
    let forever =
        mission::schedule::Window { start: mission::UtcUs(i64::MIN), stop: mission::UtcUs(i64::MAX) };
    for drift_s in [0, 5, u32::MAX] {
        problem.policy = Policy { drift_s, keep_permille: u32::MAX, max_states: 1000 };
        let schedule = plan(&problem, &[]);
        crate::rules::check(&problem, &schedule, "extremes");
        let mut memory = schedule.memory;
        crate::rules::check(&problem, &plan(&problem, &memory), "extremes, remembered");
        for remembered in &mut memory {
            (remembered.aos_s, remembered.los_s) = (i64::MIN, i64::MAX);
        }
        crate::rules::check(&problem, &plan(&problem, &memory), "extremes, badly remembered");
    }
    let reason = "always".to_owned();
    problem.blackouts.push(Blackout { scope: Scope::Satellite(satellite("long")), window: forever, reason });
    crate::rules::check(&problem, &plan(&problem, &[]), "shut for ever");
}
