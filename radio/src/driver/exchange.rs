//! One request and the wait for its answer, bounded in time, bytes and tries.

use crate::airtime::uart_us;
use crate::reply::{Expected, Verdict, judge};

/// An answer must have come this long after the request left.
const REPLY_LIMIT_US: u64 = 500_000;
/// Silence that ends a reply without line end. Longer than the 16 ms an FTDI adapter sits on short replies.
const SILENCE_US: u64 = 50_000;
/// Bytes kept of what comes back; the oldest go first.
const KEPT_BYTES: usize = 512;

/// A request under way.
#[derive(Debug)]
pub(super) struct Exchange {
    request: Vec<u8>,
    expected: Expected,
    received: Vec<u8>,
    last_byte_us: Option<u64>,
    limit_us: u64,
    judged_silent: bool,
}

/// Whether the exchange has come to an end.
#[derive(Debug)]
pub(super) enum Progress {
    Waiting,
    /// Never [`Verdict::Wait`].
    Answered(Verdict),
    /// The limit passed.
    Unanswered,
}

impl Exchange {
    /// Begins when the request is handed over.
    pub(super) fn new(now_us: u64, baud: u32, request: Vec<u8>, expected: Expected) -> Self {
        let limit_us = now_us + uart_us(request.len(), baud) + REPLY_LIMIT_US;
        Self { request, expected, received: Vec::new(), last_byte_us: None, limit_us, judged_silent: true }
    }

    /// Takes bytes; returns those that fell out at the front.
    pub(super) fn push(&mut self, now_us: u64, bytes: &[u8]) -> Vec<u8> {
        if bytes.is_empty() {
            return Vec::new();
        }
        self.received.extend_from_slice(bytes);
        self.last_byte_us = Some(now_us);
        self.judged_silent = false;
        let surplus = self.received.len().saturating_sub(KEPT_BYTES);
        self.received.drain(..surplus).collect()
    }

    /// Judges what has come. Call after bytes and at [`Exchange::wakeup_us`].
    pub(super) fn progress(&mut self, now_us: u64) -> Progress {
        let silent = self.silence_us().is_some_and(|at| now_us >= at);
        self.judged_silent |= silent;
        match judge(self.expected, &self.request, &self.received, silent || now_us >= self.limit_us) {
            Verdict::Wait if now_us >= self.limit_us => Progress::Unanswered,
            Verdict::Wait => Progress::Waiting,
            verdict => Progress::Answered(verdict),
        }
    }

    pub(super) fn wakeup_us(&self) -> u64 {
        match self.silence_us() {
            Some(at) if !self.judged_silent => at.min(self.limit_us),
            _ => self.limit_us,
        }
    }

    fn silence_us(&self) -> Option<u64> {
        self.last_byte_us.map(|at| at + SILENCE_US)
    }

    pub(super) fn received(&self) -> &[u8] {
        &self.received
    }

    /// Whether nothing but the request itself came back.
    pub(super) fn only_echo(&self) -> bool {
        !self.received.is_empty() && self.received == self.request
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::at;
    use crate::reply::AtReply;

    fn query() -> Exchange {
        Exchange::new(0, 9600, at("FWCODE=?", false), Expected::At { name: "FWCODE" })
    }

    #[test]
    fn silence_ends_a_reply_without_newline() {
        let mut exchange = query();
        assert!(exchange.push(20_000, b"FWCODE=7453").is_empty());
        assert!(matches!(exchange.progress(20_000), Progress::Waiting));
        assert_eq!(exchange.wakeup_us(), 70_000);
        let Progress::Answered(Verdict::At { reply, .. }) = exchange.progress(70_000) else {
            panic!("no answer")
        };
        assert_eq!(reply, AtReply::Value("7453".into()));
    }

    #[test]
    fn an_endless_babble_ends_at_the_limit() {
        let mut exchange = query();
        let mut now = 0;
        loop {
            exchange.push(now, &[0x55; 100]);
            assert!(exchange.received().len() <= KEPT_BYTES);
            match exchange.progress(now) {
                Progress::Waiting => now += 10_000,
                Progress::Unanswered => break,
                Progress::Answered(verdict) => panic!("{verdict:?}"),
            }
        }
        assert!(now < 530_000);
    }

    #[test]
    fn after_silence_without_meaning_the_limit_is_next() {
        let mut exchange = query();
        exchange.push(1_000, b"xx");
        assert_eq!(exchange.wakeup_us(), 51_000);
        assert!(matches!(exchange.progress(51_000), Progress::Waiting));
        assert!(exchange.wakeup_us() > 500_000);
    }
}
