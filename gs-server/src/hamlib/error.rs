//! What goes wrong with a daemon, and what to do about it.

/// A daemon did not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum HamlibError {
    /// Nobody listens there, or not for us.
    #[error(
        "{address} cannot be reached: is the daemon running (rotctld, rigctld), and is the address right?"
    )]
    Unreachable {
        /// Host and port.
        address: String,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// No answer to a connection.
    #[error("{address} does not answer within {after_ms} ms: is the host up?")]
    NoConnection {
        /// Host and port.
        address: String,
        /// How long it was tried.
        after_ms: u128,
    },
    /// The connection broke.
    #[error("{address} closed the connection at '{command}': the daemon has ended, or lost its device")]
    Closed {
        /// Host and port.
        address: String,
        /// What was asked.
        command: String,
        /// What the operating system said, if anything.
        source: Option<std::io::Error>,
    },
    /// No whole answer in time. Unknown commands get none.
    #[error(
        "{address} does not answer '{command}' within {after_ms} ms: the device hangs, or this version does not know \
         the command"
    )]
    Silent {
        /// Host and port.
        address: String,
        /// What was asked.
        command: String,
        /// How long it was waited.
        after_ms: u128,
    },
    /// What came is not the answer to what was asked.
    #[error("{address} answers '{command}' with '{found}': answers are out of step")]
    OutOfStep {
        /// Host and port.
        address: String,
        /// What was asked.
        command: String,
        /// The line that came, cut.
        found: String,
    },
    /// An answer without an end.
    #[error("{address} answers '{command}' without end: is this rotctld or rigctld?")]
    Endless {
        /// Host and port.
        address: String,
        /// What was asked.
        command: String,
    },
    /// The daemon refused.
    #[error("{address} refuses '{command}': {} (RPRT {code})", meaning(*code))]
    Refused {
        /// Host and port.
        address: String,
        /// What was asked.
        command: String,
        /// hamlib's error number, negative.
        code: i32,
    },
    /// The answer holds no number where one should be, or one that cannot be.
    #[error("{address} answers '{command}' with {what} '{found}', which is no such value")]
    Malformed {
        /// Host and port.
        address: String,
        /// What was asked.
        command: String,
        /// What the value should be.
        what: &'static str,
        /// What was found, cut.
        found: String,
    },
    /// The rig accepted a frequency and shows another.
    #[error(
        "{address} accepted {wanted_hz} Hz and shows {found_hz} Hz: does the rig cover that band, on this VFO?"
    )]
    NotTaken {
        /// Host and port.
        address: String,
        /// What was set, Hz.
        wanted_hz: u64,
        /// What was read back, Hz.
        found_hz: f64,
    },
}

impl HamlibError {
    /// The connection cannot be used any more. The rest are answers, in step.
    #[must_use]
    pub fn breaks_connection(&self) -> bool {
        !matches!(self, Self::Refused { .. } | Self::Malformed { .. } | Self::NotTaken { .. })
    }

    /// With what lies under it, as one sentence.
    #[must_use]
    pub fn told(&self) -> String {
        match std::error::Error::source(self) {
            Some(source) => format!("{self} ({source})"),
            None => self.to_string(),
        }
    }
}

/// What hamlib's numbers mean to whoever stands beside the antenna.
fn meaning(code: i32) -> &'static str {
    match code {
        -1 => "invalid parameter; for a position: outside the rotator's limits",
        -2 => "invalid configuration",
        -3 => "out of memory",
        -4 | -11 => "this model cannot do that",
        -5 => "the device does not answer the daemon",
        -6 => "input or output error between daemon and device",
        -7 => "internal error of the daemon",
        -8 => "the device answers nonsense",
        -9 => "rejected by the device",
        -12 | -16 => "no such VFO",
        -13 | -14 => "error on the device's bus",
        -17 => "argument out of its domain",
        -20 => "the device is switched off",
        _ => "an error of hamlib's",
    }
}
