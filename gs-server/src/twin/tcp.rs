//! The twin's end as a TCP listener: bytes as on the wire, like a serial server in raw mode.

use std::io;
use std::net::SocketAddr;

use tokio::net::{TcpListener, TcpStream};

use super::{Heard, TwinError};

/// A listener and at most one connection. Further ones are closed at once: a serial port has one owner.
#[derive(Debug)]
pub struct TcpEnd {
    listener: TcpListener,
    ground: Option<(TcpStream, SocketAddr)>,
}

impl TcpEnd {
    /// Takes over a listener.
    pub fn new(listener: TcpListener) -> Self {
        Self { listener, ground: None }
    }

    /// Where it listens.
    ///
    /// # Errors
    /// [`TwinError::Listen`] when the socket does not tell.
    pub fn address(&self) -> Result<SocketAddr, TwinError> {
        self.listener.local_addr().map_err(TwinError::Listen)
    }

    pub(super) async fn read(&mut self, buffer: &mut [u8]) -> Result<Heard, TwinError> {
        loop {
            let Some((stream, peer)) = &self.ground else {
                self.accept().await?;
                continue;
            };
            let outcome = tokio::select! {
                readable = stream.readable() => readable.and_then(|()| stream.try_read(buffer)),
                other = self.listener.accept() => {
                    if let Ok((_, other)) = other {
                        tracing::warn!(%other, %peer, "{other} wants to connect and is closed: {peer} has the port");
                    }
                    continue;
                }
            };
            match outcome {
                Ok(len) if len > 0 => return Ok(Heard::Bytes(len)),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Ok(_) | Err(_) => {
                    tracing::info!(%peer, "{peer} is gone");
                    self.ground = None;
                    return Ok(Heard::Gone);
                }
            }
        }
    }

    async fn accept(&mut self) -> Result<(), TwinError> {
        match self.listener.accept().await {
            Ok((stream, peer)) => {
                tracing::info!(%peer, "{peer} is connected");
                // Frames are short and timing is the point; where it cannot be set, all still works.
                if let Err(error) = stream.set_nodelay(true) {
                    tracing::debug!(%error, "TCP_NODELAY is refused: {error}");
                }
                self.ground = Some((stream, peer));
                Ok(())
            }
            // Those errors are of one connection, not of the listener.
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::ConnectionAborted
                        | io::ErrorKind::ConnectionReset
                        | io::ErrorKind::Interrupted
                ) =>
            {
                Ok(())
            }
            Err(error) => Err(TwinError::Listen(error)),
        }
    }

    pub(super) fn is_present(&self) -> bool {
        self.ground.is_some()
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> usize {
        let Some((stream, _)) = &self.ground else { return 0 };
        let mut sent = 0;
        while sent < bytes.len() {
            match stream.try_write(&bytes[sent..]) {
                Ok(len) if len > 0 => sent += len,
                // Full: an adapter's buffer overruns as well. Broken: the next read tells.
                _ => break,
            }
        }
        sent
    }
}
