//! What can go wrong with the database, told so that the reader knows what to do next.

use std::io;
use std::path::{Path, PathBuf};

use sqlx::postgres::PgDatabaseError;

/// Why storage did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Another server works in this folder.
    #[error("{} is in use by another server{}: stop that one, or use another data folder", folder.display(), process(*.holder))]
    Locked {
        /// The data folder.
        folder: PathBuf,
        /// The process that holds it, when it left its number.
        holder: Option<u32>,
    },
    /// The file is no database any more, or a value in it is not what was written.
    #[error(
        "the database is damaged ({found}): put a backup in its place, or move the file away and import its frames"
    )]
    Damaged {
        /// What was noticed.
        found: String,
    },
    /// A newer version of this program made the database.
    #[error(
        "the database has schema {found}, this program knows up to {known}: start the newer program that made it"
    )]
    NewerSchema {
        /// The newest step that was applied to the file.
        found: i64,
        /// The newest step that this program has.
        known: i64,
    },
    /// Something simulated and something real would meet in one folder.
    #[error("{} was made by a {}: use another data folder", folder.display(), if *.simulated { "simulation" } else { "real station" })]
    SimulatedMark {
        /// The data folder.
        folder: PathBuf,
        /// What the folder is.
        simulated: bool,
    },
    /// The operating system does not let us.
    #[error("no permission for {}: make this user its owner (chown), or use another data folder", path.display())]
    Permission {
        /// For what.
        path: PathBuf,
    },
    /// There is no room.
    #[error(
        "the disk is full, or the database has reached its size limit: make room, and it goes on by itself; or raise \
         storage.max_page_count and start again"
    )]
    Full,
    /// The device failed.
    #[error(
        "reading or writing {what} failed: look at the disk, its cable and the limit of the shell (ulimit -f)"
    )]
    Io {
        /// What was read or written.
        what: String,
        /// What the system said.
        #[source]
        source: io::Error,
    },
    /// The records contradict what is stored: a nonce for the second time, a row that nobody made. Nothing was stored.
    #[error("the records contradict the database: {0}")]
    Conflict(String),
    /// A number that the database has no room for.
    #[error("{what} {value} is out of range: the database holds numbers up to 9223372036854775807")]
    OutOfRange {
        /// Which.
        what: &'static str,
        /// The number.
        value: u64,
    },
    /// The database is elsewhere and does not answer, or went away in the middle.
    #[error("the database does not answer: look at its server and the network; it goes on by itself")]
    Away {
        /// What was noticed.
        #[source]
        source: io::Error,
    },
    /// The database's server does not let this user in, or not do this.
    #[error(
        "the database's server refuses ({said}): look at the user and the database in storage.database, at its password \
         (storage.password_file), and at what it may do there"
    )]
    NotLetIn {
        /// What the server said.
        said: String,
    },
    /// The file with the password for the database.
    #[error("the password for the database cannot be taken from {}: {problem}", path.display())]
    PasswordFile {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        problem: &'static str,
    },
    /// Another server works as this station on the same database.
    #[error(
        "another server works as this station on the same database: stop that one, or give this one another station.name"
    )]
    StationTaken,
    /// Another server holds the lease of a key.
    #[error("key {key} is used by station {station} until {}", utc(*.until_us))]
    Leased {
        /// The id of the key.
        key: String,
        /// Who holds it.
        station: String,
        /// Until then, microseconds since 1970 UTC, unless it is renewed.
        until_us: i64,
    },
    /// Another server works on the same intent.
    #[error("another server works on this request: ask again with the same idempotency key")]
    Claimed,
    /// Another server took this station over.
    #[error("another server has taken this station over: this one stores nothing any more; stop it")]
    Replaced,
    /// The database is set so that what was acknowledged may be lost.
    #[error("the database runs with {setting} = {value}: set it to on, or what was acknowledged may be lost")]
    Unsafe {
        /// Which setting.
        setting: &'static str,
        /// What it is.
        value: String,
    },
    /// Anything else that the database says.
    #[error("the database refused")]
    Database(#[source] sqlx::Error),
}

pub(crate) fn utc(at_us: i64) -> String {
    jiff::Timestamp::from_microsecond(at_us)
        .map_or_else(|_| "an unknown time".to_owned(), |at| format!("{at:.0}"))
}

