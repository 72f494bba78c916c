//! The ground station's server: the shell around [`mission::Station`].
//!
//! | module | what it holds |
//! |---|---|
//! | [`clock`] | the machine's clock and simulated ones; the only place that reads time or sets a timer |
//! | [`config`] | one TOML file, a struct per section |
//!
//! What it does **not** do: decide what to send or when (the mission engine does), know the wire format (`protocol`
//! does) or the module's commands (`radio` does). Tasks and threads are born only here.

pub mod clock;
pub mod config;
pub mod decode;
pub mod engine;
pub mod http;
pub mod hub;
pub mod keys;
pub mod storage;
pub mod witness;
