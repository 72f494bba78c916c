//! Any bytes decode without a panic, and what decodes encodes back to the same bytes.

use proptest::prelude::*;
use protocol::{
    DownFrame, Downlink, FrameForm, Key, KeyId, Nonce, PayloadError, RequestTag, SealedUplink, Telecommand,
    TwoLines, crc32, encode_down, open, seal, seal_plaintext,
};

/// Payloads that are likely to mean something: any bytes, cut to the length of a type.
fn down_payload() -> impl Strategy<Value = (u8, Vec<u8>)> {
    let lengths = prop_oneof![
        Just(0usize),
        Just(1),
        Just(13),
        Just(224),
        Just(141),
        Just(9),
        Just(117),
        Just(25),
        0..=224usize
    ];
    let types = prop_oneof![0..8u8, 0x3E..0x43u8, any::<u8>()];
    let small = prop_oneof![3 => any::<u8>(), 1 => 0..2u8];
    (types, lengths.prop_flat_map(move |len| proptest::collection::vec(small.clone(), len)))
}

/// The same for requests: a list's count and length are made to fit now and then.
fn up_payload() -> impl Strategy<Value = (u8, Vec<u8>)> {
    let any_bytes =
        (prop_oneof![0..17u8, 0x40..0x48u8, any::<u8>()], proptest::collection::vec(any::<u8>(), 0..=196));
    let list = |packet_type: u8, head: &'static [u8], count_at: usize, entry: usize, max: usize| {
        (0..=max).prop_flat_map(move |n| {
            proptest::collection::vec(0..0x7Fu8, n * entry).prop_map(move |entries| {
                let mut payload = head.to_vec();
                payload[count_at] = n as u8;
                payload.extend(entries);
                (packet_type, payload)
            })
        })
    };
    let exact = |packet_type: u8, len: usize| {
        proptest::collection::vec(any::<u8>(), len).prop_map(move |payload| (packet_type, payload))
    };
    prop_oneof![
        any_bytes,
        list(4, &[0], 0, 16, 12),
        list(7, &[0], 0, 24, 8),
        list(14, &[0], 0, 4, 48),
        list(0x41, &[9, 1, 2, 0, 1, 2, 3, 4], 3, 21, 8),
        list(0x44, &[9, 0, 1, 0], 3, 23, 8),
        list(0x46, &[1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0], 2, 12, 6),
        exact(2, 4),
        exact(6, 2),
        exact(9, 12),
        exact(10, 8),
        exact(12, 8),
        exact(15, 1),
        exact(0x40, 2),
        exact(0x43, 5),
        exact(0x45, 4),
        proptest::collection::vec(0x20..0x7Fu8, 138).prop_map(|text| (13, text)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, ..ProptestConfig::default() })]

    #[test]
    fn a_downlink_payload_that_decodes_encodes_to_itself((packet_type, payload) in down_payload(), tag: u8) {
        let Ok(packet) = Downlink::decode(packet_type, &payload) else { return Ok(()) };
        prop_assert_eq!(packet.packet_type(), packet_type);
        if let Downlink::Unknown { .. } = packet {
            return Ok(());
        }
        let mut out = [0xA5; 224];
        let len = packet.encode_payload(&mut out);
        prop_assert_eq!(&out[..len], &payload[..]);
        prop_assert_eq!(len, packet.payload_len());

        // The fields tile the payload.
        let mut at = 0;
        packet.visit_fields(&mut |field| {
            assert_eq!(usize::from(field.offset), at);
            assert!(field.len > 0 && !field.name.is_empty());
            at += usize::from(field.len);
        });
        prop_assert_eq!(at, len);

        for form in [FrameForm::Short, FrameForm::Full] {
            let mut out = [0xA5; 240];
            let len = encode_down(&packet, RequestTag::new(tag), form, &mut out);
            prop_assert!(out[len..].iter().all(|byte| *byte == 0xA5));
            let frame = DownFrame::parse(&out[..len]).unwrap();
            prop_assert_eq!(frame.payload(), &payload[..]);
            prop_assert_eq!(frame.raw_header().tag, tag);
            prop_assert_eq!(frame.crc(), crc32(frame.contents()));
        }
    }

    #[test]
    fn a_request_that_decodes_encodes_to_itself((packet_type, payload) in up_payload()) {
        let Ok(command) = Telecommand::decode(packet_type, &payload) else { return Ok(()) };
        prop_assert_eq!(command.packet_type(), packet_type);
        prop_assert!(command.validate().is_ok());
        let mut out = [0xA5; 196];
        let len = command.encode_payload(&mut out);
        prop_assert_eq!(&out[..len], &payload[..]);
        prop_assert!(out[len..].iter().all(|byte| *byte == 0xA5));
        let mut at = 0;
        command.visit_fields(&mut |field| {
            assert_eq!(usize::from(field.offset), at);
            at += usize::from(field.len);
        });
        prop_assert_eq!(at, len);
        prop_assert!(command.to_string().starts_with(command.name()));
    }

    #[test]
    fn any_bytes_parse_or_not_without_a_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        if let Ok(frame) = DownFrame::parse(&bytes) {
            let _ = frame.packet();
        }
        let mut framed = b"PIXELSAT".to_vec();
        let contents = &bytes[..bytes.len().min(228)];
        framed.extend(crc32(contents).to_be_bytes());
        framed.extend(contents);
        if let Ok(frame) = DownFrame::parse(&framed) {
            let _ = frame.packet();
        }
        let _ = SealedUplink::try_from(&bytes[..]);
    }

    #[test]
    fn sealed_requests_open_and_any_flip_is_refused(
        (packet_type, payload) in up_payload(), key: [u8; 16], nonce: [u8; 12], tag in 1..=255u8, padding in any::<u8>(),
        flip in 12..240usize, bit in 0..8u8,
    ) {
        let Ok(command) = Telecommand::decode(packet_type, &payload) else { return Ok(()) };
        let (key, nonce) = (Key::from_bytes(key), Nonce::from_bytes(nonce));
        let tag = RequestTag::new(tag).unwrap();
        let sealed = seal(&key, nonce, tag, &command, &[padding; 200]);
        let opened = open(&key, &sealed).unwrap();
        prop_assert!(opened.check_crc().is_ok());
        prop_assert_eq!((opened.tag(), opened.nonce()), (Some(tag), nonce));
        prop_assert_eq!(opened.telecommand(), Ok(command));
        prop_assert!(opened.plaintext()[4 + payload.len()..].iter().all(|byte| *byte == padding));

        let mut bytes = *sealed.as_bytes();
        bytes[flip] ^= 1u8 << bit;
        prop_assert!(open(&key, &SealedUplink::from_bytes(bytes).unwrap()).is_err());
    }

    #[test]
    fn any_plaintext_is_judged_without_a_panic(head: [u8; 32], body: u8, packet_type in 0..0x48u8, length in 0..210u16) {
        let mut plaintext = [body; 200];
        plaintext[..32].copy_from_slice(&head);
        plaintext[0] = packet_type;
        plaintext[2..4].copy_from_slice(&length.to_be_bytes());
        let key = Key::from_bytes([1; 16]);
        let opened = open(&key, &seal_plaintext(&key, Nonce::from_bytes([0; 12]), &plaintext)).unwrap();
        prop_assert!(opened.check_crc().is_ok());
        match opened.telecommand() {
            Err(PayloadError::HeaderLength { .. }) => prop_assert!(length > 196),
            _ => prop_assert!(length <= 196),
        }
    }

    #[test]
    fn crc_is_the_one_of_crc32fast(bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
        prop_assert_eq!(crc32(&bytes), crc32fast::hash(&bytes));
    }

    #[test]
    fn text_parsers_take_any_text(text in "\\PC*", other in "\\PC*") {
        let _ = text.parse::<KeyId>();
        let _ = TwoLines::new(&text, &other);
    }
}

#[test]
fn a_request_reads_as_a_line() {
    let chunks = Telecommand::GetImageChunk { first: 1, count: 2 };
    assert_eq!(chunks.to_string(), "GetImageChunk first=1 count=2");
    assert_eq!(Telecommand::Ping.to_string(), "Ping");
    let payload = [2, 0, 1, 0, 2, 0, 3, 0, 4];
    let ranges = Telecommand::decode(14, &payload).unwrap();
    assert_eq!(ranges.to_string(), "GetImageRanges n=2 [0] first=1 count=2 [1] first=3 count=4");
    let capture = Telecommand::decode(6, &[1, 1]).unwrap();
    assert_eq!(capture.to_string(), "CaptureImage resolution=SVGA grey=true strong_compression=false");
}
