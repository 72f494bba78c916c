//! The one gate before the engine: what is critical needs the right to it, and under the two-person rule somebody
//! else's yes to exactly that.
//!
//! Every intent of the API passes [`pass`], in `Write::submit`; what was approved comes through [`release`]. Plans carry
//! critical commands too: they are let through when the plan is armed, bound to its text.

use api::{CommandRequest, Outcome, ProblemKind};
use mission::plan::{Action, CheckContext, Plan, Step};
use mission::{Accepted, CommandIntent, Gate, Intent, PlanName, Principal};
use serde_json::Value;
use sha2::{Digest as _, Sha256};
use tokio::sync::MutexGuard;

use super::App;
use super::admit::may;
use super::extract::number;
use super::problem::Failure;
use super::{commands, write};
use crate::engine::{Done, IntentError};
use crate::people::{Ask, Asked, Caller, Right};
use crate::plan::check_words;
use crate::storage::ApprovalRow;

/// What becomes of an intent at the gate.
pub(super) enum Pass<'a> {
    /// The engine may have it; whoever holds the guard keeps plans from being exchanged meanwhile.
    Go(Option<MutexGuard<'a, ()>>),
    /// It waits for a second person.
    Wait {
        /// Its number.
        approval: u64,
        /// It was asked for before, under the same key.
        replayed: bool,
    },
}

/// Something critical, and what an approval of it is bound to.
struct Critical {
    kind: &'static str,
    digest: [u8; 32],
    summary: String,
}

/// A request as it came in.
pub(super) struct Came<'a> {
    pub(super) caller: &'a Caller,
    pub(super) idempotency_key: &'a str,
    pub(super) digest: [u8; 32],
    pub(super) body: &'a Value,
}

/// Whether an intent may go to the engine now.
///
/// # Errors
/// The right is missing, it was refused, or its time is over.
pub(super) async fn pass<'a>(app: &'a App, came: Came<'_>, intent: &Intent) -> Result<Pass<'a>, Failure> {
    let people = &app.state.people;
    let is_of_plans =
        matches!(intent, Intent::AddPlan { .. } | Intent::WithdrawPlan(_) | Intent::ArmPlan { .. });
    let two_person = people.settings().two_person;
    let guard = if two_person && is_of_plans { Some(people.releasing().await) } else { None };
    let Some(critical) = critical(app, intent, came.body).await? else { return Ok(Pass::Go(guard)) };
    may(came.caller, Right::Critical)?;
    if !two_person {
        return Ok(Pass::Go(guard));
    }
    if let Some(row) = people.asked(came.caller, came.idempotency_key).await? {
        return again(app, &came, &critical, row, guard).await;
    }
    let request = match intent {
        Intent::ArmPlan { plan, .. } => serde_json::json!({ "plan": plan.as_str() }),
        _ => came.body.clone(),
    };
    let ask = Ask {
        kind: critical.kind,
        request: request.to_string(),
        digest: critical.digest,
        summary: critical.summary,
        idempotency_key: came.idempotency_key.to_owned(),
        request_digest: came.digest,
    };
    let row = people.ask(came.caller, ask).await?;
    Ok(Pass::Wait { approval: number(row.id), replayed: false })
}

/// The same was asked for before.
async fn again<'a>(
    app: &'a App,
    came: &Came<'_>,
    critical: &Critical,
    row: ApprovalRow,
    guard: Option<MutexGuard<'a, ()>>,
) -> Result<Pass<'a>, Failure> {
    if row.request_digest != came.digest {
        let detail = "This Idempotency-Key was used for another request: choose a new one.";
        return Err(Failure::new(ProblemKind::IdempotencyKeyReused, detail));
    }
    let over = |why: &str| {
        Failure::new(ProblemKind::ApprovalRefused, format!("Number {}: {why}. Ask for it anew.", row.id))
    };
    match app.state.people.state_of(&row) {
        Asked::Awaiting => Ok(Pass::Wait { approval: number(row.id), replayed: true }),
        Asked::Refused => Err(over("it was refused")),
        Asked::Expired => Err(over("nobody approved it in time")),
        Asked::Approved => {
            let principal = Principal::new(&row.principal);
            let known = app.state.store.find_intent(&principal, &row.idempotency_key).await?;
            if known.is_some() {
                return Ok(Pass::Go(guard));
            }
            // Approved, but the engine never took it: it refused, or the server died in between.
            if row.released_at_us.is_some() || app.state.people.is_over(row.expires_at_us) {
                return Err(over("it was approved, and not taken in time"));
            }
            if row.digest != critical.digest {
                return Err(over("it is not what was approved any more"));
            }
            Ok(Pass::Go(guard))
        }
    }
}

