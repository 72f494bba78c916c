//! What rigctld can be asked.

use std::sync::Arc;

use super::connection::{Connection, Patience, value};
use super::error::HamlibError;
use crate::clock::Timer;

/// A rig behind rigctld.
pub struct RigClient {
    connection: Connection,
    info: Option<String>,
    /// The daemon was started with `-o`: every command names a VFO first.
    names_vfo: bool,
}

/// What a rig is set to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigReading {
    /// Receiver, Hz.
    pub receive_hz: f64,
    /// Transmitter in split operation, Hz; `None` where the model tells none.
    pub transmit_hz: Option<f64>,
}

impl RigClient {
    /// Connects, and asks whether commands name a VFO.
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
                connection.ask_line("chk_vfo").await
            })
            .await?;
        let names_vfo = match answer {
            Ok(line) => line.trim_start_matches("ChkVFO:").trim() == "1",
            Err(HamlibError::Silent { .. }) => {
                connection = Connection::open(address, patience, timer).await?;
                false
            }
            Err(error) if error.breaks_connection() => return Err(error),
            Err(_) => false,
        };
        let mut client = Self { connection, info: None, names_vfo };
        // This one takes no VFO, not even with `-o`: a name of one would be taken for part of the next command.
        client.info = match client.connection.ask("get_info", "").await {
            Ok(lines) => value(&lines, "Info").map(|info| info.chars().take(80).collect()),
            Err(error) if error.breaks_connection() => return Err(error),
            Err(_) => None,
        };
        Ok(client)
    }

    /// What the rig calls itself.
    #[must_use]
    pub fn info(&self) -> Option<&str> {
        self.info.as_deref()
    }

    /// Whether commands name a VFO (`rigctld -o`).
    #[must_use]
    pub fn names_vfo(&self) -> bool {
        self.names_vfo
    }

    /// What it is set to.
    ///
    /// # Errors
    /// [`HamlibError`]; `Malformed` for what is no frequency.
    pub async fn reading(&mut self) -> Result<RigReading, HamlibError> {
        let receive_hz = self.receive_hz().await?;
        let transmit_hz = match self.transmit_hz().await {
            Ok(hz) => Some(hz),
            Err(error) if error.breaks_connection() => return Err(error),
            Err(_) => None,
        };
        Ok(RigReading { receive_hz, transmit_hz })
    }

    /// Tunes the receiver and reads back what it took, Hz. A difference of less than `resolution_hz` is the rig's rounding.
    ///
    /// # Errors
    /// [`HamlibError`]; `NotTaken` when it shows another frequency.
    pub async fn tune(&mut self, hz: u64, resolution_hz: u32) -> Result<f64, HamlibError> {
        self.ask("set_freq", &hz.to_string()).await?;
        let found_hz = self.receive_hz().await?;
        self.taken(hz, found_hz, resolution_hz)
    }

    /// Tunes the transmitter in split operation and reads back what it took, Hz.
    ///
    /// # Errors
    /// [`HamlibError`]; `NotTaken` when it shows another frequency.
    pub async fn tune_transmitter(&mut self, hz: u64, resolution_hz: u32) -> Result<f64, HamlibError> {
        self.ask("set_split_freq", &hz.to_string()).await?;
        let found_hz = self.transmit_hz().await?;
        self.taken(hz, found_hz, resolution_hz)
    }

    async fn receive_hz(&mut self) -> Result<f64, HamlibError> {
        let lines = self.ask("get_freq", "").await?;
        self.frequency("get_freq", &lines, "Frequency")
    }

    async fn transmit_hz(&mut self) -> Result<f64, HamlibError> {
        let lines = self.ask("get_split_freq", "").await?;
        self.frequency("get_split_freq", &lines, "TX Frequency")
    }

    fn frequency(
        &self,
        command: &'static str,
        lines: &[String],
        key: &'static str,
    ) -> Result<f64, HamlibError> {
        let hz = self.connection.number(command, lines, key)?;
        if hz < 0.0 {
            return Err(self.connection.malformed(command, key, &hz.to_string()));
        }
        Ok(hz)
    }

    #[expect(clippy::cast_precision_loss, reason = "frequencies are far below 2^53 Hz")]
    fn taken(&self, wanted_hz: u64, found_hz: f64, resolution_hz: u32) -> Result<f64, HamlibError> {
        if (wanted_hz as f64 - found_hz).abs() > f64::from(resolution_hz) {
            let address = self.connection.address().to_owned();
            return Err(HamlibError::NotTaken { address, wanted_hz, found_hz });
        }
        Ok(found_hz)
    }

    async fn ask(&mut self, name: &str, argument: &str) -> Result<Vec<String>, HamlibError> {
        if !self.names_vfo {
            return self.connection.ask(name, argument).await;
        }
        self.connection.ask(name, format!("currVFO {argument}").trim_end()).await
    }
}
