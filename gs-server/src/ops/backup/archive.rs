//! The tar file: members are hashed while they are written and while they are read.

use std::fs::File;
use std::io::{self, BufReader, Read, Write as _};
use std::path::Path;

use sha2::{Digest as _, Sha256};

use super::{BackupError, CONFIGURATION, FORMAT, MANIFEST, Manifest, Member, TEXT_MAX, failed, own_file};
use crate::storage::DATABASE;

/// Members that a backup may have: one per key and three more. Beyond it, it is none of ours.
const MEMBERS_MAX: usize = 256;

/// A backup that is being written.
pub(super) struct Writer {
    tar: tar::Builder<File>,
    /// Seconds since 1970, for each member.
    at_s: u64,
    members: Vec<Member>,
}

impl Writer {
    pub(super) fn new(file: File, at_s: u64) -> Self {
        Self { tar: tar::Builder::new(file), at_s, members: Vec::new() }
    }

    pub(super) fn add_file(&mut self, name: &str, path: &Path) -> io::Result<()> {
        let file = File::open(path)?;
        let bytes = file.metadata()?.len();
        // What grows meanwhile is cut at the size that was announced; what shrinks is an error.
        self.add(name, bytes, BufReader::with_capacity(1 << 16, file).take(bytes))
    }

    pub(super) fn add_bytes(&mut self, name: &str, content: &[u8]) -> io::Result<()> {
        self.add(name, content.len() as u64, content)
    }

    fn add(&mut self, name: &str, bytes: u64, content: impl Read) -> io::Result<()> {
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes);
        header.set_mode(0o600);
        header.set_mtime(self.at_s);
        header.set_entry_type(tar::EntryType::Regular);
        let mut hashing = Hashing { inner: content, hash: Sha256::new(), bytes: 0 };
        self.tar.append_data(&mut header, name, &mut hashing)?;
        if hashing.bytes != bytes {
            return Err(io::Error::other(format!("{name} became shorter while it was read")));
        }
        self.members.push(Member { name: name.to_owned(), bytes, sha256: hashing.digest() });
        Ok(())
    }

    /// Writes the manifest, and makes everything durable.
    pub(super) fn finish(mut self, describe: impl FnOnce(Vec<Member>) -> Manifest) -> io::Result<Manifest> {
        let manifest = describe(std::mem::take(&mut self.members));
        let mut text = serde_json::to_vec_pretty(&manifest)?;
        text.push(b'\n');
        self.add_bytes(MANIFEST, &text)?;
        self.tar.into_inner()?.sync_all()?;
        Ok(manifest)
    }
}

/// A backup that was read: what it says of itself, and its small members.
pub(super) struct Opened {
    pub(super) manifest: Manifest,
    pub(super) configuration: Option<Vec<u8>>,
    /// Names (key ids) and contents of the witnesses.
    pub(super) witness: Vec<(String, Vec<u8>)>,
}

/// Reads a backup, puts its database into a new file `database`, and holds everything against the manifest.
pub(super) fn read(path: &Path, database: &Path) -> Result<Opened, BackupError> {
    let damaged = |found: String| BackupError::Damaged { path: path.to_path_buf(), found };
    let unreadable = |error: io::Error| match error.kind() {
        io::ErrorKind::StorageFull => BackupError::Store(crate::storage::StoreError::Full),
        _ => damaged(error.to_string()),
    };
    let file = File::open(path).map_err(failed(path, "cannot be opened"))?;
    let mut tar = tar::Archive::new(BufReader::with_capacity(1 << 16, file));
    let (mut manifest, mut configuration, mut witness) = (None::<Manifest>, None, Vec::new());
    let mut members = Vec::new();
    for entry in tar.entries().map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        let name = entry.path().map_err(unreadable)?.to_string_lossy().into_owned();
        if manifest.is_some() || members.len() >= MEMBERS_MAX || !entry.header().entry_type().is_file() {
            return Err(damaged(format!("'{name}' does not belong there")));
        }
        let mut hashing = Hashing { inner: entry, hash: Sha256::new(), bytes: 0 };
        let small = |hashing: &mut Hashing<_>| -> Result<Vec<u8>, BackupError> {
            let mut content = Vec::new();
            hashing.take(TEXT_MAX + 1).read_to_end(&mut content).map_err(unreadable)?;
            match content.len() as u64 {
                ..=TEXT_MAX => Ok(content),
                _ => Err(damaged(format!("'{name}' is longer than {TEXT_MAX} bytes"))),
            }
        };
        match name.as_str() {
            DATABASE => {
                let mut out = own_file(database).map_err(failed(database, "cannot be written"))?;
                io::copy(&mut hashing, &mut out).map_err(unreadable)?;
                out.flush().and_then(|()| out.sync_all()).map_err(failed(database, "cannot be written"))?;
            }
            CONFIGURATION => configuration = Some(small(&mut hashing)?),
            MANIFEST => {
                let text = small(&mut hashing)?;
                manifest = Some(serde_json::from_slice(&text).map_err(|error| damaged(error.to_string()))?);
                continue;
            }
            _ => match name.strip_prefix("witness/").filter(|id| id.parse::<protocol::KeyId>().is_ok()) {
                Some(id) => witness.push((id.to_owned(), small(&mut hashing)?)),
                None => return Err(damaged(format!("'{name}' does not belong there"))),
            },
        }
        members.push(Member { bytes: hashing.bytes, sha256: hashing.digest(), name });
    }
    let manifest = manifest.ok_or_else(|| damaged("it ends before its manifest".to_owned()))?;
    if manifest.format != FORMAT {
        return Err(damaged(format!("its form is '{}', this program knows {FORMAT}", manifest.format)));
    }
    if let Some(other) = manifest.files.iter().find(|member| !members.contains(member)) {
        return Err(damaged(format!("'{}' is not what was written", other.name)));
    }
    if manifest.files.len() != members.len() || !members.iter().any(|member| member.name == DATABASE) {
        return Err(damaged("its manifest names other files than it has".to_owned()));
    }
    Ok(Opened { manifest, configuration, witness })
}

struct Hashing<R> {
    inner: R,
    hash: Sha256,
    bytes: u64,
}

impl<R> Hashing<R> {
    fn digest(self) -> String {
        hex::encode(self.hash.finalize())
    }
}

impl<R: Read> Read for Hashing<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.hash.update(&buffer[..count]);
        self.bytes += count as u64;
        Ok(count)
    }
}
