//! Plans over the API: handed over, armed, attached, withdrawn; the schedule, and what became of runs.

use std::sync::Arc;
use std::time::Duration;

use mission::plan::{Ask, CheckContext, Ordinal, Progress, RunEnd, StepEnd, StepResult, Ticket};
use mission::record::Record;
use mission::run::{PlanRecord, RunRecord, RunState};
use mission::{Batch, BatchId, CommandId, LinkId, PlanId, Principal, RunId, SatelliteId, UtcUs};
use serde_json::{Value, json};

use super::sky::with_elements;
use super::{Bench, heartbeat, station};
use crate::clock::wall_sleep;
use crate::plan::check_words;

fn status() -> Value {
    json!({
        "name": "status", "satellite": "pixelsat-1", "transmit": true,
        "steps": [
            {"do": "listen", "for_s": 5.0},
            {"do": "repeat-until", "at_most": 2, "steps": [{"do": "command", "command": "Ping"}]},
        ],
    })
}

/// The same, for every pass.
fn everywhere() -> Value {
    let mut plan = status();
    plan["attach"] = json!({});
    plan
}

/// Those of the coming two days; the status follows the elements a little later.
async fn passes(bench: &Bench) -> Vec<Value> {
    for _ in 0..500 {
        let station = bench.get("/api/v1/station").await.ok();
        let passes = station["satellites"][0]["next_passes"].as_array().unwrap();
        if passes.len() > 2 {
            return passes.clone();
        }
        wall_sleep(Duration::from_millis(10)).await;
    }
    panic!("the station never told passes");
}

#[tokio::test]
async fn a_plan_is_handed_over_armed_and_withdrawn() {
    let bench = Bench::new().await;
    assert_eq!(bench.get("/api/v1/plans").await.ok(), json!({"items": [], "next": null}));
    let answer = bench.post("/api/v1/plans", "a", &status()).await;
    assert_eq!((answer.status().as_u16(), &answer.ok()["outcome"]), (200, &json!("done")));
    let again = bench.post("/api/v1/plans", "a", &status()).await;
    assert_eq!(again.header("idempotency-replayed"), "true");
    bench.until("/api/v1/plans", "/items/0/name", &json!("status")).await;
    let held = bench.get("/api/v1/plans").await.ok()["items"][0].clone();
    assert_eq!(
        (&held["id"], &held["armed"], &held["added_by"], &held["station"], &held["picks"]),
        (&json!(1), &json!(false), &json!("local"), &json!("bench"), &json!([]))
    );
    assert_eq!(held["plan"]["steps"], status()["steps"]);

    bench.post("/api/v1/plans/status/arm", "b", &json!({})).await.ok();
    bench.until("/api/v1/plans", "/items/0/armed", &json!(true)).await;
    bench.post("/api/v1/plans/status/disarm", "c", &json!({})).await.ok();
    bench.until("/api/v1/plans", "/items/0/armed", &json!(false)).await;
    // Another text under the same name is another plan.
    bench.post("/api/v1/plans", "d", &everywhere()).await.ok();
    bench.until("/api/v1/plans", "/items/0/id", &json!(2)).await;
    assert_eq!(bench.delete("/api/v1/plans/status", "e").await.ok()["outcome"], "done");
    bench.until("/api/v1/plans", "/items", &json!([])).await;
    assert_eq!(bench.delete("/api/v1/plans/status", "e").await.header("idempotency-replayed"), "true");
    assert_eq!(bench.delete("/api/v1/plans/status", "f").await.problem(), "unknown-plan");
    // The key of the arming does not serve for anything else.
    assert_eq!(bench.delete("/api/v1/plans/status", "b").await.problem(), "idempotency-key-reused");
    let audit = bench.get("/api/v1/audit?limit=1").await.ok();
    assert_eq!(audit["items"][0]["action"], "plan.withdraw");
}

