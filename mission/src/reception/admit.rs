//! How much of a claim is believed.

use super::{
    Attribution, Content, DELIVERED_MAX, Doubt, Doubts, NAME_MAX, Reception, Refusal, Said, Signal,
    attribute, choose_time,
};
use crate::clock::UtcUs;

/// What the text `Error_CRC` in place of bytes says: there was a packet, and its checksum was wrong.
const ERROR_CRC: &[u8] = b"Error_CRC";
/// Characters of a source's own id that are kept.
const ID_MAX: usize = 128;

/// What is admitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Admission {
    /// The time now.
    pub now: UtcUs,
    /// The launch: nothing was received before. `None`: nobody has said.
    pub earliest: Option<UtcUs>,
    /// What our satellite is called elsewhere, in lower case: a packet without bytes is ours only under one of these.
    /// Empty: any.
    pub labels: Vec<String>,
}

impl Admission {
    /// Anything, now.
    pub const fn at(now: UtcUs) -> Self {
        Self { now, earliest: None, labels: Vec::new() }
    }

    fn is_ours(&self, said: &Said) -> bool {
        let known = |label: &str| self.labels.iter().any(|ours| ours.eq_ignore_ascii_case(label.trim()));
        self.labels.is_empty()
            || said.label.as_deref().is_some_and(known)
            || said.norad.filter(|norad| *norad != 0).is_some_and(|norad| known(&norad.to_string()))
    }
}

/// Believes as much of a claim as may be believed.
///
/// # Errors
/// [`Refusal`] when it is no reception of a satellite of ours.
pub fn admit(said: Said, admission: &Admission) -> Result<Reception, Refusal> {
    let content = match &said.bytes {
        Some(bytes) if bytes.is_empty() => return Err(Refusal::NoBytes),
        Some(bytes) if bytes.len() > DELIVERED_MAX => return Err(Refusal::PacketTooLong),
        Some(bytes) if bytes == ERROR_CRC => detection(&said, admission)?,
        Some(bytes) => match attribute(bytes) {
            Attribution::Frame { bytes, trim } => Content::Frame { bytes, trim },
            Attribution::Damaged { offered } => {
                Content::Damaged { delivered: bytes.as_slice().into(), offered }
            }
            Attribution::Test => return Err(Refusal::TestPacket),
            Attribution::Foreign => return Err(Refusal::Foreign),
        },
        None => detection(&said, admission)?,
    };
    let mut doubts = said.doubts;
    let (received_at, time_basis, time_error_us) =
        choose_time(&said.times, admission.now, admission.earliest, &mut doubts);
    let mut receiver = said.receiver;
    receiver.id = receiver.id.and_then(|id| plain(id, ID_MAX, &mut doubts));
    receiver.name = receiver.name.and_then(|name| plain(name, NAME_MAX, &mut doubts));
    let place = (receiver.latitude_deg, receiver.longitude_deg);
    if !matches!(place, (Some(lat), Some(lon)) if lat.abs() <= 90.0 && lon.abs() <= 180.0) {
        if place != (None, None) {
            doubts.add(Doubt::Position);
        }
        (receiver.latitude_deg, receiver.longitude_deg) = (None, None);
    }
    within(&mut receiver.altitude_m, -1_000.0, 20_000.0, Doubt::Altitude, &mut doubts);
    Ok(Reception {
        ear: said.ear,
        source_id: plain(said.source_id, ID_MAX, &mut doubts).unwrap_or_default(),
        receiver,
        received_at,
        time_basis,
        time_error_us,
        signal: checked(said.signal, &mut doubts),
        radio_crc: said.radio_crc,
        noisy: said.noisy,
        label: said.label.and_then(|label| plain(label, NAME_MAX, &mut doubts)),
        norad: said.norad.filter(|norad| *norad != 0),
        content,
        doubts,
        original: said.original,
    })
}

fn detection(said: &Said, admission: &Admission) -> Result<Content, Refusal> {
    if admission.is_ours(said) { Ok(Content::Detection) } else { Err(Refusal::Foreign) }
}

fn checked(mut signal: Signal, doubts: &mut Doubts) -> Signal {
    within(&mut signal.rssi_dbm, -200.0, 50.0, Doubt::Rssi, doubts);
    within(&mut signal.snr_db, -60.0, 60.0, Doubt::Snr, doubts);
    within(&mut signal.frequency_hz, 1e6, 1e11, Doubt::Frequency, doubts);
    for value in [&mut signal.frequency_offset_hz, &mut signal.doppler_hz, &mut signal.frequency_error_hz] {
        within(value, -1e6, 1e6, Doubt::Frequency, doubts);
    }
    within(&mut signal.bandwidth_hz, 1e3, 2e6, Doubt::Modulation, doubts);
    for (value, least, most) in [(&mut signal.spreading_factor, 5, 12), (&mut signal.coding_rate, 5, 8)] {
        if value.is_some_and(|found| !(least..=most).contains(&found)) {
            *value = None;
            doubts.add(Doubt::Modulation);
        }
    }
    signal
}

