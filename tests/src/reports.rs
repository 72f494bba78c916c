//! Reports as volunteers' stations send them, made for tests.

use std::fmt::Write as _;

/// A heartbeat in a short frame.
#[must_use]
pub fn heartbeat(uptime_ms: u32) -> Vec<u8> {
    let mut payload = vec![0; 117];
    payload[100..104].copy_from_slice(&21.5_f32.to_be_bytes());
    payload[104..108].copy_from_slice(&uptime_ms.to_be_bytes());
    frame(6, &payload)
}

/// A chunk of an image.
#[must_use]
pub fn chunk(index: u16, byte: u8) -> Vec<u8> {
    let mut payload = vec![byte; 224];
    payload[..2].copy_from_slice(&index.to_be_bytes());
    frame(3, &payload)
}

/// A frame in the short form.
#[must_use]
pub fn frame(packet_type: u8, payload: &[u8]) -> Vec<u8> {
    let mut contents = vec![packet_type, 0, 0, u8::try_from(payload.len()).unwrap_or(u8::MAX)];
    contents.extend(payload);
    [b"PIXELSAT", &protocol::crc32(&contents).to_be_bytes()[..], &contents].concat()
}

/// What a board publishes, after its topic, as a subscriber writes it down. `at_us` is the board's clock.
#[must_use]
pub fn rx(station: &str, frame: &[u8], at_us: i64) -> String {
    format!(
        "tinygs/team/{station}/tele/rx {{\"station_location\":[12.971,77.594],\"mode\":\"LoRa\",\"frequency\":435,\
         \"frequency_offset\":-310.5,\"satellite\":\"PixelSat-I\",\"sf\":9,\"cr\":5,\"bw\":125,\"iIQ\":false,\"rssi\":-127.5,\
         \"snr\":-11.75,\"frequency_error\":1843.2,\"unix_GS_time\":{},\"usec_time\":{at_us},\"crc_error\":false,\
         \"data\":\"{}\",\"NORAD\":99999,\"noisy\":false}}\n",
        at_us / 1_000_000,
        base64(frame)
    )
}

/// So many frames from this one on, each heard by five stations: nine chunks to a heartbeat.
#[must_use]
pub fn log(first: u32, frames: u32) -> String {
    let mut text = String::new();
    for number in first..first + frames {
        let frame = match number % 10 {
            0 => heartbeat(number * 1_000),
            _ => chunk((number % 3_000) as u16, (number / 3_000) as u8),
        };
        for station in 0..5 {
            let at_us = 1_780_000_000_000_000 + i64::from(number) * 40_000_000 + station * 1_000;
            text.push_str(&rx(&format!("station{station}"), &frame, at_us));
        }
    }
    text
}

/// RFC 4648, with its padding.
#[must_use]
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let at = |place: usize| u32::from(three.get(place).copied().unwrap_or(0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for place in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * place) & 63) as usize];
            text.push(if place > three.len() { '=' } else { char::from(digit) });
        }
    }
    text
}

/// Bytes as hex digits.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // writing to a string does not fail
        let _ = write!(text, "{byte:02x}");
        text
    })
}
