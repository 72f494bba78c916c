//! `gs-server radio list`.

use clap::Args;
use serde::Serialize;
use serialport::{SerialPortInfo, SerialPortType};

use super::super::shell::{print_json, print_line};
use super::{Exit, Failure};
use crate::links::serial::ports;

/// `gs-server radio list`.
#[derive(Debug, Args)]
pub struct List {
    /// One JSON object per port
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Port {
    port: String,
    kind: &'static str,
    vid: Option<u16>,
    pid: Option<u16>,
    serial_number: Option<String>,
    manufacturer: Option<String>,
    product: Option<String>,
}

impl Port {
    fn new(info: SerialPortInfo) -> Self {
        let kind = match &info.port_type {
            SerialPortType::UsbPort(_) => "usb",
            SerialPortType::PciPort => "pci",
            SerialPortType::BluetoothPort => "bluetooth",
            SerialPortType::Unknown => "unknown",
        };
        let usb = match info.port_type {
            SerialPortType::UsbPort(usb) => Some(usb),
            _ => None,
        };
        Self {
            port: info.port_name,
            kind,
            vid: usb.as_ref().map(|usb| usb.vid),
            pid: usb.as_ref().map(|usb| usb.pid),
            serial_number: usb.as_ref().and_then(|usb| usb.serial_number.clone()),
            manufacturer: usb.as_ref().and_then(|usb| usb.manufacturer.clone()),
            product: usb.and_then(|usb| usb.product),
        }
    }

    fn line(&self) -> String {
        let mut line = format!("{}  {}", self.port, self.kind);
        if let (Some(vid), Some(pid)) = (self.vid, self.pid) {
            line.push_str(&format!(" {vid:04x}:{pid:04x}"));
        }
        for text in [&self.manufacturer, &self.product].into_iter().flatten() {
            line.push_str(&format!(" {text}"));
        }
        if let Some(serial) = &self.serial_number {
            line.push_str(&format!(", serial number {serial}"));
        }
        line
    }
}

impl List {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let mut ports: Vec<Port> = ports()
            .map_err(|error| Failure::doing("serial ports cannot be listed", error))?
            .into_iter()
            .map(Port::new)
            .collect();
        ports.sort_by(|a, b| (a.kind != "usb", &a.port).cmp(&(b.kind != "usb", &b.port)));
        for port in &ports {
            if self.json {
                print_json(port)?;
            } else {
                print_line(port.line())?;
            }
        }
        if ports.is_empty() {
            return Err(Failure::failed(
                "this machine has no serial port at present: is the adapter plugged in?",
            ));
        }
        Ok(Exit::Done)
    }
}
