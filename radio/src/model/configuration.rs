//! Configuration mode: registers, AT commands, and the mode switch on the data UART.

use super::timeline::Event;
use super::{Extras, Firmware, Module, Ufreq};
use crate::command::{Mode, READ, SWITCH_PREFIX, WRITE_SAVED, WRITE_VOLATILE};
use crate::registers::{COMPARED_BYTES, Registers};

const BINARY_DELAY_US: u64 = 2_000;
const AT_DELAY_US: u64 = 5_000;
const REFUSAL: [u8; 3] = [0xFF; 3];
/// Product information of registers 80 to 86.
const PRODUCT: [u8; 7] = [0x00, 0x22, 0x10, 0x17, 0x1e, 0x00, 0x00];

impl Module {
    fn second_generation(&self) -> bool {
        self.config.firmware != Firmware::V1
    }

    /// Whether a burst is the software mode switch, in a module that has it on.
    pub(super) fn is_switch(&self, bytes: &[u8]) -> bool {
        self.second_generation()
            && self.ram.software_switch()
            && !self.config.quirks.no_configuration
            && bytes.len() == SWITCH_PREFIX.len() + 1
            && bytes.starts_with(&SWITCH_PREFIX)
    }

    pub(super) fn software_switch(&mut self, bytes: &[u8]) {
        match bytes.last().copied().and_then(Mode::from_code) {
            Some(mode) => {
                self.reply(BINARY_DELAY_US, &bytes[1..]);
                self.want_mode(mode);
            }
            None => self.reply(BINARY_DELAY_US, &REFUSAL),
        }
    }

    pub(super) fn configure(&mut self, bytes: &[u8]) {
        if self.config.quirks.no_configuration {
            return;
        }
        if let Some(command) = bytes.strip_prefix(b"AT+") {
            if self.second_generation() {
                self.at(command);
            }
            return;
        }
        match *bytes {
            [READ, address, len] => match self.read_registers(address, len) {
                Some(data) => self.acknowledge(address, &data),
                None => self.reply(BINARY_DELAY_US, &REFUSAL),
            },
            [kind @ (WRITE_SAVED | WRITE_VOLATILE), address, len, ref data @ ..]
                if data.len() == usize::from(len) && usize::from(address) + data.len() <= 9 && len > 0 =>
            {
                self.write_registers(kind == WRITE_SAVED, usize::from(address), data);
                let held = self.read_registers(address, len).unwrap_or_default();
                self.acknowledge(address, &held);
            }
            _ => self.reply(BINARY_DELAY_US, &REFUSAL),
        }
    }

    fn read_registers(&self, address: u8, len: u8) -> Option<Vec<u8>> {
        if address == 0x80 {
            return PRODUCT.get(..usize::from(len)).map(<[u8]>::to_vec);
        }
        // The key reads as zero.
        let mut block = [0; 9];
        block[..COMPARED_BYTES].copy_from_slice(&self.ram.0);
        let from = usize::from(address);
        block.get(from..from + usize::from(len)).filter(|data| !data.is_empty()).map(<[u8]>::to_vec)
    }

    fn write_registers(&mut self, save: bool, address: usize, data: &[u8]) {
        let mut block = [0; 9];
        block[..COMPARED_BYTES].copy_from_slice(&self.ram.0);
        block[COMPARED_BYTES..].copy_from_slice(&self.extras.crypt);
        block[address..address + data.len()].copy_from_slice(data);
        let mut registers = Registers([0; COMPARED_BYTES]);
        registers.0.copy_from_slice(&block[..COMPARED_BYTES]);
        if (self.second_generation() || self.config.quirks.rate_clamp) && registers.air_rate() < 2 {
            registers = registers.with_air_rate(2);
        }
        self.ram = registers;
        self.extras.crypt = [block[7], block[8]];
        if save {
            self.flash = registers;
            self.flash_extras.crypt = self.extras.crypt;
            self.counters.flash_writes += 1;
        }
    }

    fn acknowledge(&mut self, address: u8, data: &[u8]) {
        let mut bytes = vec![READ, address, u8::try_from(data.len()).unwrap_or(0)];
        bytes.extend_from_slice(data);
        self.reply(BINARY_DELAY_US, &bytes);
    }

