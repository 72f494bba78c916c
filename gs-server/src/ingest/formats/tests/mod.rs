//! Forms as their writers make them, and whatever else may come.

mod hostile;

use mission::UtcUs;
use mission::reception::{Admission, Content, Ear, RadioCrc, Reception, Refusal, TimeBasis};

use super::*;

/// 2026-09-21T14:13:20Z and some.
pub(super) const NOW: UtcUs = UtcUs(1_790_000_010_000_000);
pub(super) const PONG: &str = "50495845 4c534154 240bc999 00070000";
pub(super) const RX: &str = r#"{"station_location":[12.971,77.594],"mode":"LoRa","frequency":436.7030029,"frequency_offset":-310.5,
 "satellite":"PixelSat-I","sf":9,"cr":5,"bw":125,"iIQ":false,"rssi":-127.5,"snr":-11.75,
 "frequency_error":1843.2,"unix_GS_time":1790000000,"usec_time":1790000000123456,
 "crc_error":false,"data":"3nAZUElYRUxTQVQkC8mZAAcAAA==","NORAD":99999,"noisy":false}"#;

pub(super) fn context() -> Context {
    Context::file(Admission::at(NOW))
}

pub(super) fn all(format: Format, bytes: &[u8]) -> Vec<Read> {
    receptions(format, bytes, &context()).map(Result::unwrap).collect()
}

fn one(format: Format, bytes: &[u8]) -> Reception {
    let mut all = all(format, bytes);
    assert_eq!(all.len(), 1, "{all:?}");
    all.remove(0).unwrap()
}

fn pong() -> Vec<u8> {
    hex::decode(PONG.replace(' ', "")).unwrap()
}

#[test]
fn a_boards_packet_is_read_with_all_it_says() {
    let topic = Topic::parse("tinygs/team/roof/tele/rx").unwrap();
    let arrived = Some(UtcUs(1_790_000_001_000_000));
    let context = Context { arrived, board_read_at_reception: Some(true), ..context() };
    let found = rx(&topic, RX.as_bytes(), &context);
    let [Ok(reception)] = &found[..] else { panic!("{found:?}") };
    assert_eq!(reception.ear, Ear::OwnMqtt);
    assert_eq!(reception.received_at, UtcUs(1_790_000_000_123_456), "not by way of a float");
    assert_eq!(reception.time_basis, TimeBasis::BoardAtReception);
    assert_eq!(reception.receiver.id.as_deref(), Some("team/roof"));
    assert_eq!(
        (reception.receiver.latitude_deg, reception.receiver.longitude_deg),
        (Some(12.971), Some(77.594))
    );
    let signal = reception.signal;
    assert_eq!((signal.frequency_hz, signal.frequency_offset_hz), (Some(436_703_000.0), Some(-310.5)));
    assert_eq!(
        (signal.spreading_factor, signal.bandwidth_hz, signal.coding_rate),
        (Some(9), Some(125e3), Some(5))
    );
    assert_eq!(
        (signal.rssi_dbm, signal.snr_db, signal.frequency_error_hz),
        (Some(-127.5), Some(-11.75), Some(1843.2))
    );
    let Content::Frame { bytes, trim } = &reception.content else { panic!("{reception:?}") };
    assert_eq!((&**bytes, trim.bytes), (&pong()[..], 3));
    assert_eq!(reception.original.as_deref(), Some(RX.as_bytes()), "verbatim");
}

#[test]
fn a_checksum_error_of_a_board_is_a_detection_and_its_test_packet_is_none() {
    let error =
        RX.replace("false,\"data\"", "true,\"data\"").replace("3nAZUElYRUxTQVQkC8mZAAcAAA==", "RXJyb3JfQ1JD");
    let found = one(Format::Json, error.as_bytes());
    assert_eq!((found.content, found.radio_crc), (Content::Detection, RadioCrc::Wrong));
    assert_eq!(found.signal.frequency_error_hz, Some(1843.2));
    let test = RX.replace("3nAZUElYRUxTQVQkC8mZAAcAAA==", "VGlueUdTLXRlc3QgMQ==");
    assert_eq!(all(Format::Json, test.as_bytes()), [Err(Refused { line: 1, reason: Refusal::TestPacket })]);
}

#[test]
fn what_a_subscriber_wrote_down_has_its_topics() {
    let line = RX.replace('\n', "");
    let log = format!(
        "tinygs/team/roof/tele/rx {line}\ntinygs/team/roof/tele/ping {{\"Vbat\":1}}\n\n# mine\n{line}\n"
    );
    let found = all(Format::Json, log.as_bytes());
    assert_eq!(found.len(), 3);
    assert_eq!(found[0].as_ref().unwrap().receiver.id.as_deref(), Some("team/roof"));
    assert_eq!(found[1], Err(Refused { line: 2, reason: Refusal::NotAReport }));
    let last = found[2].as_ref().unwrap();
    assert_eq!(last.receiver.id, None);
    assert_eq!(last.source_id, found[0].as_ref().unwrap().source_id, "one message, whoever wrote it down");
}

