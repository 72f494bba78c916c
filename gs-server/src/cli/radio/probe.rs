//! `gs-server radio probe` and `configure`: bring the module up, dry or not, and tell what was found.

use std::time::Duration;

use clap::Args;
use radio::driver::{DriverState, Generation};

use super::super::shell::{print_json, print_line, runtime};
use super::bench::{Bench, Notice};
use super::module::Module;
use super::{Exit, Failure, Settings, Wiring};
use crate::clock::within;
use crate::config::ModePinWiring;

/// A bring-up with all its repetitions takes less.
const PATIENCE: Duration = Duration::from_secs(30);

/// `gs-server radio probe`.
#[derive(Debug, Args)]
pub struct Probe {
    #[command(flatten)]
    wiring: Wiring,
    #[command(flatten)]
    settings: Settings,
}

/// `gs-server radio configure`.
#[derive(Debug, Args)]
pub struct Configure {
    #[command(flatten)]
    wiring: Wiring,
    /// Write what differs; into RAM, until the power goes
    #[arg(long)]
    write: bool,
    /// With --write: into flash
    #[arg(long, requires = "write")]
    save: bool,
    /// Let modes be changed by a command on the data line, so that mode_pins = "software" works later
    #[arg(long)]
    software_switch: bool,
    #[command(flatten)]
    settings: Settings,
}

impl Probe {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let (module, _) = runtime()?.block_on(bring_up(
            &self.wiring,
            &self.settings,
            Change { dry: true, ..Change::default() },
        ))?;
        tell(&module, self.wiring.json)?;
        if module.answered {
            Ok(Exit::Done)
        } else {
            Err(Failure::failed("the module does not answer; the findings above name what to check"))
        }
    }
}

impl Configure {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let change = Change {
            dry: !self.write,
            save: self.save,
            software_switch: self.software_switch.then_some(true),
        };
        let (module, state) = runtime()?.block_on(bring_up(&self.wiring, &self.settings, change))?;
        tell(&module, self.wiring.json)?;
        if !module.answered {
            return Err(Failure::failed("the module does not answer; the findings above name what to check"));
        }
        if !self.write {
            if !module.differences.is_empty() {
                eprintln!("gs-server: nothing was written; add --write");
            }
            return Ok(Exit::Done);
        }
        if state == DriverState::Ready && module.configuration_verified && module.frequency_verified {
            Ok(Exit::Done)
        } else {
            Err(Failure::refused("the module does not hold what was asked, or it could not be verified"))
        }
    }
}

/// What may change in the module.
#[derive(Debug, Clone, Copy, Default)]
struct Change {
    dry: bool,
    save: bool,
    software_switch: Option<bool>,
}

/// Goes as far as the driver goes; dry, up to the first change.
async fn bring_up(
    wiring: &Wiring,
    settings: &Settings,
    change: Change,
) -> Result<(Module, DriverState), Failure> {
    let section = wiring.section()?;
    if section.mode_pins() == ModePinWiring::Strapped {
        return Err(Failure::usage(
            "a strapped module cannot be asked anything; wire M0 and M1, or see `radio monitor`",
        ));
    }
    let mut config = settings.driver_config(&section)?;
    config.save_to_flash = change.save;
    config.software_switch = change.software_switch;
    let mut bench = Bench::open(&section, config.clone(), change.dry, wiring.raw_log.as_deref()).await?;
    let mut findings = Vec::new();
    let mut tell_step = |text: String| {
        eprintln!("{text}");
        findings.push(text);
    };
    let result = within(PATIENCE, async {
        loop {
            match bench.next().await {
                Notice::State(DriverState::Ready | DriverState::Fault) => return Ok(None),
                Notice::WouldChange(bytes) => return Ok(Some(bytes)),
                Notice::State(state) => tracing::info!("{state:?}"),
                Notice::Finding(finding) => tell_step(finding.to_string()),
                Notice::Heard(bytes) => tracing::info!("{} bytes heard meanwhile", bytes.len()),
                Notice::Lost(reason) => return Err(Failure::failed(format!("the port is gone: {reason}"))),
            }
        }
    })
    .await;
    let would_write = match result {
        Some(result) => result?,
        None => {
            tell_step(format!("nothing came to an end within {} s", PATIENCE.as_secs()));
            None
        }
    };
    let mut facts = bench.driver.facts().clone();
    // The carrier comes before everything else that may be written: had it been wrong, it would be what is written.
    if would_write.is_some_and(|bytes| !bytes.starts_with(b"AT+")) && facts.generation != Generation::V1 {
        facts.frequency_hz = Some(config.frequency_hz);
    }
    Ok((Module::new(&wiring.port, &facts, &config, findings), bench.driver.state()))
}

fn tell(module: &Module, json: bool) -> Result<(), Failure> {
    if json {
        return print_json(module);
    }
    module.lines().into_iter().try_for_each(print_line)
}
