//! People in the archive: users, one-time links, sessions, tokens, approvals, and who answered for a transmission.
//!
//! Nothing secret is stored: hashes only. Every change of people is one transaction with its audit rows.

use mission::record::AuditRecord;
use sqlx::AssertSqlSafe;

use super::db::sql;
use super::row::{Row, row, select};
use super::rows::StageRow;
use super::write::Transaction;
use super::{During, Page, Scope, Store, StoreError};

row! {
    /// A user.
    UserRow in "users" {
        /// 1 to 32 of `a-z`, `0-9`, `-`, `_`; never given to somebody else.
        name: String,
        /// `viewer`, `operator`, `mission-lead` or `administrator`.
        role: String,
        /// What Argon2id made of the password, as a PHC string; `None` until one was set.
        password: Option<String>,
        /// When it was set.
        password_at_us: Option<i64>,
        /// Amateur radio call sign, empty when there is none.
        call_sign: String,
        /// The licence in words, empty when there is none.
        licence: String,
        /// May not come in any more.
        disabled: bool,
        /// When the user was made.
        created_at_us: i64,
        /// By whom.
        created_by: String,
    }
}

row! {
    /// A one-time link.
    LinkRow in "user_links" {
        /// SHA-256 of its code.
        code_hash: Vec<u8>,
        /// Whose; `None` makes the first administrator.
        user_name: Option<String>,
        /// Who made it.
        made_by: String,
        /// When.
        created_at_us: i64,
        /// Not after this.
        expires_at_us: i64,
        /// When it was used.
        used_at_us: Option<i64>,
    }
}

row! {
    /// Somebody is logged in.
    SessionRow in "sessions" {
        /// Its name in records; opens nothing.
        id: String,
        /// Who.
        user_name: String,
        /// SHA-256 of the token in the cookie.
        token_hash: Vec<u8>,
        /// SHA-256 of the token before the last exchange.
        previous_hash: Option<Vec<u8>>,
        /// Until when that one is still good; `None`: until the new one was seen.
        previous_until_us: Option<i64>,
        /// When the user logged in.
        created_at_us: i64,
        /// When the token was last exchanged.
        rotated_at_us: i64,
        /// When it was last used, to some minutes.
        seen_at_us: i64,
        /// When it was ended.
        ended_at_us: Option<i64>,
        /// Why.
        ended_why: Option<String>,
    }
}

row! {
    /// A machine's token.
    TokenRow in "tokens" {
        /// Its name, never used again.
        name: String,
        /// SHA-256 of it.
        token_hash: Vec<u8>,
        /// The user who answers for it.
        owner: Option<String>,
        /// Rights, with blanks between.
        scopes: String,
        /// When it was made.
        created_at_us: i64,
        /// By whom.
        created_by: String,
        /// Not after this.
        expires_at_us: i64,
        /// When it was revoked.
        revoked_at_us: Option<i64>,
    }
}

row! {
    /// Something that needs a second person.
    ApprovalRow in "approvals" {
        /// Its number, rising.
        id: i64,
        /// `command` or `arm-plan`.
        kind: String,
        /// What was asked for, as JSON.
        request: String,
        /// SHA-256 of what it means.
        digest: Vec<u8>,
        /// It in words.
        summary: String,
        /// Who asked, as records have it.
        principal: String,
        /// The person behind that.
        person: String,
        /// Under which idempotency key.
        idempotency_key: String,
        /// SHA-256 of the request.
        request_digest: Vec<u8>,
        /// When.
        asked_at_us: i64,
        /// Not to be approved after this.
        expires_at_us: i64,
        /// `awaiting`, `approved` or `refused`.
        state: String,
        /// Who decided.
        decided_by: Option<String>,
        /// When.
        decided_at_us: Option<i64>,
        /// Why not.
        why: Option<String>,
        /// The command that came of it.
        command: Option<i64>,
        /// When the engine took it.
        released_at_us: Option<i64>,
    }
}

row! {
    /// Whose call sign stands for a station.
    StationLicenceRow in "station_licences" {
        /// The station.
        station: String,
        /// Call sign, empty when nobody gave one.
        call_sign: String,
        /// The licence in words.
        licence: String,
    }
}

