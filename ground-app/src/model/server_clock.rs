//! What time it is at the server: all that the window shows counts by it, for a simulated satellite's time runs as it
//! likes.

use std::time::{Duration, Instant};

/// This machine's clock may differ by so much from the server's before it is said.
const DOUBT_US: i64 = 2_000_000;
/// Between two words of the server its time is carried on for no longer.
const CARRY: Duration = Duration::from_secs(2);

/// The server's time, carried on between its words.
#[derive(Debug, Clone, Default)]
pub struct ServerClock {
    last: Option<Word>,
    /// Simulated seconds per second, as it went between the last words.
    rate: f64,
}

#[derive(Debug, Clone, Copy)]
struct Word {
    server_us: i64,
    simulated: bool,
    at: Instant,
    here_us: i64,
}

/// This machine's clock and the server's disagree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockDoubt {
    /// This machine's minus the server's, in microseconds.
    pub ahead_us: i64,
}

impl ServerClock {
    /// The server says its time; `here_us` is this machine's UTC.
    pub fn hear(&mut self, server_us: i64, simulated: bool, now: Instant, here_us: i64) {
        if let Some(last) = self.last {
            let wall_s = now.saturating_duration_since(last.at).as_secs_f64();
            if wall_s > 0.05 {
                let rate = (server_us - last.server_us) as f64 / 1e6 / wall_s;
                self.rate = if simulated { rate.clamp(0.0, 1e5) } else { 1.0 };
            }
        }
        self.last = Some(Word { server_us, simulated, at: now, here_us });
    }

    /// The server's UTC in microseconds since 1970; `None` before its first word.
    #[must_use]
    pub fn now_us(&self, now: Instant) -> Option<i64> {
        let last = self.last?;
        let carried = now.saturating_duration_since(last.at);
        // A real clock goes on while the line is lost; a simulated one may stand still.
        let carried = if last.simulated { carried.min(CARRY / 4) } else { carried };
        Some(last.server_us + (carried.as_secs_f64() * 1e6 * self.rate_or_one()) as i64)
    }

    fn rate_or_one(&self) -> f64 {
        if self.rate > 0.0 { self.rate } else { 1.0 }
    }

    /// How long ago the server said something.
    #[must_use]
    pub fn silent_for(&self, now: Instant) -> Option<Duration> {
        self.last.map(|last| now.saturating_duration_since(last.at))
    }

    /// Whether this machine's clock is wrong, or the server's: not for simulated time.
    #[must_use]
    pub fn doubt(&self) -> Option<ClockDoubt> {
        let last = self.last.filter(|last| !last.simulated)?;
        let ahead_us = last.here_us - last.server_us;
        (ahead_us.abs() > DOUBT_US).then_some(ClockDoubt { ahead_us })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_hour_is_noticed_and_simulated_time_is_not_compared() {
        let now = crate::clock::instant();
        let mut clock = ServerClock::default();
        clock.hear(3_600_000_000, false, now, 0);
        assert_eq!(clock.doubt(), Some(ClockDoubt { ahead_us: -3_600_000_000 }));
        clock.hear(3_600_000_000, true, now, 0);
        assert_eq!(clock.doubt(), None);
    }

    #[test]
    fn time_is_carried_on_at_the_rate_it_goes() {
        let start = crate::clock::instant();
        let mut clock = ServerClock::default();
        clock.hear(0, true, start, 0);
        clock.hear(20_000_000, true, start + Duration::from_secs(1), 0);
        let soon = clock.now_us(start + Duration::from_millis(1250)).unwrap();
        assert!((24_000_000..=26_000_000).contains(&soon), "{soon}");
    }
}
