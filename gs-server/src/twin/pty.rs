//! The twin's end as a pseudo-terminal: a serial device as far as any program can tell.
//!
//! Its slave is kept closed on our side. The kernel then says when ground is gone (`EIO`, `POLLHUP`), as a pulled
//! cable would. One trace of a killed ground stays: the mark of exclusive use (`TIOCEXCL`), which outlives its owner as
//! long as the pseudo-terminal lives and which only a superuser may pass. Then a new pseudo-terminal takes its place
//! behind the same link.

use std::fs;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr};
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use super::{Heard, TwinError};
use crate::clock::wall_sleep;

/// How often we look whether somebody has opened the other side.
const LOOK_AGAIN: Duration = Duration::from_millis(5);

/// A pseudo-terminal behind a symbolic link, which goes with it.
#[derive(Debug)]
pub struct Pty {
    master: Arc<OwnedFd>,
    /// While somebody has the other side open. A hang-up would make it ready for ever.
    watch: Option<AsyncFd<Arc<OwnedFd>>>,
    device: PathBuf,
    link: PathBuf,
    /// Ground has been gone since we last looked, and its traces are wiped.
    is_clean: bool,
}

impl Pty {
    /// Makes one, and points `link` at it. A symbolic link in the place is replaced, anything else is left alone.
    /// Needs a tokio runtime.
    ///
    /// # Errors
    /// [`TwinError::Pty`], [`TwinError::Link`] or [`TwinError::Occupied`].
    pub fn open(link: &Path) -> Result<Self, TwinError> {
        match fs::symlink_metadata(link) {
            Ok(there) if !there.is_symlink() => return Err(TwinError::Occupied(link.into())),
            _ => {}
        }
        let (master, device) = make()?;
        let pty = Self { master: Arc::new(master), watch: None, device, link: link.into(), is_clean: true };
        pty.point_link()?;
        Ok(pty)
    }

    /// The device itself, e.g. `/dev/pts/5`. It may change; the link does not.
    pub fn device(&self) -> &Path {
        &self.device
    }

    /// The link that ground opens.
    pub fn link(&self) -> &Path {
        &self.link
    }

    /// Puts the link in its place in one step, so that ground never finds none.
    fn point_link(&self) -> Result<(), TwinError> {
        let mut name = self.link.file_name().unwrap_or_default().to_owned();
        name.push(format!(".{}", std::process::id()));
        let beside = self.link.with_file_name(name);
        let fail = |source| TwinError::Link { path: self.link.clone(), source };
        match fs::remove_file(&beside) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(fail(error)),
            _ => {}
        }
        symlink(&self.device, &beside).and_then(|()| fs::rename(&beside, &self.link)).map_err(fail)
    }

    pub(super) async fn read(&mut self, buffer: &mut [u8]) -> Result<Heard, TwinError> {
        loop {
            match rustix::io::read(&self.master, &mut *buffer) {
                Ok(len) if len > 0 => {
                    self.is_clean = false;
                    return Ok(Heard::Bytes(len));
                }
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => self.readable().await?,
                // Nobody has the other side open, and the kernel has no way to tell when somebody does.
                Ok(_) | Err(Errno::IO) => {
                    self.watch = None;
                    if !self.is_clean {
                        self.wipe()?;
                        return Ok(Heard::Gone);
                    }
                    wall_sleep(LOOK_AGAIN).await;
                }
                Err(error) => return Err(TwinError::Pty(error.into())),
            }
        }
    }

    async fn readable(&mut self) -> Result<(), TwinError> {
        let watch = match self.watch.take() {
            Some(watch) => watch,
            None => watch_readable(Arc::clone(&self.master)).map_err(TwinError::Pty)?,
        };
        let watch = self.watch.insert(watch);
        watch.readable().await.map_err(TwinError::Pty)?.clear_ready();
        Ok(())
    }

    /// Prepares for the next ground: no exclusive mark, no bytes of the last one, raw mode.
    fn wipe(&mut self) -> Result<(), TwinError> {
        self.is_clean = true;
        match prepare(&self.master) {
            Ok(()) => Ok(()),
            Err(Errno::BUSY) => {
                let (master, device) = make()?;
                tracing::info!(
                    device = %device.display(),
                    "the last ground was killed and left its mark on {}; {} takes its place",
                    self.device.display(),
                    device.display()
                );
                (self.master, self.device) = (Arc::new(master), device);
                self.point_link()
            }
            Err(error) => Err(TwinError::Pty(error.into())),
        }
    }

    pub(super) fn is_present(&self) -> bool {
        let mut ask = [PollFd::new(&self.master, PollFlags::empty())];
        let told = poll(&mut ask, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }));
        told.is_ok() && !ask[0].revents().contains(PollFlags::HUP)
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> usize {
        // Nobody there: a UART sends into the air. Written all the same, the bytes would wait for the next ground.
        if !self.is_present() {
            return 0;
        }
        self.is_clean = false;
        let mut sent = 0;
        while sent < bytes.len() {
            match rustix::io::write(&self.master, &bytes[sent..]) {
                Ok(len) if len > 0 => sent += len,
                Err(Errno::INTR) => {}
                // Full: an adapter's buffer overruns as well.
                _ => break,
            }
        }
        sent
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        // Only our own link: another twin may have taken the place.
        if fs::read_link(&self.link).is_ok_and(|device| device == self.device)
            && let Err(error) = fs::remove_file(&self.link)
        {
            tracing::warn!(%error, "link {} could not be removed: {error}", self.link.display());
        }
    }
}

