//! A connection to somebody's broker: TCP, TLS where the address says so, CONNECT and SUBSCRIBE.

use std::sync::Arc;
use std::time::Duration;

use futures_util::{SinkExt as _, StreamExt as _};
use reqwest::Url;
use rumqttc::mqttbytes::QoS;
use rumqttc::mqttbytes::v4::{
    Connect, ConnectReturnCode, Packet, Subscribe, SubscribeFilter, SubscribeReasonCode,
};
use rustls::crypto::ring;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, RootCertStore};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;

use super::wire::{CONNACK, Came, Stream, Wire, wire};
use crate::clock::within;
use crate::config::EarSection;
use crate::ingest::formats::MESSAGE_MAX;
use crate::ways::secret;

/// What each step may take.
const PATIENCE: Duration = Duration::from_secs(15);
/// Seconds without a word after which the broker takes us for gone.
pub(super) const KEEP_ALIVE_S: u16 = 30;
/// What boards publish.
const ALL_OF_BOARDS: [&str; 2] = ["tinygs/+/+/tele/+", "tinygs/+/+/stat/+"];

/// Why there is no connection.
#[derive(Debug)]
pub(super) enum NoConnection {
    /// It may be there later.
    Failed(String),
    /// It does not want us: name, password or topics.
    Refused(String),
}

use NoConnection::{Failed, Refused};

/// A broker that sends us what boards publish.
pub(super) async fn connect(section: &EarSection, client_id: &str) -> Result<Wire, NoConnection> {
    let url = Url::parse(section.url()).map_err(|error| Failed(error.to_string()))?;
    let is_secure = url.scheme() == "mqtts";
    let host = url.host_str().unwrap_or_default().trim_matches(['[', ']']).to_owned();
    let port = url.port().unwrap_or(if is_secure { 8883 } else { 1883 });
    let tcp = step("TCP", TcpStream::connect((host.as_str(), port))).await?;
    let _ = tcp.set_nodelay(true);
    let stream: Box<dyn Stream> = if is_secure {
        let connector = TlsConnector::from(Arc::new(tls(section).await?));
        let name = ServerName::try_from(host).map_err(|error| Failed(error.to_string()))?;
        Box::new(step("TLS", connector.connect(name, tcp)).await?)
    } else {
        Box::new(tcp)
    };
    let mut wire = wire(stream, MESSAGE_MAX, CONNACK);
    let mut hello = Connect::new(client_id);
    hello.keep_alive = KEEP_ALIVE_S;
    if let (Some(user), Some(file)) = (&section.user, &section.password_file) {
        let password = secret::load(file).await.map_err(Failed)?;
        hello.set_login(user.as_str(), password.as_str());
    }
    match ask(&mut wire, Packet::Connect(hello)).await? {
        Packet::ConnAck(answer) => match answer.code {
            ConnectReturnCode::Success => {}
            ConnectReturnCode::ServiceUnavailable => {
                return Err(Failed("the broker is not available now".into()));
            }
            code => {
                return Err(Refused(format!(
                    "the broker refuses us ({code:?}): look at user, password_file and client_id"
                )));
            }
        },
        other => return Err(Failed(format!("the broker answered CONNECT with {}", name(&other)))),
    }
    let topics: Vec<String> =
        section.topics.clone().unwrap_or_else(|| ALL_OF_BOARDS.map(str::to_owned).into());
    let filters = topics.iter().map(|topic| SubscribeFilter::new(topic.clone(), QoS::AtLeastOnce));
    let mut subscribe = Subscribe::new_many(filters);
    subscribe.pkid = 1;
    match ask(&mut wire, Packet::Subscribe(subscribe)).await? {
        Packet::SubAck(answer) => {
            let refused = topics.iter().zip(&answer.return_codes);
            let refused = refused.filter(|(_, code)| **code == SubscribeReasonCode::Failure);
            let refused: Vec<&str> = refused.map(|(topic, _)| topic.as_str()).collect();
            if refused.is_empty() {
                return Ok(wire);
            }
            Err(Refused(format!(
                "the broker does not let us read {}: give user the right to, or change topics",
                refused.join(", ")
            )))
        }
        other => Err(Failed(format!("the broker answered SUBSCRIBE with {}", name(&other)))),
    }
}

async fn step<T>(what: &str, work: impl Future<Output = std::io::Result<T>>) -> Result<T, NoConnection> {
    match within(PATIENCE, work).await {
        Some(Ok(done)) => Ok(done),
        Some(Err(error)) => Err(Failed(format!("no connection ({what}): {error}"))),
        None => Err(Failed(format!("no connection ({what}) within {} s", PATIENCE.as_secs()))),
    }
}

/// Sends a packet and waits for the answer.
async fn ask(wire: &mut Wire, packet: Packet) -> Result<Packet, NoConnection> {
    let talk = async {
        wire.send(packet).await.map_err(|error| Failed(error.to_string()))?;
        loop {
            return match wire.next().await {
                Some(Ok(Came::Packet(Packet::Publish(_)) | Came::TooLong { .. })) => continue,
                Some(Ok(Came::Packet(packet))) => Ok(packet),
                Some(Err(error)) => Err(Failed(error.to_string())),
                None => {
                    Err(Failed("the broker hung up: is it MQTT 3.1.1, and the port the right one?".into()))
                }
            };
        }
    };
    let none = || Err(Failed(format!("no answer within {} s", PATIENCE.as_secs())));
    within(PATIENCE, talk).await.unwrap_or_else(none)
}

fn name(packet: &Packet) -> String {
    let text = format!("{packet:?}");
    text.split(['(', ' ', '{']).next().unwrap_or_default().to_owned()
}

/// Whom we trust: the certificate that is named, or what this system does.
async fn tls(section: &EarSection) -> Result<ClientConfig, NoConnection> {
    let file = section.ca_file.clone();
    let roots = tokio::task::spawn_blocking(move || match file {
        Some(path) => {
            let text = std::fs::read(&path)
                .map_err(|error| format!("{} cannot be read: {error}", path.display()))?;
            let mut roots = RootCertStore::empty();
            for certificate in CertificateDer::pem_slice_iter(&text) {
                let bad = || format!("{} holds no certificate in PEM form", path.display());
                roots.add(certificate.map_err(|_| bad())?).map_err(|_| bad())?;
            }
            Ok(roots)
        }
        None => {
            let mut roots = RootCertStore::empty();
            roots.add_parsable_certificates(rustls_native_certs::load_native_certs().certs);
            Ok(roots)
        }
    });
    let roots: Result<_, String> = roots.await.unwrap_or_else(|error| Err(error.to_string()));
    let roots = roots.map_err(Failed)?;
    if roots.is_empty() {
        return Err(Failed("nobody is trusted: install ca-certificates, or name ca_file".into()));
    }
    let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .map_err(|error| Failed(error.to_string()))?;
    Ok(config.with_root_certificates(roots).with_no_client_auth())
}
