//! What the operating system knows of this process and of the disk. Everything may be unknown.

use std::path::Path;

/// This process.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Process {
    /// Memory that it really holds, bytes.
    pub resident_bytes: Option<u64>,
    /// Open files, sockets and the like.
    pub open_files: Option<u64>,
    /// How many it may open.
    pub open_files_max: Option<u64>,
    /// Processor time since its start, milliseconds.
    pub cpu_ms: Option<u64>,
    /// Threads.
    pub threads: Option<u64>,
}

impl Process {
    /// Looks.
    #[must_use]
    pub fn look() -> Self {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let field = |name: &str| -> Option<u64> {
            status.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
        };
        Self {
            resident_bytes: field("VmRSS:").map(|kib| kib * 1024),
            threads: field("Threads:"),
            open_files: std::fs::read_dir("/proc/self/fd").ok().map(|entries| entries.count() as u64),
            open_files_max: rustix::process::getrlimit(rustix::process::Resource::Nofile).current,
            cpu_ms: cpu_ms(),
        }
    }
}

/// Fields 14 and 15 of proc(5), in ticks of 10 ms.
fn cpu_ms() -> Option<u64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let (_, after_name) = stat.rsplit_once(')')?;
    let mut fields = after_name.split_whitespace().skip(11);
    let user: u64 = fields.next()?.parse().ok()?;
    let system: u64 = fields.next()?.parse().ok()?;
    Some(10 * (user + system))
}

/// A data folder and its disk.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Folder {
    /// What this user may still write, bytes.
    pub free_bytes: Option<u64>,
    /// The whole disk.
    pub disk_bytes: Option<u64>,
    /// The database.
    pub database_bytes: Option<u64>,
    /// Its write-ahead log.
    pub log_bytes: Option<u64>,
}

impl Folder {
    /// Looks. May wait for the disk.
    #[must_use]
    pub fn look(folder: &Path) -> Self {
        let size = |name: &str| folder.join(name).metadata().ok().map(|meta| meta.len());
        let disk = rustix::fs::statvfs(folder).ok();
        let log = size(&format!("{}-wal", crate::storage::DATABASE));
        Self {
            free_bytes: disk.as_ref().map(|disk| disk.f_bavail.saturating_mul(disk.f_frsize)),
            disk_bytes: disk.as_ref().map(|disk| disk.f_blocks.saturating_mul(disk.f_frsize)),
            database_bytes: size(crate::storage::DATABASE),
            log_bytes: log.or(Some(0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_has_memory_files_and_a_disk() {
        let process = Process::look();
        assert!(process.resident_bytes > Some(1 << 20) && process.open_files > Some(2), "{process:?}");
        let folder = tempfile::tempdir().unwrap();
        let found = Folder::look(folder.path());
        assert!(found.free_bytes <= found.disk_bytes && found.disk_bytes > Some(0), "{found:?}");
        assert_eq!((found.database_bytes, found.log_bytes), (None, Some(0)));
    }
}
