//! Time for the whole server: the only place where a clock is read or a timer is set.
//!
//! | clock | for | time |
//! |---|---|---|
//! | [`SystemClock`] | a real station | the machine's |
//! | [`ScaledClock`] | a twin in another process | the machine's times a factor, simulated |
//! | [`SteppedClock`] | `demo` and tests, all in one process | stands still until everybody waits, simulated |
//!
//! # How stepped time stays free of races
//!
//! A stepped clock jumps to the next registered wake-up only when **nobody is busy**. Who is busy says so by holding a
//! [`BusyToken`]; the rules for everyone who runs on such a clock are:
//!
//! 1. *A message carries a token.* Whoever sends a message to another task takes a token and puts it into the message,
//!    so that a message in an inbox holds the clock.
//! 2. *A wake-up carries a token.* [`Timer::sleep_until`] yields one, taken by the clock before the sleeper is woken.
//! 3. *Keep the token until you wait again.* A task drops the token of the event that woke it only after it has
//!    registered its next sleep. [`Timer::sleep_until`] registers when it is **called**, not when it is polled, so the
//!    order is: call it, drop the old token, await.
//! 4. *Work in the background holds one*: a pending persist, a witness being written, a spawned task.
//! 5. *Bytes between two ends of a wire are counted* by a [`ByteGauge`]: the writer counts before it writes, the
//!    reader takes its own token and then counts what it read. Bytes that nobody has read yet hold the clock.
//!
//! ```no_run
//! # async fn actor(timer: std::sync::Arc<dyn gs_server::clock::Timer>, mut inbox: tokio::sync::mpsc::Receiver<gs_server::clock::BusyToken>) {
//! let mut awake = timer.busy("example");
//! loop {
//!     let next = timer.now().mono.plus(1_000_000);
//!     let sleep = timer.sleep_until(next); // registered now
//!     drop(awake);
//!     awake = tokio::select! {
//!         token = sleep => token,
//!         Some(token) = inbox.recv() => token,
//!     };
//!     // … work, while `awake` holds the clock …
//! }
//! # }
//! ```
//!
//! The other two clocks hand out tokens that do nothing, so the same code runs on all three.

mod gauge;
mod kernel;
mod stepped;
mod system;
mod wall;

pub use gauge::{ByteGauge, Wire};
pub(crate) use kernel::{clock_offset_s, kernel_says_synchronised};
pub use stepped::{SteppedClock, SteppedOptions};
pub use system::{ScaledClock, SystemClock};
pub(crate) use wall::{wall_sleep, within};

use std::fmt;
use std::sync::Arc;

use futures_util::future::BoxFuture;
use mission::MonoUs;

/// A clock that one can wait on.
pub trait Timer: mission::Clock {
    /// Waits until the clock shows `at`; at once when it does already.
    ///
    /// The wake-up is registered when this is called. Keep the token it yields until the next wait is registered.
    /// Dropping the future cancels the wake-up.
    fn sleep_until(&self, at: MonoUs) -> BoxFuture<'static, BusyToken>;

    /// While the token is held a stepped clock stands still. `who` names the holder in diagnostics.
    fn busy(&self, who: &'static str) -> BusyToken;

    /// Seconds of this clock in a second of the real world, for what goes on out there; 1 where the clock is stepped.
    fn pace(&self) -> f64 {
        1.0
    }
}

/// Something that holds a stepped clock.
pub(crate) trait Holds: Send + Sync {
    fn hold(&self, who: &'static str);
    fn release(&self, who: &'static str);
}

/// Proof that somebody is at work. See the [module documentation](self).
#[must_use = "a token that is dropped at once holds nothing"]
pub struct BusyToken {
    hold: Option<(Arc<dyn Holds>, &'static str)>,
}

impl BusyToken {
    /// A token that holds nothing, for clocks that do not stop.
    pub const fn idle() -> Self {
        Self { hold: None }
    }

    pub(crate) fn of(holder: Arc<dyn Holds>, who: &'static str) -> Self {
        holder.hold(who);
        Self { hold: Some((holder, who)) }
    }

    /// Takes over a hold that was counted already.
    pub(crate) fn counted(holder: Arc<dyn Holds>, who: &'static str) -> Self {
        Self { hold: Some((holder, who)) }
    }
}

impl Clone for BusyToken {
    fn clone(&self) -> Self {
        match &self.hold {
            Some((holder, who)) => Self::of(Arc::clone(holder), who),
            None => Self::idle(),
        }
    }
}

impl Drop for BusyToken {
    fn drop(&mut self) {
        if let Some((holder, who)) = self.hold.take() {
            holder.release(who);
        }
    }
}

impl fmt::Debug for BusyToken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("BusyToken").field(&self.hold.as_ref().map(|(_, who)| who)).finish()
    }
}
