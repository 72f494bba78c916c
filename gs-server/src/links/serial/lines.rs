//! Modem lines of a TTL adapter. They are active low: a line that is asserted (`true`) is a pin at 0 V.

use serialport::{SerialPort, TTYPort};

use crate::config::AuxInput;

/// DTR and RTS for the levels of M0 and M1 (true = high), M0 on DTR and M1 on RTS.
pub(super) const fn dtr_rts(m0: bool, m1: bool) -> (bool, bool) {
    (!m0, !m1)
}

/// Whether AUX is idle (high), from the state of the input that it arrives at.
pub(super) const fn aux_idle(asserted: bool, inverted: bool) -> bool {
    asserted == inverted
}

/// Sets the mode pins: DTR first, so that on the way out of sleep no wrong mode is passed through.
pub(super) fn set(port: &mut TTYPort, m0: bool, m1: bool) -> serialport::Result<()> {
    let (dtr, rts) = dtr_rts(m0, m1);
    port.write_data_terminal_ready(dtr)?;
    port.write_request_to_send(rts)
}

/// The input that AUX arrives at; `None` when it is absent.
pub(super) fn read(port: &mut TTYPort, input: AuxInput) -> serialport::Result<Option<bool>> {
    Ok(Some(match input {
        AuxInput::Cts => port.read_clear_to_send()?,
        AuxInput::Dsr => port.read_data_set_ready()?,
        AuxInput::Dcd => port.read_carrier_detect()?,
        AuxInput::Ri => port.read_ring_indicator()?,
        AuxInput::Absent => return Ok(None),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mode: M1 M0 → RTS DTR.
    #[test]
    fn the_truth_table_of_the_mode_pins() {
        for (m1, m0, rts, dtr) in [
            (false, false, true, true), // normal
            (true, false, false, true), // configuration
            (false, true, true, false), // wake on radio
            (true, true, false, false), // sleep
        ] {
            assert_eq!(dtr_rts(m0, m1), (dtr, rts));
        }
    }

    #[test]
    fn an_idle_module_does_not_assert_its_line() {
        assert!(aux_idle(false, false) && !aux_idle(true, false));
        assert!(aux_idle(true, true) && !aux_idle(false, true));
    }
}
