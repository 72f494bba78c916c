//! TLS of the server's own: real certificates, a real client, and clients that mean no good.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use gs_server::config::{Config, TlsSection};
use gs_server::run::RunOptions;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, ServerName};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;

use super::support::{Folder, Server, pause};

/// A certificate of its own for `localhost`, and the configuration that names it.
fn config(folder: &Folder) -> (Config, CertificateDer<'static>) {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    let (certificate, key) = (folder.dir.path().join("cert.pem"), folder.dir.path().join("cert.key"));
    std::fs::write(&certificate, made.cert.pem()).unwrap();
    std::fs::write(&key, made.signing_key.serialize_pem()).unwrap();
    mode(&key, 0o600);
    let mut config = folder.strapped();
    config.http.tls = Some(TlsSection { listen: "127.0.0.1:0".parse().unwrap(), certificate, key });
    (config, CertificateDer::from_pem_slice(made.cert.pem().as_bytes()).unwrap())
}

fn mode(path: &Path, mode: u32) {
    use std::os::unix::fs::PermissionsExt as _;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
}

async fn ask(
    address: std::net::SocketAddr,
    trusted: CertificateDer<'static>,
    path: &str,
) -> std::io::Result<String> {
    let mut roots = rustls::RootCertStore::empty();
    roots.add(trusted).unwrap();
    let client =
        rustls::ClientConfig::builder_with_provider(Arc::new(rustls::crypto::ring::default_provider()))
            .with_safe_default_protocol_versions()
            .unwrap()
            .with_root_certificates(roots)
            .with_no_client_auth();
    let stream = TcpStream::connect(address).await?;
    let name = ServerName::try_from("localhost").unwrap();
    let mut stream = TlsConnector::from(Arc::new(client)).connect(name, stream).await?;
    let host = format!("localhost:{}", address.port());
    let request = format!("GET {path} HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).await?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await?;
    Ok(answer)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_api_answers_over_tls_and_slow_handshakes_hold_up_nobody() {
    let folder = Folder::new();
    let (config, trusted) = config(&folder);
    let server = Server::start(RunOptions::new(config)).await.unwrap();
    let address = server.ready.secure.unwrap();

    // Some say nothing at all, one speaks plainly.
    let mut silent = Vec::new();
    for _ in 0..100 {
        silent.push(TcpStream::connect(address).await.unwrap());
    }
    silent[0].write_all(b"GET / HTTP/1.1\r\nhost: localhost\r\n\r\n").await.unwrap();
    pause(Duration::from_millis(50)).await;

    let answer = ask(address, trusted, "/api/v1/health").await.unwrap();
    assert!(answer.starts_with("HTTP/1.1 200") || answer.starts_with("HTTP/1.1 503"), "{answer}");
    assert!(answer.contains("content-security-policy"), "{answer}");

    // A certificate that nobody vouches for is no good.
    let stranger = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    let other = CertificateDer::from_pem_slice(stranger.cert.pem().as_bytes()).unwrap();
    assert!(ask(address, other, "/api/v1/health").await.is_err());

    let (took, _) = server.stop().await;
    assert!(took < Duration::from_secs(5), "{took:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_key_that_others_may_read_and_files_that_do_not_fit_are_refused_with_their_names() {
    let folder = Folder::new();
    let (config, _) = config(&folder);
    let files = config.http.tls.clone().unwrap();
    let refused = async |config: &Config| match Server::start(RunOptions::new(config.clone())).await {
        Ok(_) => panic!("accepted"),
        Err(error) => error.to_string(),
    };

    mode(&files.key, 0o644);
    let said = refused(&config).await;
    assert!(said.contains("cert.key") && said.contains("0644") && said.contains("chmod 600"), "{said}");
    mode(&files.key, 0o600);

    let stranger = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    std::fs::write(&files.key, stranger.signing_key.serialize_pem()).unwrap();
    let said = refused(&config).await;
    assert!(said.contains("do not fit") && said.contains("http.tls.certificate"), "{said}");

    std::fs::write(&files.certificate, "hello").unwrap();
    let said = refused(&config).await;
    assert!(said.contains("cert.pem") && said.contains("no certificate"), "{said}");

    std::fs::remove_file(&files.certificate).unwrap();
    let said = refused(&config).await;
    assert!(said.contains("cert.pem") && said.contains("cannot be read"), "{said}");
}
