//! How long a packet occupies the air, and bytes the UART.
//!
//! The LoRa formula is the one of Semtech AN1200.13 and the SX126x data sheet (section 6.1.4), evaluated in integers:
//! quarter symbols first, one division at the end, rounded to the nearest microsecond.

/// The modem parameters that decide a packet's duration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LoraPhy {
    /// Spreading factor, 5..=12. Values outside are clamped when used.
    pub spreading_factor: u8,
    /// Bandwidth in hertz; 0 counts as 1.
    pub bandwidth_hz: u32,
    /// Coding rate 4/(4+n), n = 1..=4. Values outside are clamped when used.
    pub coding_rate: u8,
    /// Programmed preamble length in symbols (the modem adds 4.25, or 6.25 at SF5 and SF6).
    pub preamble_symbols: u16,
    /// Low data rate optimisation: two bits fewer per symbol.
    pub low_data_rate: bool,
    /// Whether the packet ends with the modem's 16-bit CRC.
    pub crc: bool,
    /// Whether the packet begins with the modem's header.
    pub explicit_header: bool,
    /// Bytes the module's firmware adds to each payload, unseen by the host.
    pub overhead_bytes: u8,
}

impl LoraPhy {
    /// The likelier reading of the module's "2.4k" rate: SF11, 500 kHz, 4/5, low data rate, 8 bytes of overhead.
    ///
    /// Derived from published transmit times of a sibling module, not documented by the maker; measure before relying
    /// on it. The other candidate, [`LoraPhy::OTHER_2K4`], takes the same time within one block.
    pub const LIKELY_2K4: Self = Self {
        spreading_factor: 11,
        bandwidth_hz: 500_000,
        coding_rate: 1,
        preamble_symbols: 8,
        low_data_rate: true,
        crc: true,
        explicit_header: true,
        overhead_bytes: 8,
    };

    /// The other reading of "2.4k": SF9, 125 kHz, 4/5, 7 bytes of overhead.
    pub const OTHER_2K4: Self = Self {
        spreading_factor: 9,
        bandwidth_hz: 125_000,
        low_data_rate: false,
        overhead_bytes: 7,
        ..Self::LIKELY_2K4
    };

    /// Duration of one radio packet that carries `payload_len` bytes, overhead included.
    ///
    /// One packet only: what is longer than a sub-packet leaves the module as several.
    #[must_use]
    pub const fn time_on_air_us(&self, payload_len: usize) -> u64 {
        let sf = clamp(self.spreading_factor, 5, 12) as i64;
        let cr = clamp(self.coding_rate, 1, 4) as i64;
        let bandwidth_hz = if self.bandwidth_hz == 0 { 1 } else { self.bandwidth_hz as u64 };
        // Far above the 255 bytes of a LoRa packet; keeps the arithmetic inside its range for any input.
        let capped = if payload_len > 65_535 { 65_535 } else { payload_len };
        let payload = capped as i64 + self.overhead_bytes as i64;

        let (sync_quarters, alignment) = if sf <= 6 { (25, 0) } else { (17, 8) };
        let header = if self.explicit_header { 20 } else { 0 };
        let crc = if self.crc { 16 } else { 0 };
        let bits = 8 * payload - 4 * sf + alignment + header + crc;
        let bits = if bits < 0 { 0 } else { bits };
        let bits_per_block = 4 * (sf - if self.low_data_rate { 2 } else { 0 });
        let blocks = (bits + bits_per_block - 1) / bits_per_block;

        let quarters = 4 * self.preamble_symbols as i64 + sync_quarters + 4 * (8 + blocks * (cr + 4));
        let numerator = quarters as u64 * (1 << sf) * 1_000_000;
        let denominator = 4 * bandwidth_hz;
        (numerator + denominator / 2) / denominator
    }
}

impl Default for LoraPhy {
    fn default() -> Self {
        Self::LIKELY_2K4
    }
}

const fn clamp(value: u8, low: u8, high: u8) -> u8 {
    if value < low {
        low
    } else if value > high {
        high
    } else {
        value
    }
}

/// Time of `bytes` on a UART at `baud`, 8N1: ten bits a byte, rounded up. A baud of 0 counts as 1.
#[must_use]
pub const fn uart_us(bytes: usize, baud: u32) -> u64 {
    let baud = if baud == 0 { 1 } else { baud as u64 };
    let capped = if bytes > 1_000_000_000 { 1_000_000_000 } else { bytes as u64 };
    (capped * 10_000_000).div_ceil(baud)
}

/// Bytes of the fixed-point header that the sending module strips: ADDH, ADDL, CH.
pub const FIXED_HEADER_BYTES: usize = 3;

/// Longest frame that leaves in one radio packet (the 240-byte sub-packet).
pub const MAX_FRAME_BYTES: usize = 240;

/// Silence on the UART, in byte times, by which the module knows that a burst has ended.
pub const BURST_GAP_BYTES: usize = 3;

/// What one link's timing is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct LinkTiming {
    /// The modem parameters both ends use.
    pub phy: LoraPhy,
    /// Baud rate between host and module.
    pub baud: u32,
    /// How long the far end may take from hearing the end of a request to starting its answer: its module's UART
    /// output (250 ms for a full frame) and its own work.
    pub turn_round_us: u64,
}