row! {
    /// Who answered for one radiation.
    TransmissionRow in "transmissions" {
        /// Of which command.
        command: i64,
        /// Which attempt of it.
        attempt: i64,
        /// To whom.
        satellite: String,
        /// From where.
        station: String,
        /// Over what.
        link: String,
        /// When it was permitted, which is just before it was radiated.
        at_us: i64,
        /// Who asked for it, as the command says.
        principal: String,
        /// The person behind that; `None`: nobody is known by name.
        person: Option<String>,
        /// Their call sign, or the station's.
        call_sign: Option<String>,
        /// Their licence, or the station's.
        licence: Option<String>,
    }
}

/// One change of people; several make one transaction.
#[derive(Debug, Clone)]
pub(crate) enum PeopleChange {
    /// A new user, or one that has changed.
    User(UserRow),
    /// A new link. Older ones for the same user open nothing any more.
    NewLink(LinkRow),
    /// A link is used, once.
    UseLink(LinkRow),
    /// A new session, or one that has changed.
    Session(SessionRow),
    /// All sessions of a user end.
    EndSessions { user: String, at_us: i64, why: &'static str },
    /// A new token, or one that has changed.
    Token(TokenRow),
    /// Something waits for a second person; its number is given here.
    NewApproval(ApprovalRow),
    /// It is decided: it must have been `awaiting` until now.
    Decide(ApprovalRow),
    /// It was released.
    Released(ApprovalRow),
    /// Whose call sign stands for a station.
    StationLicence(StationLicenceRow),
}

impl Store {
    /// Changes people, whole or not at all, with what the audit says of it.
    ///
    /// # Errors
    /// [`StoreError::Conflict`] when a link was used or something decided meanwhile.
    pub(crate) async fn change_people(
        &self,
        changes: &[PeopleChange],
        audit: &[AuditRecord],
    ) -> Result<(), StoreError> {
        let mut writer = self.0.writer.lock().await;
        let mut connection = writer.begin().await?;
        let mut transaction = writer.within(&mut connection);
        let result = async {
            for change in changes {
                transaction.people(change).await?;
            }
            for record in audit {
                transaction.audit(record).await?;
            }
            Ok(())
        }
        .await;
        writer.end(connection, result).await
    }

    /// All users by name.
    pub(crate) async fn users(&self) -> Result<Vec<UserRow>, StoreError> {
        let rows = sql(select::<UserRow>("order by name")).fetch_all(&self.0.readers).await?;
        rows.iter().map(UserRow::read).collect()
    }

    /// Whether there is any user.
    pub(crate) async fn has_users(&self) -> Result<bool, StoreError> {
        let count: i64 = sql("select count(*) from users").scalar(&self.0.readers).await?;
        Ok(count > 0)
    }

    pub(crate) async fn user(&self, name: &str) -> Result<Option<UserRow>, StoreError> {
        self.by_text("where name = $1", name).await
    }

    pub(crate) async fn link(&self, code_hash: &[u8]) -> Result<Option<LinkRow>, StoreError> {
        self.by_bytes("where code_hash = $1", code_hash).await
    }

    /// The session whose present or previous token this is.
    pub(crate) async fn session(&self, hash: &[u8]) -> Result<Option<SessionRow>, StoreError> {
        self.by_bytes("where token_hash = $1 or previous_hash = $1", hash).await
    }

    pub(crate) async fn session_by_id(&self, id: &str) -> Result<Option<SessionRow>, StoreError> {
        self.by_text("where id = $1", id).await
    }

    /// Those of a user that were not ended.
    pub(crate) async fn sessions_of(&self, user: &str) -> Result<Vec<SessionRow>, StoreError> {
        let rows =
            sql(select::<SessionRow>("where user_name = $1 and ended_at_us is null order by created_at_us"))
                .bind(user)
                .fetch_all(&self.0.readers)
                .await?;
        rows.iter().map(SessionRow::read).collect()
    }

    pub(crate) async fn tokens(&self) -> Result<Vec<TokenRow>, StoreError> {
        let rows = sql(select::<TokenRow>("order by name")).fetch_all(&self.0.readers).await?;
        rows.iter().map(TokenRow::read).collect()
    }

    pub(crate) async fn token(&self, name: &str) -> Result<Option<TokenRow>, StoreError> {
        self.by_text("where name = $1", name).await
    }

    pub(crate) async fn token_by_hash(&self, hash: &[u8]) -> Result<Option<TokenRow>, StoreError> {
        self.by_bytes("where token_hash = $1", hash).await
    }