fn make() -> Result<(OwnedFd, PathBuf), TwinError> {
    use std::os::unix::ffi::OsStringExt as _;
    let make = || -> rustix::io::Result<(OwnedFd, PathBuf)> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let device = ptsname(&master, Vec::new())?.into_bytes();
        fcntl_setfl(&master, fcntl_getfl(&master)? | OFlags::NONBLOCK)?;
        prepare(&master)?;
        Ok((master, std::ffi::OsString::from_vec(device).into()))
    };
    make().map_err(|error| TwinError::Pty(error.into()))
}

#[expect(
    deprecated,
    reason = "its successor is unsafe for types that may hand out another descriptor later; an OwnedFd does not"
)]
fn watch_readable(master: Arc<OwnedFd>) -> io::Result<AsyncFd<Arc<OwnedFd>>> {
    AsyncFd::with_interest(master, Interest::READABLE)
}

/// Opens the slave for a moment: raw, no mark, empty. From then on the kernel tells whether anybody has it open.
fn prepare(master: &OwnedFd) -> rustix::io::Result<()> {
    let slave = ioctl_tiocgptpeer(master, OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
    ioctl_tiocnxcl(&slave)?;
    let mut mode = tcgetattr(&slave)?;
    mode.make_raw();
    tcsetattr(&slave, OptionalActions::Now, &mode)?;
    tcflush(&slave, QueueSelector::IOFlush)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::within;
    use std::fs::File;
    use std::io::{Read as _, Write as _};
    use std::time::Duration;

    fn open(path: &Path) -> File {
        let file = rustix::fs::open(path, OFlags::RDWR | OFlags::NOCTTY, rustix::fs::Mode::empty()).unwrap();
        File::from(file)
    }

    async fn read(pty: &mut Pty, buffer: &mut [u8]) -> Heard {
        within(Duration::from_secs(10), pty.read(buffer)).await.expect("something happens").unwrap()
    }

    #[tokio::test]
    async fn a_ground_that_goes_is_noticed_and_the_next_one_starts_clean() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("radio");
        let mut pty = Pty::open(&link).unwrap();
        let mut buffer = [0; 64];
        assert!(!pty.is_present());
        assert_eq!(pty.write(b"into the air"), 0);

        for round in 0..3 {
            let mut ground = open(&link);
            assert!(pty.is_present());
            ground.write_all(b"\r\x03\x04hello").unwrap();
            assert_eq!(read(&mut pty, &mut buffer).await, Heard::Bytes(8), "raw, round {round}");
            assert_eq!(pty.write(b"unread"), 6);
            let mut seen = [0; 2];
            ground.read_exact(&mut seen).unwrap();
            assert_eq!(&seen, b"un");
            drop(ground);
            assert_eq!(read(&mut pty, &mut buffer).await, Heard::Gone);
            assert!(!pty.is_present());
            let quiet = within(Duration::from_millis(30), pty.read(&mut buffer)).await;
            assert!(quiet.is_none(), "no spinning, no second farewell: {quiet:?}");
        }
    }

    #[tokio::test]
    async fn the_link_goes_with_its_pty_and_spares_what_is_not_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("radio");
        let first = Pty::open(&link).unwrap();
        let second = Pty::open(&link).unwrap();
        assert_eq!(fs::read_link(&link).unwrap(), second.device());
        drop(first);
        assert_eq!(fs::read_link(&link).unwrap(), second.device());
        drop(second);
        assert!(fs::symlink_metadata(&link).is_err());
        fs::write(&link, "a file").unwrap();
        assert!(matches!(Pty::open(&link), Err(TwinError::Occupied(_))));
    }
}
