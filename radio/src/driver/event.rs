//! What goes into the driver and what comes out.

use super::diagnostic::Diagnostic;

/// An event for the driver, in the order it happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriverInput<'a> {
    /// The port was opened, in normal mode as far as the shell can say.
    Opened,
    /// The port is gone, or an attempt to open it failed.
    Closed,
    /// Bytes read from the port, any number at a time.
    Bytes(&'a [u8]),
    /// Level of AUX: after opening, and at each change. Idle is the high level.
    Aux {
        /// True for the high level.
        idle: bool,
    },
    /// The last [`DriverOutput::Write`] has left the host's UART. Optional; a late one prolongs the computed end of a
    /// transmission.
    Drained,
    /// Send this frame. Answered by exactly one [`DriverOutput::TxDone`] or [`DriverOutput::TxFailed`].
    Transmit {
        /// The caller's name for it.
        id: u64,
        /// Address of the module that shall hear it; 0xFFFF is every module on the channel.
        target: u16,
        /// 1..=240 bytes, without the fixed-point header.
        frame: &'a [u8],
    },
    /// The time of [`Driver::next_wakeup_us`](super::Driver::next_wakeup_us) has come. Harmless at any time.
    Wake,
    /// Give the port up: no reopening until [`DriverInput::Opened`].
    Stop,
}

/// What the shell shall do or know. Drain after every input, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DriverOutput {
    /// Write all of it in one call: a gap of three byte times would split a frame.
    Write(Vec<u8>),
    /// Drive the mode pins. Levels at the pin (true = high), already complemented for inverted lines.
    SetPins {
        /// M0.
        m0: bool,
        /// M1.
        m1: bool,
    },
    /// Discard what the operating system holds unread.
    PurgeInput,
    /// Bytes heard in data mode, without delay and without any framing.
    Deliver(Vec<u8>),
    /// The write of this frame comes next.
    TxStarted {
        /// The caller's name.
        id: u64,
    },
    /// The frame has been radiated.
    TxDone {
        /// The caller's name.
        id: u64,
        /// Time on the air.
        airtime_us: u64,
        /// True if AUX showed it, false if computed.
        measured: bool,
    },
    /// The frame was not sent, or it is not known whether it was. It is never repeated by the driver.
    TxFailed {
        /// The caller's name.
        id: u64,
        /// What may have left the antenna.
        radiated: Radiated,
        /// Why.
        reason: TxFailure,
    },
    /// A new state.
    State(DriverState),
    /// Something an operator should read.
    Diagnostic(Diagnostic),
    /// Close the port if it is open, wait, find the device again and open it; then [`DriverInput::Opened`] or
    /// [`DriverInput::Closed`]. A later `Reopen` replaces an earlier one.
    Reopen {
        /// Pause before the attempt.
        after_us: u64,
    },
}

/// Where the driver stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DriverState {
    /// No port.
    Closed,
    /// The port is open and settles; the way into configuration mode.
    Opening,
    /// Asking who the module is and what it holds.
    Identify,
    /// Writing what differs.
    Configure,
    /// Reading back.
    Verify,
    /// Receiving; a frame may be sent.
    Ready,
    /// A frame was accepted and is not yet settled.
    Sending,
    /// The module does not work; a reopening is scheduled.
    Fault,
}

impl DriverState {
    /// Whether received bytes are delivered in this state.
    #[must_use]
    pub const fn receives(self) -> bool {
        matches!(self, Self::Ready | Self::Sending)
    }
}

/// What may have left the antenna of a failed transmission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Radiated {
    /// Certainly nothing: no byte was handed over.
    No,
    /// Unknown: all, a part, or nothing.
    Maybe,
}

/// Why a transmission failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum TxFailure {
    /// The driver is not in [`DriverState::Ready`].
    #[error("the radio is not ready")]
    NotReady,
    /// Another frame is being sent.
    #[error("another frame is being sent")]
    Busy,
    /// Frames have 1..=240 bytes.
    #[error("a frame of {found} bytes cannot be sent: 1 to 240 fit")]
    Length {
        /// Bytes in the frame.
        found: usize,
    },
    /// The module's carrier frequency is not proved and sending unverified was not allowed.
    #[error("the frequency is not verified")]
    FrequencyUnverified,
    /// The module refused a setting and sending unverified was not allowed.
    #[error("the configuration is not verified")]
    ConfigurationUnverified,
    /// The module stayed busy, or bytes kept arriving, for six seconds.
    #[error("the module did not become idle")]
    ModuleBusy,
    /// The port closed.
    #[error("the port closed")]
    PortClosed,
    /// AUX was known to work and did not move.
    #[error("AUX showed no transmission")]
    AuxSilent,
    /// AUX stayed low longer than any transmission lasts.
    #[error("AUX stayed low after the transmission")]
    AuxStuckLow,
    /// The driver was stopped.
    #[error("the radio was stopped")]
    Stopped,
}
