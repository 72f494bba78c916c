//! Telecommands: asked for, and on their way.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::ConditionText;
use crate::Time;

/// A telecommand that somebody wants sent.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandRequest {
    /// To whom; may be left out where there is one satellite.
    #[serde(default)]
    pub satellite: Option<String>,
    /// Over what; may be left out where the satellite has one link.
    #[serde(default)]
    pub link: Option<String>,
    /// Name of the telecommand, e.g. `GetImageChunk`.
    pub command: String,
    /// Its arguments by name.
    #[serde(default)]
    #[cfg_attr(feature = "openapi", schema(value_type = Object))]
    pub arguments: Map<String, Value>,
    /// Higher goes first; 0 is usual.
    #[serde(default)]
    pub priority: i16,
    /// What must hold before it is radiated.
    #[serde(default)]
    pub gate: GateWord,
    /// What else must hold before it is radiated: elevation, a beacon, values, the time in the pass.
    #[serde(default)]
    pub when: Option<ConditionText>,
    /// Not radiated after this.
    #[serde(default)]
    pub expires_at: Option<Time>,
    /// How often it may be radiated, where repeating does no harm; `null` for the station's default.
    #[serde(default)]
    pub attempts: Option<u16>,
    /// The command's name again: required where the command is critical.
    #[serde(default)]
    pub confirm: Option<String>,
}

/// What must hold before a command is radiated.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum GateWord {
    /// The satellite was heard lately.
    #[default]
    Heard,
    /// Nothing: for a satellite that may be silent.
    Blind,
}

/// What became of a write. The same under the same idempotency key, for ever.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// What happened.
    pub outcome: OutcomeWord,
    /// The command concerned.
    pub command: Option<u64>,
    /// The download concerned.
    pub download: Option<u64>,
    /// What has to be approved by a second person: `/approvals/{id}`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub approval: Option<u64>,
}

/// What happened.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutcomeWord {
    /// The command is queued, durably.
    CommandQueued,
    /// The command is withdrawn.
    CommandCancelled,
    /// The download is ordered, or was active already.
    DownloadOrdered,
    /// The download is withdrawn.
    DownloadCancelled,
    /// Nothing yet: a second person has to approve it.
    AwaitingApproval,
    /// Done.
    Done,
}

/// A telecommand on its way.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommandView {
    /// Command.
    pub id: u64,
    /// Satellite.
    pub satellite: String,
    /// Station.
    pub station: String,
    /// Link.
    pub link: String,
    /// Key that seals it.
    pub key: String,
    /// Who wants it; `engine` for the machine itself.
    pub principal: String,
    /// The download that made it.
    pub download: Option<u64>,
    /// Name of the telecommand.
    pub command: String,
    /// Its arguments by name.
    #[cfg_attr(feature = "openapi", schema(value_type = Object))]
    pub arguments: Map<String, Value>,
    /// Higher goes first.
    pub priority: i16,
    /// What must hold before it is radiated.
    pub gate: GateWord,
    /// How often it may be radiated.
    pub attempts_allowed: u16,
    /// When it was accepted.
    pub created_at: Time,
    /// Not radiated after this.
    pub expires_at: Option<Time>,
    /// Its last stage: `queued`, `sealed`, `radiating`, `radiated`, `answered`, `failed`, `rejected`, `expired`,
    /// `cancelled` or `unknown`.
    pub stage: String,
    /// When it reached that.
    pub stage_at: Time,
    /// Number of the attempt, from 1; 0 before the first.
    pub attempt: u16,
    /// All stages, oldest first; only when one command is asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub stages: Option<Vec<StageView>>,
}

/// A step in the life of a telecommand.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageView {
    /// Satellite.
    pub satellite: String,
    /// Station.
    pub station: String,
    /// Link.
    pub link: String,
    /// The id of the key that seals the command.
    pub key: String,
    /// Attempt number, from 1; 0 before the first.
    pub attempt: u16,
    /// What was reached.
    pub stage: String,
    /// When.
    pub at: Time,
    /// Who caused it.
    pub who: String,
    /// Why, as a sentence.
    pub why: String,
    /// The frame that proves it.
    pub frame: Option<u64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_needs_no_more_than_its_name() {
        let request: CommandRequest = serde_json::from_str(r#"{"command":"Ping"}"#).unwrap();
        assert_eq!(request.gate, GateWord::Heard);
        assert_eq!((request.priority, request.attempts), (0, None));
        assert!(request.arguments.is_empty());
    }

    #[test]
    fn a_field_nobody_knows_is_refused() {
        let error = serde_json::from_str::<CommandRequest>(r#"{"command":"Ping","prio":1}"#).unwrap_err();
        assert!(error.to_string().contains("unknown field `prio`"), "{error}");
    }
}
