//! A client of somebody's broker: it listens to what boards publish and says nothing but what MQTT wants said.

use std::sync::Arc;

use futures_util::{SinkExt as _, StreamExt as _};
use rumqttc::mqttbytes::v4::{Packet, PubComp};
use tokio_util::sync::CancellationToken;

use super::connect::{KEEP_ALIVE_S, NoConnection, connect};
use super::wire::{Came, Wire};
use super::words::Words;
use crate::clock::Timer;
use crate::config::EarSection;
use crate::ways::intake::{Came as Taken, Intake};
use crate::ways::status::Way;

/// The first pause before another try, microseconds; doubled each time.
const PAUSE_US: u64 = 2_000_000;
/// The longest.
const LONGEST_US: u64 = 300_000_000;
/// The pause after a refusal: a wrong password must not be tried each second.
const REFUSED_US: u64 = 600_000_000;
/// A connection that held so long makes the next pause a short one again.
const HELD_US: u64 = 60_000_000;

/// The client.
pub(in crate::ways) struct Client {
    section: EarSection,
    client_id: String,
    intake: Intake,
    way: Arc<Way>,
    machine: Arc<dyn Timer>,
}

impl Client {
    pub(in crate::ways) fn new(
        section: &EarSection,
        station: &str,
        intake: Intake,
        way: Arc<Way>,
        machine: Arc<dyn Timer>,
    ) -> Self {
        // Never as a board: two clients with one id push each other off.
        let client_id = section
            .client_id
            .clone()
            .unwrap_or_else(|| format!("pixelsat-ground-{station}-{}", section.name));
        Self { section: section.clone(), client_id, intake, way, machine }
    }

    /// Listens until `stop`, and takes its leave then.
    pub(in crate::ways) async fn run(self, stop: CancellationToken) {
        let mut pause_us = PAUSE_US;
        loop {
            let begun = self.machine.now().mono;
            let wait_us = match self.once(&stop).await {
                Ok(()) => return,
                Err(NoConnection::Failed(why)) => {
                    self.way.fails(&why);
                    if self.machine.now().mono.since(begun) >= HELD_US {
                        pause_us = PAUSE_US;
                    }
                    let wait_us = pause_us;
                    pause_us = (pause_us * 2).min(LONGEST_US);
                    wait_us
                }
                Err(NoConnection::Refused(why)) => {
                    self.way.refuses(&why);
                    REFUSED_US
                }
            };
            let sleep = self.machine.sleep_until(self.machine.now().mono.plus(wait_us));
            tokio::select! {
                () = stop.cancelled() => return,
                _ = sleep => {}
            }
        }
    }

    /// One connection, until it breaks; `Ok` when we are to stop.
    async fn once(&self, stop: &CancellationToken) -> Result<(), NoConnection> {
        let connecting = connect(&self.section, &self.client_id);
        let mut wire = tokio::select! {
            () = stop.cancelled() => return Ok(()),
            wire = connecting => wire?,
        };
        self.way.count("connections");
        self.way.works();
        let broke = |why: String| NoConnection::Failed(why);
        let period_us = u64::from(KEEP_ALIVE_S) * 500_000;
        let mut ping_at = self.machine.now().mono.plus(period_us);
        let mut heard = self.machine.now().mono;
        let mut words = Words::default();
        loop {
            let came = tokio::select! {
                () = stop.cancelled() => {
                    let _ = wire.send(Packet::Disconnect).await;
                    return Ok(());
                }
                word = words.next(), if words.is_any() => {
                    let Some(Ok(word)) = word else { return Err(broke("the archive takes nothing any more".into())) };
                    wire.send(word).await.map_err(|error| broke(error.to_string()))?;
                    continue;
                }
                came = wire.next(), if words.has_room() => came,
                _ = self.machine.sleep_until(ping_at) => {
                    let now = self.machine.now().mono;
                    if now.since(heard) > 3 * period_us {
                        return Err(broke(format!("the broker was silent for {} s", now.since(heard) / 1_000_000)));
                    }
                    ping_at = now.plus(period_us);
                    wire.send(Packet::PingReq).await.map_err(|error| broke(error.to_string()))?;
                    continue;
                }
            };
            heard = self.machine.now().mono;
            match came {
                Some(Ok(came)) => self.take(came, &mut wire, &mut words).await.map_err(broke)?,
                Some(Err(error)) => return Err(broke(error.to_string())),
                None => return Err(broke("the broker hung up".into())),
            }
        }
    }

    async fn take(&self, came: Came, wire: &mut Wire, words: &mut Words) -> Result<(), String> {
        let answer = match came {
            Came::TooLong { is_reception } => {
                if is_reception {
                    self.intake.too_long();
                } else {
                    self.way.count("too-long");
                }
                None
            }
            Came::Packet(Packet::Publish(publish)) => {
                // A retained message is an old one, and boards retain nothing.
                let mut stored = None;
                if publish.retain {
                    self.way.count("retained");
                } else {
                    let wants_word = Words::wants(publish.qos);
                    if let Taken::Waits(word) =
                        self.intake.message(&publish.topic, &publish.payload, wants_word).await
                    {
                        stored = Some(word);
                    }
                    self.way.works();
                }
                words.owe(publish.qos, publish.pkid, stored);
                None
            }
            Came::Packet(Packet::PubRel(release)) => Some(Packet::PubComp(PubComp::new(release.pkid))),
            Came::Packet(Packet::PingResp) => {
                self.way.works();
                None
            }
            Came::Packet(_) => None,
        };
        match answer {
            Some(answer) => wire.send(answer).await.map_err(|error| error.to_string()),
            None => Ok(()),
        }
    }
}