    fn at(&mut self, command: &[u8]) {
        let bare = command.strip_suffix(b"\r\n");
        let quirks = &self.config.quirks;
        if quirks.silent_at || quirks.wants_crlf && bare.is_none() {
            return;
        }
        if quirks.rejects_crlf && bare.is_some() {
            self.reply_text("=ERR");
            return;
        }
        let text = String::from_utf8_lossy(bare.unwrap_or(command)).into_owned();
        if text == "RESET" {
            self.reply_text("AT+RESET=OK");
            // The answer leaves first; the boot forgets what had not.
            self.counters.resets += 1;
            self.timeline.push(self.output_free_us.max(self.now_us), Event::Reset { life: self.life });
            return;
        }
        let Some((name, argument)) = text.split_once('=') else {
            self.reply_text("=ERR");
            return;
        };
        let answer = if argument == "?" {
            self.at_query(name)
        } else {
            self.at_set(name, argument).map(str::to_owned)
        };
        match answer {
            Some(value) => self.reply_text(&format!("AT+{name}={value}")),
            None => self.reply_text(&format!("AT+{name}=ERR")),
        }
    }

    fn at_query(&self, name: &str) -> Option<String> {
        let quirks = &self.config.quirks;
        let v2_2 = self.config.firmware == Firmware::V2_2;
        match name {
            "FWCODE" => Some(if v2_2 { "7453-0-21" } else { "7364-0-10" }.to_owned()),
            "DEVTYPE" => Some(quirks.device_type.clone().unwrap_or_else(|| "E22-400T30D".to_owned())),
            "UAUX" if v2_2 && !quirks.no_uaux => Some(u8::from(self.extras.uaux).to_string()),
            "UFREQ" if !quirks.no_ufreq => Some(match self.extras.ufreq {
                Some(Ufreq { start_hz, step_hz, last_channel }) => {
                    format!("1,{start_hz},{step_hz},{last_channel}")
                }
                None => "0,410125000,1000000,83".to_owned(),
            }),
            "ADDR" => Some(self.ram.address().to_string()),
            "CHANNEL" => Some(self.ram.channel().to_string()),
            "DRSSI" => Some(u8::from(self.ram.rssi_byte()).to_string()),
            "POWER" => Some(self.ram.power().code().to_string()),
            _ => None,
        }
    }

    fn at_set(&mut self, name: &str, argument: &str) -> Option<&'static str> {
        let quirks = &self.config.quirks;
        match name {
            "UAUX" if self.config.firmware == Firmware::V2_2 && !quirks.no_uaux => {
                let on = matches!(argument, "1");
                self.extras.uaux = on;
                self.save_extras();
                Some("OK")
            }
            "UFREQ" if !quirks.no_ufreq => {
                let (enabled, start_hz, step_hz, last) = crate::reply::parse_ufreq(argument)?;
                let last_channel = u8::try_from(last).ok()?;
                // In use after the next reset only.
                self.flash_extras.ufreq = enabled.then_some(Ufreq { start_hz, step_hz, last_channel });
                self.counters.flash_writes += 1;
                Some("OK")
            }
            "CHANNEL" => {
                let channel = argument.parse::<u8>().ok().filter(|c| *c <= 83)?;
                self.ram = self.ram.with_channel(channel);
                self.flash = self.flash.with_channel(channel);
                self.counters.flash_writes += 1;
                Some("OK")
            }
            _ => None,
        }
    }

    fn save_extras(&mut self) {
        self.flash_extras = Extras { ufreq: self.flash_extras.ufreq, ..self.extras };
        self.counters.flash_writes += 1;
    }

    fn reply_text(&mut self, text: &str) {
        let mut bytes = text.as_bytes().to_vec();
        if !self.config.quirks.no_newline {
            bytes.extend_from_slice(b"\r\n");
        }
        self.reply(AT_DELAY_US, &bytes);
    }

    fn reply(&mut self, delay_us: u64, bytes: &[u8]) {
        let mut all = self.config.quirks.junk_prefix.clone();
        all.extend_from_slice(bytes);
        self.output(delay_us, &all);
    }
}
