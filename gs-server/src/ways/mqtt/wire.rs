//! Packets on the wire, bounded before anything is allocated for them: a packet that is too long is passed over byte by
//! byte, and only told of. The packets themselves are read and written by `rumqttc`.

use rumqttc::mqttbytes::v4::{Codec, Packet};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio_util::bytes::{Buf as _, BytesMut};
use tokio_util::codec::{Decoder, Encoder, Framed};

use crate::ingest::formats::{MESSAGE_MAX, RECEPTION_MAX};

/// What a topic and the rest around a payload may have.
const AROUND: usize = 1 << 10;
/// The first byte of a PUBLISH, in its upper half.
const PUBLISH: u8 = 3;

/// A connection, plain or TLS.
pub(in crate::ways) trait Stream: AsyncRead + AsyncWrite + Send + Sync + Unpin {}

impl<T: AsyncRead + AsyncWrite + Send + Sync + Unpin> Stream for T {}

/// Packets over a connection.
pub(in crate::ways) type Wire = Framed<Box<dyn Stream>, Bounded>;

/// First byte of a CONNECT, with which a client begins.
pub(in crate::ways) const CONNECT: u8 = 0x10;
/// First byte of a CONNACK, with which a broker does.
pub(in crate::ways) const CONNACK: u8 = 0x20;

/// A connection that speaks packets. `most` is what any packet but a reception may have, bytes; `begin` the first byte of
/// all.
pub(in crate::ways) fn wire(stream: Box<dyn Stream>, most: usize, begin: u8) -> Wire {
    Framed::new(stream, Bounded::new(most, begin))
}

/// What came.
#[derive(Debug, PartialEq)]
pub(in crate::ways) enum Came {
    /// A packet.
    Packet(Packet),
    /// A message that was too long, passed over; whether it was a reception.
    TooLong { is_reception: bool },
}

/// Why a connection cannot go on.
#[derive(Debug, thiserror::Error)]
pub(in crate::ways) enum WireError {
    /// The connection broke.
    #[error("the connection broke: {0}")]
    Io(#[from] std::io::Error),
    /// It is not MQTT 3.1.1.
    #[error("the other side does not speak MQTT 3.1.1: {0}")]
    Malformed(String),
}

/// The codec, with bounds.
pub(in crate::ways) struct Bounded {
    inner: Codec,
    most: usize,
    /// Bytes of a packet that is passed over.
    skipping: usize,
    /// What the first byte of all must be, until it has come.
    begin: Option<u8>,
}

impl Bounded {
    fn new(most: usize, begin: u8) -> Self {
        let most = most.min(MESSAGE_MAX) + AROUND;
        let inner = Codec { max_incoming_size: most + AROUND, max_outgoing_size: 64 << 10 };
        Self { inner, most, skipping: 0, begin: Some(begin) }
    }

    /// What is too long of what begins here: bytes to pass over, and whether it is a reception. `None`: nothing, or it
    /// cannot be told yet.
    fn too_long(&self, from: &BytesMut) -> Option<(usize, bool)> {
        let mut length = 0_usize;
        let (mut shift, mut at) = (0, 1);
        loop {
            let byte = *from.get(at)?;
            length |= usize::from(byte & 0x7F) << shift;
            (shift, at) = (shift + 7, at + 1);
            if byte & 0x80 == 0 {
                break;
            }
            if shift > 21 {
                return None; // malformed; the codec says so
            }
        }
        let is_publish = from.first()? >> 4 == PUBLISH;
        if length <= RECEPTION_MAX || !is_publish {
            return None;
        }
        let topic_length = usize::from(u16::from_be_bytes([*from.get(at)?, *from.get(at + 1)?]));
        let topic = from.get(at + 2..at + 2 + topic_length.min(AROUND))?;
        let is_reception = topic.ends_with(b"/tele/rx");
        let most = if is_reception { RECEPTION_MAX.min(self.most) + AROUND } else { self.most };
        (length > most).then_some((at + length, is_reception))
    }
}

impl Decoder for Bounded {
    type Item = Came;
    type Error = WireError;

