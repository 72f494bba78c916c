//! The digital twin of the satellite: flight behaviour, camera, attitude and sensors, and the channel to the ground.
//!
//! | module | what |
//! | --- | --- |
//! | [`Twin`] | the flight software: requests of the ICD in, frames out, in the ICD's order of checks |
//! | [`Channel`] | the air: losses, bursts, flipped bits, cut frames, strength, all seeded |
//! | [`PassProfile`] | how it is decided when the satellite is above the horizon: by its orbit, or by stored passes |
//! | [`Orbit`] | what it flies: elements, given or made up for the start |
//! | [`Sky`] | whether it is up now, how high, how far, and when that changes |
//! | [`Device`] | twin, channel and the ground's radio module joined: what the far end of a serial port is |
//! | [`JournalEntry`] | what happened, a line each; [`TwinState`] is rebuilt from it |
//! | [`picture`] | the JPEG the camera takes |
//!
//! Everything is stepped and seeded: the same calls give the same bytes. A year costs seconds.
//!
//! What this crate does **not** do: it has no clock, no threads, no I/O; it does not make the journal durable (whoever
//! takes [`DeviceOutput::Journal`] does, before asking for more); it knows nothing of the ground's engine. Its attitude, power and sensors are plausible, not a model of the real satellite.
//!
//! ```
//! use protocol::{Counter, DownFrame, Downlink, Key, Nonce, RequestTag, Telecommand, seal};
//! use satellite::{Camera, Twin, TwinConfig, TwinState};
//!
//! let key = Key::from_bytes([7; 16]);
//! let config = TwinConfig { camera: Camera::Pattern { size_bytes: 500 }, ..TwinConfig::new(1, key.clone()) };
//! let mut twin = Twin::new(config, TwinState::default());
//!
//! let ping = seal(&key, Nonce::new(Counter(1), [0; 4]), RequestTag::FIRST, &Telecommand::Ping, &[0; 200]);
//! twin.receive(2_500_000, ping.as_bytes());
//! while twin.next_journal().is_some() {} // made durable here
//! let answer = twin.poll(2_600_000).expect("the answer");
//! assert_eq!(DownFrame::parse(&answer).unwrap().packet(), Ok(Downlink::Pong));
//! ```

mod attitude;
mod body;
mod channel;
mod config;
mod device;
mod elements;
mod journal;
mod noise;
mod orbit;
mod passes;
pub mod picture;
mod place;
mod replay;
mod sky;
mod state;
mod stats;
mod store;
mod twin;
mod vector;

pub use channel::{
    Burst, CarriedAt, Channel, ChannelConfig, ChannelStats, LossCause, Reception, Transit, mean_rssi_dbm,
};
pub use config::{Camera, Fault, ImageSource, ReplayPolicy, TwinConfig};
pub use device::{DOPPLER_TOLERANCE_HZ, Device, DeviceConfig, DeviceOutput, DeviceStats};
pub use journal::{JournalEntry, JournalError, Refusal};
pub use orbit::Orbit;
pub use passes::{PassProfile, PassShape, range_km};
pub use replay::AcceptedNonces;
pub use sky::{Sky, SkyLook};
pub use state::{ClockSetting, StateChange, StoredImage, TwinState};
pub use stats::{RefusalCounts, TwinStats};
pub use twin::Twin;
