//! Who may do what: users and roles, sessions, tokens of machines, the two-person rule.
//!
//! | module | what it holds |
//! |---|---|
//! | `right` | rights, and the roles that bring them |
//! | `caller` | who asks: a session, a machine's token, the server's own token, or nobody |
//! | `session` | logging in and out, tokens of sessions and their exchange |
//! | `users`, `tokens` | users with their one-time links; tokens of machines |
//! | `approvals` | what waits for a second person |
//! | `password`, `secret`, `limiter` | Argon2id on a small pool, random secrets, how often one may fail |
//!
//! Only hashes are stored. Every change is one transaction with its audit row.
//!
//! What it does **not** do: know HTTP, or decide which path needs which right (`http::routes` does). Sessions run on this
//! machine's clock, also beside a simulated station; the audit carries the station's time as everything else does.

mod approvals;
mod caller;
mod limiter;
mod password;
mod right;
mod secret;
mod session;
mod tokens;
mod users;

use std::net::IpAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use mission::record::AuditRecord;
use mission::{Clock, Principal};
use tokio::sync::watch;

use crate::clock::wall_sleep;
use crate::storage::{PeopleChange, StationLicenceRow, Store, StoreError};

pub use approvals::{Ask, Asked, Decision};
pub use caller::{Caller, Credential};
pub use password::{PASSWORD_MAX, PASSWORD_MIN};
pub use right::{NoSuchRight, NoSuchRole, Right, Rights, Role};
pub use secret::Secret;
pub use session::SessionRules;
pub use tokens::TokenWanted;
pub use users::{UserChanged, UserWanted, Welcome};

use limiter::{Limiter, RetryAfter};
use password::Passwords;

/// Whatever else tells that a credential ended, an open stream looks this often.
const LOOK_AGAIN: Duration = Duration::from_secs(20);

/// What the configuration says about people.
#[derive(Debug, Clone, Default)]
pub struct PeopleSettings {
    /// What is critical needs a second person.
    pub two_person: bool,
    /// How long a second person has, microseconds.
    pub approval_us: i64,
    /// When sessions end by themselves.
    pub session: SessionRules,
    /// Browsers come over TLS: cookies are marked so, and origins must begin with `https`.
    pub https: bool,
    /// Whether one may look without logging in; `None`: on loopback, as long as there is no user.
    pub open_reading: Option<bool>,
    /// The server listens on loopback only.
    pub on_loopback: bool,
    /// Whose memory the archive is.
    pub station: String,
    /// The station's call sign, for those who have none of their own.
    pub call_sign: String,
    /// The licence that goes with it.
    pub licence: String,
}

/// Why people were not changed, or somebody not let in. `Display` may be told to whoever asked.
#[derive(Debug, thiserror::Error)]
pub enum PeopleError {
    /// The operating system gives no random bytes.
    #[error("the operating system gives no random bytes: nothing was changed")]
    NoRandomness,
    /// Too many passwords are being worked on.
    #[error("too many people log in at once; try again in a moment")]
    Busy,
    /// A password that may not be set.
    #[error(
        "password: give {PASSWORD_MIN} characters to {PASSWORD_MAX} bytes, found {characters} characters"
    )]
    BadPassword {
        /// How many it has.
        characters: usize,
    },
    /// Name and password do not go together, or the user may not come in.
    #[error("name and password do not go together, or the user is disabled")]
    WrongPassword,
    /// Too many failures.
    #[error("too many failed attempts: try again in {seconds} s")]
    RateLimited {
        /// When.
        seconds: u64,
    },
    /// A cookie that was exchanged for a newer one is used again.
    #[error(
        "this session's cookie had been exchanged for a newer one: somebody holds a copy, so the session was ended. Log in again"
    )]
    SessionReplayed,
    /// A link that opens nothing.
    #[error(
        "the link was used, is older than 24 h, or a newer one was made: ask an administrator for another (`gs-server user link NAME`)"
    )]
    LinkRefused,
    /// A name that cannot be one.
    #[error(
        "name: '{found}' cannot be a name: give 1 to 32 of a-z, 0-9, '-', '_', beginning with a letter, and none of local, engine, station, nobody"
    )]
    BadName {
        /// What was given, cut.
        found: String,
    },
    /// The first administrator needs a name.
    #[error("name: is missing: the first administrator chooses one")]
    NameMissing,
    /// A field whose text is too long or unprintable.
    #[error("{field}: give at most 64 printable characters")]
    BadText {
        /// Which.
        field: &'static str,
    },
    /// No such user.
    #[error("there is no user '{0}'; `gs-server user list` tells who there is")]
    UnknownUser(String),
    /// The name is taken, perhaps by somebody who was disabled.
    #[error("name: '{0}' is taken: names are never given to somebody else")]
    NameTaken(String),
    /// Nobody would be left who could let people in.
    #[error("'{0}' is the last administrator: make somebody else administrator first")]
    LastAdministrator(String),
    /// No such token.
    #[error("there is no token '{0}' that is in use; `gs-server token list` tells which there are")]
    UnknownToken(String),
    /// Nobody gives what he has not.
    #[error("scopes: '{0}' is more than the token's owner may do, or than you may")]
    TooMuch(String),
    /// Nonsense in a request.
    #[error("{field}: {problem}")]
    Wrong {
        /// Where.
        field: &'static str,
        /// What is wrong and what would be right.
        problem: String,
    },
    /// No such approval.
    #[error("nothing under number {0} waits for anybody")]
    UnknownApproval(i64),
    /// It cannot be approved, or not by this one.
    #[error("{0}")]
    NotApproved(String),
    /// The archive.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Everything about people. Cheap to clone.
#[derive(Clone)]
pub struct People(Arc<Inner>);

