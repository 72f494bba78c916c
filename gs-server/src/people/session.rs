//! Logging in and out. A session is a random token in a cookie; the archive has its SHA-256.
//!
//! The token is exchanged for a new one now and then. The old one stays good until the new one is seen, and a minute after
//! that for requests that are under way; whoever shows it later holds a copy, and the session ends.

use std::net::IpAddr;

use mission::Principal;

use super::caller::{Caller, Credential, role};
use super::secret::{Secret, csrf, hash, same};
use super::{People, PeopleError, limited};
use crate::storage::{PeopleChange, SessionRow, StoreError, UserRow};

const SECOND_US: i64 = 1_000_000;
const HOUR_US: i64 = 3600 * SECOND_US;
/// A token is exchanged when it is so old.
const ROTATE_US: i64 = HOUR_US;
/// The old one is good for so long after the new one was seen.
const OVERLAP_US: i64 = 60 * SECOND_US;
/// When a session was used is written down to this part of its idle time.
const SEEN_PARTS: i64 = 10;
/// Sessions that a user may have; the oldest makes room.
const SESSIONS_MAX: usize = 16;

/// When sessions end by themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SessionRules {
    /// One that nobody uses ends after so long, microseconds.
    pub idle_us: i64,
    /// Every one ends after so long, microseconds.
    pub max_us: i64,
}

impl Default for SessionRules {
    fn default() -> Self {
        Self { idle_us: HOUR_US / 2, max_us: 12 * HOUR_US }
    }
}

impl SessionRules {
    fn is_open(self, row: &SessionRow, now: i64) -> bool {
        row.ended_at_us.is_none()
            && now < row.created_at_us.saturating_add(self.max_us)
            && now < row.seen_at_us.saturating_add(self.idle_us)
    }
}

impl People {
    /// Lets somebody in who knows the password: the token for the cookie, and who it is.
    ///
    /// # Errors
    /// [`PeopleError`]: wrong, too often, too many at once.
    pub(crate) async fn log_in(
        &self,
        name: &str,
        password: &str,
        address: Option<IpAddr>,
    ) -> Result<(Secret, Caller), PeopleError> {
        let now = self.0.clock.now().mono;
        self.may_try(address)?;
        self.limiter().account(now, name).map_err(limited)?;
        // People type their password where the name belongs, and a database may log what it is asked: the name stays here.
        let user = self.0.store.users().await?.into_iter().find(|user| user.name == name);
        let stored = user.as_ref().filter(|user| !user.disabled).and_then(|user| user.password.as_deref());
        let is_right = self.0.passwords.verify(password, stored).await?;
        let Some(user) = user.filter(|_| is_right) else {
            self.failed(address);
            self.limiter().account_failed(now, name);
            tracing::warn!(address = address.map(tracing::field::display), "A login was refused.");
            return Err(PeopleError::WrongPassword);
        };
        self.limiter().account_opened(name);
        self.begin_session(user).await
    }

    /// A new session of a user who has proved who it is.
    pub(super) async fn begin_session(&self, user: UserRow) -> Result<(Secret, Caller), PeopleError> {
        let _one_after_the_other = self.0.changing.lock().await;
        let token = Secret::new("")?;
        let now = self.now_us();
        let mut changes = Vec::new();
        let open = self.0.store.sessions_of(&user.name).await?;
        let too_many = (open.len() + 1).saturating_sub(SESSIONS_MAX);
        for oldest in open.into_iter().take(too_many) {
            changes.push(PeopleChange::Session(ended(oldest, now, "too many sessions")));
        }
        let row = SessionRow {
            id: Secret::new("")?.reveal()[..12].to_owned(),
            user_name: user.name.clone(),
            token_hash: hash(token.reveal()),
            previous_hash: None,
            previous_until_us: None,
            created_at_us: now,
            rotated_at_us: now,
            seen_at_us: now,
            ended_at_us: None,
            ended_why: None,
        };
        let audit = self.audit(&user.name, "session.begin", format!("session {}", row.id));
        let caller = self.session_of_user(&row, &user);
        changes.push(PeopleChange::Session(row));
        self.change(&changes, audit).await?;
        Ok((token, caller))
    }

    /// A session of somebody of this role, who is made when not there.
    #[cfg(test)]
    pub(crate) async fn session_of(&self, name: &str, role: super::Role) -> Secret {
        let wanted = super::UserWanted {
            name: name.to_owned(),
            role,
            call_sign: String::new(),
            licence: String::new(),
        };
        match self.add_user(&Caller::local(), wanted).await {
            Ok(_) | Err(PeopleError::NameTaken(_)) => {}
            Err(error) => panic!("{error}"),
        }
        let user = self.0.store.user(name).await.unwrap().unwrap();
        self.begin_session(user).await.unwrap().0
    }

