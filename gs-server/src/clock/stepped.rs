//! Simulated time in one process: it stands still until everybody waits, then jumps to the next wake-up.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use mission::{Clock, MonoUs, Now, UtcUs};
use tokio::sync::oneshot;

use super::{BusyToken, Holds, Timer};

/// How a stepped clock runs.
#[derive(Debug, Clone, Copy)]
pub struct SteppedOptions {
    /// What the clock shows at its origin.
    pub utc_at_origin: UtcUs,
    /// Simulated seconds per second of wall time at most; `None` runs as fast as the work is done.
    pub speed: Option<f64>,
}

/// A clock that jumps. Cheap to clone; its thread ends with the last clone.
///
/// Sleepers wake one at a time, in the order of their times and then of their registration: the next one is woken only
/// when the one before, and all that it set off, waits again.
#[derive(Clone)]
pub struct SteppedClock {
    shared: Arc<Shared>,
    _thread: Arc<ThreadGuard>,
}

struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    utc_at_origin: UtcUs,
}

struct State {
    now_us: u64,
    busy: usize,
    holders: BTreeMap<&'static str, usize>,
    sleepers: BinaryHeap<Reverse<Sleeper>>,
    next_number: u64,
    /// Up to here the ceiling does not count.
    skip_until_us: u64,
    speed: Option<f64>,
    /// Wall time and simulated time from which the ceiling is counted.
    anchor: (Instant, u64),
    stopped: bool,
}

struct Sleeper {
    at_us: u64,
    number: u64,
    wake: oneshot::Sender<BusyToken>,
}

impl PartialEq for Sleeper {
    fn eq(&self, other: &Self) -> bool {
        (self.at_us, self.number) == (other.at_us, other.number)
    }
}

impl Eq for Sleeper {}

impl PartialOrd for Sleeper {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Sleeper {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.at_us, self.number).cmp(&(other.at_us, other.number))
    }
}

/// After a pause longer than this the clock does not hurry to catch up with its ceiling.
const CATCH_UP: Duration = Duration::from_millis(20);

/// Stops the thread when the last clock goes.
struct ThreadGuard(Arc<Shared>);

impl Drop for ThreadGuard {
    fn drop(&mut self) {
        self.0.lock().stopped = true;
        self.0.changed.notify_all();
    }
}

#[expect(clippy::disallowed_methods, reason = "the ceiling on simulated time is counted in wall time")]
fn wall_now() -> Instant {
    Instant::now()
}

