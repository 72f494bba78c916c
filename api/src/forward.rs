//! What is passed on to others: SatNOGS DB, a webhook.

use serde::{Deserialize, Serialize};

use crate::Time;

/// A reception and how it stands with one target.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ForwardView {
    /// Its number, from 1, rising.
    pub id: u64,
    /// To whom.
    pub target: String,
    /// `waiting`, `sending`, `sent`, `unknown` (it may have arrived; nobody knows), `refused` or `dry` (it would have been sent).
    pub state: String,
    /// Whose frame.
    pub satellite: String,
    /// The frame.
    pub frame: u64,
    /// `radio` or `own-mqtt`.
    pub source: String,
    /// Who heard it, as the target is told.
    pub receiver: String,
    /// When it was received.
    pub received_at: Time,
    /// When it was written down for the target.
    pub made_at: Time,
    /// Attempts that were begun.
    pub attempts: u64,
    /// When the target took it.
    pub sent_at: Option<Time>,
    /// Why the last attempt failed.
    pub error: Option<String>,
    /// Its number for the target: the same for this reception and target, whenever it is sent.
    pub message_id: String,
}

/// A reception with the exact request for its target.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ForwardWhole {
    /// How it stands.
    pub forward: ForwardView,
    /// What is sent; `null` when its target is not configured any more, or it cannot be sent.
    pub request: Option<ForwardRequest>,
}

/// What is sent by POST. Secrets are left out.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ForwardRequest {
    /// Its media type.
    pub content_type: String,
    /// Its body, byte for byte.
    pub body: String,
}

/// A target of frames.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ForwardTargetView {
    /// Its name.
    pub name: String,
    /// `sids` or `webhook`.
    pub kind: String,
    /// Where it leads, without secrets.
    pub leads_to: String,
    /// Frames are really sent; otherwise it is a dry run.
    pub live: bool,
    /// Who has paused it.
    pub paused_by: Option<String>,
    /// When.
    pub paused_at: Option<Time>,
    /// Receptions that are to be sent.
    pub waiting: u64,
    /// Receptions that it took.
    pub sent: u64,
    /// Receptions that it may have taken; nobody knows.
    pub unknown: u64,
    /// Receptions that it did not want.
    pub refused: u64,
    /// Receptions that would have been sent.
    pub dry: u64,
    /// When the oldest that waits was received.
    pub oldest_waiting_at: Option<Time>,
    /// When it took one last.
    pub last_sent_at: Option<Time>,
    /// Why the last attempt failed; `null` when it went through, or there was none since the start.
    pub failing: Option<String>,
}