    /// Whoever shows this cookie; `None`: nobody, or the session has ended.
    ///
    /// # Errors
    /// [`PeopleError::SessionReplayed`], once; [`PeopleError::Store`].
    pub(crate) async fn by_cookie(&self, token: &str) -> Result<Option<Caller>, PeopleError> {
        let hashed = hash(token);
        let Some(row) = self.0.store.session(&hashed).await? else { return Ok(None) };
        let now = self.now_us();
        let rules = self.settings().session;
        if !rules.is_open(&row, now) {
            return Ok(None);
        }
        let Some(user) = self.0.store.user(&row.user_name).await?.filter(|user| !user.disabled) else {
            return Ok(None);
        };
        let is_previous = row.token_hash != hashed;
        if is_previous && row.previous_until_us.is_some_and(|until| until <= now) {
            tracing::warn!(session = row.id, "An exchanged cookie is used again: the session ends.");
            let audit = self.audit(&row.user_name, "session.replayed", format!("session {}: ended", row.id));
            self.change(&[PeopleChange::Session(ended(row, now, "replayed"))], audit).await?;
            return Err(PeopleError::SessionReplayed);
        }
        let settles = !is_previous && row.previous_hash.is_some() && row.previous_until_us.is_none();
        if settles || now - row.seen_at_us > rules.idle_us / SEEN_PARTS {
            self.note_use(&row.id, settles, now).await;
        }
        Ok(Some(self.session_of_user(&row, &user)))
    }

    /// Writes down that a session is used, and that the new token has arrived.
    async fn note_use(&self, id: &str, settles: bool, now: i64) {
        let _one_after_the_other = self.0.changing.lock().await;
        let noted = async {
            let Some(row) = self.0.store.session_by_id(id).await? else { return Ok(()) };
            let until = row.previous_until_us;
            let until = if settles { until.or(Some(now + OVERLAP_US)) } else { until };
            let row = SessionRow { seen_at_us: now, previous_until_us: until, ..row };
            self.0.store.change_people(&[PeopleChange::Session(row)], &[]).await
        };
        // While the archive takes nothing people stay logged in.
        if let Err(error) = noted.await {
            tracing::debug!(%error, "The use of a session could not be noted.");
        }
    }

    /// A new token for a session whose own is old; `None` when it is young, or the old one is out of use already.
    ///
    /// # Errors
    /// [`PeopleError`].
    pub(crate) async fn renew(&self, token: &str) -> Result<Option<Secret>, PeopleError> {
        let hashed = hash(token);
        let _one_after_the_other = self.0.changing.lock().await;
        let now = self.now_us();
        let row =
            self.0.store.session(&hashed).await?.filter(|row| self.settings().session.is_open(row, now));
        // A previous token whose successor never arrived is exchanged once more.
        let is_due = |row: &SessionRow| {
            now - row.rotated_at_us >= ROTATE_US
                && (row.token_hash == hashed || row.previous_until_us.is_none())
        };
        let Some(row) = row.filter(is_due) else { return Ok(None) };
        let next = Secret::new("")?;
        let row = SessionRow {
            token_hash: hash(next.reveal()),
            previous_hash: Some(hashed),
            previous_until_us: None,
            rotated_at_us: now,
            seen_at_us: now,
            ..row
        };
        self.0.store.change_people(&[PeopleChange::Session(row)], &[]).await?;
        Ok(Some(next))
    }

    /// Whether a page has sent the word of the session whose cookie came with it.
    pub(crate) fn is_csrf_of(&self, token: &str, given: &str) -> bool {
        same(&csrf(token), given)
    }

    /// The word that belongs to this cookie.
    pub(crate) fn csrf_of(&self, token: &str) -> String {
        csrf(token)
    }

    /// Ends a session.
    ///
    /// # Errors
    /// [`PeopleError::Store`].
    pub(crate) async fn log_out(&self, caller: &Caller) -> Result<(), PeopleError> {
        let Credential::Session(id) = &caller.credential else { return Ok(()) };
        let _one_after_the_other = self.0.changing.lock().await;
        let Some(row) = self.0.store.session_by_id(id).await? else { return Ok(()) };
        let audit = self.audit(&row.user_name, "session.end", format!("session {id}"));
        self.change(&[PeopleChange::Session(ended(row, self.now_us(), "logged out"))], audit).await
    }

    /// Ends all sessions of the caller's user, this one too.
    ///
    /// # Errors
    /// [`PeopleError::Store`].
    pub(crate) async fn log_out_everywhere(&self, caller: &Caller) -> Result<(), PeopleError> {
        let Some(user) = caller.person.clone() else { return Ok(()) };
        let _one_after_the_other = self.0.changing.lock().await;
        let audit = self.audit(caller.name(), "session.end-all", format!("user {user}"));
        let end = PeopleChange::EndSessions { user, at_us: self.now_us(), why: "logged out everywhere" };
        self.change(&[end], audit).await
    }

    /// The caller of a session by its name in records, if it is open.
    pub(super) async fn session_caller(&self, id: &str) -> Result<Option<Caller>, StoreError> {
        let row = self.0.store.session_by_id(id).await?;
        let Some(row) = row.filter(|row| self.settings().session.is_open(row, self.now_us())) else {
            return Ok(None);
        };
        let user = self.0.store.user(&row.user_name).await?.filter(|user| !user.disabled);
        Ok(user.map(|user| self.session_of_user(&row, &user)))
    }

    fn session_of_user(&self, row: &SessionRow, user: &UserRow) -> Caller {
        let role = role(user);
        Caller {
            credential: Credential::Session(row.id.clone()),
            principal: Some(Principal::new(&user.name)),
            person: Some(user.name.clone()),
            role: Some(role),
            rights: role.rights(),
            expires_at_us: Some(row.created_at_us.saturating_add(self.settings().session.max_us)),
        }
    }
}

fn ended(row: SessionRow, at_us: i64, why: &str) -> SessionRow {
    SessionRow { ended_at_us: Some(at_us), ended_why: Some(why.to_owned()), ..row }
}
