//! What a world is made of: the far end of the port, the driver, and names.

use mission::{LinkId, SatelliteId, StationId};
use protocol::Key;
use radio::airtime::LinkTiming;
use radio::driver::{AuxWiring, DriverConfig, ModePins};
use radio::model::ModelConfig;
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use satellite::{Camera, ClockSetting, Device, DeviceConfig, ImageSource, TwinConfig, TwinState};

use crate::config::WorldConfig;

/// The satellite, the air and the module, as configured.
pub(crate) fn device(config: &mut WorldConfig, rng: &mut ChaCha8Rng, key: &Key) -> Device {
    config.channel.seed = rng.random();
    let mut twin = TwinConfig::new(rng.random(), key.clone());
    if !config.real_picture {
        twin.camera = Camera::Pattern { size_bytes: config.image_bytes };
        let mut bytes = vec![0; usize::try_from(config.image_bytes).unwrap_or(0)];
        rng.fill_bytes(&mut bytes);
        twin.image = ImageSource::Bytes { bytes: bytes.into(), width_px: 408, height_px: 304 };
    }
    twin.ranges = config.ranges;
    twin.orbit = config.orbit.clone();
    twin.utc_at_zero_ms = config.utc_at_zero_ms;
    let (mut model, mut timing) = (ModelConfig::prepared(true), LinkTiming::default());
    let (mut state, mut address) = (TwinState::default(), None);
    if let Some(known) = &config.known {
        twin.ranges = known.profile.ranges;
        twin.heartbeat_period_us = known.profile.heartbeat_period_us;
        twin.first_heartbeat_us = known.first_heartbeat_us;
        model = ModelConfig::prepared(known.profile.rssi);
        (model.phy, timing, address) = (known.timing.phy, known.timing, Some(known.profile.address));
        // A satellite in service has its elements.
        state.elements = true;
    }
    if config.known.is_some() || config.strangers.is_some_and(|who| who.abroad) {
        // In service, and of schedules: its clock was set.
        let utc_ms = config.utc_at_zero_ms;
        state.clock = Some(ClockSetting { set_ms: utc_ms, at_utc_ms: utc_ms });
    }
    let made = DeviceConfig::new(twin, config.channel.clone(), model);
    let satellite_address = address.unwrap_or(made.satellite_address);
    Device::new(DeviceConfig { state, timing, satellite_address, ..made })
}

pub(crate) fn driver_config() -> DriverConfig {
    DriverConfig { mode_pins: ModePins::Software, aux: AuxWiring::Absent, ..DriverConfig::default() }
}

#[expect(clippy::expect_used, reason = "a literal that keeps the rule of names")]
pub(crate) fn named(name: &str) -> SatelliteId {
    SatelliteId::new(name).expect("a legal name")
}

#[expect(clippy::expect_used, reason = "a literal that keeps the rule of names")]
pub(crate) fn named_link(name: &str) -> LinkId {
    LinkId::new(name).expect("a legal name")
}

#[expect(clippy::expect_used, reason = "a literal that keeps the rule of names")]
pub(crate) fn station_name() -> StationId {
    StationId::new("home").expect("a legal name")
}
