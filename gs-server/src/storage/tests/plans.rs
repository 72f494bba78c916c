//! Plans, their runs, and what commands wait for.

use std::sync::Arc;

use mission::plan::{Ask, CheckContext, Condition, Guard, Op, Ordinal, Progress, RunEnd, Ticket};
use mission::record::{CommandRecord, Record};
use mission::run::{PlanRecord, RunRecord, RunState};
use mission::{CommandId, PlanId, Principal, RunId, Stage, UtcUs};
use protocol::Telecommand;

use super::super::{Page, Scope};
use super::records::*;
use super::{Kind, fresh, reopen};
use crate::plan::check_words;

const TEXT: &str = r#"{"name":"status","satellite":"pixelsat-1","transmit":true,"at_los":"finish-later",
    "attach":{"min_max_elevation_deg":20.0},
    "steps":[{"do":"listen","for_s":5.5},{"do":"command","command":"Ping","when":{"elevation_deg":10.0}}]}"#;

pub(super) fn plan(id: u64, armed: bool) -> PlanRecord {
    let words = serde_json::from_str(TEXT).unwrap();
    let context = CheckContext { timing: Default::default(), profile: None, pass: None, now: None };
    PlanRecord {
        id: PlanId(id),
        station: route().station,
        plan: Arc::new(check_words(&words, &context).0.unwrap()),
        text: Arc::from(TEXT),
        added_at: UtcUs(NOON_US),
        who: Principal::new("ada"),
        armed,
        picks: vec![UtcUs(NOON_US + 7)],
        withdrawn_at: None,
    }
}

pub(super) fn run(id: u64, plan: u64, state: RunState, end: Option<RunEnd>) -> Record {
    let ask = Ask { ticket: Ticket::Command(CommandId(1)), stage: Some(Stage::Radiated) };
    Record::Run(Box::new(RunRecord {
        id: RunId(id),
        plan: PlanId(plan),
        satellite: route().satellite,
        station: route().station,
        link: Some(route().link),
        pass: None,
        aos_at: UtcUs(NOON_US + 1),
        los_at: UtcUs(NOON_US + 2),
        state,
        progress: Progress { asked: [(Ordinal(3), ask)].into(), end, ..Progress::default() },
        at: UtcUs(NOON_US),
    }))
}

both!(plans_and_runs_come_back_as_they_were);
async fn plans_and_runs_come_back_as_they_were(kind: Kind) {
    let (parent, store) = fresh(kind).await;
    let waiting = RunState::Waiting("the link is away".to_owned());
    let records = vec![
        Record::Plan(plan(1, false)),
        run(1, 1, RunState::Planned, None),
        run(2, 1, RunState::Ended, Some(RunEnd::Later)),
        run(3, 1, RunState::Missed("asleep".to_owned()), None),
        run(4, 1, waiting.clone(), None),
    ];
    store.apply(&batch(records)).await.unwrap();
    store.apply(&batch(vec![Record::Plan(plan(1, true)), run(1, 1, RunState::Running, None)])).await.unwrap();
    drop(store);
    let store = reopen(&parent).await.unwrap();
    let snapshot = store.snapshot(&[route().satellite], &[]).await.unwrap();
    assert_eq!(snapshot.plans, [plan(1, true)]);
    assert_eq!((snapshot.last_ids.plan, snapshot.last_ids.run), (1, 4));
    let states: Vec<_> = snapshot.runs.iter().map(|run| (run.id.0, run.state.clone())).collect();
    assert_eq!(states, [(1, RunState::Running), (2, RunState::Ended), (4, waiting)]);
    assert_eq!(snapshot.runs[1].progress.end, Some(RunEnd::Later));
    assert_eq!(snapshot.runs[0].progress.asked.len(), 1);
    assert_eq!(store.runs(&Scope::default(), &Page::default()).await.unwrap().len(), 4);
}

both!(withdrawn_plan_is_kept_and_not_taken_up);
async fn withdrawn_plan_is_kept_and_not_taken_up(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    store.apply(&batch(vec![Record::Plan(plan(1, true))])).await.unwrap();
    let gone = PlanRecord { withdrawn_at: Some(UtcUs(NOON_US + 1)), armed: false, ..plan(1, true) };
    store.apply(&batch(vec![Record::Plan(gone)])).await.unwrap();
    assert!(store.snapshot(&[], &[]).await.unwrap().plans.is_empty());
    assert_eq!(store.plans(&Page::default()).await.unwrap().len(), 1);
}

both!(conditions_stand_beside_their_commands);
async fn conditions_stand_beside_their_commands(kind: Kind) {
    let (_parent, store) = fresh(kind).await;
    let when = Condition {
        min_elevation_deg: Some(12.5),
        heard_within_us: Some(30_000_000),
        telemetry: vec![Guard {
            parameter: "heartbeat.temp".to_owned(),
            op: Op::AtMost,
            value: 40.25,
            max_age_us: 120_000_000,
        }],
        after_aos_us: Some(1_500_000),
        before_los_us: Some(2_000_001),
    };
    let waits = CommandRecord { when: Some(Box::new(when)), ..command(1, Telecommand::Ping) };
    let plain = command(2, Telecommand::Ping);
    let records = vec![
        Record::Command(waits.clone()),
        Record::Stage(stage(1, 0, Stage::Queued, NOON_US)),
        Record::Command(plain.clone()),
        Record::Stage(stage(2, 0, Stage::Queued, NOON_US)),
    ];
    store.apply(&batch(records)).await.unwrap();
    let snapshot = store.snapshot(&[route().satellite], &[]).await.unwrap();
    let found: Vec<_> =
        snapshot.satellites[0].commands.iter().map(|command| command.record.clone()).collect();
    assert_eq!(found, [waits, plain]);
    assert!(store.command_condition(2).await.unwrap().is_none());
}
