//! A pseudo-terminal of the test's own, for tests that play the radio themselves.

use std::fs::File;
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use protocol::{Downlink, FRAME_LEN, FrameForm, down_type, encode_down};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// A pseudo-terminal behind a symbolic link; dropped, both are gone, as a pulled adapter is.
#[derive(Debug)]
pub struct Pty {
    master: File,
    link: PathBuf,
}

impl Pty {
    /// Makes one, raw, and points the link at it.
    ///
    /// # Panics
    /// When there is none to be had.
    #[must_use]
    pub fn at(link: &Path) -> Self {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let master = openpt(flags).expect("a pseudo-terminal");
        grantpt(&master).and_then(|()| unlockpt(&master)).expect("a pseudo-terminal");
        let device = ptsname(&master, Vec::new()).expect("its name").into_string().expect("its name");
        let slave = ioctl_tiocgptpeer(&master, flags).expect("its other end");
        let mut mode = tcgetattr(&slave).expect("its mode");
        mode.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &mode).expect("its mode");
        let status = fcntl_getfl(&master).expect("its flags");
        fcntl_setfl(&master, status | OFlags::NONBLOCK).expect("its flags");
        // A link that was left behind would lead elsewhere.
        let _ = std::fs::remove_file(link);
        symlink(device, link).expect("a symbolic link");
        Self { master: master.into(), link: link.to_path_buf() }
    }

    /// Writes as the radio would.
    ///
    /// # Panics
    /// When the other end takes nothing.
    pub fn write(&mut self, bytes: &[u8]) {
        self.master.write_all(bytes).expect("room in the pseudo-terminal");
    }

    /// What came from the other end since the last time.
    ///
    /// # Panics
    /// When the pseudo-terminal fails.
    pub fn read(&mut self) -> Vec<u8> {
        let mut all = Vec::new();
        let mut piece = [0; 4096];
        loop {
            match self.master.read(&mut piece) {
                Ok(0) => return all,
                Ok(count) => all.extend_from_slice(&piece[..count]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return all,
                // Nobody has the other end open.
                Err(error) if error.raw_os_error() == Some(rustix::io::Errno::IO.raw_os_error()) => {
                    return all;
                }
                Err(error) => panic!("{error}"),
            }
        }
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.link);
    }
}

/// A heartbeat as it comes down, short, with this uptime and zeros for all else.
///
/// # Panics
/// Never: the length is that of the ICD.
#[must_use]
pub fn heartbeat(uptime_ms: u32) -> Vec<u8> {
    /// ICD, section 4: where uptime stands in the payload, and how long that is.
    const UPTIME_AT: usize = 104;
    const PAYLOAD_LEN: usize = 117;
    let mut payload = [0; PAYLOAD_LEN];
    payload[UPTIME_AT..UPTIME_AT + 4].copy_from_slice(&uptime_ms.to_be_bytes());
    let packet = Downlink::decode(down_type::HEARTBEAT, &payload).expect("a heartbeat");
    let mut frame = [0; FRAME_LEN];
    let length = encode_down(&packet, None, FrameForm::Short, &mut frame);
    frame[..length].to_vec()
}
