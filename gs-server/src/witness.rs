//! The witness: the highest counter of each key, kept outside the database.
//!
//! A database that is put back from a backup has forgotten counters that were radiated since, and a nonce that is
//! used twice gives the key away. The witness remembers: the database commits, then the witness is raised, then the
//! frame goes out. At the start the engine compares the two (see `mission::snapshot::KeySnapshot`).
//!
//! One file per key, `witness/<key id>`, one line of text with a checksum. It is replaced as a whole: a temporary file
//! is written and synced, renamed over the old one, and the folder is synced. Whatever happens in between, the old line
//! or the new one stands there.
//!
//! A folder that came out of a backup holds the file `restored` besides. A key without a witness of its own is then
//! [`Witness::Restored`]: nothing is sealed until an operator has confirmed, which gives the key a witness again. What the
//! backup knew of the counter stands in `<key id>.restored`.
//!
//! What it does **not** do: decide whether sealing may go on, or lower a counter.

use std::collections::BTreeMap;
use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use mission::snapshot::Witness;
use protocol::{Counter, KeyId};

/// First word of a witness: what it is, and the version of its form.
const MARK: &str = "pixelsat-witness-1";

/// Marks a folder that came out of a backup.
const RESTORED: &str = "restored";

/// More than any witness has; what is longer is none.
const MOST_BYTES: u64 = 256;

/// The folder with one witness per key.
#[derive(Debug, Clone)]
pub struct WitnessFolder {
    path: PathBuf,
}

impl WitnessFolder {
    /// Opens the folder, and makes it (mode 0700) when there is none.
    ///
    /// # Errors
    /// What the system says when it cannot be made.
    pub fn open(path: &Path) -> io::Result<Self> {
        if !path.is_dir() {
            DirBuilder::new().recursive(true).mode(0o700).create(path)?;
            if let Some(parent) = path.parent() {
                Disk.sync_folder(parent)?;
            }
        }
        Ok(Self { path: path.to_path_buf() })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The witness of this key.
    pub fn file(&self, key: KeyId) -> PathBuf {
        self.path.join(key.to_string())
    }

    /// What the witness of this key says. A temporary file that was left behind says nothing.
    pub fn read(&self, key: KeyId) -> Witness {
        match read(&self.file(key), key) {
            Witness::Missing if self.path.join(RESTORED).exists() => {
                match read(&self.path.join(key.to_string()).with_extension(RESTORED), key) {
                    Witness::At(counter) | Witness::Restored(Some(counter)) => {
                        Witness::Restored(Some(counter))
                    }
                    Witness::Missing | Witness::Damaged(_) | Witness::Restored(None) => {
                        Witness::Restored(None)
                    }
                }
            }
            witness => witness,
        }
    }

    /// Every key that has a witness here, with its counter; those that cannot be read are left out.
    ///
    /// # Errors
    /// What the system says when the folder cannot be read.
    pub fn all(&self) -> io::Result<Vec<(KeyId, Counter)>> {
        let mut found = BTreeMap::new();
        for entry in std::fs::read_dir(&self.path)? {
            let name = entry?.file_name();
            let Some(key) =
                name.to_str().and_then(|name| name.split('.').next()).and_then(|name| name.parse().ok())
            else {
                continue;
            };
            if let Witness::At(counter) | Witness::Restored(Some(counter)) = self.read(key) {
                found.insert(key.to_string(), (key, counter));
            }
        }
        Ok(found.into_values().collect())
    }

    /// Marks this folder as one that came out of a backup, which knew these counters. Durable when it returns.
    ///
    /// # Errors
    /// What the system says. The mark comes last: without it the folder must not be used.
    pub fn mark_restored(&self, known: &[(KeyId, Counter)], remark: &str) -> io::Result<()> {
        let write = |name: String, text: String| {
            let path = self.path.join(name);
            let file = Disk.write(&path, text.as_bytes())?;
            Disk.sync(&path, &file)
        };
        for (key, counter) in known {
            write(format!("{key}.{RESTORED}"), line(*key, *counter))?;
        }
        write(RESTORED.to_owned(), format!("{remark}\n"))?;
        Disk.sync_folder(&self.path)
    }

    /// What stands in the file of a witness, for a backup.
    pub(crate) fn text(key: KeyId, counter: Counter) -> String {
        line(key, counter)
    }

    /// The reverse of [`Self::text`], with the name of the file; `None` when it is none.
    pub(crate) fn parse_text(name: &str, content: &[u8]) -> Option<(KeyId, Counter)> {
        let key = name.parse().ok()?;
        parse(content, key).ok().map(|counter| (key, counter))
    }

    /// Raises the witness of this key to this counter; it is on the disk when this returns. Where the witness stands
    /// higher already, it stays.
    ///
    /// # Errors
    /// What the system says; the old witness stands then, or the new one, but nothing between.
    pub fn raise(&self, key: KeyId, counter: Counter) -> io::Result<()> {
        if let Witness::At(held) = self.read(key)
            && held >= counter
        {
            return Ok(());
        }
        self.replace(&Disk, key, counter)
    }

    fn replace(&self, steps: &impl Steps, key: KeyId, counter: Counter) -> io::Result<()> {
        let path = self.file(key);
        let temporary = path.with_extension("new");
        let file = steps.write(&temporary, line(key, counter).as_bytes())?;
        steps.sync(&temporary, &file)?;
        steps.rename(&temporary, &path)?;
        steps.sync_folder(&self.path)
    }
}

fn read(path: &Path, key: KeyId) -> Witness {
    let damaged = |why: String| Witness::Damaged(format!("{}: {why}", path.display()));
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Witness::Missing,
        Err(error) => return damaged(format!("it cannot be opened ({error})")),
    };
    let mut bytes = Vec::new();
    if let Err(error) = file.take(MOST_BYTES + 1).read_to_end(&mut bytes) {
        return damaged(format!("it cannot be read ({error})"));
    }
    match parse(&bytes, key) {
        Ok(counter) => Witness::At(counter),
        Err(why) => damaged(why),
    }
}

