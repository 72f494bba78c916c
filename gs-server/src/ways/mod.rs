//! Ways in over the network for what others heard: `[[ears]]` of the configuration.
//!
//! | file | idea |
//! |---|---|
//! | [`status`] | how each way stands: state, age, errors, counts |
//! | `boards` | what boards of one's own say of themselves |
//! | `intake` | messages of boards into the archive; the bounded queue before it |
//! | `mqtt` | packets on the wire; a client of somebody's broker |
//! | `broker` | a broker of our own: it takes, and passes nothing on |
//! | `poll` | the HTTP API of TinyGS and the database of SatNOGS, asked politely |
//!
//! Everything that comes is a stranger's: it goes through [`crate::ingest`], which is bounded and believes little. Nothing
//! here can transmit, or make a board transmit: there is no code for `tx`, `reset` or `update`.

mod boards;
mod broker;
mod intake;
mod mqtt;
mod poll;
mod secret;
pub mod status;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use mission::SatelliteId;
use mission::alert::Condition;

use crate::clock::{SystemClock, Timer};
use crate::config::{Config, EarKind};
use crate::ingest::{Aliases, Ears};
use crate::lifecycle::Lifecycle;
use crate::run::RunError;
use crate::storage::Store;

use boards::Boards;
pub(crate) use secret::load as secret;
use status::Way;
pub use status::WaysHandle;

/// Tells the alerts what is wrong with whom; `None`: nothing any more.
pub(crate) type Tell = Arc<dyn Fn(&str, Option<Condition>) + Send + Sync>;

/// What the ways need.
pub(crate) struct WaysParts<'a> {
    pub(crate) config: &'a Config,
    pub(crate) ears: Ears,
    pub(crate) aliases: Aliases,
    pub(crate) store: Store,
    pub(crate) timer: Arc<dyn Timer>,
    pub(crate) tell: Tell,
}

/// Opens every way of the configuration; they live as long as `life`.
///
/// # Errors
/// [`RunError`] when a broker cannot listen, or a file that it needs cannot be read.
pub(crate) async fn open(parts: WaysParts<'_>, life: &Lifecycle) -> Result<WaysHandle, RunError> {
    let WaysParts { config, ears, aliases, store, timer, tell } = parts;
    let boards = Boards::default();
    // Sockets and their time-outs run on the machine's clock, however fast the station's own goes.
    let machine: Arc<dyn Timer> = Arc::new(SystemClock::new());
    let mut ways = Vec::new();
    for section in &config.ears {
        let Some(satellite) = section.satellite(config).and_then(|name| SatelliteId::new(name).ok()) else {
            continue;
        };
        let way = Arc::new(Way::new(section, &satellite, Arc::clone(&timer), Arc::clone(&tell)));
        ways.push(Arc::clone(&way));
        let (stop, name) = (life.soft.clone(), format!("ear {}", section.name));
        match section.kind {
            EarKind::Mqtt | EarKind::Broker => {
                let (intake, worker) = intake::Intake::new(
                    ears.clone(),
                    aliases.clone(),
                    satellite,
                    boards.clone(),
                    Arc::clone(&way),
                );
                let ending = stop.clone();
                life.spawn(format!("{name}, its queue"), async move {
                    worker.run(ending).await;
                    Ok(())
                });
                if section.kind == EarKind::Mqtt {
                    let client =
                        mqtt::Client::new(section, &config.station.name, intake, way, Arc::clone(&machine));
                    life.spawn(name, async move {
                        client.run(stop).await;
                        Ok(())
                    });
                } else {
                    let broker = broker::Broker::open(section, intake, way, Arc::clone(&machine)).await?;
                    life.spawn(name, async move {
                        broker.run(stop).await;
                        Ok(())
                    });
                }
            }
            EarKind::TinygsApi | EarKind::SatnogsDb => {
                let parts = poll::PollerParts {
                    section: section.clone(),
                    satellite,
                    config,
                    ears: ears.clone(),
                    aliases: aliases.clone(),
                    store: store.clone(),
                    timer: Arc::clone(&timer),
                    way,
                };
                let poller = poll::Poller::new(parts)?;
                life.spawn(name, async move {
                    poller.run(stop).await;
                    Ok(())
                });
            }
        }
    }
    Ok(WaysHandle::new(ways, boards, timer))
}
