//! What systemd wants to hear (`Type=notify`): that we are ready, that we live, that we stop. Without systemd nothing
//! of this happens.

use std::time::Duration;

use sd_notify::NotifyState;

use crate::clock::{wall_sleep, within};
use crate::engine::EngineHandle;
use crate::lifecycle::Lifecycle;

/// Tells that the server is ready, and from then on, half as long as the unit's `WatchdogSec` apart, that it lives: only while
/// the engine answers. An engine that hangs lets systemd start the server anew.
pub fn tell_systemd(life: &Lifecycle, engine: &EngineHandle) {
    let (engine, stop) = (engine.clone(), life.soft.clone());
    let watchdog = sd_notify::watchdog_enabled();
    tell(&[NotifyState::Ready]);
    life.spawn("systemd", async move {
        loop {
            let Some(every) = watchdog.map(|limit| limit / 2) else {
                stop.cancelled().await;
                break;
            };
            tokio::select! {
                () = stop.cancelled() => break,
                () = beat(&engine, every) => {}
            }
        }
        tell(&[NotifyState::Stopping]);
        Ok(())
    });
}

async fn beat(engine: &EngineHandle, every: Duration) {
    if within(every, engine.answers()).await == Some(true) {
        tell(&[NotifyState::Watchdog]);
    } else {
        tracing::error!("the engine does not answer within {} s", every.as_secs());
    }
    wall_sleep(every).await;
}

fn tell(state: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(state) {
        tracing::warn!(%error, "systemd cannot be told how it stands: {error}");
    }
}