fn line(key: KeyId, counter: Counter) -> String {
    let text = format!("{MARK} key={key} counter={counter}");
    let checksum = protocol::crc32(text.as_bytes());
    format!("{text} crc={checksum:08x}\n")
}

fn parse(bytes: &[u8], key: KeyId) -> Result<Counter, String> {
    let malformed = || "it is not one line as this program writes it".to_owned();
    let text = std::str::from_utf8(bytes).map_err(|_| malformed())?;
    let fields = text.strip_suffix('\n').and_then(|text| text.strip_prefix(MARK)).ok_or_else(malformed)?;
    let mut words = fields.split(' ').skip(1);
    let mut word = |name: &str| words.next().and_then(|word| word.strip_prefix(name)).ok_or_else(malformed);
    let named = word("key=")?;
    let counter = Counter(word("counter=")?.parse().map_err(|_| malformed())?);
    if named != key.to_string() {
        return Err(format!("it belongs to key {named}"));
    }
    // Written again and compared whole: no second spelling of a number, and nothing behind it.
    if text != line(key, counter) {
        return Err("its checksum is wrong".to_owned());
    }
    Ok(counter)
}

/// The steps that make a file durable, in their order. A trait so that a test can watch and fail each of them.
trait Steps {
    fn write(&self, path: &Path, bytes: &[u8]) -> io::Result<File>;
    fn sync(&self, path: &Path, file: &File) -> io::Result<()>;
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    fn sync_folder(&self, path: &Path) -> io::Result<()>;
}

struct Disk;

impl Steps for Disk {
    fn write(&self, path: &Path, bytes: &[u8]) -> io::Result<File> {
        let mut file = OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(path)?;
        file.write_all(bytes)?;
        Ok(file)
    }

    fn sync(&self, _path: &Path, file: &File) -> io::Result<()> {
        file.sync_all()
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        std::fs::rename(from, to)
    }

    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        File::open(path)?.sync_all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::cell::RefCell;
    use std::os::unix::fs::PermissionsExt as _;

    fn key(byte: u8) -> KeyId {
        protocol::Key::from_bytes([byte; 16]).id()
    }

    fn folder() -> (tempfile::TempDir, WitnessFolder) {
        let parent = tempfile::tempdir().unwrap();
        let folder = WitnessFolder::open(&parent.path().join("witness")).unwrap();
        (parent, folder)
    }

    /// Does what [`Disk`] does, writes down each step, and fails at one of them.
    #[derive(Default)]
    struct Recording {
        steps: RefCell<Vec<String>>,
        fail_at: Option<usize>,
    }

    impl Recording {
        fn step(&self, what: &str, path: &Path) -> io::Result<()> {
            let mut steps = self.steps.borrow_mut();
            steps.push(format!("{what} {}", path.file_name().unwrap().to_string_lossy()));
            match self.fail_at {
                Some(at) if steps.len() > at => Err(io::Error::other("no")),
                _ => Ok(()),
            }
        }
    }

