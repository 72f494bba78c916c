//! What is sent to break a reader.

use std::io::{self, BufRead, Read as _};

use mission::reception::{Doubt, Refusal, TimeBasis};
use proptest::prelude::*;

use super::super::*;
use super::{NOW, PONG, RX, all, context};

/// So many bytes of one kind, without having them.
struct Long {
    byte: u8,
    left: u64,
}

impl io::Read for Long {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = out.len().min(usize::try_from(self.left).unwrap());
        out[..count].fill(self.byte);
        self.left -= count as u64;
        Ok(count)
    }
}

/// Something long between two good messages.
fn between(before: &str, byte: u8, length: u64, after: &str) -> Vec<Read> {
    let (rx, text) = (RX.replace('\n', ""), |text: &str| io::Cursor::new(text.to_owned().into_bytes()));
    let whole = text(&format!("{rx}\n{before}"))
        .chain(Long { byte, left: length })
        .chain(text(&format!("{after}\n{rx}\n")));
    let reader = io::BufReader::with_capacity(1 << 16, whole);
    let items = Items::new(Format::Json, reader);
    let (mut out, mut most) = (Vec::new(), 0);
    for item in items {
        let item = item.unwrap();
        most = most.max(item.body.as_ref().map_or(0, Vec::len));
        read(&item, &context(), &mut out);
    }
    assert!(most <= PACKET_MAX + 1);
    out
}

#[test]
fn a_line_of_100_mb_is_passed_over_and_the_next_one_is_read() {
    let found = between("{\"data\":\"", b'A', 100 << 20, "\"}");
    assert_eq!(found.len(), 3);
    assert!(found[0].is_ok() && found[2].is_ok());
    assert_eq!(found[1], Err(Refused { line: 2, reason: Refusal::TooLong }));
    // And one that does not even begin as an object.
    let found = between("", b'x', 1 << 20, "");
    assert_eq!(found[1], Err(Refused { line: 2, reason: Refusal::Malformed }));
    assert!(found[2].is_ok());
}

#[test]
fn a_depth_of_100_000_overflows_nothing() {
    let open = format!("{{\"data\":{}", "[".repeat(100_000));
    let close = format!("{}}}", "]".repeat(100_000));
    let found = between(&open, b'1', 1, &close);
    assert_eq!(found[1], Err(Refused { line: 2, reason: Refusal::TooDeep }));
    assert!(found[2].is_ok());
    let deep = |levels: usize| {
        let text = RX.replacen('{', &format!("{{\"x\":{}1{},", "[".repeat(levels), "]".repeat(levels)), 1);
        all(Format::Json, text.as_bytes()).remove(0)
    };
    assert!(deep(31).is_ok());
    assert_eq!(deep(32), Err(Refused { line: 1, reason: Refusal::TooDeep }));
}

#[test]
fn a_message_is_cut_at_its_limit() {
    let long = format!("{{\"data\":\"\",\"x\":\"{}\"}}", "y".repeat(RECEPTION_MAX));
    assert_eq!(message(long.as_bytes(), &context()), [Err(Refused { line: 1, reason: Refusal::TooLong })]);
    let huge = vec![b'['; MESSAGE_MAX + 1];
    assert_eq!(message(&huge, &context()), [Err(Refused { line: 1, reason: Refusal::TooLong })]);
    assert_eq!(message(b"", &context()), [Err(Refused { line: 1, reason: Refusal::Malformed })]);
}

#[test]
fn wrong_types_cost_their_value_and_not_the_frame() {
    let wrong = RX
        .replace("\"sf\":9", "\"sf\":\"nine\"")
        .replace("-127.5", "[1]")
        .replace("[12.971,77.594]", "[\"x\",1e400]")
        .replace("1790000000123456", "1.790000000123456e15")
        .replace("\"noisy\":false", "\"noisy\":\"yes\"")
        .replace("1e400", "400");
    let found = all(Format::Json, wrong.as_bytes()).remove(0).unwrap();
    assert!(found.doubts.has(Doubt::WrongType));
    assert_eq!((found.signal.spreading_factor, found.signal.rssi_dbm), (None, None));
    assert_eq!(found.received_at.0, 1_790_000_000_000_000, "the whole seconds; the float is not believed");
    assert!(found.frame().is_some());
    for (key, refusal) in [("\"data\":7", Refusal::NoBytes), ("\"data\":\"*\"", Refusal::BadBytes)] {
        let text = RX.replace("\"data\":\"3nAZUElYRUxTQVQkC8mZAAcAAA==\"", key);
        assert_eq!(all(Format::Json, text.as_bytes()), [Err(Refused { line: 1, reason: refusal })]);
    }
}

#[test]
fn times_of_1970_and_of_tomorrow_are_not_believed() {
    for (us, s, doubt) in
        [("31000000", "31", Doubt::TimeTooEarly), ("1890000000123456", "1890000000", Doubt::TimeInFuture)]
    {
        let text = RX.replace("1790000000123456", us).replace("1790000000,", &format!("{s},"));
        let found = all(Format::Json, text.as_bytes()).remove(0).unwrap();
        assert_eq!((found.received_at, found.time_basis), (NOW, TimeBasis::Import));
        assert!(found.doubts.has(doubt));
    }
}

#[test]
fn a_line_that_was_cut_does_not_take_the_next_ones_with_it() {
    let rx = RX.replace('\n', "");
    for cut in (1..rx.len()).step_by(7) {
        let text = format!("{}\n{rx}\n{rx}\n", &rx[..cut]);
        let found = all(Format::Json, text.as_bytes());
        let good = found.iter().filter(|read| read.is_ok()).count();
        assert_eq!(good, 2, "cut at {cut}: {:?}", &rx[..cut]);
        assert!(found.len() >= 3);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn anything_may_come_in_any_format(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        for format in [Format::Json, Format::SatnogsCsv, Format::Kiss, Format::Hex, Format::Raw] {
            for found in all(format, &bytes).into_iter().flatten() {
                let again = all(Format::Json, export(&found).as_bytes()).remove(0);
                prop_assert!(again.is_ok_and(|again| again.content.kind() == found.content.kind()));
            }
        }
    }

    #[test]
    fn pieces_do_not_matter(size in 1_usize..40, at in 0_usize..400, byte in any::<u8>()) {
        let mut text = format!("{}\n{{\"packets\":[{RX}]}}\n{PONG}\n", RX.replace('\n', "")).into_bytes();
        let at = at % text.len();
        text[at] = byte;
        let whole: Vec<Read> = all(Format::Json, &text);
        let pieces = io::BufReader::with_capacity(size, &text[..]);
        let cut: Vec<Read> = receptions(Format::Json, pieces, &context()).map(Result::unwrap).collect();
        prop_assert_eq!(whole, cut);
    }
}

#[test]
fn a_reader_that_fails_says_so() {
    struct Broken;
    impl io::Read for Broken {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::Error::other("the disk is gone"))
        }
    }
    impl BufRead for Broken {
        fn fill_buf(&mut self) -> io::Result<&[u8]> {
            Err(io::Error::other("the disk is gone"))
        }
        fn consume(&mut self, _: usize) {}
    }
    let found: Vec<_> = receptions(Format::Hex, Broken, &context()).collect();
    assert_eq!(found.len(), 1);
    assert!(found[0].is_err());
}
