//! What rotctld can be asked.

use std::sync::Arc;

use mission::pointing::Position;

use super::connection::{Connection, Patience, value};
use super::error::HamlibError;
use crate::clock::Timer;

/// The limits that a daemon tells of its rotator, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotatorLimits {
    /// First and last azimuth.
    pub azimuth_deg: (f64, f64),
    /// First and last elevation.
    pub elevation_deg: (f64, f64),
}

/// A rotator behind rotctld.
pub struct RotatorClient {
    connection: Connection,
    limits: Option<RotatorLimits>,
    info: Option<String>,
}

impl RotatorClient {
    /// Connects, and asks for name and limits. Daemons that tell neither are taken all the same.
    ///
    /// # Errors
    /// [`HamlibError`] when nobody is there, or somebody who speaks otherwise.
    pub async fn connect(
        address: &str,
        patience: Patience,
        timer: &Arc<dyn Timer>,
    ) -> Result<Self, HamlibError> {
        let (mut connection, answer) =
            Connection::open_asking(address, patience, timer, async |connection| {
                connection.ask("dump_state", "").await
            })
            .await?;
        let limits = match answer {
            Ok(lines) => limits(&connection, &lines),
            // Very old daemons do not know it, and say nothing. A late answer must not be taken for another.
            Err(HamlibError::Silent { .. }) => {
                connection = Connection::open(address, patience, timer).await?;
                None
            }
            Err(error) if error.breaks_connection() => return Err(error),
            Err(_) => None,
        };
        let mut client = Self { connection, limits, info: None };
        client.info = match client.connection.ask("get_info", "").await {
            Ok(lines) => value(&lines, "Info").map(|info| info.chars().take(80).collect()),
            Err(error) if error.breaks_connection() => return Err(error),
            Err(_) => None,
        };
        Ok(client)
    }

    /// What the rotator calls itself.
    #[must_use]
    pub fn info(&self) -> Option<&str> {
        self.info.as_deref()
    }

    /// What the daemon says of its limits.
    #[must_use]
    pub fn limits(&self) -> Option<RotatorLimits> {
        self.limits
    }

    /// Where it stands.
    ///
    /// # Errors
    /// [`HamlibError`]; `Malformed` for what is no angle.
    pub async fn position(&mut self) -> Result<Position, HamlibError> {
        let lines = self.connection.ask("get_pos", "").await?;
        let azimuth_deg = self.connection.number("get_pos", &lines, "Azimuth")?;
        let elevation_deg = self.connection.number("get_pos", &lines, "Elevation")?;
        for (what, angle) in [("Azimuth", azimuth_deg), ("Elevation", elevation_deg)] {
            if angle.abs() > 1_000.0 {
                return Err(self.connection.malformed("get_pos", what, &angle.to_string()));
            }
        }
        Ok(Position { azimuth_deg, elevation_deg })
    }

    /// Tells it where to turn. It is on its way when this comes back, not there.
    ///
    /// # Errors
    /// [`HamlibError`]; positions that are not finite, or beyond what the daemon told, are refused before they are sent.
    pub async fn set_position(&mut self, position: Position) -> Result<(), HamlibError> {
        let (azimuth, elevation) = (rounded(position.azimuth_deg), rounded(position.elevation_deg));
        let text = format!("{azimuth:.2} {elevation:.2}");
        let is_inside = |angle: f64, range: (f64, f64)| (range.0 - 0.005..=range.1 + 0.005).contains(&angle);
        let allowed = position.is_finite()
            && self.limits.is_none_or(|limits| {
                is_inside(azimuth, limits.azimuth_deg) && is_inside(elevation, limits.elevation_deg)
            });
        if !allowed {
            return Err(HamlibError::Refused {
                address: self.connection.address().to_owned(),
                command: format!("set_pos {text}"),
                code: -1,
            });
        }
        self.connection.ask("set_pos", &text).await.map(drop)
    }

    /// Stops it where it is.
    ///
    /// # Errors
    /// [`HamlibError`].
    pub async fn stop(&mut self) -> Result<(), HamlibError> {
        self.connection.ask("stop", "").await.map(drop)
    }

    /// Its own park command.
    ///
    /// # Errors
    /// [`HamlibError`]; `Refused` by models that have none.
    pub async fn park(&mut self) -> Result<(), HamlibError> {
        self.connection.ask("park", "").await.map(drop)
    }
}

/// To the two decimals that daemons print, without a negative zero.
fn rounded(angle_deg: f64) -> f64 {
    (angle_deg * 100.0).round() / 100.0 + 0.0
}

/// Limits that are ranges; otherwise the daemon told nothing of use.
fn limits(connection: &Connection, lines: &[String]) -> Option<RotatorLimits> {
    let number = |key, plain: &str| {
        let of_old =
            lines.iter().find_map(|line| line.strip_prefix(plain)?.strip_prefix('=')?.trim().parse().ok());
        connection.number("dump_state", lines, key).ok().or(of_old).filter(|angle: &f64| angle.is_finite())
    };
    let azimuth_deg = (number("Minimum Azimuth", "min_az")?, number("Maximum Azimuth", "max_az")?);
    let elevation_deg = (number("Minimum Elevation", "min_el")?, number("Maximum Elevation", "max_el")?);
    let are_ranges = azimuth_deg.0 < azimuth_deg.1 && elevation_deg.0 < elevation_deg.1;
    are_ranges.then_some(RotatorLimits { azimuth_deg, elevation_deg })
}
