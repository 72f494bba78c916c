//! Where ground is joined to the twin.

use super::{Pty, TcpEnd, TwinError};

/// The end at which ground speaks: what would be the serial adapter.
#[derive(Debug)]
pub enum End {
    /// A pseudo-terminal.
    Pty(Pty),
    /// A TCP connection, one at a time.
    Tcp(TcpEnd),
}

/// What came from ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Heard {
    /// This many bytes.
    Bytes(usize),
    /// Ground is gone; the next bytes may come from another.
    Gone,
}

impl End {
    /// Waits for bytes or for the end of ground. Nothing is lost when the wait is dropped.
    ///
    /// # Errors
    /// [`TwinError`] when the end itself fails, and not only ground.
    pub async fn read(&mut self, buffer: &mut [u8]) -> Result<Heard, TwinError> {
        match self {
            Self::Pty(pty) => pty.read(buffer).await,
            Self::Tcp(tcp) => tcp.read(buffer).await,
        }
    }

    /// Whether anybody listens.
    pub fn is_present(&self) -> bool {
        match self {
            Self::Pty(pty) => pty.is_present(),
            Self::Tcp(tcp) => tcp.is_present(),
        }
    }

    /// Sends bytes to ground without waiting, as a UART does: how many found room.
    pub fn write(&mut self, bytes: &[u8]) -> usize {
        match self {
            Self::Pty(pty) => pty.write(bytes),
            Self::Tcp(tcp) => tcp.write(bytes),
        }
    }
}
