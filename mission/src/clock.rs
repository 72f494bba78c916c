//! Time as a parameter: two scales, read together.
//!
//! Waiting is done on the monotonic scale, which never steps; what is written down carries UTC. Nothing in this
//! crate reads a clock: [`Now`] comes in with every input.

/// Monotonic microseconds since an origin of the process's own choosing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MonoUs(pub u64);

impl MonoUs {
    /// This much later; stays at the end of time when it would pass it.
    #[must_use]
    pub const fn plus(self, us: u64) -> Self {
        Self(self.0.saturating_add(us))
    }

    /// Microseconds since `earlier`, 0 when that lies ahead.
    pub const fn since(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }
}

/// Microseconds since 1970-01-01T00:00:00Z, without leap seconds (POSIX time).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct UtcUs(pub i64);

impl UtcUs {
    /// This much later (or earlier, when negative).
    #[must_use]
    pub const fn plus(self, us: i64) -> Self {
        Self(self.0.saturating_add(us))
    }
}

/// One instant on both scales.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Now {
    /// For waiting.
    pub mono: MonoUs,
    /// For writing down.
    pub utc: UtcUs,
}

/// Where the time comes from. The shell has one for the machine's clock, and simulated ones.
pub trait Clock: Send + Sync {
    /// The time now, on both scales.
    fn now(&self) -> Now;

    /// Whether this clock is made up. Real links and real keys refuse such a clock.
    fn is_simulated(&self) -> bool;
}
