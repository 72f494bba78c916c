//! What survives a restart of the satellite, and of the process that plays it: counters, boots, image, clock.

use protocol::{Nonce, Resolution};

use crate::{AcceptedNonces, JournalEntry, JournalError};

/// The stored image, as a recipe: the seed and the number make the bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredImage {
    /// Number of the picture in the satellite's life, from 1; 0 is the one it was launched with.
    pub number: u32,
    /// Size.
    pub resolution: Resolution,
    /// Without colour.
    pub grey: bool,
    /// Strongly compressed.
    pub strong_compression: bool,
}

/// How the satellite's clock was set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockSetting {
    /// What it was set to, ms since 1970 UTC.
    pub set_ms: u64,
    /// True time at that moment, ms since 1970 UTC.
    pub at_utc_ms: u64,
}

impl ClockSetting {
    /// What the clock says at this true time, ms since 1970 UTC. It keeps time without error.
    #[must_use]
    pub const fn read_ms(self, utc_ms: u64) -> u64 {
        self.set_ms.wrapping_add(utc_ms.wrapping_sub(self.at_utc_ms))
    }
}

/// One thing written to the satellite's permanent memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateChange {
    /// An uplink's counter was accepted. Stored before anything else is done with the frame.
    Nonce(Nonce),
    /// The computer started.
    Boot {
        /// Boots so far, this one included.
        boots: u32,
        /// True time, ms since 1970 UTC.
        utc_ms: u64,
    },
    /// The camera began a capture: there is no image, and this is the number of the next.
    ImageErased {
        /// Number the image will have.
        next_number: u32,
    },
    /// An image was stored.
    Image(StoredImage),
    /// The clock was set, or lost.
    Clock(Option<ClockSetting>),
    /// Transmissions were allowed or forbidden. It survives a reset: whoever told the satellite to be silent must
    /// be able to rely on it.
    Transmitter(bool),
    /// Orbital elements were stored.
    Elements,
}

/// The satellite's permanent memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TwinState {
    /// Memory against replay.
    pub nonces: AcceptedNonces,
    /// Boots so far; 0 = never switched on.
    pub boots: u32,
    /// True time of the last boot, ms since 1970 UTC.
    pub booted_utc_ms: u64,
    /// The image; `None` if there is none or it is being taken.
    pub image: Option<StoredImage>,
    /// Number of the next image.
    pub next_image: u32,
    /// The clock; `None` if it was never set.
    pub clock: Option<ClockSetting>,
    /// Whether it may transmit.
    pub transmitter: bool,
    /// Whether it has orbital elements.
    pub elements: bool,
}

impl Default for TwinState {
    /// A satellite that was never switched on.
    fn default() -> Self {
        Self {
            nonces: AcceptedNonces::default(),
            boots: 0,
            booted_utc_ms: 0,
            image: None,
            next_image: 1,
            clock: None,
            transmitter: true,
            elements: false,
        }
    }
}

impl TwinState {
    /// Makes one change.
    pub fn apply(&mut self, change: &StateChange) {
        match *change {
            StateChange::Nonce(nonce) => self.nonces.accept(nonce),
            StateChange::Boot { boots, utc_ms } => {
                self.boots = boots;
                self.booted_utc_ms = utc_ms;
            }
            StateChange::ImageErased { next_number } => {
                self.image = None;
                self.next_image = next_number;
            }
            StateChange::Image(image) => {
                self.image = Some(image);
                self.next_image = image.number.wrapping_add(1);
            }
            StateChange::Clock(clock) => self.clock = clock,
            StateChange::Transmitter(on) => self.transmitter = on,
            StateChange::Elements => self.elements = true,
        }
    }

    /// The state after everything a journal tells. A last line without its end is a write that was cut short by a
    /// crash; nothing followed from it, so it is left out.
    ///
    /// # Errors
    /// [`JournalError`] with the number of the first line that is none.
    pub fn from_journal(text: &str) -> Result<Self, JournalError> {
        let mut state = Self::default();
        for (index, line) in text.split_inclusive('\n').enumerate() {
            let Some(line) = line.strip_suffix('\n') else { break };
            if line.trim().is_empty() {
                continue;
            }
            let entry = JournalEntry::parse_line(line).map_err(|error| error.on_line(index + 1))?;
            if let JournalEntry::Stored { change, .. } = entry {
                state.apply(&change);
            }
        }
        Ok(state)
    }
}
