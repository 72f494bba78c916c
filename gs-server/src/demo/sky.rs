//! What an orbit would say: when the satellite is in view. Between passes time is skipped.

use mission::{MonoUs, Now, SatelliteId, UtcUs};
use satellite::PassProfile;

use super::scene::Scene;
use crate::clock::SteppedClock;
use crate::engine::{EngineInbox, EngineMessage};

/// So long before a pass the watcher wants to look again.
const BEFORE_AOS_US: u64 = 5_000_000;

pub(super) struct Sky {
    passes: PassProfile,
    /// Satellite time minus clock time.
    ahead_us: u64,
    clock: SteppedClock,
    engine: EngineInbox,
    told: Option<bool>,
    next_change_us: Option<u64>,
}

impl Sky {
    pub(super) fn new(scene: &Scene, passes: &PassProfile) -> Self {
        Self {
            passes: passes.clone(),
            ahead_us: scene.start_us,
            clock: scene.clock.clone(),
            engine: scene.ready.inbox.clone(),
            told: None,
            next_change_us: None,
        }
    }

    /// Looks at the sky, and tells the engine when it has changed. With `watched`, time between passes is skipped.
    pub(super) async fn look(&mut self, now: Now, watched: bool) -> bool {
        let sky_us = now.mono.0 + self.ahead_us;
        let in_view = self.passes.in_view(sky_us);
        if self.told != Some(in_view) {
            self.told = Some(in_view);
            self.next_change_us =
                self.passes.next_change_us(sky_us).map(|us| us.saturating_sub(self.ahead_us));
            let until = self.next_change_us.map(|us| UtcUs(now.utc.0 + (us - now.mono.0).cast_signed()));
            if let Ok(satellite) = SatelliteId::new("pixelsat-1") {
                let in_view = in_view.then_some(until);
                self.engine.send(EngineMessage::View { satellite, in_view }).await;
            }
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