#[tokio::test]
async fn wrong_plans_name_the_field_and_the_remedy() {
    let bench = Bench::new().await;
    for (change, problem, field, says) in [
        (json!({"steps": [{"do": "listn"}]}), "plan-refused", "steps[0].do", "Did you mean 'listen'?"),
        (json!({"transmit": false}), "plan-refused", "steps[1].steps[0]", "transmit"),
        (json!({"name": "No Name"}), "plan-refused", "name", "another name"),
        (
            json!({"steps": [{"do": "command", "command": "Reset"}]}),
            "plan-refused",
            "steps[0].approved_by",
            "nobody has approved it",
        ),
        (
            json!({"steps": [{"do": "command", "command": "GetImageRanges", "arguments": {"ranges": [{"first": 0, "count": 1}]}}]}),
            "plan-refused",
            "steps[0]",
            "profile",
        ),
        (
            json!({"limit_s": 30.0, "steps": [{"do": "listen", "for_s": 60.0}]}),
            "plan-refused",
            "limit_s",
            "60 s",
        ),
        (json!({"satellite": "sputnik"}), "unknown-satellite", "satellite", "pixelsat-1"),
        (json!({"priority": "high"}), "wrong-shape", "priority", "expected"),
        (json!({"stops": []}), "wrong-shape", "stops", "unknown field"),
        (json!({"steps": [{"do": "listen", "for": 1}]}), "wrong-shape", "steps[0].for", "unknown field"),
    ] {
        let mut plan = status();
        for (name, value) in change.as_object().unwrap() {
            plan[name.as_str()] = value.clone();
        }
        let answer = bench.post("/api/v1/plans", "k", &plan).await;
        assert_eq!(answer.problem(), problem, "{change}");
        let told = answer.json();
        let error = &told["errors"][0];
        assert!(error["field"].as_str().unwrap().starts_with(field), "{change}: {told}");
        assert!(error["message"].as_str().unwrap().contains(says), "{change}: {told}");
    }
    assert_eq!(bench.get("/api/v1/plans").await.ok()["items"], json!([]));
}

#[tokio::test]
async fn an_approval_that_is_over_is_refused_by_the_engine() {
    let bench = Bench::new().await;
    let mut plan = status();
    plan["steps"] = json!([{"do": "command", "command": "Reset",
        "approved_by": {"name": "A. Verma", "expires_at": "2020-01-01T00:00:00Z"}}]);
    let answer = bench.post("/api/v1/plans", "k", &plan).await;
    assert_eq!(answer.problem(), "plan-refused");
    assert!(answer.json()["detail"].as_str().unwrap().contains("steps[0].approved_by"), "{}", answer.json());
}

#[tokio::test]
async fn plans_and_satellites_that_are_not_there_are_told() {
    let bench = Bench::new().await;
    for verb in ["arm", "disarm"] {
        let answer = bench.post(&format!("/api/v1/plans/none/{verb}"), verb, &json!({})).await;
        assert_eq!((answer.status().as_u16(), answer.problem().as_str()), (404, "unknown-plan"));
        assert_eq!(answer.json()["errors"][0]["field"], "plan");
    }
    let at = json!({"at": "2026-12-01T18:22:00Z"});
    assert_eq!(bench.post("/api/v1/plans/none/attach", "a", &at).await.problem(), "unknown-plan");
    assert_eq!(bench.post("/api/v1/plans/No%20Name/attach", "b", &at).await.problem(), "unknown-plan");
    let soon = json!({"at": "soon"});
    assert_eq!(bench.post("/api/v1/plans/none/detach", "c", &soon).await.problem(), "wrong-shape");
    for verb in ["hold", "release"] {
        let path = format!("/api/v1/satellites/pixelsat-1/{verb}");
        let answer = bench.post(&path, &path, &json!({})).await;
        assert_eq!((answer.status().as_u16(), answer.problem().as_str()), (409, "nothing-runs"), "{verb}");
        let path = format!("/api/v1/satellites/sputnik/{verb}");
        assert_eq!(bench.post(&path, &path, &json!({})).await.problem(), "unknown-satellite");
    }
    assert_eq!(bench.get("/api/v1/runs").await.ok(), json!({"items": [], "next": null}));
    assert_eq!(bench.get("/api/v1/runs/1").await.problem(), "not-found");
    assert_eq!(bench.get("/api/v1/runs?limit=0").await.problem(), "bad-parameter");
    // Without a place nothing is scheduled, and nothing is better.
    let schedule = bench.get("/api/v1/schedule").await.ok();
    assert_eq!((&schedule["contacts"], &schedule["refused"]), (&json!([]), &json!([])));
    assert_eq!((&schedule["proved"], &schedule["gap"]), (&json!(true), &json!(0.0)));
}

