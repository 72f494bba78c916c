//! Users, and the one-time links by which they set their passwords.

use std::net::IpAddr;

use super::caller::Caller;
use super::right::Role;
use super::secret::{Secret, hash};
use super::{People, PeopleError, check_name, check_text};
use crate::storage::{LinkRow, PeopleChange, StoreError, UserRow};

/// A link is good for a day.
const LINK_US: i64 = 24 * 3600 * 1_000_000;

/// A user that somebody wants to let in.
#[derive(Debug, Clone)]
pub struct UserWanted {
    /// The name.
    pub name: String,
    /// The role.
    pub role: Role,
    /// Call sign, empty for none.
    pub call_sign: String,
    /// Licence, empty for none.
    pub licence: String,
}

/// What is to change; `None` stays.
#[derive(Debug, Clone, Default)]
pub struct UserChanged {
    /// The role.
    pub role: Option<Role>,
    /// Call sign, empty for none.
    pub call_sign: Option<String>,
    /// Licence, empty for none.
    pub licence: Option<String>,
    /// Shut out, or let in again.
    pub disabled: Option<bool>,
}

/// What somebody says who comes with a one-time link.
pub struct Welcome<'a> {
    /// The link's code.
    pub code: &'a str,
    /// The first administrator's name.
    pub name: Option<&'a str>,
    /// The new password.
    pub password: &'a str,
    /// Another call sign.
    pub call_sign: Option<&'a str>,
    /// Another licence.
    pub licence: Option<&'a str>,
}

impl People {
    /// All users, each with how many sessions are open.
    ///
    /// # Errors
    /// [`StoreError`].
    pub(crate) async fn users(&self) -> Result<Vec<(UserRow, u64)>, StoreError> {
        let mut users = Vec::new();
        for user in self.0.store.users().await? {
            let sessions = self.0.store.sessions_of(&user.name).await?.len() as u64;
            users.push((user, sessions));
        }
        Ok(users)
    }

    /// Makes a user, who has to come with a one-time link.
    ///
    /// # Errors
    /// [`PeopleError`].
    pub(crate) async fn add_user(&self, by: &Caller, wanted: UserWanted) -> Result<UserRow, PeopleError> {
        check_name(&wanted.name)?;
        let _one_after_the_other = self.0.changing.lock().await;
        if self.0.store.user(&wanted.name).await?.is_some() {
            return Err(PeopleError::NameTaken(wanted.name));
        }
        let user = UserRow {
            role: wanted.role.name().to_owned(),
            password: None,
            password_at_us: None,
            call_sign: check_text("call_sign", &wanted.call_sign)?,
            licence: check_text("licence", &wanted.licence)?,
            disabled: false,
            created_at_us: self.now_us(),
            created_by: by.name().to_owned(),
            name: wanted.name,
        };
        let audit = self.audit(by.name(), "user.add", format!("user {}, {}", user.name, user.role));
        self.change(&[PeopleChange::User(user.clone())], audit).await?;
        Ok(user)
    }

    /// Changes a user. Whoever is disabled has no session any more.
    ///
    /// # Errors
    /// [`PeopleError`].
    pub(crate) async fn change_user(
        &self,
        by: &Caller,
        name: &str,
        wanted: UserChanged,
    ) -> Result<UserRow, PeopleError> {
        let _one_after_the_other = self.0.changing.lock().await;
        let Some(old) = self.0.store.user(name).await? else {
            return Err(PeopleError::UnknownUser(name.chars().take(40).collect()));
        };
        let text = |field, new: Option<&String>, old: &String| {
            new.map_or_else(|| Ok(old.clone()), |new| check_text(field, new))
        };
        let new = UserRow {
            role: wanted.role.map_or_else(|| old.role.clone(), |role| role.name().to_owned()),
            call_sign: text("call_sign", wanted.call_sign.as_ref(), &old.call_sign)?,
            licence: text("licence", wanted.licence.as_ref(), &old.licence)?,
            disabled: wanted.disabled.unwrap_or(old.disabled),
            ..old.clone()
        };
        if is_administrator(&old) && !is_administrator(&new) {
            let mut others = self.0.store.users().await?.into_iter().filter(|user| user.name != name);
            if !others.any(|user| is_administrator(&user)) {
                return Err(PeopleError::LastAdministrator(new.name));
            }
        }
        let mut told = vec![format!("user {name}")];
        let mut tell = |what: &str, old: &str, new: &str| {
            if old != new {
                told.push(format!("{what} '{old}' to '{new}'"));
            }
        };
        tell("role", &old.role, &new.role);
        tell("call sign", &old.call_sign, &new.call_sign);
        tell("licence", &old.licence, &new.licence);
        if old.disabled != new.disabled {
            told.push(if new.disabled { "disabled" } else { "enabled" }.to_owned());
        }
        let mut changes = vec![PeopleChange::User(new.clone())];
        if new.disabled {
            let at_us = self.now_us();
            changes.push(PeopleChange::EndSessions { user: name.to_owned(), at_us, why: "disabled" });
        }
        self.change(&changes, self.audit(by.name(), "user.change", told.join(", "))).await?;
        Ok(new)
    }

