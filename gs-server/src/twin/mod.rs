//! The simulated satellite behind a real port: a pseudo-terminal or a TCP listener, for any ground software.
//!
//! [`satellite::Device`] is the satellite, its channel and the ground's radio module, stepped and without I/O. In here
//! it gets a clock ([`crate::clock::Timer`]), an [`End`] through which ground speaks to it, and a [`JournalFile`]: what
//! the satellite stores is on disk before anything follows from it, so that its counters survive whatever happens to
//! this process.
//!
//! What it does **not** do: hold the port's other end open. A ground that goes away, killed or not, leaves the satellite
//! flying on; a ground that comes back finds it a while later, as in life.

mod ends;
mod journal;
mod orbit;
mod player;
mod pty;
mod tcp;

pub use ends::{End, Heard};
pub use journal::{JournalFile, Replayed};
pub use orbit::{OrbitError, orbit_from};
pub use player::{Ask, Player, View};
pub use pty::Pty;
pub use tcp::TcpEnd;

use std::io;
use std::path::PathBuf;

/// Why the twin ended, or could not begin.
#[derive(Debug, thiserror::Error)]
pub enum TwinError {
    /// No pseudo-terminal.
    #[error("no pseudo-terminal could be made")]
    Pty(#[source] io::Error),
    /// The link to the pseudo-terminal.
    #[error("link {path} to the pseudo-terminal cannot be made", path = .path.display())]
    Link {
        /// Where it should be.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// Something else is in its place.
    #[error("{path} exists and is no symbolic link; remove it, or give another place", path = .0.display())]
    Occupied(PathBuf),
    /// The port.
    #[error("the listener failed")]
    Listen(#[source] io::Error),
    /// The journal cannot be read or written.
    #[error("journal {path}", path = .path.display())]
    Journal {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The journal is not one.
    #[error("journal {path} is damaged", path = .path.display())]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// Where.
        source: satellite::JournalError,
    },
    /// Two twins would write one journal.
    #[error("journal {path} is in use by another twin", path = .0.display())]
    InUse(PathBuf),
}
