//! When the satellite is in view, by its orbit. Between passes time is skipped.

use mission::{MonoUs, Now};

use super::scene::Scene;
use crate::clock::SteppedClock;

/// So long before a pass the watcher wants to look again.
const BEFORE_AOS_US: u64 = 5_000_000;

pub(super) struct Sky {
    sky: satellite::Sky,
    /// Satellite time minus clock time.
    ahead_us: u64,
    clock: SteppedClock,
    seen: Option<bool>,
    next_change_us: Option<u64>,
}

impl Sky {
    pub(super) fn new(scene: &Scene) -> Self {
        Self {
            sky: scene.sky.clone(),
            ahead_us: scene.start_us,
            clock: scene.clock.clone(),
            seen: None,
            next_change_us: None,
        }
    }

    /// Looks at the sky. With `watched`, time between passes is skipped.
    pub(super) fn look(&mut self, now: Now, watched: bool) -> bool {
        let sky_us = now.mono.0 + self.ahead_us;
        let in_view = self.sky.in_view(sky_us);
        if self.seen != Some(in_view) {
            self.seen = Some(in_view);
            self.next_change_us = self.sky.next_change_us(sky_us).map(|us| us.saturating_sub(self.ahead_us));
            if let (false, true, Some(next_us)) = (in_view, watched, self.next_change_us) {
                self.clock.skip_until(MonoUs(next_us.saturating_sub(BEFORE_AOS_US)));
            }
        }
        in_view
    }

    /// When the sky changes next, on the clock's scale.
    pub(super) fn next_us(&self) -> Option<u64> {
        self.next_change_us
    }
}
