//! E-mail by SMTP, with TLS unless the server is this machine.

use std::time::{Duration, SystemTime};

use lettre::message::Mailbox;
use lettre::message::header::{ContentType, HeaderName, HeaderValue};
use lettre::transport::smtp::authentication::Credentials;
use lettre::transport::smtp::client::{Tls, TlsParameters};
use lettre::transport::smtp::extension::ClientId;
use lettre::{AsyncSmtpTransport, AsyncTransport as _, Message, Tokio1Executor};

use super::{Letter, PATIENCE, SendError};
use crate::config::{ConfigError, TargetSection, TransportSecurity};

pub(super) struct Email {
    host: String,
    port: u16,
    security: TransportSecurity,
    from: Mailbox,
    to: Vec<Mailbox>,
    user: Option<String>,
    station: String,
}

impl Email {
    pub(super) fn new(section: &TargetSection, key: &str, station: &str) -> Result<Self, ConfigError> {
        let (host, port) = section.mail_server(key)?;
        let mailbox = |name: &str, address: &str| {
            address.parse::<Mailbox>().map_err(|error| {
                ConfigError::value(format!("{key}.{name}"), error.to_string(), "Give name@host.")
            })
        };
        Ok(Self {
            host,
            port,
            security: section.security,
            from: mailbox("from", section.from.as_deref().unwrap_or_default())?,
            to: section.to.iter().map(|address| mailbox("to", address)).collect::<Result<_, _>>()?,
            user: section.user.clone(),
            station: station.to_owned(),
        })
    }

    /// The account at the mail server.
    pub(super) fn user(&self) -> Option<&str> {
        self.user.as_deref()
    }

    pub(super) async fn send(&self, letter: &Letter, password: Option<&str>) -> Result<(), SendError> {
        let message = self.message(letter)?;
        let tls = || {
            TlsParameters::new(self.host.clone())
                .map_err(|error| SendError::Unreached(format!("no secure connection can be made: {error}")))
        };
        let tls = match self.security {
            TransportSecurity::Starttls => Tls::Required(tls()?),
            TransportSecurity::Tls => Tls::Wrapper(tls()?),
            TransportSecurity::None => Tls::None,
        };
        let mut builder = AsyncSmtpTransport::<Tokio1Executor>::builder_dangerous(&self.host)
            .port(self.port)
            .tls(tls)
            .hello_name(ClientId::Domain("localhost".to_owned()))
            .timeout(Some(PATIENCE / 2));
        if let (Some(user), Some(password)) = (&self.user, password) {
            builder = builder.credentials(Credentials::new(user.clone(), password.to_owned()));
        }
        let transport = builder.build();
        transport.send(message).await.map(drop).map_err(|error| {
            let said = chain(&error);
            match error.status() {
                // This message, or one of its receivers, will never be taken.
                Some(_) if error.is_permanent() => {
                    SendError::Refused(format!("the mail server refused: {said}"))
                }
                Some(_) => SendError::Unreached(format!("the mail server said: {said}")),
                None => SendError::Unreached(format!("the mail server was not reached: {said}")),
            }
        })
    }

    fn message(&self, letter: &Letter) -> Result<Message, SendError> {
        let refused =
            |error: lettre::error::Error| SendError::Refused(format!("no mail can be made: {error}"));
        let made = Duration::from_micros(letter.made_at_us.max(0).unsigned_abs());
        let mut builder = Message::builder()
            .from(self.from.clone())
            .subject(letter.title.clone())
            .date(SystemTime::UNIX_EPOCH + made)
            // The same in each attempt: whoever gets it twice can tell.
            .message_id(Some(format!("<{}@{}.pixelsat-ground>", letter.message_id, self.station)))
            .raw_header(HeaderValue::new(
                HeaderName::new_from_ascii_str("Auto-Submitted"),
                "auto-generated".to_owned(),
            ));
        for to in &self.to {
            builder = builder.to(to.clone());
        }
        builder.header(ContentType::TEXT_PLAIN).body(letter.text.clone()).map_err(refused)
    }
}

fn chain(error: &lettre::transport::smtp::Error) -> String {
    let mut text = error.to_string();
    let mut inner = std::error::Error::source(error);
    while let Some(reason) = inner {
        let more = reason.to_string();
        if !text.contains(&more) {
            text.push_str(": ");
            text.push_str(&more);
        }
        inner = reason.source();
    }
    text.chars().take(300).map(|c| if c.is_control() { ' ' } else { c }).collect()
}