/// Drops a value that is out of range or no number.
fn within(value: &mut Option<f64>, least: f64, most: f64, doubt: Doubt, doubts: &mut Doubts) {
    if value.is_some_and(|found| !(least..=most).contains(&found)) {
        *value = None;
        doubts.add(doubt);
    }
}

/// Text that may be shown: no control characters, nothing that turns the direction of writing, not too long.
fn plain(text: String, most: usize, doubts: &mut Doubts) -> Option<String> {
    let unseen = |c: char| {
        c.is_control()
            || matches!(c, '\u{200B}'..='\u{200F}' | '\u{2028}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
    };
    // As nearly all names are.
    let trimmed = text.trim();
    if trimmed.len() <= most && trimmed.bytes().all(|byte| matches!(byte, 0x20..=0x7E)) {
        if trimmed.len() == text.len() {
            return (!text.is_empty()).then_some(text);
        }
        return (!trimmed.is_empty()).then(|| trimmed.to_owned());
    }
    let mut kept: String = text.trim().chars().filter(|c| !unseen(*c)).take(most).collect();
    if kept.len() != text.trim().len() {
        doubts.add(Doubt::Name);
    }
    kept.truncate(kept.trim_end().len());
    (!kept.is_empty()).then_some(kept)
}

#[cfg(test)]
mod tests {
    use super::super::{Ear, TimeBasis};
    use super::*;

    const PONG: [u8; 16] =
        [0x50, 0x49, 0x58, 0x45, 0x4C, 0x53, 0x41, 0x54, 0x24, 0x0B, 0xC9, 0x99, 0, 7, 0, 0];

    fn said() -> Said {
        Said { bytes: Some(PONG.into()), ..Said::new(Ear::File, "1".into()) }
    }

    fn admission() -> Admission {
        Admission::at(UtcUs(1_790_000_000_000_000))
    }

    #[test]
    fn bad_values_are_dropped_and_the_frame_survives() {
        let mut bad = said();
        bad.signal = Signal {
            rssi_dbm: Some(-201.0),
            snr_db: Some(f64::NAN),
            frequency_error_hz: Some(f64::INFINITY),
            spreading_factor: Some(13),
            ..Signal::default()
        };
        bad.receiver.latitude_deg = Some(90.5);
        bad.receiver.longitude_deg = Some(0.0);
        bad.receiver.altitude_m = Some(1e9);
        bad.receiver.name = Some(format!("\u{1b}[31m\u{202E}{}", "n".repeat(100)));
        let reception = admit(bad, &admission()).unwrap();
        let doubts: Vec<_> = reception.doubts.iter().collect();
        let expected = [
            Doubt::Position,
            Doubt::Altitude,
            Doubt::Rssi,
            Doubt::Snr,
            Doubt::Frequency,
            Doubt::Modulation,
            Doubt::Name,
        ];
        assert_eq!(doubts, expected);
        assert_eq!(reception.signal, Signal::default());
        assert_eq!(reception.receiver.name, Some(format!("[31m{}", "n".repeat(60))));
        assert_eq!((reception.receiver.latitude_deg, reception.receiver.longitude_deg), (None, None));
        assert_eq!(reception.frame(), Some(&PONG[..]));
        assert_eq!(reception.time_basis, TimeBasis::Import);
    }

    #[test]
    fn good_values_stay() {
        let mut good = said();
        good.signal.rssi_dbm = Some(-127.5);
        good.receiver.latitude_deg = Some(-90.0);
        good.receiver.longitude_deg = Some(180.0);
        let reception = admit(good, &admission()).unwrap();
        assert!(reception.doubts.is_empty());
        assert_eq!(reception.signal.rssi_dbm, Some(-127.5));
        assert_eq!(reception.receiver.longitude_deg, Some(180.0));
    }

    #[test]
    fn a_packet_without_bytes_is_a_detection_of_what_was_listened_to() {
        let mut error = said();
        error.bytes = Some(ERROR_CRC.into());
        error.label = Some("PixelSat-I".into());
        assert_eq!(admit(error.clone(), &admission()).unwrap().content, Content::Detection);
        let ours = Admission { labels: vec!["pixelsat-i".into(), "99999".into()], ..admission() };
        assert_eq!(admit(error.clone(), &ours).unwrap().content, Content::Detection);
        error.label = Some("Norbi".into());
        assert_eq!(admit(error.clone(), &ours), Err(Refusal::Foreign));
        error.norad = Some(99_999);
        assert!(admit(error, &ours).is_ok());
    }

    #[test]
    fn sizes_are_bounded() {
        for (bytes, refusal) in [
            (vec![], Refusal::NoBytes),
            (vec![0; 257], Refusal::PacketTooLong),
            (vec![0; 256], Refusal::Foreign),
        ] {
            assert_eq!(admit(Said { bytes: Some(bytes), ..said() }, &admission()), Err(refusal));
        }
    }
}
