//! Key files: where the uplink key lies, and when it is refused.
//!
//! A key file is text: one line of 32 hex digits, and the line `simulated` if the key is for a twin and must never
//! reach a real radio. Lines that begin with `#` are remarks. Its mode is 0600 (or 0400, as service managers hand out
//! credentials) and it belongs to whoever runs the server: anything else is refused, with the command that mends it.
//!
//! Nothing in here prints a key, and no error quotes the content of a key file. Every buffer is wiped.

use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use protocol::{Key, KeyId};
use rustix::fs::{Mode, OFlags};
use thiserror::Error;
use zeroize::{Zeroize as _, Zeroizing};

/// Bytes in a key: AES-128.
const KEY_LEN: usize = 16;
/// Longer files are no key files. Fixed, so that no reallocation leaves a copy behind.
const FILE_MAX: usize = 1024;
/// The line that marks a key for a twin.
const SIMULATED: &str = "simulated";

/// A key and what its file says about it.
#[derive(Debug, Clone)]
pub struct KeyFile {
    /// Where it was read.
    pub path: PathBuf,
    /// The key; it never shows itself.
    pub key: Key,
    /// For a twin: real links refuse it.
    pub simulated: bool,
}

impl KeyFile {
    /// The public name of the key.
    pub fn id(&self) -> KeyId {
        self.key.id()
    }
}