fn process(holder: Option<u32>) -> String {
    holder.map(|pid| format!(" (process {pid})")).unwrap_or_default()
}

impl StoreError {
    /// Whether the same call may succeed later, without anybody changing what is asked.
    pub fn is_temporary(&self) -> bool {
        matches!(self, Self::Full | Self::Io { .. } | Self::Away { .. } | Self::Leased { .. } | Self::Claimed)
    }

    /// An error of the file system, for this path.
    pub(crate) fn from_io(path: &Path, source: io::Error) -> Self {
        match source.kind() {
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                Self::Permission { path: path.to_path_buf() }
            }
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => Self::Full,
            _ => Self::Io { what: path.display().to_string(), source },
        }
    }

    /// The database does not answer.
    pub(crate) fn away(found: impl Into<String>) -> Self {
        Self::Away { source: io::Error::other(found.into()) }
    }

    pub(crate) fn damaged(found: impl Into<String>) -> Self {
        Self::Damaged { found: found.into() }
    }
}

/// Primary result codes, <https://www.sqlite.org/rescode.html>.
mod code {
    pub(super) const PERM: i32 = 3;
    pub(super) const READONLY: i32 = 8;
    pub(super) const IOERR: i32 = 10;
    pub(super) const CORRUPT: i32 = 11;
    pub(super) const FULL: i32 = 13;
    pub(super) const CANTOPEN: i32 = 14;
    pub(super) const CONSTRAINT: i32 = 19;
    pub(super) const NOTADB: i32 = 26;
}

impl From<sqlx::Error> for StoreError {
    fn from(error: sqlx::Error) -> Self {
        match &error {
            sqlx::Error::Database(inner) if inner.try_downcast_ref::<PgDatabaseError>().is_some() => {
                let (code, text) =
                    (inner.code().unwrap_or_default().into_owned(), inner.message().to_owned());
                of_postgres(&code, &text, error)
            }
            sqlx::Error::Database(inner) => {
                let extended: i32 = inner.code().and_then(|code| code.parse().ok()).unwrap_or(0);
                let text = inner.message().to_owned();
                match extended & 0xff {
                    code::FULL => Self::Full,
                    code::IOERR => Self::Io {
                        what: "the database".into(),
                        source: io::Error::other(format!("{text} (code {extended})")),
                    },
                    code::CORRUPT | code::NOTADB => Self::damaged(text),
                    code::CONSTRAINT => Self::Conflict(text),
                    code::PERM | code::READONLY | code::CANTOPEN => {
                        Self::Permission { path: "the database".into() }
                    }
                    _ => Self::Database(error),
                }
            }
            sqlx::Error::Io(_)
            | sqlx::Error::Tls(_)
            | sqlx::Error::Protocol(_)
            | sqlx::Error::PoolTimedOut => Self::Away { source: io::Error::other(error) },
            // A value of another type than its column may hold: nobody could have written that.
            sqlx::Error::ColumnDecode { .. } | sqlx::Error::Decode(_) => Self::damaged(error.to_string()),
            _ => Self::Database(error),
        }
    }
}

/// By the classes of <https://www.postgresql.org/docs/current/errcodes-appendix.html>.
fn of_postgres(code: &str, text: &str, error: sqlx::Error) -> StoreError {
    let io = || StoreError::Io {
        what: "the database".into(),
        source: io::Error::other(format!("{text} (code {code})")),
    };
    match code {
        "53100" => StoreError::Full,
        "58030" => io(),
        "XX001" | "XX002" => StoreError::damaged(text),
        "42501" | "28000" | "28P01" | "3D000" => StoreError::NotLetIn { said: text.to_owned() },
        // Too many connections, out of memory, shutting down, starting up, a statement or a wait that took too long.
        "57014" | "55P03" | "25P03" | "25006" => StoreError::away(text),
        _ => match code.get(..2).unwrap_or_default() {
            "08" | "53" | "57" | "40" => StoreError::away(text),
            // A condition that a row breaks, and what our triggers refuse.
            "23" | "P0" => StoreError::Conflict(text.to_owned()),
            _ => StoreError::Database(error),
        },
    }
}
