//! The module behind a TCP connection: a twin, or a serial server in raw mode. Bytes as they are, no modem lines.

use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio_util::sync::{CancellationToken, DropGuard};

use super::port::{AuxWatch, Connector, Port, PortContext, PortEvent};
use crate::clock::within;
use crate::config::LinkSection;

/// Writes that may wait; the driver writes one thing at a time.
const WRITES: usize = 16;
/// A far end that does not answer in this time is not there.
const CONNECT: Duration = Duration::from_secs(5);

pub(crate) struct Tcp {
    address: String,
}

impl Tcp {
    pub(crate) fn new(section: &LinkSection) -> Self {
        Self { address: section.connect.clone().unwrap_or_default() }
    }
}

impl Connector for Tcp {
    fn connect(
        &self,
        context: PortContext,
    ) -> impl Future<Output = Result<Box<dyn Port>, String>> + Send + 'static {
        let address = self.address.clone();
        async move {
            let stream = within(CONNECT, TcpStream::connect(&address))
                .await
                .ok_or_else(|| format!("{address} does not answer"))?
                .map_err(|error| format!("{address} cannot be reached: {error}"))?;
            // Whole frames are written at once; waiting for more would only delay them.
            stream.set_nodelay(true).map_err(|error| format!("{address}: {error}"))?;
            let (mut reader, mut writer) = stream.into_split();
            let (writes, mut to_write) = mpsc::channel::<Vec<u8>>(WRITES);
            let ended = CancellationToken::new();
            let reading = context.clone();
            let token = ended.clone();
            tokio::spawn(async move {
                let mut buffer = vec![0; 4096];
                let reason = loop {
                    let count = tokio::select! {
                        () = token.cancelled() => return,
                        result = reader.read(&mut buffer) => match result {
                            Ok(0) => break "the far end closed the connection".to_owned(),
                            Ok(count) => count,
                            Err(error) => break error.to_string(),
                        },
                    };
                    let event =
                        PortEvent::Bytes { bytes: buffer[..count].to_vec(), received: reading.timer.now() };
                    if reading.events.send(reading.parcel(event)).await.is_err() {
                        return;
                    }
                };
                // Nobody listens any more when the link has closed the port itself.
                let _ = reading.events.send(reading.parcel(PortEvent::Lost { reason })).await;
            });
            tokio::spawn(async move {
                while let Some(bytes) = to_write.recv().await {
                    if let Err(error) = writer.write_all(&bytes).await {
                        let lost = PortEvent::Lost { reason: error.to_string() };
                        let _ = context.events.send(context.parcel(lost)).await;
                        return;
                    }
                }
            });
            Ok(Box::new(TcpPort { writes, _ended: ended.drop_guard() }) as Box<dyn Port>)
        }
    }

    fn has_lines(&self) -> bool {
        false
    }
}

struct TcpPort {
    writes: mpsc::Sender<Vec<u8>>,
    _ended: DropGuard,
}

impl Port for TcpPort {
    fn write(&mut self, bytes: Vec<u8>) -> Result<(), String> {
        self.writes.try_send(bytes).map_err(|_| "the far end takes no bytes".to_owned())
    }

    fn set_pins(&mut self, _m0: bool, _m1: bool) -> Result<(), String> {
        Ok(())
    }

    fn purge(&mut self) -> Result<(), String> {
        Ok(())
    }

    fn watch_aux(&mut self, _watch: AuxWatch) {}

    fn hangs(&mut self) -> Option<String> {
        None
    }
}
