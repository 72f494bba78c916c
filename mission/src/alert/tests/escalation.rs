use super::super::{AlertState, Escalation};
use super::*;
use crate::id::AlertId;

fn escalating() -> Policy {
    let step = |after_min, to: &str| Escalation { after_min, to: vec![to.to_owned()] };
    Policy { escalate: vec![step(10, "lead"), step(30, "phone")], ..policy() }
}

/// Who was told in each minute of an hour and a half.
fn minutes(alerts: &mut Alerts, from: u64) -> Vec<(u64, String)> {
    let mut all = Vec::new();
    for minute in 0..90 {
        let changes = alerts.observe(at(from + minute * 60), &[condition(Level::Warning)]);
        all.extend(changes.notices.into_iter().map(|Notice { target, .. }| (minute, target)));
    }
    all
}

#[test]
fn nobody_acknowledges_and_the_next_one_is_told_each_once() {
    let all = minutes(&mut machine(escalating()), 0);
    let expected = [(0, "chat"), (10, "lead"), (30, "phone")];
    assert_eq!(all, expected.map(|(minute, to)| (minute, to.to_owned())));
}

#[test]
fn an_acknowledgement_ends_it_and_a_worse_level_begins_it_anew() {
    let mut alerts = machine(escalating());
    alerts.observe(at(0), &[condition(Level::Warning)]);
    alerts.acknowledge(at(599), AlertId(1), &anna(), None).unwrap();
    assert_eq!(minutes(&mut alerts, 600), []);
    let worse = alerts.observe(at(6_000), &[condition(Level::Critical)]);
    assert_eq!(told(&worse), [(NoticeKind::Worse, "chat")]);
    let later = alerts.observe(at(6_600), &[condition(Level::Critical)]);
    assert_eq!(told(&later), [(NoticeKind::Escalated, "lead")]);
}

#[test]
fn what_returned_by_itself_and_was_not_seen_escalates_all_the_same() {
    let mut alerts = machine(escalating());
    alerts.observe(at(0), &[condition(Level::Warning)]);
    alerts.observe(at(60), &[]);
    assert_eq!(
        told(&alerts.tick(at(600))),
        [(NoticeKind::Returned, "chat"), (NoticeKind::Escalated, "lead")]
    );
    assert_eq!(only(&alerts).state(), AlertState::Returned);
}

#[test]
fn in_quiet_hours_only_the_gravest_goes_out_and_the_rest_waits() {
    let mut policy = escalating();
    policy.quiet_hours = vec!["21:00-05:00".parse().unwrap()];
    policy.targets[2].quiet = false;
    policy.notify.push("phone".into());
    let mut alerts = machine(policy);
    let night = 22 * 3_600;
    let held = |changes: &Changes| -> Vec<(String, bool)> {
        changes.notices.iter().map(|notice| (notice.target.clone(), notice.held)).collect()
    };
    let raised = alerts.observe(at(night), &[condition(Level::Distress)]);
    assert_eq!(held(&raised), [("chat".to_owned(), true), ("phone".to_owned(), false)]);
    let worse = alerts.observe(at(night + 1), &[condition(Level::Critical)]);
    assert_eq!(held(&worse), [("chat".to_owned(), false), ("phone".to_owned(), false)]);
    // By day nothing waits.
    let mut alerts = machine(Policy { quiet_hours: vec!["21:00-05:00".parse().unwrap()], ..escalating() });
    assert!(alerts.observe(at(12 * 3_600), &[condition(Level::Watch)]).notices.iter().all(|n| !n.held));
}

#[test]
fn a_target_that_is_not_reached_is_not_told_so() {
    let mut policy = policy();
    policy.notify = vec!["chat".into(), "lead".into()];
    let mut alerts = machine(policy);
    let lost = Condition::new(AlertKind::Delivery, "chat", Level::Warning, "messages do not go through");
    assert_eq!(told(&alerts.observe(at(0), &[lost])), [(NoticeKind::Raised, "lead")]);
}

#[test]
fn a_target_gets_what_is_grave_enough_for_it_and_hears_the_end_of_what_it_got() {
    let mut policy = policy();
    policy.targets[1].min_level = Level::Critical;
    policy.notify = vec!["chat".into(), "lead".into(), "lead".into(), "nobody".into()];
    let mut alerts = machine(policy);
    assert_eq!(told(&alerts.observe(at(0), &[condition(Level::Watch)])), [(NoticeKind::Raised, "chat")]);
    let worse = alerts.observe(at(1), &[condition(Level::Critical)]);
    assert_eq!(told(&worse), [(NoticeKind::Worse, "chat"), (NoticeKind::Worse, "lead")]);
    alerts.observe(at(2), &[condition(Level::Watch)]);
    let over = alerts.observe(at(700), &[]);
    assert_eq!(told(&over), [(NoticeKind::Returned, "chat"), (NoticeKind::Returned, "lead")]);
}