    impl Steps for Recording {
        fn write(&self, path: &Path, bytes: &[u8]) -> io::Result<File> {
            if let Err(error) = self.step("write", path) {
                let half = bytes.get(..bytes.len() / 2).unwrap();
                Disk.write(path, half)?;
                return Err(error);
            }
            Disk.write(path, bytes)
        }
        fn sync(&self, path: &Path, file: &File) -> io::Result<()> {
            self.step("sync", path)?;
            Disk.sync(path, file)
        }
        fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
            self.step("rename", from)?;
            Disk.rename(from, to)
        }
        fn sync_folder(&self, path: &Path) -> io::Result<()> {
            self.step("sync folder", path)?;
            Disk.sync_folder(path)
        }
    }

    #[test]
    fn it_is_written_synced_renamed_and_the_folder_synced_in_this_order() {
        let (_parent, folder) = folder();
        let key = key(1);
        let recording = Recording::default();
        folder.replace(&recording, key, Counter(7)).unwrap();
        let expected = [
            format!("write {key}.new"),
            format!("sync {key}.new"),
            format!("rename {key}.new"),
            "sync folder witness".to_owned(),
        ];
        assert_eq!(recording.steps.into_inner(), expected);
        assert_eq!(folder.read(key), Witness::At(Counter(7)));
    }

    #[test]
    fn a_step_that_fails_leaves_the_old_line_or_the_new_one() {
        for fail_at in 0..4 {
            let (_parent, folder) = folder();
            folder.raise(key(1), Counter(7)).unwrap();
            let failing = Recording { fail_at: Some(fail_at), ..Recording::default() };
            assert!(folder.replace(&failing, key(1), Counter(8)).is_err());
            let expected = if fail_at < 3 { Counter(7) } else { Counter(8) };
            assert_eq!(folder.read(key(1)), Witness::At(expected), "step {fail_at}");
            // What was left behind does not stand in the way.
            folder.raise(key(1), Counter(9)).unwrap();
            assert_eq!(folder.read(key(1)), Witness::At(Counter(9)));
        }
    }

    #[test]
    fn it_is_never_lowered() {
        let (_parent, folder) = folder();
        assert_eq!(folder.read(key(1)), Witness::Missing);
        folder.raise(key(1), Counter(u64::MAX)).unwrap();
        folder.raise(key(1), Counter(3)).unwrap();
        assert_eq!(folder.read(key(1)), Witness::At(Counter(u64::MAX)));
        assert_eq!(folder.read(key(2)), Witness::Missing);
    }

    #[test]
    fn a_folder_from_a_backup_says_so_until_a_key_has_a_witness_of_its_own() {
        let (_parent, folder) = folder();
        folder.raise(key(1), Counter(5)).unwrap();
        assert_eq!(folder.all().unwrap(), [(key(1), Counter(5))]);
        let (_parent, restored) = self::folder();
        restored.mark_restored(&folder.all().unwrap(), "out of a backup").unwrap();
        assert_eq!(restored.read(key(1)), Witness::Restored(Some(Counter(5))));
        assert_eq!(restored.read(key(2)), Witness::Restored(None), "a key that the backup did not know");
        assert_eq!(restored.all().unwrap(), [(key(1), Counter(5))], "a backup of the backup knows it, too");
        restored.raise(key(1), Counter(9)).unwrap();
        assert_eq!(restored.read(key(1)), Witness::At(Counter(9)));
        assert_eq!(restored.read(key(2)), Witness::Restored(None));
    }

    #[test]
    fn nobody_else_may_read_it() {
        let (_parent, folder) = folder();
        folder.raise(key(1), Counter(1)).unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(folder.path()), 0o700);
        assert_eq!(mode(&folder.file(key(1))), 0o600);
    }

    #[test]
    fn the_witness_of_another_key_is_refused() {
        let (_parent, folder) = folder();
        folder.raise(key(1), Counter(5)).unwrap();
        std::fs::rename(folder.file(key(1)), folder.file(key(2))).unwrap();
        let Witness::Damaged(why) = folder.read(key(2)) else { panic!("accepted") };
        assert!(why.contains("belongs to key"), "{why}");
    }

    #[test]
    fn a_damaged_one_can_be_raised_again() {
        let (_parent, folder) = folder();
        std::fs::write(folder.file(key(1)), "").unwrap();
        assert!(matches!(folder.read(key(1)), Witness::Damaged(_)));
        folder.raise(key(1), Counter(5)).unwrap();
        assert_eq!(folder.read(key(1)), Witness::At(Counter(5)));
    }

    proptest! {
        #[test]
        fn one_changed_byte_is_noticed(counter in any::<u64>(), at in 0usize..80, flip in 1u8..=255) {
            let written = line(key(1), Counter(counter));
            prop_assert_eq!(parse(written.as_bytes(), key(1)), Ok(Counter(counter)));
            let mut bytes = written.into_bytes();
            let at = at % bytes.len();
            bytes[at] ^= flip;
            prop_assert!(parse(&bytes, key(1)).is_err());
        }

        #[test]
        fn a_cut_line_is_noticed(counter in any::<u64>(), keep in 0usize..80) {
            let written = line(key(1), Counter(counter));
            let keep = keep % written.len();
            prop_assert!(parse(&written.as_bytes()[..keep], key(1)).is_err());
        }

        #[test]
        fn junk_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            prop_assert!(parse(&bytes, key(1)).is_err());
        }
    }
}
