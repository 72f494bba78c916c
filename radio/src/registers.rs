//! The configuration block of the module: registers 00 to 06, which can be read back.
//!
//! Registers 07 and 08 (the key) are write only and read as zero; they are in [`CRYPT_BYTES`] of a write but never in a
//! comparison.

/// Registers 00..=06, the ones that read back what was written.
pub const COMPARED_BYTES: usize = 7;
/// Registers 07 and 08: the key, write only.
pub const CRYPT_BYTES: usize = 2;
/// The whole block that is read and written at once.
pub const BLOCK_BYTES: usize = COMPARED_BYTES + CRYPT_BYTES;

/// Transmit power of the 30 dBm module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PowerStep {
    /// 21 dBm (126 mW): the lowest step, the default on a bench.
    #[default]
    Dbm21,
    /// 24 dBm (251 mW).
    Dbm24,
    /// 27 dBm (501 mW).
    Dbm27,
    /// 30 dBm (1 W): about 620 mA at 5 V, more than a USB 2 port guarantees.
    Dbm30,
}

impl PowerStep {
    /// The value in REG1 bits 1:0.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Dbm30 => 0,
            Self::Dbm27 => 1,
            Self::Dbm24 => 2,
            Self::Dbm21 => 3,
        }
    }

    /// The step of REG1 bits 1:0.
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code & 3 {
            0 => Self::Dbm30,
            1 => Self::Dbm27,
            2 => Self::Dbm24,
            _ => Self::Dbm21,
        }
    }

    /// Power at the module's antenna connector.
    #[must_use]
    pub const fn dbm(self) -> u8 {
        30 - 3 * self.code()
    }

    /// The step of that many dBm, if the module has it.
    #[must_use]
    pub const fn from_dbm(dbm: u8) -> Option<Self> {
        match dbm {
            21 => Some(Self::Dbm21),
            24 => Some(Self::Dbm24),
            27 => Some(Self::Dbm27),
            30 => Some(Self::Dbm30),
            _ => None,
        }
    }
}

/// Registers 00..=06 as the module holds them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Registers(pub [u8; COMPARED_BYTES]);

impl Registers {
    /// The block documented as factory state: address 0, 9600 8N1, 2.4k, 30 dBm, channel 23, transparent.
    pub const FACTORY: Self = Self([0x00, 0x00, 0x00, 0x62, 0x00, 0x17, 0x03]);

    /// The state of a batch that was measured: as [`Registers::FACTORY`] with the RSSI byte already on.
    pub const FACTORY_WITH_RSSI: Self = Self([0x00, 0x00, 0x00, 0x62, 0x00, 0x17, 0x83]);

    /// Registers 00 and 01: the module's own address.
    #[must_use]
    pub const fn address(self) -> u16 {
        u16::from_be_bytes([self.0[0], self.0[1]])
    }

    /// Sets registers 00 and 01.
    #[must_use]
    pub const fn with_address(mut self, address: u16) -> Self {
        [self.0[0], self.0[1]] = address.to_be_bytes();
        self
    }

    /// Register 02: the network number, which both ends must share.
    #[must_use]
    pub const fn net_id(self) -> u8 {
        self.0[2]
    }

    /// Sets register 02.
    #[must_use]
    pub const fn with_net_id(mut self, net_id: u8) -> Self {
        self.0[2] = net_id;
        self
    }

    /// Baud rate of REG0 bits 7:5, used outside configuration mode.
    #[must_use]
    pub const fn baud(self) -> u32 {
        match self.0[3] >> 5 {
            0 => 1_200,
            1 => 2_400,
            2 => 4_800,
            3 => 9_600,
            4 => 19_200,
            5 => 38_400,
            6 => 57_600,
            _ => 115_200,
        }
    }

    /// Sets REG0 bits 7:5 to a baud code 0..=7 (3 is 9600) and the parity to 8N1.
    #[must_use]
    pub const fn with_baud_code(mut self, code: u8) -> Self {
        self.0[3] = (self.0[3] & 0x07) | ((code & 7) << 5);
        self
    }

