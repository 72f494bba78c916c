//! The audit as a chain: each row is tied to the one before it, so that nobody changes, drops or moves a row unnoticed.
//!
//! The hash of a row is SHA-256 over the hash of the row before it and all its columns. The last one is the head; it
//! stands in the file `audit-head` beside the database as well, and belongs into a notebook (`gs-server audit verify`
//! prints it): whoever can write the database can make a whole new chain, but not one that ends in a head that
//! somebody wrote down.
//!
//! Where several stations share a database they have one chain: a row is numbered and tied while nobody else writes.

use std::collections::VecDeque;
use std::fmt;
use std::fs::OpenOptions;
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Mutex;

use sha2::{Digest as _, Sha256};

use super::db::{Connection, DbRow, sql};
use super::row::{Row as _, select};
use super::rows::{AuditLinkRow, AuditRow};
use super::{Archive, StoreError};

/// The file with the newest head, in the data folder.
const HEAD_FILE: &str = "audit-head";
/// More than any head has.
const HEAD_BYTES_MAX: u64 = 256;
/// What the first row of a chain is tied to.
const BEGINNING: [u8; 32] = [0; 32];
/// Rows that are in memory at once.
const ROWS_AT_ONCE: i64 = 2_000;
/// Findings that are told in full.
const FINDINGS_MAX: usize = 20;

/// The end of a chain at some time: which row, and its hash. `Display` and `FromStr` speak `17:<64 hex digits>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AuditHead {
    /// The last row.
    pub row: i64,
    /// Its hash.
    pub hash: [u8; 32],
}

impl fmt::Display for AuditHead {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.row, hex::encode(self.hash))
    }
}

impl FromStr for AuditHead {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wanted = "a head is ROW:HASH with 64 hex digits, as `gs-server audit verify` prints it";
        let (row, hash) = text.trim().split_once(':').ok_or(wanted)?;
        let row = row.parse().ok().filter(|row| *row > 0).ok_or(wanted)?;
        let mut bytes = [0; 32];
        hex::decode_to_slice(hash, &mut bytes).map_err(|_| wanted)?;
        Ok(Self { row, hash: bytes })
    }
}

/// What looking at the whole chain found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct AuditVerdict {
    /// Rows looked at.
    pub rows: u64,
    /// The end of the chain; `None`: there is no row.
    pub head: Option<AuditHead>,
    /// How many things are wrong; 0: the audit is what was written.
    pub wrong: u64,
    /// The first of them, as sentences.
    pub findings: Vec<String>,
}

impl AuditVerdict {
    fn found(&mut self, finding: String) {
        self.wrong += 1;
        if self.findings.len() < FINDINGS_MAX {
            self.findings.push(finding);
        }
    }
}

/// The hash of this row, after a row with that hash.
pub(super) fn link(before: &[u8; 32], row: &AuditRow) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(b"pixelsat-ground audit 1\0");
    hash.update(before);
    hash.update(row.id.to_be_bytes());
    hash.update(row.at_us.to_be_bytes());
    for text in [&row.station, &row.who, &row.action, &row.detail] {
        hash.update((text.len() as u64).to_be_bytes());
        hash.update(text);
    }
    hash.finalize().into()
}

/// What the next row is tied to.
pub(super) async fn newest(connection: &mut Connection) -> Result<[u8; 32], StoreError> {
    let found = sql(select::<AuditLinkRow>("order by audit desc limit 1")).fetch_optional(connection).await?;
    found.as_ref().map_or(Ok(BEGINNING), |row| hash_of(&AuditLinkRow::read(row)?))
}

fn hash_of(row: &AuditLinkRow) -> Result<[u8; 32], StoreError> {
    row.hash.as_slice().try_into().map_err(|_| StoreError::damaged("a hash of the audit has not 32 bytes"))
}

/// Ties the rows of an audit that is older than the chain. One that has a chain already is left as it is.
pub(super) async fn begin(connection: &mut Connection) -> Result<(), StoreError> {
    let links: i64 = sql("select count(*) from audit_links").scalar(&mut *connection).await?;
    if links > 0 {
        return Ok(());
    }
    let rows = sql(select::<AuditRow>("order by id")).fetch_all(&mut *connection).await?;
    if rows.is_empty() {
        return Ok(());
    }
    sql("begin").execute(&mut *connection).await?;
    let mut before = BEGINNING;
    for row in rows {
        let row = AuditRow::read(&row)?;
        before = link(&before, &row);
        let tie = AuditLinkRow { audit: row.id, hash: before.to_vec() };
        tie.bind(sql(AuditLinkRow::INSERT)).execute(&mut *connection).await?;
    }
    sql("commit").execute(connection).await?;
    Ok(())
}

