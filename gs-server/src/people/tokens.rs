//! Tokens of machines: told once, kept as SHA-256, good for some rights and some days.

use super::caller::{Caller, role};
use super::right::Rights;
use super::secret::{Secret, hash};
use super::{People, PeopleError, check_name};
use crate::storage::{PeopleChange, StoreError, TokenRow};

/// By this word people and scanners know what they have found.
const WORD: &str = "gst_";
const DAY_US: i64 = 24 * 3600 * 1_000_000;
/// The longest life of a token, days.
const DAYS_MAX: u32 = 3650;

/// A token that somebody wants.
#[derive(Debug, Clone)]
pub struct TokenWanted {
    /// Its name.
    pub name: String,
    /// What it may do.
    pub scopes: Rights,
    /// For how long, days.
    pub days: u32,
    /// The user who answers for it; the one who makes it, if that is a user.
    pub owner: Option<String>,
}

impl People {
    /// All tokens, those too that are not in use any more.
    ///
    /// # Errors
    /// [`StoreError`].
    pub(crate) async fn tokens(&self) -> Result<Vec<TokenRow>, StoreError> {
        self.0.store.tokens().await
    }

    /// Makes a token: its text, told once, and what is kept.
    ///
    /// # Errors
    /// [`PeopleError`].
    pub(crate) async fn new_token(
        &self,
        by: &Caller,
        wanted: TokenWanted,
    ) -> Result<(Secret, TokenRow), PeopleError> {
        check_name(&wanted.name)?;
        if !(1..=DAYS_MAX).contains(&wanted.days) {
            let problem = format!("give 1 to {DAYS_MAX}, found {}", wanted.days);
            return Err(PeopleError::Wrong { field: "days", problem });
        }
        if wanted.scopes == Rights::NONE {
            let problem = "give at least one right, e.g. look".to_owned();
            return Err(PeopleError::Wrong { field: "scopes", problem });
        }
        let _one_after_the_other = self.0.changing.lock().await;
        if self.0.store.token(&wanted.name).await?.is_some() {
            return Err(PeopleError::NameTaken(wanted.name));
        }
        let owner = wanted.owner.or_else(|| by.person.clone());
        let mut most = by.rights;
        if let Some(owner) = &owner {
            let user = self.0.store.user(owner).await?.filter(|user| !user.disabled);
            let user = user.ok_or_else(|| PeopleError::UnknownUser(owner.chars().take(40).collect()))?;
            most = most.and(role(&user).rights());
        }
        if !wanted.scopes.are_within(most) {
            return Err(PeopleError::TooMuch(wanted.scopes.words()));
        }
        let secret = Secret::new(WORD)?;
        let now = self.now_us();
        let row = TokenRow {
            token_hash: hash(secret.reveal()),
            owner,
            scopes: wanted.scopes.words(),
            created_at_us: now,
            created_by: by.name().to_owned(),
            expires_at_us: now + i64::from(wanted.days) * DAY_US,
            revoked_at_us: None,
            name: wanted.name,
        };
        let owner = row.owner.as_deref().unwrap_or("nobody by name");
        let detail = format!("token {} of {owner}: {}, {} days", row.name, row.scopes, wanted.days);
        self.change(&[PeopleChange::Token(row.clone())], self.audit(by.name(), "token.new", detail)).await?;
        Ok((secret, row))
    }

    /// Ends a token's use, at once and for ever.
    ///
    /// # Errors
    /// [`PeopleError::UnknownToken`]; [`PeopleError::Store`].
    pub(crate) async fn revoke_token(&self, by: &Caller, name: &str) -> Result<(), PeopleError> {
        let _one_after_the_other = self.0.changing.lock().await;
        let row = self.0.store.token(name).await?.filter(|row| row.revoked_at_us.is_none());
        let row = row.ok_or_else(|| PeopleError::UnknownToken(name.chars().take(40).collect()))?;
        let row = TokenRow { revoked_at_us: Some(self.now_us()), ..row };
        let audit = self.audit(by.name(), "token.revoke", format!("token {name}"));
        self.change(&[PeopleChange::Token(row)], audit).await
    }
}
