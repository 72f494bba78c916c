//! The configuration in a few lines, for the log at start and `config check`. No secret is in it.

use std::fmt;

use super::Config;

impl fmt::Display for Config {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.is_simulated() { ", simulated" } else { "" };
        writeln!(f, "station {}{kind}, clock {:?}", self.station.name, self.station.clock)?;
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
            "storage {}: reserve {} bytes, {}",
            self.storage.folder.display(),
            self.storage.reserve_bytes,
            match self.storage.max_page_count {
                Some(pages) => format!("at most {pages} pages"),
                None => "no limit on its size".to_owned(),
            },
        )?;
        write!(
            f,
            "http {}: hosts {:?}, token in {}",
            self.http.listen,
            self.http.allowed_hosts,
            self.token_file().display()
        )?;
        if let Some(simulation) = &self.simulation {
            write!(f, "\nsimulation: {} times life", simulation.speed)?;
        }
        Ok(())
    }
}
