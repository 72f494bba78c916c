//! Uplink: streams, payloads, sealed frames.

use protocol::{
    Key, Nonce, RequestTag, SealedUplink, Telecommand, UP_MAGIC, UpDecoder, crc32, open, seal, seal_raw,
};

use crate::pieces;

/// A stream: first byte how to cut it.
pub fn up_stream(data: &[u8]) {
    let [cut, stream @ ..] = data else { return };
    let expected: Vec<_> = stream
        .windows(240)
        .enumerate()
        .filter(|(_, window)| window.starts_with(&UP_MAGIC))
        .map(|(at, window)| (at as u64, window.to_vec()))
        .collect();
    let mut found = Vec::new();
    let mut decoder = UpDecoder::new();
    let mut pushed = 0;
    for piece in pieces(*cut, stream) {
        let before = pushed;
        pushed += piece.len() as u64;
        decoder.push(piece, &mut |offset, sealed| {
            assert!(before < offset + 240 && offset + 240 <= pushed, "a candidate comes with its last byte");
            found.push((offset, sealed.as_bytes().to_vec()));
        });
    }
    assert_eq!(found, expected);
    assert_eq!(decoder.counters().candidates, expected.len() as u64);
}

/// First byte the type, the rest the payload.
pub fn telecommand_payload(data: &[u8]) {
    let [packet_type, payload @ ..] = data else { return };
    let Ok(command) = Telecommand::decode(*packet_type, payload) else { return };
    assert_eq!(command.packet_type(), *packet_type);
    assert_eq!(command.validate(), Ok(()));
    let mut out = [0xA5; 196];
    let len = command.encode_payload(&mut out);
    assert_eq!(len, payload.len());
    assert!(out[len..].iter().all(|byte| *byte == 0xA5), "bytes behind the payload are not touched");
    // *No attitude* is any NaN on the wire, so there the bytes may differ; the value does not.
    if command.packet_type() != protocol::up_type::SET_DOWNLINK_SCHEDULE {
        assert_eq!(&out[..len], payload);
    }
    assert_eq!(Telecommand::decode(*packet_type, &out[..len]).as_ref(), Ok(&command));
    let mut at = 0;
    command.visit_fields(&mut |field| {
        assert_eq!(usize::from(field.offset), at, "fields tile the payload");
        at += usize::from(field.len);
    });
    assert_eq!(at, len);
    assert!(command.to_string().starts_with(command.name()));
}

/// Key (16), nonce (12), where to damage (2), then plaintext, padded to 200.
pub fn sealed_open(data: &[u8]) {
    let Some((key, rest)) = data.split_first_chunk::<16>() else { return };
    let Some((nonce, rest)) = rest.split_first_chunk::<12>() else { return };
    let Some(([place, bit], rest)) = rest.split_first_chunk::<2>() else { return };
    let (key, nonce) = (Key::from_bytes(*key), Nonce::from_bytes(*nonce));
    let mut plaintext = [0; 200];
    let len = rest.len().min(200);
    plaintext[..len].copy_from_slice(&rest[..len]);

    let sealed = seal_raw(&key, nonce, crc32(&plaintext), &plaintext);
    let opened = open(&key, &sealed);
    let opened = opened.as_ref().ok().filter(|opened| opened.plaintext() == &plaintext);
    assert!(opened.is_some(), "what was sealed opens");
    if let Some(opened) = opened {
        assert_eq!(opened.nonce(), nonce);
        assert_eq!(opened.check_crc(), Ok(()));
        assert_eq!(opened.payload().is_ok(), opened.header().length <= 196);
        if let (Ok(command), Some(tag)) = (opened.telecommand(), opened.tag()) {
            let again = open(&key, &seal(&key, nonce, tag, &command, &plaintext));
            assert_eq!(again.as_ref().map(|again| again.telecommand()), Ok(Ok(command)));
            assert_eq!(again.as_ref().map(|again| again.tag()), Ok(RequestTag::new(tag.get())));
        }
    }
    // Any one bit under the tag decides.
    let mut bytes = *sealed.as_bytes();
    bytes[12 + usize::from(*place) % 228] ^= 1 << (bit % 8);
    assert!(SealedUplink::from_bytes(bytes).is_ok_and(|damaged| open(&key, &damaged).is_err()));
    // Bytes as they come open under no key.
    if let Ok(foreign) = SealedUplink::try_from(data.get(..240).unwrap_or(&[])) {
        assert!(open(&key, &foreign).is_err());
    }
}