impl Default for LinkTiming {
    /// SF11/500 kHz, 9600 baud, half a second of turn-round.
    fn default() -> Self {
        Self { phy: LoraPhy::LIKELY_2K4, baud: 9600, turn_round_us: 500_000 }
    }
}

impl LinkTiming {
    /// Time a frame of `len` bytes occupies the air.
    #[must_use]
    pub const fn frame_us(&self, len: usize) -> u64 {
        self.phy.time_on_air_us(len)
    }

    /// From the start of the host's write to the first radiated symbol: header and frame on the UART, then the silence
    /// by which the module knows the end.
    #[must_use]
    pub const fn lead_in_us(&self, len: usize) -> u64 {
        uart_us(len + FIXED_HEADER_BYTES, self.baud) + uart_us(BURST_GAP_BYTES, self.baud)
    }

    /// From the start of the host's write to the end of the radiation, for a frame of `len` bytes.
    #[must_use]
    pub const fn send_us(&self, len: usize) -> u64 {
        self.lead_in_us(len) + self.frame_us(len)
    }

    /// [`LinkTiming::send_us`] of an uplink frame, which always has 240 bytes.
    #[must_use]
    pub const fn uplink_us(&self) -> u64 {
        self.send_us(MAX_FRAME_BYTES)
    }

    /// From the end of a packet on the air to its last byte (RSSI byte counted) at the host: 2.5 ms of AUX lead, then
    /// the UART.
    #[must_use]
    pub const fn delivery_us(&self, len: usize) -> u64 {
        2_500 + uart_us(len + 1, self.baud)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn phy(sf: u8, khz: u32, low_data_rate: bool) -> LoraPhy {
        LoraPhy {
            spreading_factor: sf,
            bandwidth_hz: khz * 1000,
            low_data_rate,
            overhead_bytes: 0,
            ..LoraPhy::LIKELY_2K4
        }
    }

    /// The published table, in tenths of a millisecond.
    #[test]
    fn golden_table_of_airtimes() {
        let columns = [
            (
                phy(9, 125, false),
                [Some(1853), Some(5540), Some(11889), Some(12093), Some(12298), Some(12503)],
            ),
            (
                phy(11, 500, true),
                [Some(1853), Some(5540), Some(11889), Some(11889), Some(12298), Some(12503)],
            ),
            (
                phy(11, 500, false),
                [Some(1649), Some(4721), Some(9841), Some(10045), Some(10250), Some(10455)],
            ),
            (
                phy(10, 250, false),
                [Some(1853), Some(5130), Some(10865), Some(10865), Some(11069), Some(11479)],
            ),
            (
                phy(11, 250, false),
                [Some(3297), Some(9441), Some(19681), Some(20091), Some(20500), Some(20910)],
            ),
            (phy(12, 125, true), [None, None, Some(85279), Some(86917), Some(88556), Some(90194)]),
        ];
        for (phy, expected) in columns {
            for (len, expected) in [20, 100, 240, 243, 248, 255].into_iter().zip(expected) {
                if let Some(tenths_ms) = expected {
                    let found = (phy.time_on_air_us(len) + 50) / 100;
                    assert_eq!(found, tenths_ms, "{phy:?} with {len} bytes");
                }
            }
        }
    }

    /// Steps of 20.48 ms at the sizes measured on a sibling module, for both candidates.
    #[test]
    fn both_candidates_step_where_the_sibling_was_measured() {
        for phy in [LoraPhy::LIKELY_2K4, LoraPhy::OTHER_2K4] {
            for len in [19, 23, 28, 32, 37, 41, 46] {
                assert_eq!(phy.time_on_air_us(len + 1) - phy.time_on_air_us(len), 20_480, "{phy:?} at {len}");
            }
        }
    }

    #[test]
    fn top_rate_at_sf5_uses_the_short_spreading_factor_formula() {
        let sf5 = LoraPhy { spreading_factor: 5, ..phy(11, 500, false) };
        // 8 + 6.25 + 8 symbols, then ceil((160 - 20 + 20 + 16) / 20) = 9 blocks of 5, at 64 us each.
        assert_eq!(sf5.time_on_air_us(20), (8 * 64) + (6 * 64 + 16) + (8 + 45) * 64);
    }

    #[test]
    fn uart_times_of_the_data_sheet() {
        assert_eq!(uart_us(243, 9600), 253_125);
        assert_eq!(uart_us(240, 9600), 250_000);
        assert_eq!(uart_us(3, 9600), 3_125);
        assert_eq!(uart_us(243, 115_200), 21_094);
        assert_eq!(uart_us(0, 9600), 0);
        assert_eq!(uart_us(1, 0), 10_000_000);
    }

    #[test]
    fn extreme_inputs_stay_in_range() {
        let odd = LoraPhy { spreading_factor: 255, bandwidth_hz: 0, coding_rate: 0, ..LoraPhy::LIKELY_2K4 };
        assert!(odd.time_on_air_us(usize::MAX) > 0);
        assert!(uart_us(usize::MAX, 1) > 0);
    }

    #[test]
    fn an_uplink_takes_about_one_and_a_half_seconds() {
        assert_eq!(LinkTiming::default().uplink_us(), 253_125 + 3_125 + 1_229_824);
    }
}
