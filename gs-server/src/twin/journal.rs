//! The twin's journal as a file: replayed at the start, appended to, on disk before anything follows.

use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, flock};
use satellite::{JournalEntry, StateChange, TwinState};

use super::TwinError;

/// An open journal. One process has it at a time.
#[derive(Debug)]
pub struct JournalFile {
    file: File,
    path: PathBuf,
}

/// What a journal told when it was opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replayed {
    /// The satellite's permanent memory.
    pub state: TwinState,
    /// True time when the twin's scale was 0, in microseconds since 1970; `None` in an empty journal.
    pub utc_at_zero_us: Option<i64>,
    /// The latest time on that scale, in microseconds.
    pub last_us: u64,
}

impl JournalFile {
    /// Opens or makes it, and rebuilds the satellite's memory from it. A line cut short by a crash is cut off.
    ///
    /// # Errors
    /// [`TwinError`] when it is in use, cannot be read, or is damaged elsewhere than at its end.
    pub fn open(path: &Path) -> Result<(Self, Replayed), TwinError> {
        let fail = |source| TwinError::Journal { path: path.into(), source };
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(path)
            .map_err(fail)?;
        flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(|_| TwinError::InUse(path.into()))?;
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(fail)?;
        let whole = text.rfind('\n').map_or(0, |at| at + 1);
        text.truncate(whole);
        file.set_len(whole as u64).map_err(fail)?;
        file.seek(SeekFrom::End(0)).map_err(fail)?;

        let damaged = |source| TwinError::Damaged { path: path.into(), source };
        let state = TwinState::from_journal(&text).map_err(damaged)?;
        let mut replayed = Replayed { state, utc_at_zero_us: None, last_us: 0 };
        for line in text.lines().filter(|line| !line.trim().is_empty()) {
            let entry = JournalEntry::parse_line(line).map_err(damaged)?;
            replayed.last_us = replayed.last_us.max(entry.at_us());
            if let (JournalEntry::Stored { at_us, change: StateChange::Boot { utc_ms, .. } }, None) =
                (&entry, replayed.utc_at_zero_us)
            {
                replayed.utc_at_zero_us = Some((utc_ms * 1000).cast_signed() - at_us.cast_signed());
            }
        }
        Ok((Self { file, path: path.into() }, replayed))
    }

    /// Writes one entry. What the satellite stored is on disk when this returns; the rest is with the kernel, which is
    /// enough to survive the end of this process.
    ///
    /// # Errors
    /// [`TwinError::Journal`]; nothing more may be taken from the satellite then.
    pub fn append(&mut self, entry: &JournalEntry) -> Result<(), TwinError> {
        let mut line = entry.to_line();
        line.push('\n');
        self.write(&line, matches!(entry, JournalEntry::Stored { .. }))
            .map_err(|source| TwinError::Journal { path: self.path.clone(), source })
    }

    fn write(&mut self, line: &str, is_stored: bool) -> io::Result<()> {
        self.file.write_all(line.as_bytes())?;
        if is_stored { self.file.sync_data() } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{Counter, Nonce};

    fn stored(at_us: u64, change: StateChange) -> JournalEntry {
        JournalEntry::Stored { at_us, change }
    }

    #[test]
    fn counters_and_time_survive_a_torn_write() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("twin.journal");
        let (mut journal, empty) = JournalFile::open(&path).unwrap();
        assert_eq!((empty.state, empty.utc_at_zero_us, empty.last_us), (TwinState::default(), None, 0));
        assert!(matches!(JournalFile::open(&path), Err(TwinError::InUse(_))));
        journal.append(&stored(2_000, StateChange::Boot { boots: 1, utc_ms: 1_000_002 })).unwrap();
        journal.append(&stored(7_000, StateChange::Nonce(Nonce::new(Counter(77), [1; 4])))).unwrap();
        journal.file.write_all(b"9000 stored what=boot bo").unwrap();
        drop(journal);

        let (mut journal, replayed) = JournalFile::open(&path).unwrap();
        assert_eq!(replayed.state.nonces.highest(), Some(Counter(77)));
        assert_eq!((replayed.utc_at_zero_us, replayed.last_us), (Some(1_000_000_000), 7_000));
        journal.append(&stored(9_000, StateChange::Elements)).unwrap();
        drop(journal);
        assert!(JournalFile::open(&path).unwrap().1.state.elements);

        std::fs::write(&path, "soup\n").unwrap();
        assert!(matches!(JournalFile::open(&path), Err(TwinError::Damaged { .. })));
    }
}
