//! The AUX pin: high when idle, and what quirks make of it.

#[derive(Debug)]
pub(super) struct AuxLine {
    /// Low for a mode change.
    pub(super) mode_change: bool,
    /// A chattering line shows the complement.
    pub(super) flipped: bool,
    shown: bool,
}

impl Default for AuxLine {
    /// High, as an unpowered line with its pull-up reads.
    fn default() -> Self {
        Self { mode_change: false, flipped: false, shown: true }
    }
}

impl AuxLine {
    /// The level to report, if it changed.
    pub(super) fn show(&mut self, busy: bool, stuck: Option<bool>) -> Option<bool> {
        let idle = stuck.unwrap_or(!busy ^ self.flipped);
        (std::mem::replace(&mut self.shown, idle) != idle).then_some(idle)
    }

    pub(super) fn level(&self) -> bool {
        self.shown
    }
}
