use super::super::{ActionError, AlertState};
use super::*;
use crate::id::AlertId;
use crate::record::EventKind;

#[test]
fn an_alert_goes_through_the_life_that_isa_18_2_gives_it() {
    let mut alerts = machine(policy());
    let raised = alerts.observe(at(10), &[condition(Level::Warning)]);
    assert_eq!(told(&raised), [(NoticeKind::Raised, "chat")]);
    let alert = only(&alerts);
    assert_eq!((alert.id, alert.state(), alert.times), (AlertId(1), AlertState::Unacknowledged, 1));
    assert!(alert.wants_eyes());

    alerts.acknowledge(at(20), alert.id, &anna(), Some("on it")).unwrap();
    let alert = only(&alerts);
    assert_eq!(alert.state(), AlertState::Acknowledged);
    assert_eq!((alert.note.as_deref(), alert.wants_eyes()), (Some("on it"), false));

    let over = alerts.observe(at(700), &[]);
    assert_eq!(over.alerts.last().unwrap().state(), AlertState::Closed);
    assert_eq!(told(&over), [(NoticeKind::Returned, "chat")]);
    assert_eq!(alerts.open().count(), 0);

    let again = alerts.observe(at(800), &[condition(Level::Watch)]);
    assert_eq!(again.alerts[0].id, AlertId(2), "history is not opened again");
}

#[test]
fn what_returned_stays_until_somebody_acknowledges() {
    let mut alerts = machine(policy());
    alerts.observe(at(10), &[condition(Level::Critical)]);
    alerts.observe(at(20), &[]);
    for day in 1..=30 {
        alerts.tick(at(day * 86_400));
    }
    let alert = only(&alerts);
    assert_eq!((alert.state(), alert.returned_at), (AlertState::Returned, Some(at(20).utc)));
    let closed = alerts.acknowledge(at(40 * 86_400), alert.id, &anna(), None).unwrap();
    assert_eq!(closed.alerts[0].state(), AlertState::Closed);
    assert_eq!(
        alerts.acknowledge(at(40 * 86_400), alert.id, &anna(), None),
        Err(ActionError::NotOpen(alert.id))
    );
}

#[test]
fn without_a_latch_it_closes_by_itself_once_it_has_settled() {
    let mut alerts = machine(with(AlertKind::Limit, |rule| rule.latch = false));
    alerts.observe(at(10), &[condition(Level::Watch)]);
    alerts.observe(at(20), &[]);
    assert!(alerts.tick(at(619)).is_empty() || alerts.open().count() == 1);
    let closed = alerts.tick(at(620));
    assert_eq!(closed.alerts[0].state(), AlertState::Closed);
}

#[test]
fn what_gets_worse_is_told_at_once_and_voids_the_acknowledgement() {
    let mut alerts = machine(policy());
    alerts.observe(at(10), &[condition(Level::Watch)]);
    alerts.acknowledge(at(11), AlertId(1), &anna(), None).unwrap();
    let worse = alerts.observe(at(12), &[condition(Level::Severe)]);
    assert_eq!(told(&worse), [(NoticeKind::Worse, "chat")]);
    let alert = only(&alerts);
    assert_eq!((alert.state(), alert.worst), (AlertState::Unacknowledged, Level::Severe));
    let milder = alerts.observe(at(13), &[condition(Level::Watch)]);
    assert_eq!(
        (told(&milder).len(), only(&alerts).level, only(&alerts).worst),
        (0, Level::Watch, Level::Severe)
    );
}

#[test]
fn on_a_shelf_nobody_is_told_and_afterwards_it_waits_again() {
    let mut alerts = machine(policy());
    alerts.observe(at(10), &[condition(Level::Watch)]);
    let until = at(5000).utc;
    assert_eq!(alerts.shelve(at(11), AlertId(1), &anna(), at(11).utc, None), Err(ActionError::Shelf));
    assert_eq!(alerts.shelve(at(11), AlertId(1), &anna(), at(700_000).utc, None), Err(ActionError::Shelf));
    alerts.shelve(at(11), AlertId(1), &anna(), until, Some("known, antenna is down")).unwrap();
    assert_eq!(only(&alerts).state(), AlertState::Shelved);
    assert_eq!(told(&alerts.observe(at(12), &[condition(Level::Critical)])), []);
    assert_eq!(told(&alerts.observe(at(4999), &[condition(Level::Critical)])), []);
    let back = alerts.observe(at(5000), &[condition(Level::Critical)]);
    assert_eq!(told(&back), [(NoticeKind::Worse, "chat")]);
    assert_eq!(only(&alerts).state(), AlertState::Unacknowledged);

    alerts.shelve(at(5001), AlertId(1), &anna(), at(9000).utc, None).unwrap();
    alerts.unshelve(at(5002), AlertId(1), &anna()).unwrap();
    assert_eq!(only(&alerts).waiting_since, at(5002).utc);
}

