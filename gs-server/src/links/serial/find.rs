//! Where a port is, and what to say when it is not there.

use std::path::Path;

use serialport::{ErrorKind, SerialPortInfo, SerialPortType};

use crate::config::UsbId;

/// The ports of this machine. Where there is no list of them, as in a container without `/sys`, there are none: the library
/// would panic.
///
/// # Errors
/// What the library says when the list cannot be read.
pub(crate) fn ports() -> serialport::Result<Vec<SerialPortInfo>> {
    if Path::new("/sys/class/tty").is_dir() { serialport::available_ports() } else { Ok(Vec::new()) }
}

/// Names of the ports of this machine, adapters first.
pub fn port_names() -> Vec<String> {
    let mut ports = ports().unwrap_or_default();
    ports.sort_by_key(|port| (!matches!(port.port_type, SerialPortType::UsbPort(_)), port.port_name.clone()));
    ports.into_iter().map(|port| port.port_name).collect()
}

fn there_are() -> String {
    /// More than this nobody reads.
    const SHOWN: usize = 8;
    let names = port_names();
    match names.len() {
        0 => "this machine has no serial port at present".to_owned(),
        n if n > SHOWN => format!("there are {} and {} more", names[..SHOWN].join(", "), n - SHOWN),
        _ => format!("there are {}", names.join(", ")),
    }
}

pub(super) fn path(path: &str) -> Result<String, String> {
    if Path::new(path).exists() {
        Ok(path.to_owned())
    } else {
        Err(format!("port {path} is not there; {}", there_are()))
    }
}

pub(super) fn usb(wanted: &UsbId) -> Result<String, String> {
    let ports = ports().map_err(|error| format!("ports cannot be listed: {error}"))?;
    let found = ports.into_iter().find(|port| match &port.port_type {
        SerialPortType::UsbPort(usb) => {
            usb.vid == wanted.vid
                && usb.pid == wanted.pid
                && wanted
                    .serial_number
                    .as_ref()
                    .is_none_or(|serial| usb.serial_number.as_ref() == Some(serial))
        }
        _ => false,
    });
    found.map(|port| port.port_name).ok_or_else(|| {
        let serial =
            wanted.serial_number.as_ref().map(|s| format!(" with serial number {s}")).unwrap_or_default();
        format!(
            "USB adapter {:04x}:{:04x}{serial} is not plugged in; {}",
            wanted.vid,
            wanted.pid,
            there_are()
        )
    })
}

pub(super) fn cannot_open(path: &str, error: &serialport::Error) -> String {
    match error.kind {
        ErrorKind::NoDevice => format!("port {path} is in use by another program, or just went: {error}"),
        ErrorKind::Io(std::io::ErrorKind::PermissionDenied) => {
            format!("port {path} may not be opened: add this user to the group of the device (often dialout)")
        }
        _ => format!("port {path} cannot be opened as a serial port: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_port_is_told_with_what_there_is() {
        let sentence = path("/dev/ttyNOSUCH").unwrap_err();
        assert!(sentence.starts_with("port /dev/ttyNOSUCH is not there; "), "{sentence}");
        let sentence = usb(&UsbId { vid: 0xdead, pid: 0xbeef, serial_number: Some("x".into()) }).unwrap_err();
        assert!(sentence.contains("dead:beef with serial number x"), "{sentence}");
    }
}