/// Looks at the whole chain of this archive, beside servers that may be running, and changes nothing. `noted` are
/// heads that somebody wrote down; the one in the data folder counts as well.
///
/// # Errors
/// [`StoreError`] when there is no database or it cannot be read. What is wrong inside is a finding, not an error.
pub async fn verify_audit(archive: &Archive, noted: &[AuditHead]) -> Result<AuditVerdict, StoreError> {
    let mut connection = archive.reading().await?;
    let mut verdict = AuditVerdict::default();
    let mut heads: Vec<(AuditHead, String)> =
        noted.iter().map(|head| (*head, "the head that was given".to_owned())).collect();
    match HeadFile::new(&archive.folder).read() {
        Ok(Some(head)) => heads.push((head, format!("the file {HEAD_FILE}"))),
        Ok(None) => {}
        Err(why) => verdict.found(format!("the file {HEAD_FILE} is not what was written: {why}")),
    }

    let (mut last, mut before) = (0_i64, BEGINNING);
    let mut met = vec![false; heads.len()];
    let mut rows = VecDeque::new();
    let mut from = Some(i64::MIN);
    loop {
        if rows.is_empty()
            && let Some(first) = from
        {
            rows = tied_rows(&mut connection, first).await?;
        }
        let Some(row) = rows.pop_front() else { break };
        let id: i64 = row.try_get("id")?;
        from = id.checked_add(1);
        if id != last + 1 {
            verdict.found(format!("row {} is missing: after row {last} comes row {id}", last + 1));
        }
        verdict.rows += 1;
        last = id;
        let tied: Option<Vec<u8>> = row.try_get("link")?;
        let tied = tied.and_then(|hash| <[u8; 32]>::try_from(hash).ok());
        let expected = match AuditRow::read(&row) {
            Ok(row) => Some(link(&before, &row)),
            Err(StoreError::Damaged { found }) => {
                verdict.found(found);
                None
            }
            Err(error) => return Err(error),
        };
        match (tied, expected) {
            (Some(tied), Some(expected)) if tied != expected => {
                verdict
                    .found(format!("row {id} is not what was written, or does not follow the row before it"));
            }
            (None, _) => verdict.found(format!("row {id} is tied to nothing: its link was removed")),
            _ => {}
        }
        // Goes on with what stands there, so that one wrong row is one finding.
        before = tied.or(expected).unwrap_or(before);
        verdict.head = Some(AuditHead { row: id, hash: before });
        for ((head, name), met) in heads.iter().zip(&mut met) {
            if head.row == id {
                *met = true;
                if head.hash != before {
                    verdict.found(format!("row {id} has another hash than {name} says"));
                }
            }
        }
    }
    for ((head, name), met) in heads.iter().zip(met) {
        if !met {
            verdict.found(format!("{name} ends at row {}, which is not there: rows were cut off", head.row));
        }
    }
    let ties: i64 = sql("select count(*) from audit_links where audit not in (select id from audit)")
        .scalar(&mut connection)
        .await?;
    if ties > 0 {
        verdict.found(format!("{ties} links have lost their row: rows were cut off"));
    }
    connection.close().await?;
    Ok(verdict)
}

/// The newest rows of the audit of this archive, oldest first, beside servers that may be running.
///
/// # Errors
/// As [`verify_audit`]; a row that is not what was written is an error here.
pub async fn read_audit(archive: &Archive, limit: u32) -> Result<Vec<AuditRow>, StoreError> {
    let mut connection = archive.reading().await?;
    let rows = sql(select::<AuditRow>("order by id desc limit ?"))
        .bind(i64::from(limit))
        .fetch_all(&mut connection)
        .await?;
    connection.close().await?;
    rows.iter().rev().map(AuditRow::read).collect()
}

/// The next rows and what ties them, from this one on.
async fn tied_rows(connection: &mut Connection, from: i64) -> Result<VecDeque<DbRow>, StoreError> {
    let rows = sql("select a.id, a.station, a.at_us, a.who, a.action, a.detail, a.crc, l.hash as link
         from audit a left join audit_links l on l.audit = a.id where a.id >= ? order by a.id limit ?")
    .bind(from)
    .bind(ROWS_AT_ONCE)
    .fetch_all(connection)
    .await?;
    Ok(rows.into())
}

/// The file with the newest head. It is written after the commit, off the loop, and may lag behind by a row when the
/// power fails: what it names must be there, what follows may be more.
#[derive(Debug)]
pub(super) struct HeadFile {
    path: PathBuf,
    written: Mutex<i64>,
}

impl HeadFile {
    pub(super) fn new(folder: &Path) -> Self {
        Self { path: folder.join(HEAD_FILE), written: Mutex::new(0) }
    }

    /// Puts this head into the file, unless a newer one was faster.
    pub(super) fn raise(&self, head: AuditHead) {
        let mut written = self.written.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if *written >= head.row {
            return;
        }
        match self.replace(head) {
            Ok(()) => *written = head.row,
            Err(error) => {
                tracing::warn!(path = %self.path.display(), %error, "The head of the audit is not noted: {error}");
            }
        }
    }

    fn replace(&self, head: AuditHead) -> io::Result<()> {
        let temporary = self.path.with_extension("new");
        let mut file =
            OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(&temporary)?;
        writeln!(file, "{head}")?;
        std::fs::rename(&temporary, &self.path)
    }

    fn read(&self) -> Result<Option<AuditHead>, String> {
        let mut text = String::new();
        match std::fs::File::open(&self.path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error.to_string()),
            Ok(file) => {
                file.take(HEAD_BYTES_MAX).read_to_string(&mut text).map_err(|error| error.to_string())?
            }
        };
        text.parse().map(Some).map_err(str::to_owned)
    }
}
