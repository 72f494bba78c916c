//! The ground's mind, without hands: the station engine as a plain state machine.
//!
//! [`Station`] takes [`Input`]s (bytes, confirmations, intents, the time) and yields [`Effect`]s (persist this,
//! raise the witness, transmit that) and a [`Station::next_wakeup`]. It has no clock, no socket, no file and no
//! randomness of its own, so the same code runs beside a radio, in a demo faster than life and in a seeded
//! simulation of years.
//!
//! Two promises are kept by construction:
//! - *durable before radiated*: a [`Effect::Transmit`] is only ever built from a sealed frame whose batch, witness
//!   and `radiating` stage were confirmed durable;
//! - *durable before told*: a [`Effect::Reply`] follows the confirmation of the batch that holds what it tells.
//!
//! What it does **not** do: read a clock, open a port, know SQL or HTTP.

pub mod alert;
pub mod clock;
pub mod config;
mod cover;
pub mod downlink;
pub mod id;
pub mod intent;
pub mod level;
pub mod limits;
pub mod plan;
pub mod pointing;
pub mod port;
pub mod reception;
pub mod record;
pub mod run;
pub mod schedule;
pub mod sky;
pub mod snapshot;
pub mod stage;
mod station;
pub mod status;
pub mod telemetry;

pub use clock::{Clock, MonoUs, Now, UtcUs};
pub use config::{CounterRule, LinkConfig, Profile, SatelliteConfig, StationConfig};
pub use cover::{Cost, Cover, Range, cheapest_cover};
pub use id::{
    AlertId, AntennaId, BatchId, CommandId, DownloadId, ElementsId, FrameId, ImageId, IntentId, LinkId,
    PassId, PlanId, PlanName, Principal, RunId, SatelliteId, StationId, TxId,
};
pub use intent::{Accepted, CommandIntent, Intent, IntentEnvelope, IntentReceipt, Refusal};
pub use level::Level;
pub use limits::{LimitRule, LimitState};
pub use port::{Effect, Input, Lease, LinkState, MaybeRadiated, ReservedFrame, Transmit};
pub use record::{Batch, Gate, Record, Source};
pub use sky::{ElementSet, PassAhead, Site};
pub use snapshot::Snapshot;
pub use stage::Stage;
pub use station::{Entropy, Station};
pub use status::Status;
