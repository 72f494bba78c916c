//! What strangers write: files and messages of reports.

use std::io::BufReader;

use gs_server::ingest::formats::{Context, Format, Items, PACKET_MAX, Read, export, message, read};
use mission::UtcUs;
use mission::reception::{Admission, Content, DELIVERED_MAX, NAME_MAX};
use protocol::DownFrame;

const FORMATS: [Format; 5] = [Format::Json, Format::SatnogsCsv, Format::Kiss, Format::Hex, Format::Raw];

/// Any bytes as a file; the first chooses its format and in what pieces it is read. What comes out is bounded, whatever
/// is taken for a frame is one, values are in their ranges, pieces make no difference, and our own export of a reception
/// is read as the same.
pub fn formats(data: &[u8]) {
    let Some((choice, file)) = data.split_first() else { return };
    let format = FORMATS[usize::from(*choice) % FORMATS.len()];
    let whole = found(format, file, 1 << 16);
    assert_eq!(whole, found(format, file, 1 + usize::from(*choice / 5)), "in pieces it is another file");
    for reception in whole.into_iter().flatten() {
        let (signal, receiver) = (&reception.signal, &reception.receiver);
        assert!(signal.rssi_dbm.is_none_or(|dbm| (-200.0..=50.0).contains(&dbm)), "{reception:?}");
        assert!(signal.snr_db.is_none_or(|db| (-60.0..=60.0).contains(&db)), "{reception:?}");
        assert!(receiver.latitude_deg.is_none_or(|deg| deg.abs() <= 90.0), "{reception:?}");
        assert!(receiver.name.as_ref().is_none_or(|name| name.chars().count() <= NAME_MAX), "{reception:?}");
        assert!(reception.received_at <= context().admission.now.plus(60_000_000), "{reception:?}");
        match &reception.content {
            Content::Frame { bytes, .. } => assert!(DownFrame::parse(bytes).is_ok(), "no frame"),
            Content::Damaged { delivered, .. } => assert!(delivered.len() <= DELIVERED_MAX),
            Content::Detection => {}
        }
        let again = message(export(&reception).as_bytes(), &context());
        assert!(matches!(&again[..], [Ok(_)]), "our own export is refused: {again:?} of {reception:?}");
        for again in again.into_iter().flatten() {
            assert_eq!(again.content.kind(), reception.content.kind());
            assert_eq!(again.frame(), reception.frame());
            assert_eq!((again.receiver_id(), again.signal), (reception.receiver_id(), reception.signal));
        }
    }
}

fn context() -> Context {
    Context::file(Admission::at(UtcUs(1_790_000_010_000_000)))
}

fn found(format: Format, file: &[u8], piece: usize) -> Vec<Read> {
    let mut out = Vec::new();
    for item in Items::new(format, BufReader::with_capacity(piece, file)) {
        // Reading from memory does not fail.
        let Ok(item) = item else { break };
        assert!(item.body.as_ref().map_or(0, Vec::len) <= PACKET_MAX + 1, "too much is held");
        read(&item, &context(), &mut out);
    }
    out
}