    pub(crate) async fn approval(&self, id: i64) -> Result<Option<ApprovalRow>, StoreError> {
        let row =
            sql(select::<ApprovalRow>("where id = $1")).bind(id).fetch_optional(&self.0.readers).await?;
        row.as_ref().map(ApprovalRow::read).transpose()
    }

    /// What this principal asked for under this key.
    pub(crate) async fn approval_asked(
        &self,
        principal: &str,
        idempotency_key: &str,
    ) -> Result<Option<ApprovalRow>, StoreError> {
        let row = sql(select::<ApprovalRow>("where principal = $1 and idempotency_key = $2"))
            .bind(principal)
            .bind(idempotency_key)
            .fetch_optional(&self.0.readers)
            .await?;
        row.as_ref().map(ApprovalRow::read).transpose()
    }

    /// A page of what needed a second person; `open`: only what still waits.
    pub(crate) async fn approvals(
        &self,
        open: bool,
        during: &During,
        page: &Page,
    ) -> Result<Vec<ApprovalRow>, StoreError> {
        let list = super::read::List::of::<ApprovalRow>().during("asked_at_us", during);
        let list = if open { list.equal("state", Some("awaiting")) } else { list };
        list.page(self, "id", page).await
    }

    /// Who answered for what, by the numbers of the commands.
    pub(crate) async fn transmissions(
        &self,
        scope: &Scope,
        page: &Page,
    ) -> Result<Vec<TransmissionRow>, StoreError> {
        super::read::List::of::<TransmissionRow>().scope("at_us", scope).page(self, "command", page).await
    }

    /// Whose call sign stands for a station.
    pub(crate) async fn station_licence(
        &self,
        station: &str,
    ) -> Result<Option<StationLicenceRow>, StoreError> {
        self.by_text("where station = $1", station).await
    }

    /// The plan of this name that is in use: number and text.
    pub(crate) async fn plan_in_use(&self, name: &str) -> Result<Option<super::PlanRow>, StoreError> {
        self.by_text("where name = $1 and withdrawn_at_us is null", name).await
    }

    async fn by_text<R: Row>(&self, condition: &'static str, text: &str) -> Result<Option<R>, StoreError> {
        let row = sql(select::<R>(condition)).bind(text).fetch_optional(&self.0.readers).await?;
        row.as_ref().map(R::read).transpose()
    }

    async fn by_bytes<R: Row>(&self, condition: &'static str, bytes: &[u8]) -> Result<Option<R>, StoreError> {
        let row = sql(select::<R>(condition)).bind(bytes).fetch_optional(&self.0.readers).await?;
        row.as_ref().map(R::read).transpose()
    }
}

impl Transaction<'_> {
    async fn people(&mut self, change: &PeopleChange) -> Result<(), StoreError> {
        match change {
            PeopleChange::User(user) => self.upsert("name", user).await,
            PeopleChange::NewLink(link) => {
                self.spend_links(link.user_name.as_deref(), link.created_at_us).await?;
                self.insert(link).await
            }
            PeopleChange::UseLink(link) => {
                let done =
                    sql("update user_links set used_at_us = $1, crc = $2 where code_hash = $3 and used_at_us is null")
                        .bind(link.used_at_us)
                        .bind(link.crc())
                        .bind(&link.code_hash)
                        .execute(&mut *self.connection)
                        .await?;
                settled(done, "the link was used")
            }
            PeopleChange::Session(session) => self.upsert("id", session).await,
            PeopleChange::EndSessions { user, at_us, why } => {
                let found = sql(select::<SessionRow>("where user_name = $1 and ended_at_us is null"))
                    .bind(user)
                    .fetch_all(&mut *self.connection)
                    .await?;
                for row in &found {
                    let row = SessionRow {
                        ended_at_us: Some(*at_us),
                        ended_why: Some((*why).to_owned()),
                        ..SessionRow::read(row)?
                    };
                    self.upsert("id", &row).await?;
                }
                Ok(())
            }
            PeopleChange::Token(token) => self.upsert("name", token).await,
            PeopleChange::NewApproval(approval) => {
                let last: i64 =
                    sql("select coalesce(max(id), 0) from approvals").scalar(&mut *self.connection).await?;
                self.insert(&ApprovalRow { id: last + 1, ..approval.clone() }).await
            }
            PeopleChange::Decide(approval) => {
                let done = sql(
                    "update approvals set state = $1, decided_by = $2, decided_at_us = $3, why = $4, crc = $5
                     where id = $6 and state = 'awaiting'",
                )
                .bind(&approval.state)
                .bind(&approval.decided_by)
                .bind(approval.decided_at_us)
                .bind(&approval.why)
                .bind(approval.crc())
                .bind(approval.id)
                .execute(&mut *self.connection)
                .await?;
                settled(done, "it was decided")
            }
            PeopleChange::Released(approval) => self.upsert("id", approval).await,
            PeopleChange::StationLicence(licence) => self.upsert("station", licence).await,
        }
    }