const PACKET: &str = r#"{"id":"0193-a","serverTime":1790000002000,"raw":"UElYRUxTQVQkC8mZAAcAAA==","mode":"LoRa","freq":435,
  "sf":9,"bw":125,"cr":5,"satellite":"Norbi","norad":0,"satPos":{"lat":1,"lng":2,"alt":500},"stationNumber":2}"#;

#[test]
fn a_list_of_the_api_gives_its_packets_and_one_packet_its_stations() {
    let list = format!(
        "{{\"templates\":{{\"x\":\"<b>{{[\"}},\"packets\":[{PACKET},{PACKET}],\"more\":{{\"a\":[1]}}}}"
    );
    let found = all(Format::Json, list.as_bytes());
    assert_eq!(found.len(), 2);
    let first = found[0].as_ref().unwrap();
    assert_eq!(
        (first.ear, first.source_id.as_str(), first.time_basis),
        (Ear::TinygsApi, "0193-a", TimeBasis::Server)
    );
    assert_eq!(first.received_at, UtcUs(1_790_000_002_000_000));
    assert_eq!(first.frame(), Some(&pong()[..]), "by its content: the label says Norbi");
    assert_eq!((first.receiver_id(), first.norad), ("", None));

    let station = |name: &str, error: bool, us: u64| {
        format!(
            r#"{{"name":"{name}","userId":42,"location":[50.1,14.4],"distance":900,"elevation":12,"usec_time":{us},
                "crc_error":{error},"doppler":1.00001,"receptionParams":{{"rssi":-130,"snr":-9.5,"frequency_error":-812}}}}"#
        )
    };
    let stations = format!("{},{}", station("A", false, 1_790_000_001_500_000), station("B", true, 77));
    let detail = PACKET.replacen('{', &format!("{{\"stations\":[{stations}],"), 1);
    let found = all(Format::Json, detail.as_bytes());
    let [Ok(a), Ok(b)] = &found[..] else { panic!("{found:?}") };
    assert_eq!((a.receiver_id(), b.receiver_id()), ("A@42", "B@42"));
    assert_eq!((a.time_basis, b.time_basis), (TimeBasis::Board, TimeBasis::Server));
    assert_eq!(a.received_at, UtcUs(1_790_000_001_500_000));
    assert_eq!((a.signal.frequency_error_hz, a.receiver.latitude_deg), (Some(-812.0), Some(50.1)));
    assert_eq!(b.content, Content::Detection, "the bytes are the other station's");
    assert!(a.original.is_some() && b.original.is_none(), "kept once");
}

#[test]
fn satnogs_json_and_csv_tell_the_same() {
    let row = r#"{"norad_cat_id":98765,"transmitter":"x","app_source":"sids","schema":"","decoded":"","frame":"504958454C534154240BC99900070000",
        "observer":"DL0XYZ-JO62qn","timestamp":"2026-09-21T14:13:20Z","version":"","sat_id":"ABCD"}"#;
    for text in [row.to_owned(), format!("[{row}]"), format!("{{\"next\":null,\"results\":[{row}]}}")] {
        let found = one(Format::Json, text.as_bytes());
        assert_eq!((found.ear, found.received_at), (Ear::Satnogs, UtcUs(1_790_000_000_000_000)), "{text}");
        assert_eq!(found.receiver.name.as_deref(), Some("DL0XYZ-JO62qn"));
        assert!((found.receiver.latitude_deg.unwrap() - 52.56).abs() < 0.03);
        let csv = "2026-09-21 14:13:20|504958454C534154240BC99900070000\n";
        assert_eq!(one(Format::SatnogsCsv, csv.as_bytes()).source_id, found.source_id);
    }
    let headed = "timestamp,frame\n2026-09-21 14:13:20,\"504958454C534154240BC99900070000\"\n";
    let found = all(Format::SatnogsCsv, headed.as_bytes());
    assert_eq!(found[0], Err(Refused { line: 1, reason: Refusal::NotAReport }));
    assert_eq!(found[1].as_ref().unwrap().frame(), Some(&pong()[..]));
}

