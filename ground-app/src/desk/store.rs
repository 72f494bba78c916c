//! The desk's file: written whole or not at all.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::Desk;

/// Changes are written down after this long at most.
const SOON: Duration = Duration::from_secs(1);

/// Where the desk is kept.
#[derive(Debug)]
pub struct DeskFile {
    path: PathBuf,
    written: String,
    looked_at: Option<Instant>,
    /// Why the last change could not be written; `None`: it was.
    failure: Option<String>,
}

/// Why a desk could not be read.
#[derive(Debug, thiserror::Error)]
pub enum DeskFileError {
    /// It is there, but cannot be read.
    #[error("{path}: {source}; move it away to begin with a fresh desk", path = .path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl DeskFile {
    /// Reads the desk; a file that is none is kept aside as `.unreadable`, and the desk is a fresh one: what was wrong is
    /// the second value.
    ///
    /// # Errors
    /// [`DeskFileError`] when the file cannot be read at all.
    pub fn open(path: &Path) -> Result<(Self, Desk, Option<String>), DeskFileError> {
        let io = |source| DeskFileError::Io { path: path.to_owned(), source };
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(io(error)),
        };
        let file = Self { path: path.to_owned(), written: text.clone(), looked_at: None, failure: None };
        if text.is_empty() {
            return Ok((file, Desk::default(), None));
        }
        match serde_json::from_str(&text) {
            Ok(desk) => Ok((file, desk, None)),
            Err(error) => {
                let aside = path.with_extension("unreadable");
                std::fs::rename(path, &aside).map_err(io)?;
                let told = format!("{}: {error}; it is kept as {}", path.display(), aside.display());
                Ok((Self { written: String::new(), ..file }, Desk::default(), Some(told)))
            }
        }
    }

    /// Writes the desk down if it changed and a second has passed; `at_once` does not wait.
    pub fn keep(&mut self, desk: &Desk, now: Instant, at_once: bool) {
        if !at_once && self.looked_at.is_some_and(|at| now.saturating_duration_since(at) < SOON) {
            return;
        }
        self.looked_at = Some(now);
        let text = match serde_json::to_string(desk) {
            Ok(text) => text,
            Err(error) => return self.failure = Some(error.to_string()),
        };
        if text == self.written {
            return;
        }
        match write(&self.path, &text) {
            Ok(()) => (self.written, self.failure) = (text, None),
            Err(error) => self.failure = Some(format!("{}: {error}", self.path.display())),
        }
    }

    /// Why the last change could not be written.
    #[must_use]
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }
}

fn write(path: &Path, text: &str) -> std::io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let new = path.with_extension("new");
    let mut file = std::fs::File::create(&new)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    std::fs::rename(&new, path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::desk::Layout;

    #[test]
    fn a_desk_comes_back_and_a_broken_one_is_kept_aside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/desk.json");
        let (mut file, mut desk, _) = DeskFile::open(&path).unwrap();
        desk.layout = Layout::Images;
        let (place, tree) = (desk.place(), desk.take_tree());
        desk.put_tree(place, tree);
        file.keep(&desk, crate::clock::instant(), false);
        assert_eq!(file.failure(), None);
        let (_, again, told) = DeskFile::open(&path).unwrap();
        assert_eq!((again.layout, again.trees.len(), told), (Layout::Images, 1, None));
        std::fs::write(&path, "{").unwrap();
        let (_, fresh, told) = DeskFile::open(&path).unwrap();
        assert_eq!(fresh.layout, Layout::Pass);
        assert!(told.unwrap().contains("unreadable"));
        assert!(path.with_extension("unreadable").exists());
    }
}
