//! As much of MQTT 3.1.1 as a board speaks: it says hello, publishes, and hears what was acknowledged.

use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// Longer than this no answer takes.
const PATIENCE: Duration = Duration::from_secs(30);

/// A connection to a broker that let us in.
#[derive(Debug)]
pub struct Board {
    stream: TcpStream,
}

impl Board {
    /// Says hello with this client id, and hears that it is welcome.
    ///
    /// # Errors
    /// No connection, or no welcome.
    pub fn connect(address: SocketAddr, client_id: &str) -> io::Result<Self> {
        let mut stream = TcpStream::connect_timeout(&address, PATIENCE)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        // Clean session, no keep-alive.
        let hello = [&text("MQTT")[..], &[4, 2, 0, 0], &text(client_id)].concat();
        stream.write_all(&packet(0x10, &hello))?;
        let mut answer = [0; 4];
        stream.read_exact(&mut answer)?;
        match answer {
            [0x20, 2, _, 0] => Ok(Self { stream }),
            _ => Err(io::Error::other(format!("the broker answered {answer:?}"))),
        }
    }

    /// The same connection once more, for whoever reads while another writes.
    ///
    /// # Errors
    /// The system has no handle left.
    pub fn twice(&self) -> io::Result<Self> {
        Ok(Self { stream: self.stream.try_clone()? })
    }

    /// Sends packets that were made before.
    ///
    /// # Errors
    /// The broker hung up.
    pub fn send(&mut self, packets: &[u8]) -> io::Result<()> {
        self.stream.write_all(packets)
    }

    /// The number of the next message that the broker acknowledges.
    ///
    /// # Errors
    /// It hung up, or says something else.
    pub fn acknowledged(&mut self) -> io::Result<u16> {
        let mut answer = [0; 4];
        self.stream.read_exact(&mut answer)?;
        match answer {
            [0x40, 2, high, low] => Ok(u16::from_be_bytes([high, low])),
            _ => Err(io::Error::other(format!("the broker said {answer:?}"))),
        }
    }
}

/// A message. With a number it is to be acknowledged (QoS 1), without it is forgotten when it is sent (QoS 0).
#[must_use]
pub fn publish(topic: &str, payload: &[u8], number: Option<u16>) -> Vec<u8> {
    let number = number.map(u16::to_be_bytes);
    let kind = if number.is_some() { 0x32 } else { 0x30 };
    packet(kind, &[&text(topic)[..], number.as_ref().map_or(&[][..], |number| &number[..]), payload].concat())
}

fn text(text: &str) -> Vec<u8> {
    [&u16::try_from(text.len()).unwrap_or(0).to_be_bytes()[..], text.as_bytes()].concat()
}

fn packet(kind: u8, body: &[u8]) -> Vec<u8> {
    let mut packet = vec![kind];
    let mut rest = body.len();
    loop {
        let more = rest > 0x7F;
        packet.push((rest & 0x7F) as u8 | if more { 0x80 } else { 0 });
        rest >>= 7;
        if !more {
            break;
        }
    }
    packet.extend_from_slice(body);
    packet
}