/// Makes again what was asked for, as long as it is still the same.
///
/// # Errors
/// [`ProblemKind::ApprovalRefused`] when it is not.
pub(super) async fn remake(app: &App, row: &ApprovalRow) -> Result<Intent, Failure> {
    let changed = |why: String| Failure::new(ProblemKind::ApprovalRefused, format!("{why} Ask for it anew."));
    let body: Value = serde_json::from_str(&row.request)
        .map_err(|_| changed("What was asked for cannot be read any more.".to_owned()))?;
    let intent = match row.kind.as_str() {
        "command" => {
            let request: CommandRequest = serde_json::from_value(body.clone())
                .map_err(|error| changed(format!("The request is not understood any more: {error}.")))?;
            Intent::Command(commands::intent(app, &request)?)
        }
        _ => {
            let name = body["plan"].as_str().unwrap_or_default();
            let plan = PlanName::new(name).map_err(|error| changed(format!("{error}.")))?;
            Intent::ArmPlan { plan, armed: true }
        }
    };
    match critical(app, &intent, &body).await? {
        Some(critical) if critical.digest.as_slice() == row.digest => Ok(intent),
        _ => Err(changed("It is not what was asked for any more.".to_owned())),
    }
}

/// Hands to the engine what was approved, in the name of who asked, under the key of the request: it counts once.
///
/// # Errors
/// What the engine says.
pub(super) async fn release(app: &App, row: &ApprovalRow, intent: Intent) -> Result<Outcome, Failure> {
    let digest: [u8; 32] = row.request_digest.as_slice().try_into().unwrap_or_default();
    let principal = Principal::new(&row.principal);
    let done = app.state.engine.intent(principal, row.idempotency_key.clone(), digest, intent).await;
    let command = match &done {
        Ok(Done { accepted: Accepted::Command(id), .. }) => i64::try_from(id.0).ok(),
        Ok(_) | Err(IntentError::Refused(_)) => None,
        // Not settled: whoever approved may say it again.
        Err(error) => return Err(error.clone().into()),
    };
    app.state.people.released(row, command).await?;
    let (outcome, _) = write::outcome(&done?.accepted);
    Ok(outcome)
}

/// What is critical in an intent; `None`: nothing.
async fn critical(app: &App, intent: &Intent, body: &Value) -> Result<Option<Critical>, Failure> {
    match intent {
        Intent::Command(command) if command.telecommand.is_critical() => of_command(command, body).map(Some),
        Intent::ArmPlan { plan, armed: true } => of_plan(app, plan).await,
        _ => Ok(None),
    }
}

fn of_command(command: &CommandIntent, body: &Value) -> Result<Critical, Failure> {
    let telecommand = &command.telecommand;
    if command.confirmation.as_deref() != Some(telecommand.name()) {
        return Err(mission::Refusal::NeedsConfirmation(telecommand.name()).into());
    }
    let mut payload = [0; protocol::UP_PAYLOAD_MAX];
    let length = telecommand.encode_payload(&mut payload).min(payload.len());
    let gate = if command.gate == Gate::Blind { "blind" } else { "heard" };
    let conditions = format!(
        "{} {gate} {:?} {:?} {}",
        command.priority,
        command.expires_at.map(|at| at.0),
        command.attempts_allowed,
        body.get("when").unwrap_or(&Value::Null)
    );
    let link = command.link.as_ref().map_or("", |link| link.as_str());
    let digest = bind(&[
        b"command",
        command.satellite.as_str().as_bytes(),
        link.as_bytes(),
        &[telecommand.packet_type()],
        &payload[..length],
        conditions.as_bytes(),
    ]);
    Ok(Critical { kind: "command", digest, summary: format!("{telecommand} to {}", command.satellite) })
}

async fn of_plan(app: &App, name: &PlanName) -> Result<Option<Critical>, Failure> {
    // The archive, not the status: what was handed over just now counts.
    let Some(row) = app.state.store.plan_in_use(name.as_str()).await? else { return Ok(None) };
    let context =
        CheckContext { timing: radio::airtime::LinkTiming::default(), profile: None, pass: None, now: None };
    let (plan, _) = check_words(&row.text()?, &context);
    let names = plan.as_ref().map(criticals).unwrap_or_default();
    if plan.is_some() && names.is_empty() {
        return Ok(None);
    }
    let digest = bind(&[b"arm-plan", &row.id.to_be_bytes(), row.plan.as_bytes()]);
    let summary = format!("plan {name} for {}, with {}", row.satellite, names.join(", "));
    Ok(Some(Critical { kind: "arm-plan", digest, summary }))
}

/// Names of the critical telecommands in a plan.
fn criticals(plan: &Plan) -> Vec<&'static str> {
    fn walk(steps: &[Step], names: &mut Vec<&'static str>) {
        for step in steps {
            match &step.action {
                Action::Send(send) => names.extend(
                    send.telecommands.iter().filter(|t| t.is_critical()).map(protocol::Telecommand::name),
                ),
                Action::Repeat { steps, .. } => walk(steps, names),
                _ => {}
            }
        }
    }
    let mut names = Vec::new();
    walk(&plan.steps, &mut names);
    names.sort_unstable();
    names.dedup();
    names
}

/// SHA-256 over parts, each with its length before it.
fn bind(parts: &[&[u8]]) -> [u8; 32] {
    let mut hash = Sha256::new();
    for part in parts {
        hash.update((part.len() as u64).to_be_bytes());
        hash.update(part);
    }
    hash.finalize().into()
}