#[tokio::test]
async fn a_chosen_pass_stands_in_the_schedule_with_plan_and_reason() {
    let bench = with_elements().await;
    let passes = passes(&bench).await;
    let pass = &passes[passes.len() - 2];
    bench.post("/api/v1/plans", "a", &status()).await.ok();
    let nowhere =
        bench.post("/api/v1/plans/status/attach", "b", &json!({"at": "2020-01-01T00:00:00Z"})).await;
    assert_eq!((nowhere.status().as_u16(), nowhere.problem().as_str()), (409, "pass-refused"));
    assert_eq!(nowhere.json()["errors"][0]["field"], "at");

    bench.post("/api/v1/plans/status/attach", "c", &json!({"at": pass["tca"]})).await.ok();
    bench.until("/api/v1/schedule", "/contacts/0/plan", &json!("status")).await;
    let schedule = bench.get("/api/v1/schedule").await.ok();
    let contact = &schedule["contacts"][0];
    assert_eq!(schedule["contacts"].as_array().unwrap().len(), 1);
    assert!(
        contact["start"].as_str() >= pass["aos"].as_str() && contact["stop"].as_str() <= pass["los"].as_str()
    );
    let why = contact["why"].as_str().unwrap();
    assert!(why.contains("an operator chose it") && why.contains("not armed"), "{why}");
    assert_eq!((&contact["armed"], &contact["cut_start"]), (&json!(false), &Value::Null));
    assert_eq!((&schedule["worth"], &schedule["proved"]), (&schedule["bound"], &json!(true)));
    assert_eq!(bench.get("/api/v1/runs").await.ok()["items"], json!([]));

    bench.post("/api/v1/plans/status/arm", "d", &json!({})).await.ok();
    bench.until("/api/v1/runs", "/items/0/state", &json!("planned")).await;
    let run = bench.get("/api/v1/runs").await.ok()["items"][0].clone();
    assert_eq!((&run["name"], &run["outcome"], &run["pass"]), (&json!("status"), &Value::Null, &Value::Null));
    assert_eq!((&run["aos"], &run["started_at"]), (&contact["start"], &Value::Null));
    bench.until("/api/v1/schedule", "/contacts/0/armed", &json!(true)).await;

    bench.post("/api/v1/plans/status/detach", "back", &json!({"at": pass["tca"]})).await.ok();
    bench.until("/api/v1/schedule", "/contacts", &json!([])).await;
    let gone = bench.post("/api/v1/plans/status/detach", "again", &json!({"at": pass["tca"]})).await;
    assert_eq!(gone.problem(), "pass-refused");
    bench.until("/api/v1/runs", "/items/0/state", &json!("dropped")).await;
    assert!(bench.get("/api/v1/runs").await.ok()["items"][0]["why"].is_string());
}

#[tokio::test]
async fn a_pass_that_is_too_short_for_a_plan_is_not_scheduled_and_cannot_be_chosen() {
    let bench = with_elements().await;
    let mut plan = everywhere();
    plan["min_pass"] = json!({"duration_s": 3600.0});
    bench.post("/api/v1/plans", "a", &plan).await.ok();
    bench.until("/api/v1/plans", "/items/0/name", &json!("status")).await;
    let schedule = bench.get("/api/v1/schedule").await.ok();
    assert_eq!(schedule["contacts"], json!([]), "{schedule}");
    let pass = passes(&bench).await[1]["tca"].clone();
    let answer = bench.post("/api/v1/plans/status/attach", "b", &json!({"at": pass})).await;
    assert_eq!(answer.problem(), "pass-refused");
    assert!(answer.json()["detail"].as_str().unwrap().contains("does not take this pass"));
}

