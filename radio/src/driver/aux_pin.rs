//! What AUX is worth: its level, whether it was ever seen to move, and whether it can be believed.

/// More changes than this within [`CHATTER_WINDOW_US`] are noise: a packet makes two, a mode change two.
const CHATTER_EDGES: u32 = 40;
const CHATTER_WINDOW_US: u64 = 1_000_000;

/// The AUX input since the port was opened.
#[derive(Debug, Clone, Copy)]
pub(super) struct AuxPin {
    wired: bool,
    idle: bool,
    changed_us: u64,
    seen_low: bool,
    seen_move: bool,
    stuck: bool,
    chatter: bool,
    window_start_us: u64,
    window_edges: u32,
}

impl AuxPin {
    pub(super) fn new(wired: bool) -> Self {
        Self {
            wired,
            idle: true,
            changed_us: 0,
            seen_low: false,
            seen_move: false,
            stuck: false,
            chatter: false,
            window_start_us: 0,
            window_edges: 0,
        }
    }

    /// Takes a level. True if it is a change.
    pub(super) fn set(&mut self, now_us: u64, idle: bool) -> bool {
        if !self.wired || idle == self.idle {
            return false;
        }
        self.idle = idle;
        self.changed_us = now_us;
        if idle {
            self.seen_move |= self.seen_low;
            self.stuck = false;
        } else {
            self.seen_low = true;
        }
        if now_us.saturating_sub(self.window_start_us) > CHATTER_WINDOW_US {
            self.window_start_us = now_us;
            self.window_edges = 0;
        }
        self.window_edges += 1;
        true
    }

    /// True once, when the changes have become noise.
    pub(super) fn begins_to_chatter(&mut self) -> bool {
        if self.chatter || self.window_edges <= CHATTER_EDGES {
            return false;
        }
        self.chatter = true;
        true
    }

    fn usable(&self) -> bool {
        self.wired && !self.stuck && !self.chatter
    }

    /// Believably low.
    pub(super) fn busy(&self) -> bool {
        self.usable() && !self.idle
    }

    /// Seen low and high, and neither stuck nor chattering: an idle level means idle. An unconnected input also reads
    /// idle, for ever; hence the proof.
    pub(super) fn trusted(&self) -> bool {
        self.usable() && self.seen_move
    }

    /// When the level last changed.
    pub(super) fn changed_us(&self) -> u64 {
        self.changed_us
    }

    /// Low for too long: not believed until it goes high.
    pub(super) fn declare_stuck(&mut self) {
        self.stuck = true;
        self.seen_move = false;
    }

    /// Did not move when it should have: not believed until it moves again.
    pub(super) fn distrust(&mut self) {
        self.seen_move = false;
        self.seen_low = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unconnected_input_is_never_trusted() {
        let mut aux = AuxPin::new(true);
        aux.set(0, true);
        assert!(!aux.trusted() && !aux.busy());
        aux.set(10, false);
        assert!(aux.busy() && !aux.trusted());
        aux.set(20, true);
        assert!(aux.trusted());
    }

    #[test]
    fn stuck_low_is_ignored_until_it_moves() {
        let mut aux = AuxPin::new(true);
        aux.set(0, false);
        aux.declare_stuck();
        assert!(!aux.busy());
        aux.set(1, true);
        assert!(aux.trusted());
    }

    #[test]
    fn chatter_is_reported_once() {
        let mut aux = AuxPin::new(true);
        let mut reports = 0;
        for n in 0..200u64 {
            aux.set(n * 1000, n % 2 == 1);
            reports += u32::from(aux.begins_to_chatter());
        }
        assert_eq!(reports, 1);
        assert!(!aux.trusted() && !aux.busy());
    }

    #[test]
    fn an_absent_line_says_nothing() {
        let mut aux = AuxPin::new(false);
        assert!(!aux.set(0, false));
        assert!(!aux.busy());
    }
}
