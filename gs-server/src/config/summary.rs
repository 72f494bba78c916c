//! The configuration in a few lines, for the log at start and `config check`. No secret is in it.

use std::fmt;

use super::Config;

impl fmt::Display for Config {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.is_simulated() { ", simulated" } else { "" };
        writeln!(f, "station {}{kind}, clock {:?}", self.station.name, self.station.clock)?;
        let place = &self.station;
        match (place.latitude_deg, place.longitude_deg) {
            (Some(latitude), Some(longitude)) => writeln!(
                f,
                "place {latitude}, {longitude}, {} m: passes from {} degrees up, {} points of horizon, UT1-UTC {} s",
                place.height_m,
                place.min_elevation_deg,
                place.horizon_deg.len(),
                place.dut1_s,
            )?,
            _ => writeln!(f, "no place: nothing is known of passes")?,
        }
        for satellite in &self.satellites {
            writeln!(
                f,
                "satellite {}: address {:#06x}, {}, tags {}, ranges {}, counter {:?}, heartbeat every {} s, {} limits",
                satellite.name,
                satellite.address,
                match &satellite.key_file {
                    Some(file) => format!("key in {}", file.display()),
                    None => "no key (heard, not commanded)".to_owned(),
                },
                satellite.tags,
                satellite.ranges,
                satellite.counter,
                satellite.heartbeat_period_s,
                satellite.limits.len(),
            )?;
        }
        for link in &self.links {
            writeln!(
                f,
                "link {} to {}: {:?} {}, {} baud, mode pins {:?}, AUX {:?}{}, channel {}, {} Hz, {} dBm, {}{}",
                link.name,
                link.satellite,
                link.kind,
                link.far_end(),
                link.baud,
                link.mode_pins(),
                link.aux(),
                if link.aux_inverted { " inverted" } else { "" },
                link.channel,
                link.frequency_hz,
                link.power_dbm,
                if link.armed { "armed" } else { "not armed" },
                if link.transmit_unverified { ", transmits unverified" } else { "" },
            )?;
        }
        writeln!(
            f,
            "storage {}{}: reserve {} bytes, {}",
            self.storage.folder.display(),
            match &self.storage.database {
                Some(database) => format!(" and {database}"),
                None => String::new(),
            },
            self.storage.reserve_bytes,
            match self.storage.max_page_count {
                Some(pages) => format!("at most {pages} pages"),
                None => "no limit on its size".to_owned(),
            },
        )?;
        for target in &self.alerts.targets {
            writeln!(f, "alerts to {}: {}", target.name, target.shown())?;
        }
        for target in &self.forward {
            let live = if target.live { "" } else { ", dry run" };
            writeln!(f, "frames to {}: {}{live}", target.name, target.shown())?;
        }
        for source in &self.elements.fetch {
            writeln!(
                f,
                "elements from {}{}, every {} h, never within {} h",
                source.url,
                source
                    .credentials_file
                    .as_ref()
                    .map(|f| format!(", login in {}", f.display()))
                    .unwrap_or_default(),
                self.elements.every_h,
                self.elements.min_age_h,
            )?;
        }
        for ear in &self.ears {
            writeln!(f, "ear {} ({}): {}", ear.name, ear.kind.name(), ear.shown())?;
        }
        write!(
            f,
            "http {}: hosts {:?}, token in {}{}; two persons: {:?}",
            self.http.listen,
            self.http.allowed_hosts,
            self.token_file().display(),
            match &self.http.tls {
                Some(tls) => format!(", TLS at {}", tls.listen),
                None if self.http.https => ", behind TLS".to_owned(),
                None => String::new(),
            },
            self.people.two_person,
        )?;
        if let Some(rotator) = &self.rotator {
            write!(
                f,
                "\nrotator at {}: azimuth {} to {}, elevation {} to {}, {}",
                rotator.address,
                rotator.azimuth_range.0,
                rotator.azimuth_range.1,
                rotator.elevation_range.0,
                rotator.elevation_range.1,
                match rotator.park {
                    Some((azimuth, elevation)) => format!("parks at {azimuth}, {elevation}"),
                    None => "parks by its own command".to_owned(),
                },
            )?;
        }
        if let Some(rig) = &self.rig {
            write!(f, "\nrig at {}: downlink {} Hz", rig.address, rig.downlink_hz)?;
        }
        if let Some(backup) = &self.backup {
            let folder = backup.folder.display();
            write!(
                f,
                "\nbackup to {folder} every {} h, the newest {} are kept",
                backup.every_h, backup.keep
            )?;
        }
        if let Some(days) = self.retention.telemetry_days {
            write!(f, "\nretention: values older than {days} days are removed, raw frames never")?;
        }
        if let Some(simulation) = &self.simulation {
            write!(f, "\nsimulation: {} times life", simulation.speed)?;
        }
        Ok(())
    }
}