#[test]
fn it_can_be_given_to_somebody_and_doing_so_twice_changes_nothing() {
    let mut alerts = machine(policy());
    alerts.observe(at(10), &[condition(Level::Watch)]);
    assert!(!alerts.assign(at(11), AlertId(1), &anna(), Some("ben"), None).unwrap().is_empty());
    assert!(alerts.assign(at(12), AlertId(1), &anna(), Some("ben"), None).unwrap().is_empty());
    assert_eq!(only(&alerts).assignee.as_deref(), Some("ben"));
    alerts.assign(at(13), AlertId(1), &anna(), None, None).unwrap();
    assert_eq!(only(&alerts).assignee, None);
    let long = "x".repeat(1001);
    assert_eq!(alerts.assign(at(14), AlertId(1), &anna(), None, Some(&long)), Err(ActionError::TooLong));
}

#[test]
fn what_merely_happened_is_an_alert_like_any_other() {
    let mut alerts = machine(policy());
    let error = |level| Condition::new(AlertKind::Event, "satellite-error pixelsat-1", level, "error 16");
    assert!(alerts.event(at(9), EventKind::SatelliteError, &error(Level::Watch)).is_empty());
    assert!(alerts.event(at(9), EventKind::Contact, &error(Level::Severe)).is_empty());
    assert!(alerts.event(at(9), EventKind::Alert, &error(Level::Severe)).is_empty());
    let first = alerts.event(at(10), EventKind::SatelliteError, &error(Level::Warning));
    assert_eq!(told(&first), [(NoticeKind::Raised, "chat")]);
    for s in 11..600 {
        assert_eq!(told(&alerts.event(at(s), EventKind::SatelliteError, &error(Level::Warning))), []);
    }
    assert_eq!(told(&alerts.tick(at(610))), [(NoticeKind::Again, "chat")]);
    // What holds, and is not seen among what holds, does not concern it.
    alerts.observe(at(611), &[]);
    let alert = only(&alerts);
    assert_eq!((alert.state(), alert.times), (AlertState::Returned, 590));
    let known = alerts.acknowledge(at(612), alert.id, &anna(), None).unwrap();
    assert_eq!(known.alerts[0].state(), AlertState::Closed);

    let plan = Condition::new(AlertKind::Plan, "night", Level::Warning, "missed");
    assert_eq!(told(&alerts.happened(at(700), &plan)), [(NoticeKind::Raised, "chat")]);
}

#[test]
fn a_rule_that_is_off_silences_its_subject_and_a_level_may_be_set() {
    let mut policy = policy();
    policy.rules.push(Rule {
        name: "camera".into(),
        enabled: false,
        subject: Some("pixelsat-1 heartbeat.temp".into()),
        ..Rule::built_in(AlertKind::Limit)
    });
    policy.rules.push(Rule {
        name: "volts".into(),
        level: Some(Level::Severe),
        subject: Some("pixelsat-1 heartbeat.volts".into()),
        ..Rule::built_in(AlertKind::Limit)
    });
    let mut alerts = machine(policy);
    assert!(alerts.observe(at(1), &[condition(Level::Severe)]).is_empty());
    let volts = Condition::new(AlertKind::Limit, "pixelsat-1 heartbeat.volts", Level::Watch, "low");
    alerts.observe(at(2), &[condition(Level::Severe), volts]);
    assert_eq!((only(&alerts).rule.as_str(), only(&alerts).level), ("volts", Level::Severe));
}

#[test]
fn a_new_life_goes_on_where_the_last_one_ended() {
    let mut alerts = machine(policy());
    alerts.observe(at(10), &[condition(Level::Watch)]);
    let kept: Vec<Alert> = alerts.open().cloned().collect();
    let mut alerts = Alerts::new(policy(), kept, 1, at(0));
    assert!(alerts.observe(at(11), &[condition(Level::Watch)]).is_empty(), "it was told before");
    let other = Condition::new(AlertKind::Link, "e22", Level::Warning, "gone");
    for s in 12..50 {
        alerts.observe(at(s), &[condition(Level::Watch), other.clone()]);
    }
    assert_eq!(alerts.open().map(|alert| alert.id.0).max(), Some(2));
}