#[test]
fn kiss_hex_and_raw_bytes_are_read() {
    let kiss = [&[0xC0, 0x00][..], &pong(), &[0xDB, 0xDC, 0xC0, 0xC0, 0x06, 1, 0xC0, 0x10], &pong(), &[0xC0]]
        .concat();
    let found = all(Format::Kiss, &kiss);
    assert_eq!(found.len(), 2, "settings of the modem are no frames: {found:?}");
    assert_eq!(found[1].as_ref().unwrap().frame(), Some(&pong()[..]));
    assert_eq!(found[1].as_ref().unwrap().time_basis, TimeBasis::Import);

    let hex = format!(
        "# log\n2026-09-21T14:13:20.5Z rssi=-120 snr=-3.5 station=roof de:70:19 {PONG}\n{PONG}\n{PONG}\nhello\n"
    );
    let found = all(Format::Hex, hex.as_bytes());
    assert_eq!(found.len(), 4);
    let first = found[0].as_ref().unwrap();
    assert_eq!(first.received_at, UtcUs(1_790_000_000_500_000));
    assert_eq!((first.signal.rssi_dbm, first.receiver_id()), (Some(-120.0), "roof"));
    let ids: Vec<_> = found[1..3].iter().map(|read| &read.as_ref().unwrap().source_id).collect();
    assert_ne!(ids[0], ids[1], "two lines without a time are two receptions");
    assert_eq!(found[3], Err(Refused { line: 5, reason: Refusal::BadBytes }));
    assert_eq!(all(Format::Hex, hex.as_bytes())[2], found[2], "and the same two the next time");

    let raw = [b"noise".as_slice(), &pong(), b"PIXELS", &pong()].concat();
    assert_eq!(all(Format::Raw, &raw).iter().filter(|read| read.is_ok()).count(), 2);
}

#[test]
fn our_own_export_comes_back() {
    let topic = Topic::parse("tinygs/team/roof/tele/rx").unwrap();
    let was = rx(&topic, RX.as_bytes(), &context()).remove(0).unwrap();
    let line = export(&was);
    let is = one(Format::Json, line.as_bytes());
    let same = Reception { original: was.original.clone(), content: was.content.clone(), ..is.clone() };
    assert_eq!(same, was, "also how its time is known");
    assert_eq!(is.frame(), was.frame());
    // However it is known, and whatever it may be off by.
    for time_basis in TimeBasis::ALL {
        for time_error_us in [None, Some(0), Some(600_000_001)] {
            let was = Reception { time_basis, time_error_us, ..was.clone() };
            let is = one(Format::Json, export(&was).as_bytes());
            assert_eq!((is.time_basis, is.time_error_us), (time_basis, time_error_us));
            assert_eq!(is.received_at, was.received_at);
        }
    }
}

#[test]
fn a_time_of_an_export_gets_no_better_on_its_way() {
    let topic = Topic::parse("tinygs/team/roof/tele/rx").unwrap();
    let was = rx(&topic, RX.as_bytes(), &context()).remove(0).unwrap();
    let with = |basis: &str, error: serde_json::Value, at: Option<UtcUs>| {
        let mut line: serde_json::Value = serde_json::from_str(&export(&was)).unwrap();
        line["time_basis"] = basis.into();
        match error {
            serde_json::Value::Bool(_) => drop(line.as_object_mut().unwrap().remove("time_error_s")),
            error => line["time_error_s"] = error,
        }
        let context = Context { at, ..context() };
        let found = message(line.to_string().as_bytes(), &context).remove(0).unwrap();
        (found.received_at, found.time_basis, found.time_error_us)
    };
    let (at, nothing) = (was.received_at, serde_json::Value::Bool(false));
    // An export of an earlier version said how a time is known, and not how well.
    assert_eq!(with("arrival", nothing.clone(), None), (at, TimeBasis::Arrival, Some(30_000_000)));
    assert_eq!(with("board-alone", nothing.clone(), None), (at, TimeBasis::BoardAlone, None));
    for nonsense in [(-1.0).into(), 1e300.into()] {
        assert_eq!(with("server", nonsense, None), (at, TimeBasis::Server, None));
    }
    assert_eq!(with("a guess", 3.0.into(), None).1, TimeBasis::Stated);
    // Whoever knows when it was may say so, where the archive did not.
    let told = Some(at.plus(-5_000_000));
    assert_eq!(with("import", nothing.clone(), told).1, TimeBasis::Stated);
    assert_eq!(with("import", nothing, None), (at, TimeBasis::Import, None));
}

#[test]
fn a_file_is_known_by_its_beginning() {
    let hex = PONG.as_bytes();
    for (head, format) in [
        (&b"  {\"a\":1}"[..], Some(Format::Json)),
        (b"[{", Some(Format::Json)),
        (b"tinygs/a/b/tele/rx {", Some(Format::Json)),
        (b"\xC0\x00PIXELSAT", Some(Format::Kiss)),
        (b"2026-09-21 14:13:20|5049", Some(Format::SatnogsCsv)),
        (hex, Some(Format::Hex)),
        (b"\x01\x02PIXELSAT", Some(Format::Raw)),
        (b"PIXELSAT", Some(Format::Raw)),
        (b"", None),
    ] {
        assert_eq!(Format::of(head), format, "{}", String::from_utf8_lossy(head));
    }
}
