//! A fleet left alone: three satellites, two stations and their plans, for a fortnight in which everything goes wrong.
//!
//! | module | idea |
//! | --- | --- |
//! | `scene` | who takes part, and what ground is told of the orbits |
//! | `plans` | what is planned |
//! | `chaos` | what goes wrong, drawn beforehand |
//! | `incidents` | the same, carried out |
//! | `ground`, `store` | one station, and what is durable there |
//! | `world` | everything joined, stepped by events |
//! | `watch` | nothing radiates outside a window |
//! | `ledger` | every run ends in one record with its reason |
//!
//! Each station commands some satellites and listens to the others: a key is used at one place only, because its nonces are.
//! A violation prints its seed; the seed replays it.

mod chaos;
mod ground;
mod incidents;
mod ledger;
mod plans;
mod report;
mod scene;
mod store;
#[cfg(test)]
mod tests;
mod watch;
mod world;

pub use report::FleetReport;
pub use world::Fleet;