impl SteppedClock {
    /// A clock at 0 that moves as soon as somebody sleeps and nobody is busy. Take a [`Timer::busy`] token before the
    /// first task is spawned, and drop it when all are set up.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub fn new(options: SteppedOptions) -> std::io::Result<Self> {
        let speed = options.speed.filter(|s| s.is_finite() && *s > 0.0);
        let shared = Arc::new(Shared {
            state: Mutex::new(State {
                now_us: 0,
                busy: 0,
                holders: BTreeMap::new(),
                sleepers: BinaryHeap::new(),
                next_number: 0,
                skip_until_us: 0,
                speed,
                anchor: (wall_now(), 0),
                stopped: false,
            }),
            changed: Condvar::new(),
            utc_at_origin: options.utc_at_origin,
        });
        let pump = Arc::clone(&shared);
        std::thread::Builder::new().name("stepped-clock".into()).spawn(move || pump.run())?;
        Ok(Self { _thread: Arc::new(ThreadGuard(Arc::clone(&shared))), shared })
    }

    /// Until this time the ceiling does not count: time passes as fast as the work is done.
    ///
    /// For stretches in which there is nothing to see. Wake-ups inside the stretch still happen at their times.
    pub fn skip_until(&self, until: MonoUs) {
        let mut state = self.shared.lock();
        state.skip_until_us = state.skip_until_us.max(until.0);
        drop(state);
        self.shared.changed.notify_all();
    }

    /// Ends a skip: from now on the ceiling counts again.
    pub fn stop_skipping(&self) {
        let mut state = self.shared.lock();
        state.skip_until_us = state.now_us;
        state.anchor = (wall_now(), state.now_us);
    }

    /// Changes the ceiling.
    pub fn set_speed(&self, speed: Option<f64>) {
        let mut state = self.shared.lock();
        state.speed = speed.filter(|s| s.is_finite() && *s > 0.0);
        state.anchor = (wall_now(), state.now_us);
        drop(state);
        self.shared.changed.notify_all();
    }

    /// Who holds the clock at present, for the message that says why a simulation stands still.
    pub fn holders(&self) -> Vec<(&'static str, usize)> {
        self.shared.lock().holders.iter().map(|(who, n)| (*who, *n)).collect()
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(self: Arc<Self>) {
        let mut state = self.lock();
        loop {
            if state.stopped {
                return;
            }
            if state.busy > 0 {
                state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            while state.sleepers.peek().is_some_and(|Reverse(s)| s.wake.is_closed()) {
                state.sleepers.pop();
            }
            let Some(Reverse(next)) = state.sleepers.peek() else {
                state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            let at_us = next.at_us;
            if let Some(wait) = state.wait_for(at_us) {
                state = self.changed.wait_timeout(state, wait).unwrap_or_else(PoisonError::into_inner).0;
                continue;
            }
            state.now_us = state.now_us.max(at_us);
            let Some(Reverse(sleeper)) = state.sleepers.pop() else { continue };
            state.hold("woken sleeper");
            drop(state);
            // Outside the lock: a token that nobody takes is dropped here, and dropping takes the lock.
            let _ =
                sleeper.wake.send(BusyToken::counted(Arc::clone(&self) as Arc<dyn Holds>, "woken sleeper"));
            state = self.lock();
        }
    }
}

impl State {
    fn hold(&mut self, who: &'static str) {
        self.busy += 1;
        *self.holders.entry(who).or_default() += 1;
    }

    /// How long the ceiling makes us wait in wall time before the clock may show `at_us`.
    #[expect(clippy::cast_precision_loss, reason = "microseconds stay far below 2^53 for 285 years")]
    fn wait_for(&mut self, at_us: u64) -> Option<Duration> {
        let wall = wall_now();
        let speed = self.speed?;
        if at_us <= self.skip_until_us {
            self.anchor = (wall, at_us);
            return None;
        }
        // What lies inside the skip costs nothing.
        if self.skip_until_us > self.anchor.1 {
            self.anchor = (wall, self.skip_until_us);
        }
        let (anchor_wall, anchor_us) = self.anchor;
        let planned =
            anchor_wall + Duration::from_secs_f64(at_us.saturating_sub(anchor_us) as f64 / speed / 1e6);
        if planned > wall {
            return Some(planned - wall);
        }
        if wall - planned > CATCH_UP {
            self.anchor = (wall - CATCH_UP, at_us);
        }
        None
    }
}

impl Holds for Shared {
    fn hold(&self, who: &'static str) {
        self.lock().hold(who);
    }

    fn release(&self, who: &'static str) {
        let mut state = self.lock();
        state.busy = state.busy.saturating_sub(1);
        if let Some(count) = state.holders.get_mut(who) {
            *count -= 1;
            if *count == 0 {
                state.holders.remove(who);
            }
        }
        if state.busy == 0 {
            drop(state);
            self.changed.notify_all();
        }
    }
}

impl Clock for SteppedClock {
    fn now(&self) -> Now {
        let us = self.shared.lock().now_us;
        Now { mono: MonoUs(us), utc: self.shared.utc_at_origin.plus(i64::try_from(us).unwrap_or(i64::MAX)) }
    }

    fn is_simulated(&self) -> bool {
        true
    }
}

impl Timer for SteppedClock {
    fn sleep_until(&self, at: MonoUs) -> BoxFuture<'static, BusyToken> {
        let (wake, woken) = oneshot::channel();
        let mut state = self.shared.lock();
        let number = state.next_number;
        state.next_number += 1;
        let at_us = at.0.max(state.now_us);
        state.sleepers.push(Reverse(Sleeper { at_us, number, wake }));
        drop(state);
        self.shared.changed.notify_all();
        async move {
            match woken.await {
                Ok(token) => token,
                // The clock is gone; nothing will ever happen again.
                Err(_) => std::future::pending().await,
            }
        }
        .boxed()
    }

    fn busy(&self, who: &'static str) -> BusyToken {
        BusyToken::of(Arc::clone(&self.shared) as Arc<dyn Holds>, who)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::{ByteGauge, Wire};
    use std::sync::atomic::{AtomicU64, Ordering};
    use tokio::sync::mpsc;

    fn clock(speed: Option<f64>) -> SteppedClock {
        SteppedClock::new(SteppedOptions { utc_at_origin: UtcUs(1_000_000), speed }).unwrap()
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
    async fn a_year_of_waiting_takes_no_time_and_stops_at_each_wake_up() {
        let clock = clock(None);
        for day in 1..=365u64 {
            let at = MonoUs(day * 86_400_000_000);
            let _awake = clock.sleep_until(at).await;
            assert_eq!(clock.now().mono, at);
        }
    }

    /// Actors pass a message round a ring, each waiting its own time; whoever looked at the clock too early or was
    /// overtaken by it would read another time than the sum of all waits so far.
    #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
    async fn time_never_overtakes_a_message() {
        let clock = clock(None);
        let start = clock.busy("set-up");
        let (first, mut from) = mpsc::channel::<(u64, BusyToken)>(1);
        for wait in 1..=8u64 {
            let (into, next) = mpsc::channel(1);
            let mut inbox = std::mem::replace(&mut from, next);
            let clock = clock.clone();
            tokio::spawn(async move {
                while let Some((sum, token)) = inbox.recv().await {
                    assert_eq!(clock.now().mono.0, sum, "the clock ran on while a message was under way");
                    let sleep = clock.sleep_until(MonoUs(sum + wait * 7));
                    drop(token);
                    let awake = sleep.await;
                    tokio::task::yield_now().await;
                    assert_eq!(clock.now().mono.0, sum + wait * 7);
                    if into.send((sum + wait * 7, awake)).await.is_err() {
                        return;
                    }
                }
            });
        }
        let round = (1..=8u64).map(|w| w * 7).sum::<u64>();
        first.send((0, start)).await.unwrap();
        for n in 1..=500u64 {
            let (sum, token) = from.recv().await.unwrap();
            assert_eq!(sum, n * round);
            first.send((sum, token)).await.unwrap();
        }
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
    async fn it_stands_still_while_somebody_is_busy() {
        let clock = clock(None);
        let busy = clock.busy("test");
        let sleep = clock.sleep_until(MonoUs(10));
        crate::clock::wall_sleep(Duration::from_millis(20)).await;
        assert_eq!(clock.now().mono.0, 0);
        assert_eq!(clock.holders(), [("test", 1)]);
        let second = busy.clone();
        drop(busy);
        crate::clock::wall_sleep(Duration::from_millis(20)).await;
        assert_eq!(clock.now().mono.0, 0, "a copied token holds by itself");
        drop(second);
        let _awake = sleep.await;
        assert_eq!(clock.now().mono.0, 10);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_sleeper_that_was_dropped_is_not_waited_for() {
        let clock = clock(None);
        let start = clock.busy("set-up");
        let never = clock.sleep_until(MonoUs(5));
        let sleep = clock.sleep_until(MonoUs(50));
        drop(never);
        drop(start);
        let _awake = sleep.await;
        assert_eq!(clock.now().mono.0, 50);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_sleeper_that_was_woken_but_dropped_lets_the_clock_go() {
        let clock = clock(None);
        let woken = clock.sleep_until(MonoUs(5));
        while clock.now().mono.0 < 5 {
            tokio::task::yield_now().await;
        }
        drop(woken);
        let _awake = clock.sleep_until(MonoUs(6)).await;
        assert_eq!(clock.now().mono.0, 6);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn the_ceiling_holds_except_where_it_is_skipped() {
        // The ceiling counts from when the clock was last awake, a busy machine takes the time later: 20 of 50 ms must show.
        let clock = clock(Some(100.0));
        let wall = wall_now();
        let awake = clock.sleep_until(MonoUs(5_000_000)).await;
        assert!(wall.elapsed() >= Duration::from_millis(20), "{:?}", wall.elapsed());
        clock.skip_until(MonoUs(3_600_000_000));
        let wall = wall_now();
        let sleep = clock.sleep_until(MonoUs(3_600_000_000));
        drop(awake);
        let awake = sleep.await;
        assert!(wall.elapsed() < Duration::from_secs(2));
        let wall = wall_now();
        let sleep = clock.sleep_until(MonoUs(3_605_000_000));
        drop(awake);
        let _awake = sleep.await;
        assert!(wall.elapsed() >= Duration::from_millis(20), "{:?}", wall.elapsed());
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
    async fn bytes_that_nobody_read_hold_the_clock() {
        let clock = clock(None);
        let timer: Arc<dyn Timer> = Arc::new(clock.clone());
        let gauge = ByteGauge::new(Arc::clone(&timer), "wire");
        let start = clock.busy("set-up");
        gauge.wrote(3);
        let sleep = clock.sleep_until(MonoUs(1));
        drop(start);
        crate::clock::wall_sleep(Duration::from_millis(10)).await;
        assert_eq!((clock.now().mono.0, gauge.under_way()), (0, 3));
        gauge.read(2);
        crate::clock::wall_sleep(Duration::from_millis(10)).await;
        assert_eq!(clock.now().mono.0, 0);
        gauge.read(1);
        let _awake = sleep.await;
        let wire = Wire::new(&timer);
        wire.from_host.wrote(9);
        wire.from_host.abandon();
        assert_eq!(wire.from_host.under_way(), 0);
    }

    #[test]
    fn the_thread_ends_with_the_clock() {
        let clock = clock(None);
        let shared = Arc::downgrade(&clock.shared);
        let count = AtomicU64::new(0);
        drop(clock);
        while shared.upgrade().is_some() && count.fetch_add(1, Ordering::Relaxed) < 1_000_000 {
            std::thread::yield_now();
        }
        assert!(shared.upgrade().is_none());
    }
}
