//! Links: each is an actor between the engine and one way to a radio.
//!
//! | kind | far end | parts |
//! |---|---|---|
//! | `serial` | a module on a serial port or pseudo-terminal | [`driven`] + `serial` |
//! | `tcp` | the same behind a TCP connection | [`driven`] + `tcp` |
//! | `replay` | a file | `replay` |
//!
//! A link that is not there is looked for for ever, twice a second; it never stops the server. What it does **not** do:
//! find frames, decide when to transmit.

pub mod driven;
pub(crate) mod port;
mod replay;
pub(crate) mod serial;
mod tcp;

use std::sync::Arc;

use mission::LinkId;
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use crate::clock::{BusyToken, Timer, Wire};
use crate::config::{LinkKind, LinkSection};
use crate::engine::{EngineInbox, LinkCommand};

pub use serial::port_names;

/// What a link is made of.
pub struct LinkParts {
    /// Its name.
    pub id: LinkId,
    /// Its section of the configuration.
    pub section: LinkSection,
    /// The way to the engine.
    pub engine: EngineInbox,
    /// What the engine wants.
    pub commands: mpsc::Receiver<(LinkCommand, BusyToken)>,
    /// The clock.
    pub timer: Arc<dyn Timer>,
    /// How bytes under way are counted, when the far end lives in this process on a stepped clock.
    pub wire: Option<Wire>,
}

/// Runs a link until `stop`. A frame that is being sent is sent to its end, for 2.5 s at most.
pub async fn run(parts: LinkParts, stop: CancellationToken) {
    match parts.section.kind {
        LinkKind::Serial => {
            let connector = serial::Serial::new(&parts.section);
            driven::run(parts, connector, stop).await;
        }
        LinkKind::Tcp => {
            let connector = tcp::Tcp::new(&parts.section);
            driven::run(parts, connector, stop).await;
        }
        LinkKind::Replay => replay::run(parts, stop).await,
    }
}
