//! `[rotator]` and `[rig]`: what stands behind hamlib's daemons. Both are optional.

use mission::pointing::{Mount, MountFault, MountSettings, Position, RigSteps};
use serde::Deserialize;

use super::ConfigError;

/// `[rotator]`: the antenna's rotator behind rotctld.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RotatorSection {
    /// Host and port of rotctld. Default `127.0.0.1:4533`.
    pub address: String,
    /// First and last azimuth of the dial, degrees. Default `[0, 360]`; also `[-180, 180]`, `[0, 450]`.
    pub azimuth_range: (f64, f64),
    /// First and last elevation, degrees. Default `[0, 90]`; `[0, 180]` for a rotator that can flip.
    pub elevation_range: (f64, f64),
    /// Elevations beyond 90 may be used. Default `false`.
    pub flip: bool,
    /// An azimuth range of more than one turn may be used as a whole. Default `true`.
    pub overlap: bool,
    /// How fast the azimuth turns, degrees/s. Default 6.
    pub azimuth_rate_deg_s: f64,
    /// How fast the elevation turns, degrees/s. Default 3.
    pub elevation_rate_deg_s: f64,
    /// Smaller moves are not commanded, degrees. Default 2.
    pub dead_band_deg: f64,
    /// While it follows a satellite the antenna does not look lower, degrees. Default: where `elevation_range` begins.
    pub minimum_elevation: Option<f64>,
    /// Where it rests, azimuth and elevation in degrees. Without it the rotator's own park command is used.
    pub park: Option<(f64, f64)>,
    /// How long an answer may take, milliseconds. Default 2000; slow serial rotators need 5000.
    pub reply_timeout_ms: u32,
}

impl Default for RotatorSection {
    fn default() -> Self {
        let mount = MountSettings::default();
        Self {
            address: "127.0.0.1:4533".into(),
            azimuth_range: mount.azimuth_deg,
            elevation_range: mount.elevation_deg,
            flip: false,
            overlap: true,
            azimuth_rate_deg_s: mount.azimuth_rate_deg_s,
            elevation_rate_deg_s: mount.elevation_rate_deg_s,
            dead_band_deg: mount.dead_band_deg,
            minimum_elevation: None,
            park: None,
            reply_timeout_ms: 2_000,
        }
    }
}

impl RotatorSection {
    /// What the mount can do.
    ///
    /// # Errors
    /// [`MountFault`] for values that cannot be; not after [`super::Config::check`].
    pub fn mount(&self) -> Result<Mount, MountFault> {
        let (first, last) = self.azimuth_range;
        let position = |(azimuth_deg, elevation_deg)| Position { azimuth_deg, elevation_deg };
        Mount::new(MountSettings {
            azimuth_deg: (first, if self.overlap { last } else { last.min(first + 360.0) }),
            elevation_deg: self.elevation_range,
            flip: self.flip,
            azimuth_rate_deg_s: self.azimuth_rate_deg_s,
            elevation_rate_deg_s: self.elevation_rate_deg_s,
            dead_band_deg: self.dead_band_deg,
            minimum_elevation_deg: self.minimum_elevation.unwrap_or(self.elevation_range.0),
            park: self.park.map(position),
        })
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        check_address("rotator", &self.address, "127.0.0.1:4533")?;
        check_timeout("rotator", self.reply_timeout_ms)?;
        let fault = |MountFault { key, problem, remedy }| {
            ConfigError::value(format!("rotator.{key}"), problem, remedy)
        };
        self.mount().map(drop).map_err(fault)
    }
}

/// `[rig]`: a rig behind rigctld that is tuned with the Doppler shift. The E22 needs none.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigSection {
    /// Host and port of rigctld. Default `127.0.0.1:4532`.
    #[serde(default = "rigctld")]
    pub address: String,
    /// What the satellite sends on, Hz.
    pub downlink_hz: u64,
    /// What the satellite listens on, Hz: the rig's split frequency follows. Without it only the receiver is tuned.
    #[serde(default)]
    pub uplink_hz: Option<u64>,
    /// The rig's frequencies are multiples of it, Hz. Default 10.
    #[serde(default = "resolution")]
    pub resolution_hz: u32,
    /// Smaller changes are not commanded, Hz. Default 100.
    #[serde(default = "step")]
    pub step_hz: u32,
    /// How long an answer may take, milliseconds. Default 2000.
    #[serde(default = "reply_timeout")]
    pub reply_timeout_ms: u32,
}

fn rigctld() -> String {
    "127.0.0.1:4532".into()
}

fn resolution() -> u32 {
    RigSteps::default().resolution_hz
}

fn step() -> u32 {
    RigSteps::default().threshold_hz
}

const fn reply_timeout() -> u32 {
    2_000
}

