//! A folder of its own for each test: configuration, key, port, data.

use std::fmt::Write as _;
use std::net::{SocketAddr, TcpListener};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU16, Ordering};

use protocol::Key;
use tempfile::TempDir;

/// A folder that goes with the test, and what a station in it is like.
#[derive(Debug)]
pub struct Folder {
    dir: TempDir,
    /// Where the server listens.
    pub address: SocketAddr,
    /// The name of the station.
    pub name: String,
    /// Simulated seconds per second; real time when `None`.
    pub speed: Option<f64>,
    /// Seconds between heartbeats, at both ends.
    pub heartbeat_s: u32,
    /// The satellite knows GetImageRanges, and the station knows that it does.
    pub ranges: bool,
    /// More keys of the station's section.
    pub station: String,
    /// More keys of the satellite's section.
    pub satellite: String,
    /// More sections.
    pub sections: String,
    /// More keys of the link's section.
    pub link: String,
    /// More keys of the storage section.
    pub storage: String,
    /// What the server logs.
    pub log: String,
}

/// The bytes of the key in each folder.
pub const KEY: [u8; 16] =
    [0xC0, 0xFF, 0xEE, 0x5E, 0xC2, 0xE7, 0x13, 0x37, 0xBA, 0xDC, 0xAB, 0x1E, 0xDE, 0xFA, 0xCE, 0xD5];

impl Default for Folder {
    fn default() -> Self {
        Self::new()
    }
}

impl Folder {
    /// A folder with a simulated key, and a station with one serial link to a module behind a pseudo-terminal.
    ///
    /// # Panics
    /// When the folder cannot be made.
    #[must_use]
    pub fn new() -> Self {
        let dir = tempfile::Builder::new().prefix("gs-e2e-").tempdir().expect("a temporary folder");
        let folder = Self {
            dir,
            address: free_address(),
            name: "bench".to_owned(),
            speed: None,
            heartbeat_s: 60,
            ranges: false,
            station: String::new(),
            satellite: String::new(),
            sections: String::new(),
            link: "mode_pins = \"software\"\n".to_owned(),
            storage: String::new(),
            log: "info".to_owned(),
        };
        folder.write_key("twin.key", &format!("{}\nsimulated\n", key_hex()), 0o600);
        folder
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.dir.path()
    }

    /// A file in it.
    #[must_use]
    pub fn file(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// The link to the pseudo-terminal.
    #[must_use]
    pub fn port(&self) -> PathBuf {
        self.file("radio")
    }

    /// The server's data folder.
    #[must_use]
    pub fn data(&self) -> PathBuf {
        self.file("data")
    }

    /// The twin's journal.
    #[must_use]
    pub fn journal(&self) -> PathBuf {
        self.file("twin.journal")
    }

    /// The key of this folder.
    #[must_use]
    pub fn key(&self) -> Key {
        Key::from_bytes(KEY)
    }

    /// Writes a key file.
    ///
    /// # Panics
    /// When it cannot be written.
    pub fn write_key(&self, name: &str, text: &str, mode: u32) {
        use std::io::Write as _;
        let path = self.file(name);
        let mut file = std::fs::OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(mode)
            .open(&path)
            .expect("a key file");
        file.write_all(text.as_bytes()).expect("a key file");
        // The process's umask must not make a test of modes weaker.
        let mode = std::os::unix::fs::PermissionsExt::from_mode(mode);
        std::fs::set_permissions(&path, mode).expect("the mode of a key file");
    }

    /// The configuration as text.
    #[must_use]
    pub fn config_text(&self) -> String {
        let Self {
            address, heartbeat_s, ranges, name, station, satellite, sections, link, storage, log, ..
        } = self;
        let port = self.port();
        let mut text = format!(
            r#"
[station]
name = "{name}"
clock = "trust"
{station}
[[satellites]]
name = "sat"
key_file = "twin.key"
heartbeat_period_s = {heartbeat_s}
ranges = {ranges}
{satellite}
[[links]]
name = "pty"
satellite = "sat"
kind = "serial"
port = "{port}"
simulated = true
aux = "absent"
armed = true
{link}
[storage]
folder = "data"
{storage}
[http]
listen = "{address}"

[log]
filter = "{log}"

{sections}"#,
            port = port.display()
        );
        if let Some(speed) = self.speed {
            // writing to a string does not fail
            let _ = write!(text, "\n[simulation]\nspeed = {speed:.3}\n");
        }
        text
    }

    /// Writes the configuration, and says where it is.
    ///
    /// # Panics
    /// When it cannot be written.
    #[must_use]
    pub fn write_config(&self) -> PathBuf {
        let path = self.file("station.toml");
        std::fs::write(&path, self.config_text()).expect("a configuration");
        path
    }

    /// Keeps the folder, for whoever looks for the reason of a failure.
    #[must_use]
    pub fn keep(self) -> PathBuf {
        self.dir.keep()
    }
}

/// [`KEY`] in hex digits.
#[must_use]
pub fn key_hex() -> String {
    KEY.iter().fold(String::new(), |mut text, byte| {
        // writing to a string does not fail
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// A port of our own below those that the kernel hands out, so that nobody's outgoing connection takes it while a
/// killed server is down.
///
/// # Panics
/// When all of them are taken.
#[must_use]
pub fn free_address() -> SocketAddr {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    (0..9_000)
        .map(|_| {
            let offset =
                NEXT.fetch_add(1, Ordering::Relaxed).wrapping_add((std::process::id() % 9_000) as u16 * 7);
            SocketAddr::from(([127, 0, 0, 1], 21_000 + offset % 9_000))
        })
        .find(|address| TcpListener::bind(address).is_ok())
        .expect("a free port")
}
