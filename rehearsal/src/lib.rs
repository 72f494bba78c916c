//! Mission and satellite joined in stepped time: the ground's engine, the radio driver, the module, the air and the
//! twin in one thread, without tokio, SQL or a clock.
//!
//! [`World`] steps from event to event. At every step the [`checks`](Violation) hold what the engine does against what
//! the store holds and what the twin obeyed. A run is decided by its seed: the same seed gives the same log hash, and a
//! failing seed replays itself bit for bit.
//!
//! The world kills the engine at random moments (what was not committed is gone, what was radiated is radiated), lets
//! storage fail, and restarts from what the store holds. Time stands still while a batch is unconfirmed.
//!
//! [`mod@rehearse`] sends a plan through its coming pass in many such worlds, and tells what may be expected of it.
//!
//! What it does **not** do: real time, real ports, real databases. Those are `gs-server demo` and the end-to-end tests.
//!
//! ```
//! use rehearsal::{World, WorldConfig};
//!
//! let mut world = World::new(WorldConfig { image_bytes: 2_000, ..WorldConfig::seeded(7) });
//! let report = world.run_until_image(3_600).unwrap();
//! assert!(report.images_equal);
//! ```

mod checks;
mod config;
pub mod downlink;
pub mod fleet;
mod operator;
mod parts;
pub mod rehearse;
mod report;
mod store;
mod strangers;
mod world;

pub use checks::{Invariant, Violation};
pub use config::{Chaos, Known, Operator, Strangers, WorldConfig};
pub use report::Report;
pub use world::World;
