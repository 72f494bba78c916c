//! Who asks.

use mission::Principal;

use super::right::{Right, Rights, Role};
use super::{People, PeopleError};
use crate::storage::{StoreError, TokenRow, UserRow};

/// By what somebody is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Credential {
    /// By nothing.
    Nobody,
    /// By the token of the server's own 0600 file: whoever can read it owns the machine.
    Local,
    /// By a session's cookie; the session's name in records.
    Session(String),
    /// By a machine's token; its name.
    Token(String),
}

/// Who asks, and what they may do.
#[derive(Debug, Clone)]
pub struct Caller {
    /// By what they are known.
    pub credential: Credential,
    /// As records name them; `None` for nobody.
    pub principal: Option<Principal>,
    /// The user behind it: of a token its owner.
    pub person: Option<String>,
    /// The user's role, when it is a user.
    pub role: Option<Role>,
    /// What they may do.
    pub rights: Rights,
    /// Until when at most, microseconds since 1970 UTC.
    pub expires_at_us: Option<i64>,
}

impl Caller {
    /// Whoever has shown the token of the server's own file.
    #[must_use]
    pub fn local() -> Self {
        Self {
            credential: Credential::Local,
            principal: Some(Principal::new("local")),
            person: None,
            role: None,
            rights: Rights::all(),
            expires_at_us: None,
        }
    }

    /// Somebody who has shown nothing.
    pub(crate) fn nobody(may_look: bool) -> Self {
        Self {
            credential: Credential::Nobody,
            principal: None,
            person: None,
            role: None,
            rights: Some(Right::Look).filter(|_| may_look).into_iter().collect(),
            expires_at_us: None,
        }
    }

    /// As records name them.
    #[must_use]
    pub fn name(&self) -> &str {
        self.principal.as_ref().map_or("nobody", Principal::as_str)
    }

    /// The person who answers for what is asked; the credential's own name where no user stands behind it.
    #[must_use]
    pub fn answers(&self) -> &str {
        self.person.as_deref().unwrap_or_else(|| self.name())
    }
}

impl People {
    /// Somebody who has shown nothing.
    ///
    /// # Errors
    /// [`StoreError`].
    pub(crate) async fn nobody(&self) -> Result<Caller, StoreError> {
        Ok(Caller::nobody(self.is_reading_open().await?))
    }

    /// The machine whose token this is; `None`: nobody's, expired, revoked, or its owner is disabled.
    ///
    /// # Errors
    /// [`PeopleError::Store`].
    pub(crate) async fn by_token(&self, token: &str) -> Result<Option<Caller>, PeopleError> {
        let row = self.0.store.token_by_hash(&super::secret::hash(token)).await?;
        match row {
            Some(row) => Ok(self.machine(row).await?),
            None => Ok(None),
        }
    }

    async fn machine(&self, row: TokenRow) -> Result<Option<Caller>, StoreError> {
        if row.revoked_at_us.is_some() || row.expires_at_us <= self.now_us() {
            return Ok(None);
        }
        let scopes = Rights::from_words(&row.scopes).unwrap_or_default();
        let rights = match &row.owner {
            None => scopes,
            Some(owner) => match self.0.store.user(owner).await? {
                Some(user) if !user.disabled => scopes.and(role(&user).rights()),
                _ => return Ok(None),
            },
        };
        Ok(Some(Caller {
            credential: Credential::Token(row.name.clone()),
            principal: Some(Principal::new(&format!("token:{}", row.name))),
            person: row.owner,
            role: None,
            rights,
            expires_at_us: Some(row.expires_at_us),
        }))
    }

    /// Whether this caller may still look.
    pub(super) async fn still(&self, caller: &Caller) -> Result<bool, StoreError> {
        let now = match &caller.credential {
            Credential::Local => return Ok(true),
            Credential::Nobody => Some(self.nobody().await?),
            Credential::Session(id) => self.session_caller(id).await?,
            Credential::Token(name) => match self.0.store.token(name).await? {
                Some(row) => self.machine(row).await?,
                None => None,
            },
        };
        Ok(now.is_some_and(|caller| caller.rights.has(Right::Look)))
    }
}

/// Whoever the archive cannot name has the least.
pub(super) fn role(user: &UserRow) -> Role {
    user.role.parse().unwrap_or(Role::Viewer)
}
