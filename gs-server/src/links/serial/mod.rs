//! The module on a serial port, or on a pseudo-terminal.
//!
//! Two threads own the port: one reads, one writes, drains, sets lines and looks at AUX. No flow control, exclusive,
//! flushed when opened. The port counts as gone when a read says so (`EIO`, `ENXIO`, a broken pipe, end of file), when
//! its path disappears or leads elsewhere, or when a thread hangs in the driver.

mod find;
mod lines;
mod threads;

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use serialport::{ClearBuffer, FlowControl, SerialPort as _};

use super::driven::drives_lines;
use super::port::{Connector, Port, PortContext};
use crate::config::{AuxInput, LinkSection, UsbId, driver_config};

pub use find::port_names;
pub(crate) use find::ports;

/// How long a read waits before the thread looks whether the port is still there.
const READ_WAIT: Duration = Duration::from_millis(100);

#[derive(Debug, Clone)]
pub(crate) struct Serial {
    wanted: Wanted,
    baud: u32,
    aux: AuxInput,
    aux_inverted: bool,
    lines: bool,
    threads: Threads,
}

#[derive(Debug, Clone)]
enum Wanted {
    Usb(UsbId),
    Path(String),
}

impl Serial {
    pub(crate) fn new(section: &LinkSection) -> Self {
        let wanted = match &section.usb {
            Some(usb) => Wanted::Usb(usb.clone()),
            None => Wanted::Path(section.port.clone().unwrap_or_default()),
        };
        Self {
            wanted,
            baud: section.baud,
            aux: section.aux(),
            aux_inverted: section.aux_inverted,
            lines: drives_lines(driver_config(section).mode_pins),
            threads: Threads::default(),
        }
    }

    fn open(&self, context: PortContext) -> Result<Box<dyn Port>, String> {
        // A port is exclusive also against our own threads that have not let go of it yet.
        self.threads.wait_until_gone();
        let path = match &self.wanted {
            Wanted::Usb(usb) => find::usb(usb)?,
            Wanted::Path(path) => find::path(path)?,
        };
        let real =
            std::fs::canonicalize(&path).map_err(|error| format!("{path} cannot be found: {error}"))?;
        let port = serialport::new(&path, self.baud)
            .timeout(READ_WAIT)
            .flow_control(FlowControl::None)
            .open_native()
            .map_err(|error| find::cannot_open(&path, &error))?;
        // Bytes that came before we did are nobody's. On a counted wire they are thrown away by number instead.
        if context.wire.is_none() {
            port.clear(ClearBuffer::All).map_err(|error| format!("{path} cannot be flushed: {error}"))?;
        }
        let port = threads::start(port, threads::Place { path, real }, self, context)
            .map_err(|error| format!("no thread for the port: {error}"))?;
        Ok(Box::new(port))
    }
}

impl Connector for Serial {
    fn connect(
        &self,
        context: PortContext,
    ) -> impl Future<Output = Result<Box<dyn Port>, String>> + Send + 'static {
        let this = self.clone();
        async move {
            match tokio::task::spawn_blocking(move || this.open(context)).await {
                Ok(result) => result,
                Err(error) => Err(format!("opening the port failed: {error}")),
            }
        }
    }

    fn has_lines(&self) -> bool {
        self.lines
    }
}

/// The threads that hold the port open.
#[derive(Debug, Clone, Default)]
struct Threads(Arc<(Mutex<usize>, Condvar)>);

impl Threads {
    fn enter(&self) -> ThreadMark {
        *self.0.0.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        ThreadMark(self.clone())
    }

    /// Waits for a second at most; a thread that hangs in the driver may never let go.
    fn wait_until_gone(&self) {
        let count = self.0.0.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.0.1.wait_timeout_while(count, Duration::from_secs(1), |count| *count > 0);
        drop(waited);
    }
}

/// Held by a thread while it holds the port.
struct ThreadMark(Threads);

impl Drop for ThreadMark {
    fn drop(&mut self) {
        let (count, changed) = &*self.0.0;
        *count.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        changed.notify_all();
    }
}