    /// Air rate code, REG0 bits 2:0: 2 is "2.4k" on every firmware, 0 and 1 are slower on the first generation only.
    #[must_use]
    pub const fn air_rate(self) -> u8 {
        self.0[3] & 7
    }

    /// Sets REG0 bits 2:0.
    #[must_use]
    pub const fn with_air_rate(mut self, code: u8) -> Self {
        self.0[3] = (self.0[3] & !7) | (code & 7);
        self
    }

    /// Sub-packet length of REG1 bits 7:6, in bytes.
    #[must_use]
    pub const fn sub_packet_bytes(self) -> usize {
        match self.0[4] >> 6 {
            0 => 240,
            1 => 128,
            2 => 64,
            _ => 32,
        }
    }

    /// REG1 bit 2: modes may be changed by a command on the data UART (second generation).
    #[must_use]
    pub const fn software_switch(self) -> bool {
        self.0[4] & 0x04 != 0
    }

    /// Sets REG1 bit 2.
    #[must_use]
    pub const fn with_software_switch(mut self, on: bool) -> Self {
        self.0[4] = (self.0[4] & !0x04) | ((on as u8) << 2);
        self
    }

    /// REG1 bits 1:0.
    #[must_use]
    pub const fn power(self) -> PowerStep {
        PowerStep::from_code(self.0[4])
    }

    /// Sets REG1 bits 1:0.
    #[must_use]
    pub const fn with_power(mut self, power: PowerStep) -> Self {
        self.0[4] = (self.0[4] & !3) | power.code();
        self
    }

    /// Register 05: channel 0..=83.
    #[must_use]
    pub const fn channel(self) -> u8 {
        self.0[5]
    }

    /// Sets register 05.
    #[must_use]
    pub const fn with_channel(mut self, channel: u8) -> Self {
        self.0[5] = channel;
        self
    }

    /// REG3 bit 7: one RSSI byte follows each received radio packet.
    #[must_use]
    pub const fn rssi_byte(self) -> bool {
        self.0[6] & 0x80 != 0
    }

    /// Sets REG3 bit 7.
    #[must_use]
    pub const fn with_rssi_byte(mut self, on: bool) -> Self {
        self.0[6] = (self.0[6] & !0x80) | ((on as u8) << 7);
        self
    }

    /// REG3 bit 6: the first three bytes of a burst name the target.
    #[must_use]
    pub const fn fixed_point(self) -> bool {
        self.0[6] & 0x40 != 0
    }

    /// Sets REG3 bit 6.
    #[must_use]
    pub const fn with_fixed_point(mut self, on: bool) -> Self {
        self.0[6] = (self.0[6] & !0x40) | ((on as u8) << 6);
        self
    }
}

/// Carrier of a channel on the module's own grid: 410.125 MHz + channel * 1 MHz.
#[must_use]
pub const fn grid_frequency_hz(channel: u8) -> u32 {
    410_125_000 + channel as u32 * 1_000_000
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factory_block_reads_as_documented() {
        let r = Registers::FACTORY;
        assert_eq!((r.address(), r.net_id(), r.baud(), r.air_rate()), (0, 0, 9600, 2));
        assert_eq!((r.sub_packet_bytes(), r.power(), r.channel()), (240, PowerStep::Dbm30, 23));
        assert!(!r.rssi_byte() && !r.fixed_point() && !r.software_switch());
        assert_eq!(grid_frequency_hz(r.channel()), 433_125_000);
        assert!(Registers::FACTORY_WITH_RSSI.rssi_byte());
    }

    #[test]
    fn setters_touch_their_own_bits_only() {
        let r = Registers([0xa5; 7])
            .with_address(0xde70)
            .with_net_id(0)
            .with_baud_code(3)
            .with_air_rate(2)
            .with_power(PowerStep::Dbm21)
            .with_software_switch(false)
            .with_channel(0x19)
            .with_rssi_byte(true)
            .with_fixed_point(true);
        assert_eq!(r.0, [0xde, 0x70, 0x00, 0x62, 0xa3, 0x19, 0xe5]);
        assert_eq!(PowerStep::from_dbm(24).map(PowerStep::dbm), Some(24));
        assert_eq!(PowerStep::from_dbm(33), None);
    }
}