struct Inner {
    store: Store,
    /// For sessions, links, tokens and approvals.
    clock: Arc<dyn Clock>,
    /// For the audit.
    station_clock: Arc<dyn Clock>,
    settings: PeopleSettings,
    passwords: Passwords,
    limiter: Mutex<Limiter>,
    /// What is read, changed and written goes one after the other.
    changing: tokio::sync::Mutex<()>,
    /// Plans are exchanged, armed and released one after the other, so that what was approved is what is armed.
    releasing: tokio::sync::Mutex<()>,
    changed: watch::Sender<u64>,
    has_users: AtomicBool,
}

impl People {
    /// The people of an archive. `clock` counts sessions and links; `station_clock` dates the audit.
    ///
    /// # Errors
    /// [`StoreError`].
    pub async fn open(
        store: Store,
        settings: PeopleSettings,
        clock: Arc<dyn Clock>,
        station_clock: Arc<dyn Clock>,
    ) -> Result<Self, StoreError> {
        let has_users = store.has_users().await?;
        let licence = StationLicenceRow {
            station: settings.station.clone(),
            call_sign: settings.call_sign.clone(),
            licence: settings.licence.clone(),
        };
        if store.station_licence(&settings.station).await?.as_ref() != Some(&licence) {
            store.change_people(&[PeopleChange::StationLicence(licence)], &[]).await?;
        }
        Ok(Self(Arc::new(Inner {
            store,
            clock,
            station_clock,
            settings,
            passwords: Passwords::new(),
            limiter: Mutex::default(),
            changing: tokio::sync::Mutex::new(()),
            releasing: tokio::sync::Mutex::new(()),
            changed: watch::Sender::new(0),
            has_users: AtomicBool::new(has_users),
        })))
    }

    /// What the configuration says.
    #[must_use]
    pub fn settings(&self) -> &PeopleSettings {
        &self.0.settings
    }

    /// Whether one may look without logging in.
    ///
    /// # Errors
    /// [`StoreError`].
    pub async fn is_reading_open(&self) -> Result<bool, StoreError> {
        match self.0.settings.open_reading {
            Some(open) => Ok(open),
            None if !self.0.settings.on_loopback => Ok(false),
            None => Ok(!self.has_users().await?),
        }
    }

    /// Whether anybody was ever let in. Users are never deleted, so once is for ever.
    pub(crate) async fn has_users(&self) -> Result<bool, StoreError> {
        if !self.0.has_users.load(Ordering::Relaxed) && self.0.store.has_users().await? {
            self.0.has_users.store(true, Ordering::Relaxed);
        }
        Ok(self.0.has_users.load(Ordering::Relaxed))
    }

    /// Whether this instant is over by the clock of people.
    pub(crate) fn is_over(&self, at_us: i64) -> bool {
        at_us <= self.now_us()
    }

    /// Held while a plan is exchanged or armed under the two-person rule.
    pub(crate) async fn releasing(&self) -> tokio::sync::MutexGuard<'_, ()> {
        self.0.releasing.lock().await
    }

    /// Returns when this caller may not even look any more: logged out, revoked, expired, disabled.
    pub(crate) async fn until_gone(&self, caller: &Caller) {
        let mut changed = self.0.changed.subscribe();
        loop {
            match self.still(caller).await {
                Ok(true) => {}
                Ok(false) => return,
                // What cannot be looked up now is looked up again.
                Err(error) => tracing::debug!(%error, "It cannot be seen whether a stream may go on."),
            }
            tokio::select! {
                _ = changed.changed() => {}
                () = wall_sleep(LOOK_AGAIN) => {}
            }
        }
    }

    /// Whether an address may show a credential at all.
    pub(crate) fn may_try(&self, address: Option<IpAddr>) -> Result<(), PeopleError> {
        self.limiter().address(self.0.clock.now().mono, address).map_err(limited)
    }

    /// An address has shown a credential that is none.
    pub(crate) fn failed(&self, address: Option<IpAddr>) {
        let now = self.0.clock.now().mono;
        self.limiter().address_failed(now, address);
    }

    fn limiter(&self) -> std::sync::MutexGuard<'_, Limiter> {
        self.0.limiter.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now_us(&self) -> i64 {
        self.0.clock.now().utc.0
    }

    fn audit(&self, who: &str, action: &'static str, detail: impl Into<String>) -> AuditRecord {
        let at = self.0.station_clock.now().utc;
        AuditRecord { at, who: Principal::new(who), action, detail: detail.into() }
    }

    async fn change(&self, changes: &[PeopleChange], audit: AuditRecord) -> Result<(), PeopleError> {
        self.0.store.change_people(changes, &[audit]).await?;
        self.0.changed.send_modify(|number| *number = number.wrapping_add(1));
        Ok(())
    }
}

fn limited(RetryAfter(seconds): RetryAfter) -> PeopleError {
    PeopleError::RateLimited { seconds }
}

/// Names of users and tokens stand in every record, so they are plain, and none of them is somebody else already.
fn check_name(name: &str) -> Result<(), PeopleError> {
    const RESERVED: [&str; 5] = ["local", "engine", "station", "nobody", "anonymous"];
    let legal = (1..=32).contains(&name.len())
        && name.bytes().next().is_some_and(|b| b.is_ascii_lowercase())
        && name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || matches!(b, b'-' | b'_'));
    if legal && !RESERVED.contains(&name) {
        return Ok(());
    }
    Err(PeopleError::BadName { found: name.chars().take(40).collect() })
}

fn check_text(field: &'static str, text: &str) -> Result<String, PeopleError> {
    let text = text.trim();
    if text.chars().count() > 64 || text.chars().any(char::is_control) {
        return Err(PeopleError::BadText { field });
    }
    Ok(text.to_owned())
}
