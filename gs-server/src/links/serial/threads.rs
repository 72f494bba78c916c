//! The two threads of an open port.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

use serialport::{ClearBuffer, SerialPort as _, TTYPort};

use super::{Serial, ThreadMark, lines};
use crate::clock::BusyToken;
use crate::config::AuxInput;
use crate::links::port::{AuxWatch, EventSender, Port, PortContext, PortEvent};

/// Commands that may wait for the writing thread; more means that it hangs.
const COMMANDS: usize = 32;
/// Between two looks at AUX while the driver waits for it.
const AUX_CLOSE: Duration = Duration::from_millis(3);
/// Between two looks otherwise.
const AUX_IDLE: Duration = Duration::from_millis(50);
/// Looks, one a second, at a thread that does nothing before it counts as hung. A full frame at 1200 baud takes 2 s.
const PATIENCE: u32 = 5;

/// Where the port was found.
pub(super) struct Place {
    /// As configured, or as the adapter was found.
    pub(super) path: String,
    /// The device behind links.
    pub(super) real: PathBuf,
}

enum Command {
    Write(Vec<u8>),
    Pins { m0: bool, m1: bool },
    Purge,
    Watch(AuxWatch),
}

/// The open port, as the link's actor holds it. Dropped, it lets both threads end.
pub(super) struct OpenSerial {
    commands: SyncSender<(Command, BusyToken)>,
    closed: Arc<AtomicBool>,
    context: PortContext,
    reader: Watched,
    writer: Watched,
    /// Commands that were sent, against those that the writer has done.
    sent: u64,
    done: Arc<AtomicU64>,
}

/// A thread that shows that it lives.
struct Watched {
    beats: Arc<AtomicU64>,
    seen: u64,
    missed: u32,
}

impl Watched {
    fn new() -> Self {
        Self { beats: Arc::default(), seen: 0, missed: 0 }
    }

    /// One look; true when it has not moved for too long although it should.
    fn hangs(&mut self, should_move: bool) -> bool {
        let beats = self.beats.load(Ordering::Relaxed);
        self.missed = if beats == self.seen && should_move { self.missed + 1 } else { 0 };
        self.seen = beats;
        self.missed >= PATIENCE
    }
}

pub(super) fn start(
    port: TTYPort,
    place: Place,
    serial: &Serial,
    context: PortContext,
) -> io::Result<OpenSerial> {
    let (commands, inbox) = sync_channel(COMMANDS);
    let open = OpenSerial {
        commands,
        closed: Arc::default(),
        context: context.clone(),
        reader: Watched::new(),
        writer: Watched::new(),
        sent: 0,
        done: Arc::default(),
    };
    let reading = Reading {
        port: port.try_clone_native().map_err(io::Error::from)?,
        place,
        closed: Arc::clone(&open.closed),
        beats: Arc::clone(&open.reader.beats),
        context: context.clone(),
        _mark: serial.threads.enter(),
    };
    let writing = Writing {
        port,
        inbox,
        beats: Arc::clone(&open.writer.beats),
        done: Arc::clone(&open.done),
        context,
        aux: serial.aux,
        aux_inverted: serial.aux_inverted,
        watch: AuxWatch::Off,
        shown: None,
        _mark: serial.threads.enter(),
    };
    std::thread::Builder::new().name("serial-read".into()).spawn(move || reading.run())?;
    std::thread::Builder::new().name("serial-write".into()).spawn(move || writing.run())?;
    Ok(open)
}

impl OpenSerial {
    fn send(&mut self, command: Command) -> Result<(), String> {
        let busy = self.context.timer.busy("command on its way to the port");
        match self.commands.try_send((command, busy)) {
            Ok(()) => {
                self.sent += 1;
                Ok(())
            }
            Err(_) => Err("the port takes no more commands: its driver hangs, or it is gone".to_owned()),
        }
    }
}

impl Port for OpenSerial {
    fn write(&mut self, bytes: Vec<u8>) -> Result<(), String> {
        self.send(Command::Write(bytes))
    }

    fn set_pins(&mut self, m0: bool, m1: bool) -> Result<(), String> {
        self.send(Command::Pins { m0, m1 })
    }

    fn purge(&mut self) -> Result<(), String> {
        self.send(Command::Purge)
    }

    fn watch_aux(&mut self, watch: AuxWatch) {
        // A port that takes nothing is noticed by the next write or look.
        let _ = self.send(Command::Watch(watch));
    }

    fn hangs(&mut self) -> Option<String> {
        // A reader that waits for a place in our own queue is not hung.
        let reader_free = self.context.events.capacity() > 0;
        if self.reader.hangs(reader_free) {
            return Some("reading hangs in the port's driver".to_owned());
        }
        let owing = self.sent > self.done.load(Ordering::Relaxed);
        self.writer.hangs(owing).then(|| "writing hangs in the port's driver".to_owned())
    }
}

impl Drop for OpenSerial {
    fn drop(&mut self) {
        self.closed.store(true, Ordering::Relaxed);
    }
}

struct Reading {
    port: TTYPort,
    place: Place,
    closed: Arc<AtomicBool>,
    beats: Arc<AtomicU64>,
    context: PortContext,
    _mark: ThreadMark,
}

