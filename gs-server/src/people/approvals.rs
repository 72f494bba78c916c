//! The two-person rule: what is critical waits until another person has said yes to exactly that.
//!
//! What is asked for is a durable row with the SHA-256 of what it means. Whoever approves sends the digest that was
//! shown. What an approval releases is made again from the row and held against the digest once more.

use super::caller::Caller;
use super::{People, PeopleError};
use crate::storage::{ApprovalRow, During, Page, PeopleChange, StoreError};

/// Something critical that somebody wants.
#[derive(Debug, Clone)]
pub struct Ask {
    /// `command` or `arm-plan`.
    pub kind: &'static str,
    /// The request as JSON, from which it can be made again.
    pub request: String,
    /// SHA-256 of what it means.
    pub digest: [u8; 32],
    /// It in words.
    pub summary: String,
    /// Its idempotency key.
    pub idempotency_key: String,
    /// SHA-256 of the request.
    pub request_digest: [u8; 32],
}

/// How it stands with what was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asked {
    /// Nobody has decided yet.
    Awaiting,
    /// Somebody has said yes.
    Approved,
    /// Somebody has said no.
    Refused,
    /// Nobody has said anything in time.
    Expired,
}

impl Asked {
    /// The word in the API.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Awaiting => "awaiting",
            Self::Approved => "approved",
            Self::Refused => "refused",
            Self::Expired => "expired",
        }
    }
}

/// What a second person says.
#[derive(Debug, Clone, Copy)]
pub enum Decision<'a> {
    /// Yes, to what has this digest (hexadecimal).
    Approve {
        /// As it was shown.
        digest: &'a str,
    },
    /// No.
    Refuse {
        /// Why.
        why: &'a str,
    },
}

impl People {
    /// How it stands with something at present.
    #[must_use]
    pub fn state_of(&self, row: &ApprovalRow) -> Asked {
        match row.state.as_str() {
            "approved" => Asked::Approved,
            "refused" => Asked::Refused,
            _ if row.expires_at_us <= self.now_us() => Asked::Expired,
            _ => Asked::Awaiting,
        }
    }

    /// What this caller asked for under this key before.
    ///
    /// # Errors
    /// [`StoreError`].
    pub(crate) async fn asked(&self, caller: &Caller, key: &str) -> Result<Option<ApprovalRow>, StoreError> {
        self.0.store.approval_asked(caller.name(), key).await
    }

    /// Lays something critical before the others.
    ///
    /// # Errors
    /// [`PeopleError::Store`].
    pub(crate) async fn ask(&self, caller: &Caller, ask: Ask) -> Result<ApprovalRow, PeopleError> {
        let _one_after_the_other = self.0.changing.lock().await;
        let key = ask.idempotency_key.clone();
        if let Some(row) = self.asked(caller, &key).await? {
            return Ok(row);
        }
        let now = self.now_us();
        let row = ApprovalRow {
            id: 0,
            kind: ask.kind.to_owned(),
            request: ask.request,
            digest: ask.digest.to_vec(),
            summary: ask.summary,
            principal: caller.name().to_owned(),
            person: caller.answers().to_owned(),
            idempotency_key: ask.idempotency_key,
            request_digest: ask.request_digest.to_vec(),
            asked_at_us: now,
            expires_at_us: now.saturating_add(self.0.settings.approval_us),
            state: Asked::Awaiting.name().to_owned(),
            decided_by: None,
            decided_at_us: None,
            why: None,
            command: None,
            released_at_us: None,
        };
        let audit = self.audit(caller.name(), "approval.ask", row.summary.clone());
        self.change(&[PeopleChange::NewApproval(row)], audit).await?;
        let row = self.asked(caller, &key).await?;
        row.ok_or_else(|| StoreError::damaged("what was asked for is not there").into())
    }

    /// One of them.
    ///
    /// # Errors
    /// [`PeopleError::UnknownApproval`]; [`PeopleError::Store`].
    pub(crate) async fn approval(&self, id: i64) -> Result<ApprovalRow, PeopleError> {
        self.0.store.approval(id).await?.ok_or(PeopleError::UnknownApproval(id))
    }

    /// A page of them.
    ///
    /// # Errors
    /// [`StoreError`].
    pub(crate) async fn approvals(
        &self,
        open: bool,
        during: &During,
        page: &Page,
    ) -> Result<Vec<ApprovalRow>, StoreError> {
        let mut rows = self.0.store.approvals(open, during, page).await?;
        rows.retain(|row| !open || self.state_of(row) == Asked::Awaiting);
        Ok(rows)
    }

    /// Decides. Nobody approves what the same person asked for, by whatever way; who asked may take it back.
    ///
    /// # Errors
    /// [`PeopleError::NotApproved`] with the reason; [`PeopleError::Store`].
    pub(crate) async fn decide(
        &self,
        caller: &Caller,
        id: i64,
        decision: Decision<'_>,
    ) -> Result<ApprovalRow, PeopleError> {
        let refuse = |why: String| Err(PeopleError::NotApproved(why));
        let _one_after_the_other = self.0.changing.lock().await;
        let row = self.approval(id).await?;
        let by = caller.answers();
        let is_own = by == row.person || caller.name() == row.principal;
        match (self.state_of(&row), decision) {
            (Asked::Awaiting, _) => {}
            // Asked again because no answer came.
            (Asked::Approved, Decision::Approve { digest })
                if row.decided_by.as_deref() == Some(by) && digest == hex::encode(&row.digest) =>
            {
                return Ok(row);
            }
            (state, _) => return refuse(format!("number {id} is {} already: ask for it anew", state.name())),
        }
        let (state, why, action) = match decision {
            Decision::Approve { digest } => {
                if caller.person.is_none() {
                    return refuse(format!(
                        "{by} is no person: log in, or give the token of a user (--token-file), to approve"
                    ));
                }
                if is_own {
                    return refuse(format!("{by} asked for it: another person has to approve it"));
                }
                if digest != hex::encode(&row.digest) {
                    return refuse(
                        "the digest is of something else: look at what you approve once more".to_owned(),
                    );
                }
                (Asked::Approved, None, "approval.approve")
            }
            Decision::Refuse { why } => {
                (Asked::Refused, Some(super::check_text("why", why)?), "approval.refuse")
            }
        };
        let row = ApprovalRow {
            state: state.name().to_owned(),
            decided_by: Some(by.to_owned()),
            decided_at_us: Some(self.now_us()),
            why: why.filter(|why| !why.is_empty()),
            ..row
        };
        let audit = self.audit(caller.name(), action, format!("number {id}: {}", row.summary));
        match self.change(&[PeopleChange::Decide(row.clone())], audit).await {
            Err(PeopleError::Store(StoreError::Conflict(_))) => {
                refuse(format!("number {id} was decided just now by somebody else"))
            }
            result => result.map(|()| row),
        }
    }

    /// The engine has taken it.
    ///
    /// # Errors
    /// [`PeopleError::Store`].
    pub(crate) async fn released(&self, row: &ApprovalRow, command: Option<i64>) -> Result<(), PeopleError> {
        let row = ApprovalRow { command, released_at_us: Some(self.now_us()), ..row.clone() };
        self.0.store.change_people(&[PeopleChange::Released(row)], &[]).await?;
        Ok(())
    }
}