/// Why a key file was refused or could not be made. `Display` names the remedy, never the content.
#[derive(Debug, Error)]
pub enum KeyError {
    /// There is none.
    #[error("key file {path} does not exist; make one with `gs-server key new {path}` (for a twin: with --simulated)", path = .0.display())]
    Missing(PathBuf),
    /// It cannot be opened or read.
    #[error("key file {path} cannot be read", path = .path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Somebody could point it elsewhere.
    #[error(
        "key file {path} is a symbolic link; give the path of the file itself",
        path = .0.display()
    )]
    SymbolicLink(PathBuf),
    /// A folder, a device, a pipe.
    #[error("key file {path} is not a regular file", path = .0.display())]
    NotAFile(PathBuf),
    /// Others may read it.
    #[error(
        "key file {path} has mode {mode:04o}, others may read it; run `chmod 600 {path}`, and if anybody could have \
         read it, make a new key",
        path = .path.display()
    )]
    Mode {
        /// Which file.
        path: PathBuf,
        /// Its permission bits.
        mode: u32,
    },
    /// It belongs to somebody else.
    #[error(
        "key file {path} belongs to user {owner}, the server runs as user {user}; run `chown {user} {path}`",
        path = .path.display()
    )]
    Owner {
        /// Which file.
        path: PathBuf,
        /// Its owner's number.
        owner: u32,
        /// Our number.
        user: u32,
    },
    /// Anybody could exchange it.
    #[error(
        "folder {folder} of the key file may be written by everybody; run `chmod o-w {folder}`",
        folder = .0.display()
    )]
    OpenFolder(PathBuf),
    /// Too long to be one.
    #[error("key file {path} is longer than {FILE_MAX} bytes: it is no key file", path = .0.display())]
    TooLong(PathBuf),
    /// No key in it.
    #[error("key file {path} holds no key; make one with `gs-server key new`", path = .0.display())]
    Empty(PathBuf),
    /// Wrong number of digits.
    #[error(
        "key file {path}, line {line}: a key has 32 hex digits (16 bytes), found {found}",
        path = .path.display()
    )]
    Length {
        /// Which file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Digits found.
        found: usize,
    },
    /// A character that is no hex digit.
    #[error("key file {path}, line {line}, column {column}: not a hex digit", path = .path.display())]
    NotHex {
        /// Which file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// Two keys in one file.
    #[error("key file {path}, line {line}: a second key; one file holds one key", path = .path.display())]
    Second {
        /// Which file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
    },
    /// A key is never overwritten.
    #[error("{path} exists already; a key is never overwritten", path = .0.display())]
    Exists(PathBuf),
    /// It cannot be written.
    #[error("key file {path} cannot be written", path = .path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// Reads a key file, after its mode, owner and kind were checked on the open file.
///
/// # Errors
/// [`KeyError`], a sentence with its remedy.
pub fn load(path: &Path) -> Result<KeyFile, KeyError> {
    let read = |source| KeyError::Read { path: path.into(), source };
    // Non-blocking, so that a pipe in the place of a key file cannot hold the start up.
    let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY;
    let mut file =
        OpenOptions::new().read(true).custom_flags(flags.bits().cast_signed()).open(path).map_err(
            |error| {
                if error.kind() == io::ErrorKind::NotFound {
                    KeyError::Missing(path.into())
                } else if error.raw_os_error() == Some(rustix::io::Errno::LOOP.raw_os_error()) {
                    KeyError::SymbolicLink(path.into())
                } else {
                    read(error)
                }
            },
        )?;
    check_file(path, &file)?;

    let mut text = Zeroizing::new(vec![0; FILE_MAX + 1]);
    let mut len = 0;
    loop {
        match file.read(&mut text[len..]) {
            Ok(0) => break,
            Ok(more) => len += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(read(error)),
        }
    }
    if len > FILE_MAX {
        return Err(KeyError::TooLong(path.into()));
    }
    parse(path, &text[..len])
}

fn check_file(path: &Path, file: &File) -> Result<(), KeyError> {
    let facts = file.metadata().map_err(|source| KeyError::Read { path: path.into(), source })?;
    if !facts.is_file() {
        return Err(KeyError::NotAFile(path.into()));
    }
    let mode = facts.mode() & 0o7777;
    if mode & !0o600 != 0 {
        return Err(KeyError::Mode { path: path.into(), mode });
    }
    let user = rustix::process::geteuid().as_raw();
    if facts.uid() != user {
        return Err(KeyError::Owner { path: path.into(), owner: facts.uid(), user });
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let folder_mode =
        folder.metadata().map_err(|source| KeyError::Read { path: path.into(), source })?.mode();
    // Everybody may write into /tmp, but its sticky bit keeps them from exchanging our files.
    if folder_mode & 0o002 != 0 && folder_mode & 0o1000 == 0 {
        return Err(KeyError::OpenFolder(folder.into()));
    }
    Ok(())
}

fn parse(path: &Path, text: &[u8]) -> Result<KeyFile, KeyError> {
    let mut key = None;
    let mut simulated = false;
    for (line, text) in (1..).zip(text.split(|&byte| byte == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }
        if text == SIMULATED.as_bytes() {
            simulated = true;
        } else if key.is_some() {
            return Err(KeyError::Second { path: path.into(), line });
        } else {
            key = Some(key_line(path, line, text)?);
        }
    }
    match key {
        Some(key) => Ok(KeyFile { path: path.into(), key, simulated }),
        None => Err(KeyError::Empty(path.into())),
    }
}

fn key_line(path: &Path, line: usize, digits: &[u8]) -> Result<Key, KeyError> {
    if let Some(at) = digits.iter().position(|byte| !byte.is_ascii_hexdigit()) {
        return Err(KeyError::NotHex { path: path.into(), line, column: at + 1 });
    }
    let mut bytes = Zeroizing::new([0; KEY_LEN]);
    hex::decode_to_slice(digits, bytes.as_mut_slice()).map_err(|_| KeyError::Length {
        path: path.into(),
        line,
        found: digits.len(),
    })?;
    Ok(Key::from_bytes(*bytes))
}

/// Writes a new key file with mode 0600, durably, and gives the id of the key. `bytes` is wiped.
///
/// # Errors
/// [`KeyError::Exists`] (also for a symbolic link that leads nowhere), or [`KeyError::Write`].
pub fn create(path: &Path, bytes: &mut [u8; KEY_LEN], simulated: bool) -> Result<KeyId, KeyError> {
    let id = key_id(bytes);
    let text = Zeroizing::new(file_text(bytes, id, simulated));
    bytes.zeroize();
    let fail = |source: io::Error| {
        if source.kind() == io::ErrorKind::AlreadyExists {
            KeyError::Exists(path.into())
        } else {
            KeyError::Write { path: path.into(), source }
        }
    };
    let mode = (Mode::RUSR | Mode::WUSR).bits();
    let mut file = OpenOptions::new().write(true).create_new(true).mode(mode).open(path).map_err(fail)?;
    let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_all());
    if let Err(source) = written {
        // Half a key is worse than none; that removing it may fail as well changes nothing of the report.
        drop(std::fs::remove_file(path));
        return Err(fail(source));
    }
    if let Some(folder) = path.parent() {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        File::open(folder).and_then(|folder| folder.sync_all()).map_err(fail)?;
    }
    Ok(id)
}

/// The id of these bytes, without keeping a key.
pub fn key_id(bytes: &[u8; KEY_LEN]) -> KeyId {
    Key::from_bytes(*bytes).id()
}

fn file_text(bytes: &[u8; KEY_LEN], id: KeyId, simulated: bool) -> String {
    // Room for all of it, so that no reallocation leaves a copy behind.
    let mut text = String::with_capacity(FILE_MAX);
    text.push_str("# uplink key ");
    text.push_str(&id.to_string());
    text.push_str(", AES-128. Whoever reads this can command the satellite.\n");
    let nibbles = bytes.iter().flat_map(|byte| [byte >> 4, byte & 15]);
    text.extend(nibbles.filter_map(|nibble| char::from_digit(nibble.into(), 16)));
    text.push('\n');
    if simulated {
        text.push_str(SIMULATED);
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{self, Permissions};
    use std::os::unix::fs::PermissionsExt as _;

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().unwrap()
    }

    fn write(folder: &tempfile::TempDir, text: &str, mode: u32) -> PathBuf {
        let path = folder.path().join("a.key");
        fs::write(&path, text).unwrap();
        fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
        path
    }

    const DIGITS: &str = "000102030405060708090a0b0c0d0e0f";

    #[test]
    fn a_new_key_is_read_back_with_its_mark_and_0600() {
        let folder = folder();
        for simulated in [false, true] {
            let path = folder.path().join(format!("{simulated}.key"));
            let mut bytes = [7; 16];
            let id = create(&path, &mut bytes, simulated).unwrap();
            assert_eq!(bytes, [0; 16], "wiped");
            let read = load(&path).unwrap();
            assert_eq!((read.id(), read.simulated), (id, simulated));
            assert_eq!(fs::metadata(&path).unwrap().mode() & 0o7777, 0o600);
            assert!(matches!(create(&path, &mut [8; 16], false), Err(KeyError::Exists(_))));
            assert_eq!(load(&path).unwrap().id(), id, "never overwritten");
        }
    }

    #[test]
    fn one_line_of_hex_is_enough() {
        let folder = folder();
        for text in [DIGITS.to_owned(), format!("{DIGITS}\r\n"), format!("# mine\n\n  {DIGITS}  \n")] {
            let read = load(&write(&folder, &text, 0o400)).unwrap();
            assert!(!read.simulated);
            assert_eq!(read.id(), Key::from_bytes(std::array::from_fn(|i| i as u8)).id());
        }
    }

    #[test]
    fn what_others_may_read_is_refused_with_its_remedy() {
        let folder = folder();
        for mode in [0o644, 0o640, 0o604, 0o700, 0o620, 0o4600] {
            let path = write(&folder, DIGITS, mode);
            let error = load(&path).unwrap_err();
            assert!(
                matches!(error, KeyError::Mode { mode: found, .. } if found == mode),
                "{mode:o}: {error}"
            );
            assert!(error.to_string().contains(&format!("chmod 600 {}", path.display())));
        }
    }

    #[test]
    fn odd_places_are_refused() {
        let folder = folder();
        let path = write(&folder, DIGITS, 0o600);
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&path, &link).unwrap();
        assert!(matches!(load(&link), Err(KeyError::SymbolicLink(_))));
        assert!(matches!(create(&link, &mut [0; 16], false), Err(KeyError::Exists(_))));
        assert!(matches!(load(folder.path()), Err(KeyError::NotAFile(_))));
        assert!(matches!(load(&folder.path().join("none")), Err(KeyError::Missing(_))));
        fs::set_permissions(folder.path(), Permissions::from_mode(0o777)).unwrap();
        assert!(matches!(load(&path), Err(KeyError::OpenFolder(_))));
        fs::set_permissions(folder.path(), Permissions::from_mode(0o1777)).unwrap();
        assert!(load(&path).is_ok());
    }

    #[test]
    fn content_that_is_no_key_is_refused_and_never_quoted() {
        let folder = folder();
        let two = format!("{DIGITS}\n{DIGITS}\n");
        let long = "# x\n".repeat(FILE_MAX);
        for (text, wanted) in [
            ("", "holds no key"),
            ("simulated\n", "holds no key"),
            ("0001020304", "found 10"),
            (&format!("{DIGITS}00"), "found 34"),
            (&format!("x{}", &DIGITS[1..]), "line 1, column 1: not a hex digit"),
            (&two, "line 2: a second key"),
            (&long, "longer than"),
        ] {
            let error = load(&write(&folder, text, 0o600)).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error}");
            assert!(!error.contains("0405060"), "{error}");
        }
    }
}
