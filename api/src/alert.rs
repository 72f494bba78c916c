//! Alerts: what should not be, who knows of it, and who is told.

use serde::{Deserialize, Serialize};

use crate::Time;

/// An alert: one for each rule and subject while it lasts.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlertView {
    /// Its number, from 1, rising.
    pub id: u64,
    /// Where it is in its life: `unacknowledged`, `acknowledged`, `returned`, `shelved` or `closed`.
    pub state: String,
    /// `watch`, `warning`, `distress`, `critical` or `severe`: now, or the last one when it is over.
    pub level: String,
    /// The gravest it had.
    pub worst: String,
    /// It holds now.
    pub active: bool,
    /// The rule that raised it.
    pub rule: String,
    /// What is watched: `limit`, `beacon`, `silent`, `link`, …
    pub kind: String,
    /// What it is about.
    pub subject: String,
    /// Satellite, when it concerns one.
    pub satellite: Option<String>,
    /// One sentence that stands alone.
    pub message: String,
    /// How often it came.
    pub times: u32,
    /// When it came first.
    pub raised_at: Time,
    /// When it last changed.
    pub changed_at: Time,
    /// When it returned to normal.
    pub returned_at: Option<Time>,
    /// Who took note of it.
    pub acknowledged_by: Option<String>,
    /// When.
    pub acknowledged_at: Option<Time>,
    /// Nobody is told until then.
    pub shelved_until: Option<Time>,
    /// Who put it aside.
    pub shelved_by: Option<String>,
    /// Whose it is.
    pub assignee: Option<String>,
    /// What somebody wrote to it.
    pub note: Option<String>,
    /// When it was over and known.
    pub closed_at: Option<Time>,
}

/// Takes note of an alert, or takes it off its shelf.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AlertNote {
    /// What there is to say to it; 1000 characters at most. Takes the place of the note before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Puts an alert aside.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShelveRequest {
    /// Until when; within seven days.
    pub until: Time,
    /// Why.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Gives an alert to somebody.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AssignRequest {
    /// Whose it is; `null`: nobody's.
    pub to: Option<String>,
    /// What there is to say to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// A target of messages.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TargetView {
    /// Its name.
    pub name: String,
    /// `email`, `webhook`, `matrix`, `slack` or `discord`.
    pub kind: String,
    /// Where it leads, without secrets.
    pub leads_to: String,
    /// Why the last attempt failed; `null` when it went through, or there was none since the start.
    pub failing: Option<String>,
}

/// A test message went through.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TargetTested {
    /// To which target.
    pub target: String,
}
