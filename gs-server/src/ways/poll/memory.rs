//! What is remembered of a source across restarts: `ears/NAME.json` in the data folder, replaced as a whole. That a request
//! goes out is written down before it does: whoever starts a server again and again asks nobody more often.

use std::collections::BTreeMap;
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use mission::UtcUs;
use serde::{Deserialize, Serialize};

/// What is longer is no state.
const STATE_MAX: u64 = 1 << 20;

/// How it stands with a source; microseconds since 1970.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct State {
    /// Requests of the last hour.
    pub(super) asked_at_us: Vec<i64>,
    /// When the last look ended.
    pub(super) looked_at_us: Option<i64>,
    /// Looks in vain one after the other.
    pub(super) failures: u32,
    /// Not before.
    pub(super) wait_until_us: Option<i64>,
    /// When it refused us, and by which token and address.
    pub(super) refused: Option<(i64, String)>,
    /// What it said last.
    pub(super) detail: Option<String>,
    /// TinyGS: the time of the newest packet that was seen, by name.
    pub(super) newest_us: BTreeMap<String, i64>,
    /// TinyGS: when something new was in the list, or its age was looked at, last.
    pub(super) fresh_at_us: Option<i64>,
    /// TinyGS: packets whose stations are asked for, the next one last, with the time before which they are not.
    pub(super) wanted: Vec<(String, i64)>,
    /// TinyGS: packets whose stations are known; the oldest first.
    pub(super) known: Vec<String>,
    /// TinyGS: requests for stations in the last half-hour.
    pub(super) details_at_us: Vec<i64>,
    /// SatNOGS: everything until then was read.
    pub(super) read_until_us: Option<i64>,
    /// SatNOGS: the next page of the look under way, and where the look ends.
    pub(super) page: Option<(String, i64)>,
}

/// The file.
#[derive(Debug, Clone)]
pub(super) struct Memory {
    folder: PathBuf,
    file: PathBuf,
}

impl Memory {
    /// Makes the folder (mode 0700) when there is none.
    pub(super) fn open(data: &Path, name: &str) -> io::Result<Self> {
        let folder = data.join("ears");
        if !folder.is_dir() {
            DirBuilder::new().recursive(true).mode(0o700).create(&folder)?;
            File::open(data)?.sync_all()?;
        }
        let file = folder.join(format!("{name}.json"));
        Ok(Self { folder, file })
    }

    /// What is known. What cannot be read counts as a look made now: rather late than once too often.
    pub(super) fn read(&self, now: UtcUs) -> State {
        let mut text = Vec::new();
        let read = match File::open(&self.file) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return State::default(),
            Err(error) => Err(error),
            Ok(file) => file.take(STATE_MAX).read_to_end(&mut text),
        };
        let parsed = read.and_then(|_| serde_json::from_slice::<State>(&text).map_err(io::Error::other));
        let mut state = parsed.unwrap_or_else(|error| {
            tracing::warn!(%error, "{} cannot be read: it counts as asked now", self.file.display());
            State { looked_at_us: Some(now.0), ..State::default() }
        });
        // From the future: the clock was wrong then, or is now. Counted from now on, it heals by itself.
        let early = |at: &mut i64| *at = (*at).min(now.0);
        state.asked_at_us.iter_mut().for_each(early);
        state.details_at_us.iter_mut().for_each(early);
        for at in [&mut state.looked_at_us, &mut state.fresh_at_us, &mut state.read_until_us] {
            at.iter_mut().for_each(early);
        }
        state.newest_us.values_mut().for_each(early);
        state.wait_until_us = state.wait_until_us.map(|at| at.min(now.0 + 24 * 3_600_000_000));
        state
    }

    /// On the disk when this returns.
    pub(super) fn write(&self, state: &State) -> io::Result<()> {
        let temporary = self.file.with_extension("json.new");
        let mut file =
            OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(&temporary)?;
        file.write_all(&serde_json::to_vec(state).map_err(io::Error::other)?)?;
        file.sync_all()?;
        std::fs::rename(&temporary, &self.file)?;
        File::open(&self.folder)?.sync_all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_kept_and_a_broken_file_counts_as_asked() {
        let (folder, now) = (tempfile::tempdir().unwrap(), UtcUs(1_790_000_000_000_000));
        let memory = Memory::open(folder.path(), "net").unwrap();
        assert_eq!(memory.read(now), State::default());
        let state = State { asked_at_us: vec![5, now.0 + 7], failures: 2, ..State::default() };
        memory.write(&state).unwrap();
        assert_eq!(memory.read(now), State { asked_at_us: vec![5, now.0], ..state });
        std::fs::write(folder.path().join("ears/net.json"), "{").unwrap();
        assert_eq!(memory.read(now).looked_at_us, Some(now.0));
    }
}
