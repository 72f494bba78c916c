//! What is remembered of each source across restarts: when it was asked, what it said, what it gave.
//!
//! `elements/` in the data folder holds two files for each source: `NAME.json`, how it stands, and `NAME.txt`, its last
//! good answer as it came. NAME is the beginning of the SHA-256 of the address. Both are replaced as a whole (temporary
//! file, sync, rename, sync of the folder), and **before** a request goes out it is written down that it does: a server
//! that is killed and started again and again asks no source twice.

use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use mission::UtcUs;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

/// Bytes that a source may answer.
pub(super) const BODY_MAX: usize = 10 << 20;
/// What is longer is no state.
const STATE_MAX: u64 = 64 << 10;

/// How it stands with one source; microseconds since 1970.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct State {
    /// Whose state it is.
    pub(crate) url: String,
    /// When it was last asked: written before the request goes out.
    pub(crate) asked_at_us: Option<i64>,
    /// When it last gave elements.
    pub(crate) downloaded_at_us: Option<i64>,
    /// When it was last tried in vain; `None` after a success.
    pub(crate) failed_at_us: Option<i64>,
    /// Attempts in vain one after the other.
    #[serde(default)]
    pub(crate) failures: u32,
    /// It must not be asked again until an operator says so.
    #[serde(default)]
    pub(crate) stopped: bool,
    /// What it said last, with the remedy.
    pub(crate) detail: Option<String>,
}

/// The folder with the memory of all sources.
#[derive(Debug, Clone)]
pub(crate) struct Memory {
    folder: PathBuf,
}

impl Memory {
    /// Opens the folder, and makes it (mode 0700) when there is none.
    pub(crate) fn open(data: &Path) -> io::Result<Self> {
        let folder = data.join("elements");
        if !folder.is_dir() {
            DirBuilder::new().recursive(true).mode(0o700).create(&folder)?;
            sync_folder(data)?;
        }
        Ok(Self { folder })
    }

    fn file(&self, url: &str, ending: &str) -> PathBuf {
        let digest = Sha256::digest(url.as_bytes());
        let name: String = digest.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        self.folder.join(format!("{name}.{ending}"))
    }

    /// What is known of a source. A state that cannot be read counts as a request made now: rather an hour too late than
    /// once too often.
    pub(crate) fn state(&self, url: &str, now: UtcUs) -> State {
        let path = self.file(url, "json");
        let read = match read_at_most(&path, STATE_MAX) {
            Ok(None) => return State { url: url.to_owned(), ..State::default() },
            Ok(Some(bytes)) => serde_json::from_slice::<State>(&bytes).map_err(|error| error.to_string()),
            Err(error) => Err(error.to_string()),
        };
        match read {
            // A request from the future: the clock was wrong then, or is now. Counted from now on, it heals by itself.
            Ok(state) if state.url == url => {
                let early = |at: &mut Option<i64>| *at = at.map(|at| at.min(now.0));
                let mut state = state;
                let from_the_future = state.asked_at_us.is_some_and(|at| at > now.0);
                early(&mut state.asked_at_us);
                early(&mut state.downloaded_at_us);
                early(&mut state.failed_at_us);
                if from_the_future {
                    self.keep(&state);
                }
                state
            }
            other => {
                let why = other.map_or_else(|error| error, |_| "it is of another address".to_owned());
                tracing::warn!(
                    url,
                    "what {} says of {url} is lost ({why}): it counts as asked now",
                    path.display()
                );
                let state = State { url: url.to_owned(), asked_at_us: Some(now.0), ..State::default() };
                self.keep(&state);
                state
            }
        }
    }

    /// Writes it down, or says why not.
    fn keep(&self, state: &State) {
        if let Err(error) = self.write_state(state) {
            tracing::warn!(%error, "what is known of {} cannot be written down: {error}", state.url);
        }
    }

    /// On the disk when this returns.
    pub(crate) fn write_state(&self, state: &State) -> io::Result<()> {
        let mut text = serde_json::to_vec_pretty(state).map_err(io::Error::other)?;
        text.push(b'\n');
        self.replace(&self.file(&state.url, "json"), &text)
    }

    /// The last good answer of a source.
    pub(crate) fn body(&self, url: &str) -> io::Result<Option<Vec<u8>>> {
        read_at_most(&self.file(url, "txt"), BODY_MAX as u64)
    }

    /// Keeps a good answer; on the disk when this returns.
    pub(crate) fn write_body(&self, url: &str, body: &[u8]) -> io::Result<()> {
        self.replace(&self.file(url, "txt"), body)
    }

    fn replace(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        let temporary = PathBuf::from(format!("{}.new", path.display()));
        let mut file =
            OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        std::fs::rename(&temporary, path)?;
        sync_folder(&self.folder)
    }
}

fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

fn read_at_most(path: &Path, most: u64) -> io::Result<Option<Vec<u8>>> {
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::new(io::ErrorKind::InvalidData, format!("longer than {most} bytes")));
    }
    Ok(Some(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    const URL: &str = "https://example.org/gp?GROUP=x";

    #[test]
    fn what_was_written_is_there_after_a_restart_and_belongs_to_its_address() {
        let data = tempfile::tempdir().unwrap();
        let memory = Memory::open(data.path()).unwrap();
        assert_eq!(memory.state(URL, UtcUs(5)).asked_at_us, None);
        let state = State { url: URL.into(), asked_at_us: Some(3), stopped: true, ..State::default() };
        memory.write_state(&state).unwrap();
        memory.write_body(URL, b"elements").unwrap();
        let again = Memory::open(data.path()).unwrap();
        assert_eq!(again.state(URL, UtcUs(5)), state);
        assert_eq!(again.body(URL).unwrap().as_deref(), Some(&b"elements"[..]));
        assert_eq!(again.state("https://example.org/other", UtcUs(5)).asked_at_us, None);
        assert_eq!(again.body("https://example.org/other").unwrap(), None);
    }

    #[test]
    fn a_damaged_state_and_one_from_the_future_count_as_asked_now_once_and_for_all() {
        let data = tempfile::tempdir().unwrap();
        let memory = Memory::open(data.path()).unwrap();
        std::fs::write(memory.file(URL, "json"), b"{\"url\":").unwrap();
        assert_eq!(memory.state(URL, UtcUs(7)).asked_at_us, Some(7));
        assert_eq!(memory.state(URL, UtcUs(9)).asked_at_us, Some(7), "the mended state was not written");
        let state = State { url: URL.into(), asked_at_us: Some(1000), ..State::default() };
        memory.write_state(&state).unwrap();
        assert_eq!(memory.state(URL, UtcUs(20)).asked_at_us, Some(20));
        assert_eq!(memory.state(URL, UtcUs(30)).asked_at_us, Some(20));
    }
}
