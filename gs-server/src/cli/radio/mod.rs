//! `gs-server radio list|probe|configure|monitor`: the module by hand.
//!
//! The same driver and the same port as the server's serial link, without its engine. Nothing in here transmits a
//! frame.

mod bench;
mod list;
mod module;
mod monitor;
mod probe;

use clap::{Args, Subcommand, ValueEnum};

use super::{Exit, Failure};

/// `gs-server radio`.
#[derive(Debug, Subcommand)]
pub enum Radio {
    /// List serial ports and what is behind them
    List(list::List),
    /// Who the module is, what it holds, and what the server would change; changes nothing
    #[command(after_help = "\
Examples:
  gs-server radio probe /dev/ttyUSB0
  gs-server radio probe /tmp/radio --mode-pins software --aux absent --json

Exit code 0 if the module answered, 1 if not. The findings name the remedy; docs/radio.md has the
wiring.")]
    Probe(probe::Probe),
    /// Show how the module differs from the wanted configuration; with --write set it
    #[command(after_help = "\
Examples:
  gs-server radio configure /dev/ttyUSB0                        the difference; nothing is written
  gs-server radio configure /dev/ttyUSB0 --write                into RAM, until the power goes
  gs-server radio configure /dev/ttyUSB0 --write --save         into flash
  gs-server radio configure /dev/ttyUSB0 --write --save --software-switch
      once with the lines wired; from then on mode_pins = \"software\" works

Exit code 0 if all is as wanted and verified (or nothing was to be written), 3 if the module does
not hold what was asked, 1 if it does not answer.")]
    Configure(probe::Configure),
    /// Watch what is heard: decoded frames, levels, what was skipped
    #[command(after_help = "\
Examples:
  gs-server radio monitor /dev/ttyUSB0
  gs-server radio monitor /dev/ttyUSB0 --raw-log pass.log --json | jq .name

The module is used as it is and is not configured. Ctrl-C ends it with a summary. A raw log has one
line per piece: UTC time, direction (< from the module, > to it), AUX, hex.")]
    Monitor(monitor::Monitor),
}

/// Where the module is and how it is wired.
#[derive(Debug, Clone, Args)]
pub(super) struct Wiring {
    /// The port, e.g. /dev/ttyUSB0
    #[arg(value_name = "PORT")]
    port: String,
    /// How M0 and M1 are driven
    #[arg(long, value_enum, default_value_t = Pins::Lines)]
    mode_pins: Pins,
    /// Where AUX arrives
    #[arg(long, value_enum, default_value_t = Aux::Cts)]
    aux: Aux,
    /// AUX passes an inverter
    #[arg(long)]
    aux_inverted: bool,
    /// Baud rate; only a strapped module may have another than 9600
    #[arg(long, default_value_t = 9600)]
    baud: u32,
    /// Write every byte to this file, with time and direction
    #[arg(long, value_name = "FILE")]
    raw_log: Option<std::path::PathBuf>,
    /// JSON on standard output
    #[arg(long)]
    json: bool,
}

/// What the module shall hold; the defaults are the mission's.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Wanted configuration")]
pub(super) struct Settings {
    /// The module's own address
    #[arg(long, default_value = "0xDE70", value_parser = module::number)]
    address: u16,
    /// Network number, shared with the satellite
    #[arg(long, default_value_t = 0)]
    net_id: u8,
    /// Channel 0 to 83, shared with the satellite
    #[arg(long, default_value_t = 25)]
    channel: u8,
    /// Carrier frequency
    #[arg(long, default_value_t = 435_000_000)]
    frequency_hz: u32,
    /// Transmit power: 21, 24, 27 or 30
    #[arg(long, default_value_t = 21)]
    power_dbm: u8,
    /// RSSI byte after each received packet [default: on]
    #[arg(long, value_enum, default_value_t = Rssi::On, hide_default_value = true)]
    rssi: Rssi,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Pins {
    /// M0 on DTR, M1 on RTS
    Lines,
    /// The same through inverters
    LinesInverted,
    /// Tied to normal mode; modes change by a command
    Software,
    /// Tied to normal mode; the module is used as it is
    Strapped,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Aux {
    Cts,
    Dsr,
    Dcd,
    Ri,
    /// Not wired
    Absent,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Rssi {
    On,
    Off,
    /// As the module has it
    Keep,
}

impl Radio {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::List(list) => list.run(),
            Self::Probe(probe) => probe.run(),
            Self::Configure(configure) => configure.run(),
            Self::Monitor(monitor) => monitor.run(),
        }
    }
}