    /// A one-time link: for a user, or for the first administrator while there is no user. Older ones are spent.
    ///
    /// # Errors
    /// [`PeopleError`].
    pub(crate) async fn new_link(
        &self,
        by: &str,
        user: Option<&str>,
    ) -> Result<(Secret, LinkRow), PeopleError> {
        let _one_after_the_other = self.0.changing.lock().await;
        match user {
            Some(name) => {
                let known = self.0.store.user(name).await?;
                if known.is_none() {
                    return Err(PeopleError::UnknownUser(name.chars().take(40).collect()));
                }
            }
            None if self.has_users().await? => {
                let problem = "there are users already: name whose link it is to be".to_owned();
                return Err(PeopleError::Wrong { field: "user", problem });
            }
            None => {}
        }
        let code = Secret::new("")?;
        let now = self.now_us();
        let link = LinkRow {
            code_hash: hash(code.reveal()),
            user_name: user.map(str::to_owned),
            made_by: by.to_owned(),
            created_at_us: now,
            expires_at_us: now + LINK_US,
            used_at_us: None,
        };
        let whose = user.unwrap_or("(the first administrator)");
        let audit = self.audit(by, "user.link", format!("user {whose}"));
        self.change(&[PeopleChange::NewLink(link.clone())], audit).await?;
        Ok((code, link))
    }

    /// Path and fragment of the first administrator's link, while there is nobody.
    ///
    /// # Errors
    /// [`PeopleError`].
    pub async fn first_welcome(&self) -> Result<Option<String>, PeopleError> {
        if self.has_users().await? {
            return Ok(None);
        }
        let (code, _) = self.new_link("local", None).await?;
        Ok(Some(format!("/welcome#code={}", code.reveal())))
    }

    /// Sets a password by a one-time link, and lets its user in. All other sessions of the user end.
    ///
    /// # Errors
    /// [`PeopleError`].
    pub(crate) async fn welcome(
        &self,
        said: Welcome<'_>,
        address: Option<IpAddr>,
    ) -> Result<(Secret, Caller), PeopleError> {
        self.may_try(address)?;
        super::password::check(said.password)?;
        // Refused before anything costly is done.
        if let Err(error) = self.usable_link(said.code).await {
            self.failed(address);
            return Err(error);
        }
        let password = self.0.passwords.hash(said.password).await?;
        let user = {
            let _one_after_the_other = self.0.changing.lock().await;
            let link = self.usable_link(said.code).await?;
            let now = self.now_us();
            let user = match &link.user_name {
                Some(name) => self.0.store.user(name).await?.filter(|user| !user.disabled),
                None => Some(self.first(said.name, now).await?),
            };
            let user = user.ok_or(PeopleError::LinkRefused)?;
            let text = |field, new: Option<&str>, old: &str| check_text(field, new.unwrap_or(old));
            let user = UserRow {
                password: Some(password),
                password_at_us: Some(now),
                call_sign: text("call_sign", said.call_sign, &user.call_sign)?,
                licence: text("licence", said.licence, &user.licence)?,
                ..user
            };
            let changes = [
                PeopleChange::User(user.clone()),
                PeopleChange::UseLink(LinkRow { used_at_us: Some(now), ..link }),
                PeopleChange::EndSessions { user: user.name.clone(), at_us: now, why: "new password" },
            ];
            let audit = self.audit(&user.name, "user.welcome", format!("user {} set a password", user.name));
            match self.change(&changes, audit).await {
                Err(PeopleError::Store(StoreError::Conflict(_))) => return Err(PeopleError::LinkRefused),
                result => result?,
            }
            user
        };
        self.limiter().account_opened(&user.name);
        self.begin_session(user).await
    }

    async fn usable_link(&self, code: &str) -> Result<LinkRow, PeopleError> {
        let link = self.0.store.link(&hash(code)).await?;
        let is_good = |link: &LinkRow| link.used_at_us.is_none() && self.now_us() < link.expires_at_us;
        let link = link.filter(is_good).ok_or(PeopleError::LinkRefused)?;
        // The first administrator's link was made when nobody was there.
        if link.user_name.is_none() && self.has_users().await? {
            return Err(PeopleError::LinkRefused);
        }
        Ok(link)
    }

    async fn first(&self, name: Option<&str>, now: i64) -> Result<UserRow, PeopleError> {
        let name = name.ok_or(PeopleError::NameMissing)?;
        check_name(name)?;
        Ok(UserRow {
            name: name.to_owned(),
            role: Role::Administrator.name().to_owned(),
            password: None,
            password_at_us: None,
            call_sign: String::new(),
            licence: String::new(),
            disabled: false,
            created_at_us: now,
            created_by: "local".to_owned(),
        })
    }

    /// Exchanges one's own password. All sessions end, and a new one begins.
    ///
    /// # Errors
    /// [`PeopleError`].
    pub(crate) async fn change_password(
        &self,
        caller: &Caller,
        old: &str,
        new: &str,
        address: Option<IpAddr>,
    ) -> Result<(Secret, Caller), PeopleError> {
        let name = caller.person.as_deref().unwrap_or_default();
        super::password::check(new)?;
        let now = self.0.clock.now().mono;
        self.may_try(address)?;
        self.limiter().account(now, name).map_err(super::limited)?;
        let stored = self.0.store.user(name).await?.and_then(|user| user.password);
        if !self.0.passwords.verify(old, stored.as_deref()).await? {
            self.failed(address);
            self.limiter().account_failed(now, name);
            return Err(PeopleError::WrongPassword);
        }
        let password = self.0.passwords.hash(new).await?;
        let user = {
            let _one_after_the_other = self.0.changing.lock().await;
            let user =
                self.0.store.user(name).await?.filter(|user| !user.disabled && user.password == stored);
            let user = user.ok_or(PeopleError::WrongPassword)?;
            let now = self.now_us();
            let user = UserRow { password: Some(password), password_at_us: Some(now), ..user };
            let changes = [
                PeopleChange::User(user.clone()),
                PeopleChange::EndSessions { user: user.name.clone(), at_us: now, why: "new password" },
            ];
            self.change(&changes, self.audit(name, "user.password", format!("user {name}"))).await?;
            user
        };
        self.begin_session(user).await
    }
}

fn is_administrator(user: &UserRow) -> bool {
    user.role == Role::Administrator.name() && !user.disabled
}