impl Reading {
    fn run(mut self) {
        let mut buffer = vec![0; 4096];
        let reason = loop {
            self.beats.fetch_add(1, Ordering::Relaxed);
            if self.closed.load(Ordering::Relaxed) {
                return;
            }
            match self.port.read(&mut buffer) {
                Ok(0) => break "end of file".to_owned(),
                Ok(count) => {
                    let received = self.context.timer.now();
                    let event = PortEvent::Bytes { bytes: buffer[..count].to_vec(), received };
                    if !tell(&self.context, event) {
                        return;
                    }
                }
                Err(error) if error.kind() == ErrorKind::TimedOut => {
                    if let Some(reason) = self.place.is_gone() {
                        break reason;
                    }
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => break error.to_string(),
            }
        };
        tell(&self.context, PortEvent::Lost { reason });
    }
}

impl Place {
    /// The path disappeared, or leads to another device now, though the one that we hold says nothing.
    fn is_gone(&self) -> Option<String> {
        match std::fs::canonicalize(&self.path) {
            Ok(now) if now == self.real => None,
            Ok(now) => Some(format!("{} leads to {} now", self.path, now.display())),
            Err(_) => Some(format!("{} disappeared", self.path)),
        }
    }
}

struct Writing {
    port: TTYPort,
    inbox: Receiver<(Command, BusyToken)>,
    beats: Arc<AtomicU64>,
    done: Arc<AtomicU64>,
    context: PortContext,
    aux: AuxInput,
    aux_inverted: bool,
    watch: AuxWatch,
    shown: Option<bool>,
    _mark: ThreadMark,
}

impl Writing {
    fn run(mut self) {
        loop {
            self.beats.fetch_add(1, Ordering::Relaxed);
            let result = match self.next() {
                Ok((command, _busy)) => {
                    let result = self.obey(command);
                    self.done.fetch_add(1, Ordering::Relaxed);
                    result
                }
                Err(RecvTimeoutError::Timeout) => self.look_at_aux(),
                // The link has closed the port.
                Err(RecvTimeoutError::Disconnected) => return,
            };
            if let Err(reason) = result {
                tell(&self.context, PortEvent::Lost { reason });
                return;
            }
        }
    }

    fn next(&self) -> Result<(Command, BusyToken), RecvTimeoutError> {
        let wait = match self.watch {
            AuxWatch::Close => AUX_CLOSE,
            AuxWatch::Idle => AUX_IDLE,
            AuxWatch::Off => return self.inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        self.inbox.recv_timeout(wait)
    }

    fn obey(&mut self, command: Command) -> Result<(), String> {
        match command {
            Command::Write(bytes) => {
                if let Some(gauge) = self.context.gauge_from_host() {
                    gauge.wrote(bytes.len());
                }
                self.write_all(&bytes).map_err(|error| format!("writing failed: {error}"))?;
                tell(&self.context, PortEvent::Drained);
                Ok(())
            }
            Command::Pins { m0, m1 } => lines::set(&mut self.port, m0, m1)
                .map_err(|error| format!("modem lines cannot be set ({error}); a pseudo-terminal has none: mode_pins = \"software\" or \"strapped\"")),
            Command::Purge => {
                self.port.clear(ClearBuffer::Input).map_err(|error| format!("flushing failed: {error}"))
            }
            Command::Watch(watch) => {
                self.watch = watch;
                if watch == AuxWatch::Off {
                    self.shown = None;
                    return Ok(());
                }
                self.look_at_aux()
            }
        }
    }

    /// Everything, in one call unless the system takes only a part.
    fn write_all(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            match self.port.write(bytes) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => bytes = &bytes[count..],
                // No room yet: the watchdog knows when this takes too long.
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                    if self.context.events.is_closed() {
                        return Err(error);
                    }
                }
                Err(error) => return Err(error),
            }
        }
        self.port.flush()
    }

    fn look_at_aux(&mut self) -> Result<(), String> {
        let read = lines::read(&mut self.port, self.aux).map_err(|error| {
            format!("AUX cannot be read ({error}); where there are no modem lines: aux = \"absent\"")
        })?;
        let idle = read.map(|asserted| lines::aux_idle(asserted, self.aux_inverted));
        if let Some(level) = idle.filter(|_| idle != self.shown) {
            self.shown = idle;
            tell(&self.context, PortEvent::Aux { idle: level });
        }
        Ok(())
    }
}

/// False when nobody listens any more.
fn tell(context: &PortContext, event: PortEvent) -> bool {
    let events: &EventSender = &context.events;
    events.blocking_send(context.parcel(event)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_should_move_and_does_not_is_noticed_after_five_looks() {
        let mut watched = Watched::new();
        for _ in 0..20 {
            assert!(!watched.hangs(false), "it has nothing to do");
        }
        for _ in 1..PATIENCE {
            assert!(!watched.hangs(true));
        }
        assert!(watched.hangs(true));
        watched.beats.fetch_add(1, Ordering::Relaxed);
        assert!(!watched.hangs(true), "it moves again");
    }
}