    fn decode(&mut self, from: &mut BytesMut) -> Result<Option<Came>, WireError> {
        if let Some(first) = from.first()
            && self.begin.take().is_some_and(|begin| begin != *first)
        {
            return Err(WireError::Malformed(format!("it begins with {first:#04x}")));
        }
        if self.skipping > 0 {
            let skip = self.skipping.min(from.len());
            from.advance(skip);
            self.skipping -= skip;
            if self.skipping > 0 {
                return Ok(None);
            }
        }
        if let Some((bytes, is_reception)) = self.too_long(from) {
            let now = bytes.min(from.len());
            from.advance(now);
            self.skipping = bytes - now;
            return Ok(Some(Came::TooLong { is_reception }));
        }
        // The codec makes room for the whole of a publish once its length is known: first its topic must be there, so that
        // it is known which bound holds.
        if from.first().is_some_and(|first| first >> 4 == PUBLISH)
            && from.len() < 8 + AROUND
            && !self.is_whole(from)
        {
            return Ok(None);
        }
        match self.inner.decode(from) {
            Ok(packet) => Ok(packet.map(Came::Packet)),
            Err(error) => Err(WireError::Malformed(error.to_string())),
        }
    }
}

impl Bounded {
    /// What begins here is all there.
    fn is_whole(&self, from: &BytesMut) -> bool {
        let mut inner = 0_usize;
        for (place, byte) in from.iter().skip(1).take(4).enumerate() {
            inner |= usize::from(byte & 0x7F) << (7 * place);
            if byte & 0x80 == 0 {
                return from.len() >= place + 2 + inner;
            }
        }
        // Malformed, or not even its length is there.
        from.len() > 5
    }
}

impl Encoder<Packet> for Bounded {
    type Error = WireError;

    fn encode(&mut self, packet: Packet, into: &mut BytesMut) -> Result<(), WireError> {
        self.inner.encode(packet, into).map_err(|error| WireError::Malformed(error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rumqttc::mqttbytes::QoS;
    use rumqttc::mqttbytes::v4::Publish;

    fn bytes(topic: &str, payload: usize) -> Vec<u8> {
        let mut into = BytesMut::new();
        let packet = Packet::Publish(Publish::new(topic, QoS::AtMostOnce, vec![b'x'; payload]));
        packet.write(&mut into, usize::MAX).unwrap();
        into.to_vec()
    }

    /// Everything that comes of bytes that arrive in parts of this size, and the most that was held.
    fn read(sent: &[u8], part: usize) -> (Vec<Came>, usize) {
        let (mut codec, mut held) = (Bounded::new(MESSAGE_MAX, 0x30), BytesMut::new());
        let (mut came, mut most) = (Vec::new(), 0);
        for part in sent.chunks(part) {
            held.extend_from_slice(part);
            while let Some(one) = codec.decode(&mut held).unwrap() {
                came.push(one);
            }
            most = most.max(held.capacity());
        }
        assert!(held.is_empty());
        (came, most)
    }

    #[test]
    fn what_is_too_long_is_passed_over_and_the_next_is_whole() {
        let sent = [
            bytes("tinygs/a/b/tele/rx", 700),
            bytes("tinygs/a/b/tele/rx", 40_000),
            bytes("tinygs/a/b/tele/ping", 2_000_000),
            bytes("tinygs/a/b/tele/ping", 40_000),
            bytes("tinygs/a/b/tele/rx", 16_000),
            vec![0xC0, 0],
        ]
        .concat();
        for part in [1, 7, 1_000, 1 << 16] {
            let (came, most) = read(&sent, part);
            let sizes: Vec<_> = came
                .iter()
                .map(|came| match came {
                    Came::Packet(Packet::Publish(publish)) => publish.payload.len(),
                    Came::Packet(Packet::PingReq) => 1,
                    Came::TooLong { is_reception: true } => 16,
                    Came::TooLong { is_reception: false } => 1024,
                    Came::Packet(other) => panic!("{other:?}"),
                })
                .collect();
            assert_eq!(sizes, [700, 16, 1024, 40_000, 16_000, 1], "in parts of {part}");
            assert!(most < 300_000, "{most} bytes were held");
        }
    }

    #[test]
    fn what_is_no_mqtt_ends_the_connection() {
        let mut codec = Bounded::new(MESSAGE_MAX, CONNECT);
        assert!(codec.decode(&mut BytesMut::from(&b"GET / HTTP/1.1\r\n\r\n"[..])).is_err());
        assert!(codec.decode(&mut BytesMut::from(&[0x30, 0xFF, 0xFF, 0xFF, 0xFF, 0x01, 0, 0][..])).is_err());
    }
}