    /// Links that were made before open nothing any more.
    async fn spend_links(&mut self, user: Option<&str>, at_us: i64) -> Result<(), StoreError> {
        let found = sql(select::<LinkRow>("where coalesce(user_name, '') = $1 and used_at_us is null"))
            .bind(user.unwrap_or(""))
            .fetch_all(&mut *self.connection)
            .await?;
        for row in &found {
            let row = LinkRow { used_at_us: Some(at_us), ..LinkRow::read(row)? };
            self.upsert("code_hash", &row).await?;
        }
        Ok(())
    }

    /// Who answers for this radiation, beside the permission to radiate: in the same transaction.
    pub(super) async fn responsible(&mut self, stage: &StageRow) -> Result<(), StoreError> {
        let principal: String = sql("select principal from commands where id = $1")
            .bind(stage.command)
            .scalar(&mut *self.connection)
            .await?;
        let person = self.person_behind(&principal).await?;
        let station = sql(select::<StationLicenceRow>("where station = $1"))
            .bind(&stage.station)
            .fetch_optional(&mut *self.connection)
            .await?;
        let station = station.as_ref().map(StationLicenceRow::read).transpose()?;
        let words = |own: Option<&String>, of_station: Option<&String>| {
            own.filter(|word| !word.is_empty()).or(of_station.filter(|word| !word.is_empty())).cloned()
        };
        // A call sign and a licence belong together.
        let own = person.as_ref().filter(|user| !user.call_sign.is_empty());
        let station = station.as_ref().filter(|_| own.is_none());
        let row = TransmissionRow {
            command: stage.command,
            attempt: stage.attempt,
            satellite: stage.satellite.clone(),
            station: stage.station.clone(),
            link: stage.link.clone(),
            at_us: stage.at_us,
            call_sign: words(own.map(|user| &user.call_sign), station.map(|row| &row.call_sign)),
            licence: words(own.map(|user| &user.licence), station.map(|row| &row.licence)),
            person: person.map(|user| user.name),
            principal,
        };
        // A radiation is never held up by its own record.
        let insert = AssertSqlSafe(format!("{} on conflict do nothing", TransmissionRow::INSERT));
        row.bind(sql(insert)).execute(&mut *self.connection).await?;
        Ok(())
    }

    /// The user behind a principal: of a plan who armed it last, of a token its owner.
    async fn person_behind(&mut self, principal: &str) -> Result<Option<UserRow>, StoreError> {
        let armed_by = match principal.strip_prefix("plan:") {
            Some(plan) => {
                let found = sql(
                    "select who from audit where action = 'plan.arm' and detail = $1 order by id desc limit 1",
                )
                .bind(format!("plan {plan}"))
                .fetch_optional(&mut *self.connection)
                .await?;
                found.map(|row| row.try_get::<String>("who")).transpose()?
            }
            None => Some(principal.to_owned()),
        };
        let Some(who) = armed_by else { return Ok(None) };
        let name = match who.strip_prefix("token:") {
            Some(token) => sql("select owner from tokens where name = $1")
                .bind(token)
                .scalar_optional::<Option<String>>(&mut *self.connection)
                .await?
                .flatten(),
            None => Some(who),
        };
        let Some(name) = name else { return Ok(None) };
        let row = sql(select::<UserRow>("where name = $1"))
            .bind(name)
            .fetch_optional(&mut *self.connection)
            .await?;
        row.as_ref().map(UserRow::read).transpose()
    }
}

fn settled(rows: u64, what: &str) -> Result<(), StoreError> {
    match rows {
        1 => Ok(()),
        _ => Err(StoreError::Conflict(format!("{what} already"))),
    }
}