#[tokio::test]
async fn a_report_tells_what_was_planned_and_what_happened() {
    let bench = Bench::new().await;
    let begin = bench.timer.now().utc;
    bench.hear(&heartbeat(20.0)).await;
    bench.frames(1).await;
    bench.post("/api/v1/commands", "a", &json!({"command": "Ping"})).await.ok();
    let context = CheckContext { timing: Default::default(), profile: None, pass: None, now: None };
    let words = serde_json::from_value(status()).unwrap();
    let plan = PlanRecord {
        id: PlanId(50),
        station: station().station,
        plan: Arc::new(check_words(&words, &context).0.unwrap()),
        text: Arc::from(status().to_string()),
        added_at: begin,
        who: Principal::new("ada"),
        armed: true,
        picks: Vec::new(),
        withdrawn_at: None,
    };
    let result = |step: &str, rounds: &[u32], end| StepResult {
        step: step.to_owned(),
        rounds: rounds.to_vec(),
        entered_at: begin,
        ended_at: begin.plus(1_000_000),
        end,
    };
    let progress = Progress {
        started_at: Some(begin),
        asked: [(Ordinal(1), Ask { ticket: Ticket::Command(CommandId(1)), stage: None })].into(),
        results: vec![
            result("steps[0]", &[], StepEnd::Done),
            result("steps[1].steps[0]", &[1], StepEnd::Failed("no answer".to_owned())),
        ],
        end: Some(RunEnd::Aborted { step: "steps[1].steps[0]".to_owned(), why: "no answer".to_owned() }),
        ..Progress::default()
    };
    let run = |id, state, from: UtcUs, progress| {
        Record::Run(Box::new(RunRecord {
            id: RunId(id),
            plan: PlanId(50),
            satellite: SatelliteId::new("pixelsat-1").unwrap(),
            station: station().station,
            link: Some(LinkId::new("e22").unwrap()),
            pass: None,
            aos_at: from,
            los_at: from.plus(600_000_000),
            state,
            progress,
            at: begin,
        }))
    };
    let missed = RunState::Missed("the link was away".to_owned());
    let records = vec![
        Record::Plan(plan),
        run(70, RunState::Ended, begin.plus(-1_000_000), progress),
        run(71, missed, begin.plus(3_600_000_000), Progress::default()),
    ];
    bench.store.apply(&Batch { id: BatchId(1), records }).await.unwrap();

    let newest = bench.get("/api/v1/runs?satellite=pixelsat-1&limit=1").await.ok();
    let row = &newest["items"][0];
    assert_eq!((&row["id"], &newest["next"], &row["state"]), (&json!(71), &json!(71), &json!("missed")));
    assert_eq!((&row["why"], &row["outcome"]), (&json!("the link was away"), &Value::Null));
    assert_eq!(bench.get("/api/v1/runs?before=71&limit=1").await.ok()["items"][0]["id"], 70);
    assert_eq!(bench.get("/api/v1/runs?satellite=other").await.ok()["items"], json!([]));

    let report = bench.get("/api/v1/runs/70").await.ok();
    assert_eq!((&report["run"]["state"], &report["run"]["outcome"]), (&json!("ended"), &json!("aborted")));
    assert_eq!(report["run"]["outcome_why"], "steps[1].steps[0]: no answer");
    assert_eq!((&report["run"]["name"], &report["run"]["steps_ended"]), (&json!("status"), &json!(2)));
    assert_eq!(report["plan"]["steps"], status()["steps"]);
    assert_eq!((&report["steps"][0]["do"], &report["steps"][0]["why"]), (&json!("listen"), &Value::Null));
    let failed = &report["steps"][1];
    assert_eq!(
        (&failed["do"], &failed["end"], &failed["why"], &failed["rounds"]),
        (&json!("command Ping"), &json!("failed"), &json!("no answer"), &json!([1]))
    );
    assert_eq!(report["commands"][0]["id"], 1);
    assert_eq!(report["commands"][0]["stages"][0]["stage"], "queued");
    assert_eq!((&report["frames_heard"], &report["chunks_gained"]), (&json!(1), &json!(0)));
    // The other run's window lies an hour later.
    assert_eq!(bench.get("/api/v1/runs/71").await.ok()["frames_heard"], 0);
}