impl RigSection {
    /// How it is tuned.
    pub fn steps(&self) -> RigSteps {
        RigSteps { resolution_hz: self.resolution_hz, threshold_hz: self.step_hz, ..RigSteps::default() }
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        check_address("rig", &self.address, "127.0.0.1:4532")?;
        check_timeout("rig", self.reply_timeout_ms)?;
        for (key, hz) in [("downlink_hz", Some(self.downlink_hz)), ("uplink_hz", self.uplink_hz)] {
            if hz.is_some_and(|hz| !(1_000_000..=10_000_000_000).contains(&hz)) {
                return Err(ConfigError::value(
                    format!("rig.{key}"),
                    format!("{} Hz", hz.unwrap_or_default()),
                    "Give a frequency in Hz, 1 MHz to 10 GHz.",
                ));
            }
        }
        for (key, hz) in [("resolution_hz", self.resolution_hz), ("step_hz", self.step_hz)] {
            if !(1..=100_000).contains(&hz) {
                return Err(ConfigError::value(
                    format!("rig.{key}"),
                    format!("{hz} Hz"),
                    "Give 1 to 100000.",
                ));
            }
        }
        Ok(())
    }
}

fn check_address(section: &str, address: &str, example: &str) -> Result<(), ConfigError> {
    let is_one = address
        .rsplit_once(':')
        .is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0));
    if is_one {
        return Ok(());
    }
    Err(ConfigError::value(
        format!("{section}.address"),
        format!("'{address}' is no host and port"),
        format!("Give host:port, as in {example}."),
    ))
}

fn check_timeout(section: &str, timeout_ms: u32) -> Result<(), ConfigError> {
    if (50..=30_000).contains(&timeout_ms) {
        return Ok(());
    }
    Err(ConfigError::value(
        format!("{section}.reply_timeout_ms"),
        format!("{timeout_ms} ms"),
        "Give 50 to 30000; 2000 suits most, 5000 slow serial rotators.",
    ))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::config::Config;

    fn checked(sections: &str) -> Result<Config, String> {
        let text = format!(
            "[station]\nname = \"a\"\n[[satellites]]\nname = \"s\"\n\
             [[links]]\nname = \"l\"\nsatellite = \"s\"\nkind = \"serial\"\nport = \"/dev/null\"\n\
             [storage]\nfolder = \"d\"\n{sections}"
        );
        let config = Config::from_toml(&text, Path::new("/srv")).map_err(|error| error.to_string())?;
        config.check().map_err(|error| error.to_string())?;
        Ok(config)
    }

    #[test]
    fn sections_with_and_without_values_are_taken() {
        assert!(checked("").unwrap().rotator.is_none());
        let config = checked("[rotator]\n[rig]\ndownlink_hz = 435_000_000\n").unwrap();
        assert_eq!(config.rotator.unwrap().address, "127.0.0.1:4533");
        assert_eq!(config.rig.unwrap().steps().threshold_hz, 100);
        let config = checked(
            "[rotator]\naddress = \"antenna.local:4600\"\nazimuth_range = [0, 450]\noverlap = false\n\
             elevation_range = [0, 180]\nflip = true\npark = [180, 0]\nminimum_elevation = 2\n",
        )
        .unwrap();
        let mount = config.rotator.unwrap().mount().unwrap();
        assert_eq!(mount.settings().azimuth_deg, (0.0, 360.0));
        assert_eq!(mount.settings().minimum_elevation_deg, 2.0);
    }

    #[test]
    fn what_cannot_be_is_refused_with_its_key_and_a_remedy() {
        for (section, key) in [
            ("[rotator]\naddress = \"4533\"", "rotator.address"),
            ("[rotator]\naddress = \"here:0\"", "rotator.address"),
            ("[rotator]\nazimuth_range = [360, 0]", "rotator.azimuth_range"),
            ("[rotator]\nazimuth_range = [nan, 360]", "rotator.azimuth_range"),
            ("[rotator]\nelevation_range = [0, 270]", "rotator.elevation_range"),
            ("[rotator]\nflip = true", "rotator.flip"),
            ("[rotator]\nazimuth_rate_deg_s = 0", "rotator.azimuth_rate_deg_s"),
            ("[rotator]\ndead_band_deg = 0", "rotator.dead_band_deg"),
            ("[rotator]\nminimum_elevation = -3", "rotator.minimum_elevation"),
            ("[rotator]\npark = [500, 0]", "rotator.park"),
            ("[rotator]\nreply_timeout_ms = 0", "rotator.reply_timeout_ms"),
            ("[rig]\ndownlink_hz = 435", "rig.downlink_hz"),
            ("[rig]\ndownlink_hz = 435000000\nuplink_hz = 1", "rig.uplink_hz"),
            ("[rig]\ndownlink_hz = 435000000\nresolution_hz = 0", "rig.resolution_hz"),
            ("[rig]\ndownlink_hz = 435000000\naddress = \"\"", "rig.address"),
        ] {
            let told = checked(section).unwrap_err();
            assert!(told.contains(&format!("key {key}: ")) && told.contains("Give"), "{told}");
        }
        assert!(checked("[rotator]\nazimut_range = [0, 360]").unwrap_err().contains("azimut_range"));
        assert!(checked("[rig]\n").unwrap_err().contains("downlink_hz"));
    }
}
