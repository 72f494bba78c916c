//! The loop that gives the stepped device time, bytes and a journal.

use std::sync::Arc;

use mission::MonoUs;
use satellite::{Device, DeviceOutput, DeviceStats, Fault};
use tokio::sync::{mpsc, oneshot};
use tokio_util::sync::CancellationToken;

use super::{End, Heard, JournalFile, TwinError};
use crate::clock::{BusyToken, Timer, Wire};

/// What others in this process may ask of a running twin.
#[derive(Debug)]
pub enum Ask {
    /// How it is.
    View(oneshot::Sender<View>),
    /// Something shall go wrong, or right again, now.
    Fault(Fault),
}

/// A twin at one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct View {
    /// What it did so far.
    pub stats: DeviceStats,
    /// The image it holds; empty if none.
    pub image: Vec<u8>,
    /// Bytes for ground that found no room, or nobody there.
    pub unheard_bytes: u64,
}

/// A device with its clock, its end and its journal.
pub struct Player {
    device: Device,
    journal: Option<JournalFile>,
    timer: Arc<dyn Timer>,
    /// Device time minus clock time.
    ahead_us: u64,
    wire: Option<Wire>,
    unheard_bytes: u64,
}

/// Bytes taken from ground at a time.
const PIECE_LEN: usize = 1024;

impl Player {
    /// Joins them. `start_us` is what the device's scale shows now. `wire` counts bytes between two ends in one
    /// process, for a stepped clock.
    pub fn new(
        device: Device,
        journal: Option<JournalFile>,
        timer: Arc<dyn Timer>,
        start_us: u64,
        wire: Option<Wire>,
    ) -> Self {
        let ahead_us = start_us.saturating_sub(timer.now().mono.0);
        Self { device, journal, timer, ahead_us, wire, unheard_bytes: 0 }
    }

    fn now_us(&self) -> u64 {
        self.timer.now().mono.0.saturating_add(self.ahead_us)
    }

    /// Plays until stopped. `awake` holds a stepped clock until the first wait.
    ///
    /// # Errors
    /// [`TwinError`] when the journal cannot be written or the end fails: nothing is answered from then on.
    pub async fn run(
        mut self,
        mut end: End,
        mut asks: mpsc::Receiver<Ask>,
        stop: CancellationToken,
        mut awake: BusyToken,
    ) -> Result<View, TwinError> {
        let mut piece = [0; PIECE_LEN];
        loop {
            self.play(&mut end)?;
            let timer = Arc::clone(&self.timer);
            let next = self.device.next_event_us().map(|at_us| at_us.saturating_sub(self.ahead_us));
            // A device without events has the end of time left to wait for.
            let sleep = timer.sleep_until(MonoUs(next.unwrap_or(u64::MAX)));
            drop(awake);
            tokio::select! {
                biased;
                () = stop.cancelled() => return Ok(self.view()),
                token = sleep => awake = token,
                heard = end.read(&mut piece) => {
                    awake = timer.busy("twin");
                    self.take(heard?, &piece, &mut end)?;
                }
                Some(ask) = asks.recv() => {
                    awake = timer.busy("twin");
                    self.answer(ask, &mut end)?;
                }
            }
        }
    }

    fn take(&mut self, heard: Heard, piece: &[u8], end: &mut End) -> Result<(), TwinError> {
        match heard {
            Heard::Bytes(len) => {
                if let Some(wire) = &self.wire {
                    wire.from_host.read(len);
                }
                self.play(end)?;
                self.device.host_write(self.now_us(), &piece[..len]);
            }
            Heard::Gone => {
                tracing::debug!("ground is gone");
                if let Some(wire) = &self.wire {
                    wire.from_host.abandon();
                    wire.to_host.abandon();
                }
            }
        }
        Ok(())
    }

    fn answer(&mut self, ask: Ask, end: &mut End) -> Result<(), TwinError> {
        match ask {
            // Whoever asked and left does not need it any more.
            Ask::View(reply) => drop(reply.send(self.view())),
            Ask::Fault(fault) => {
                self.play(end)?;
                self.device.inject(self.now_us(), fault);
            }
        }
        Ok(())
    }

    /// Everything that is due, in its order: the journal first, then what follows from it.
    fn play(&mut self, end: &mut End) -> Result<(), TwinError> {
        let now_us = self.now_us();
        while let Some(output) = self.device.poll(now_us) {
            match output {
                DeviceOutput::Journal(entry) => {
                    if let Some(journal) = &mut self.journal {
                        journal.append(&entry)?;
                    }
                }
                DeviceOutput::HostBytes(bytes) => self.send(&bytes, end),
                // Neither a pseudo-terminal nor TCP has modem lines.
                DeviceOutput::Aux { .. } => {}
            }
        }
        if let Some(fault) = self.device.take_orbit_fault() {
            tracing::warn!(
                error = %fault,
                "the satellite's elements end here: {fault}; it stays below the horizon, start it with newer elements"
            );
        }
        Ok(())
    }

    fn send(&mut self, bytes: &[u8], end: &mut End) {
        let sent = if let Some(wire) = self.wire.as_ref().filter(|_| end.is_present()) {
            // Counted before it is written, or the reader would be quicker than the count.
            wire.to_host.wrote(bytes.len());
            let sent = end.write(bytes);
            wire.to_host.read(bytes.len() - sent);
            sent
        } else {
            end.write(bytes)
        };
        self.unheard_bytes += (bytes.len() - sent) as u64;
    }

    fn view(&self) -> View {
        View {
            stats: self.device.stats(),
            image: self.device.twin().image().to_vec(),
            unheard_bytes: self.unheard_bytes,
        }
    }
}
