//! Between the engine's records of plans, runs and conditions and the rows of their tables.

use std::sync::Arc;

use api::{ConditionText, PlanText};
use mission::plan::{CheckContext, Condition};
use mission::record::CommandRecord;
use mission::run::{PlanRecord, RunRecord, RunState};
use mission::{PassId, PlanId, Principal, RunId, UtcUs};

use super::StoreError;
use super::convert::{int, narrow, parse};
use super::progress;
use super::rows::{ConditionRow, PlanRow, RunRow};
use crate::plan::{check_words, condition_of, condition_text};

fn json<T: serde::Serialize>(value: &T) -> Result<String, StoreError> {
    serde_json::to_string(value).map_err(|error| StoreError::Conflict(error.to_string()))
}

impl PlanRow {
    pub(super) fn of(record: &PlanRecord) -> Result<Self, StoreError> {
        Ok(Self {
            id: int("plan", record.id.0)?,
            name: record.plan.name.to_string(),
            satellite: record.plan.satellite.to_string(),
            station: record.station.to_string(),
            plan: record.text.to_string(),
            added_at_us: record.added_at.0,
            who: record.who.to_string(),
            armed: record.armed,
            picks: json(&record.picks.iter().map(|pick| pick.0).collect::<Vec<_>>())?,
            withdrawn_at_us: record.withdrawn_at.map(|at| at.0),
        })
    }

    /// The plan in the words of the API.
    ///
    /// # Errors
    /// [`StoreError`] when the text is none that was written here.
    pub fn text(&self) -> Result<PlanText, StoreError> {
        let wrong =
            |why: &dyn std::fmt::Display| StoreError::damaged(format!("plans.plan of {}: {why}", self.id));
        serde_json::from_str(&self.plan).map_err(|error| wrong(&error))
    }

    /// Passes that an operator chose, microseconds since 1970 UTC.
    ///
    /// # Errors
    /// [`StoreError`] when the column is none that was written here.
    pub fn picks_us(&self) -> Result<Vec<i64>, StoreError> {
        serde_json::from_str(&self.picks)
            .map_err(|error| StoreError::damaged(format!("plans.picks of {}: {error}", self.id)))
    }

    pub(super) fn record(&self) -> Result<PlanRecord, StoreError> {
        let context = CheckContext { timing: Default::default(), profile: None, pass: None, now: None };
        let (plan, findings) = check_words(&self.text()?, &context);
        let plan = plan.ok_or_else(|| {
            let why = findings.first().map(ToString::to_string).unwrap_or_default();
            StoreError::damaged(format!("plans.plan of {}: {why}", self.id))
        })?;
        Ok(PlanRecord {
            id: PlanId(narrow("plans.id", self.id)?),
            station: parse("plans.station", &self.station)?,
            plan: Arc::new(plan),
            text: Arc::from(self.plan.as_str()),
            added_at: UtcUs(self.added_at_us),
            who: Principal::new(&self.who),
            armed: self.armed,
            picks: self.picks_us()?.into_iter().map(UtcUs).collect(),
            withdrawn_at: self.withdrawn_at_us.map(UtcUs),
        })
    }
}

impl RunRow {
    pub(super) fn of(record: &RunRecord) -> Result<Self, StoreError> {
        Ok(Self {
            id: int("run", record.id.0)?,
            plan: int("plan", record.plan.0)?,
            satellite: record.satellite.to_string(),
            station: record.station.to_string(),
            link: record.link.as_ref().map(ToString::to_string),
            pass: record.pass.map(|id| int("pass", id.0)).transpose()?,
            aos_at_us: record.aos_at.0,
            los_at_us: record.los_at.0,
            state: record.state.name().to_owned(),
            why: record.state.why().map(str::to_owned),
            progress: progress::write(&record.progress)?,
            outcome: record.progress.end.as_ref().map(|end| end.name().to_owned()),
            at_us: record.at.0,
        })
    }

    /// The run as the engine has it.
    ///
    /// # Errors
    /// [`StoreError`] when a column is none that was written here.
    pub fn record(&self) -> Result<RunRecord, StoreError> {
        let why = || self.why.clone().unwrap_or_default();
        Ok(RunRecord {
            id: RunId(narrow("plan_runs.id", self.id)?),
            plan: PlanId(narrow("plan_runs.plan", self.plan)?),
            satellite: parse("plan_runs.satellite", &self.satellite)?,
            station: parse("plan_runs.station", &self.station)?,
            link: self.link.as_deref().map(|link| parse("plan_runs.link", link)).transpose()?,
            pass: self.pass.map(|id| narrow("plan_runs.pass", id).map(PassId)).transpose()?,
            aos_at: UtcUs(self.aos_at_us),
            los_at: UtcUs(self.los_at_us),
            state: match self.state.as_str() {
                "planned" => RunState::Planned,
                "waiting" => RunState::Waiting(why()),
                "running" => RunState::Running,
                "held" => RunState::Held,
                "ended" => RunState::Ended,
                "missed" => RunState::Missed(why()),
                "dropped" => RunState::Dropped(why()),
                other => return Err(StoreError::damaged(format!("plan_runs.state holds '{other}'"))),
            },
            progress: progress::read(&self.progress)?,
            at: UtcUs(self.at_us),
        })
    }
}

impl ConditionRow {
    /// `None` when the command waits for nothing else.
    pub(super) fn of(record: &CommandRecord) -> Result<Option<Self>, StoreError> {
        let Some(when) = record.when.as_deref() else { return Ok(None) };
        Ok(Some(Self { command: int("command", record.id.0)?, condition: json(&condition_text(when))? }))
    }

    /// In the words of the API.
    ///
    /// # Errors
    /// [`StoreError`] when the text is none that was written here.
    pub fn text(&self) -> Result<ConditionText, StoreError> {
        serde_json::from_str(&self.condition)
            .map_err(|error| StoreError::damaged(format!("command_conditions of {}: {error}", self.command)))
    }

    pub(super) fn condition(&self) -> Result<Condition, StoreError> {
        condition_of("when", &self.text()?).map_err(|findings| {
            let why = findings.first().map(ToString::to_string).unwrap_or_default();
            StoreError::damaged(format!("command_conditions of {}: {why}", self.command))
        })
    }
}
