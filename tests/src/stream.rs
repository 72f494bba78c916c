//! A follower of `/api/v1/stream`.

use std::io;
use std::net::TcpStream;
use std::time::Duration;

use api::StreamMessage;
use tokio_tungstenite::tungstenite::{self, Message, WebSocket, client::IntoClientRequest as _};

use crate::Client;

/// An open stream.
pub struct Follower {
    socket: WebSocket<TcpStream>,
}

/// What a look at the stream gave.
pub enum Look {
    /// A message.
    Message(Box<StreamMessage>),
    /// Nothing yet.
    Nothing,
    /// The stream is over.
    Over,
}

impl Follower {
    /// Opens the stream after this event.
    ///
    /// # Errors
    /// The server is not there, or refuses.
    pub fn open(client: &Client, after: i64) -> io::Result<Self> {
        let address = client.address;
        let socket = TcpStream::connect(address)?;
        socket.set_read_timeout(Some(Duration::from_secs(10)))?;
        let request = format!("ws://{address}/api/v1/stream?after={after}")
            .into_client_request()
            .map_err(io::Error::other)?;
        let (socket, _) = tungstenite::client(request, socket)
            .map_err(|error| io::Error::other(format!("the stream is refused: {error}")))?;
        socket.get_ref().set_read_timeout(Some(Duration::from_millis(50)))?;
        Ok(Self { socket })
    }

    /// Waits for a message, a moment at most.
    ///
    /// # Panics
    /// When the server says something that is no message of the stream.
    pub fn look(&mut self) -> Look {
        match self.socket.read() {
            Ok(Message::Text(text)) => match serde_json::from_str(&text) {
                Ok(message) => Look::Message(Box::new(message)),
                Err(error) => panic!("{error}: {text}"),
            },
            Ok(Message::Close(_)) => Look::Over,
            Ok(_) => Look::Nothing,
            Err(tungstenite::Error::Io(error))
                if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) =>
            {
                Look::Nothing
            }
            Err(_) => Look::Over,
        }
    }
}
