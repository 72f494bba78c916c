//! Daemons that the server talks to, and the server itself.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};

use super::Finding;
use crate::clock::within;
use crate::config::Config;

/// Longer than this nobody is waited for.
pub(super) const PATIENCE: Duration = Duration::from_secs(3);
/// More than any answer of ours.
const ANSWER_MAX: u64 = 1 << 20;

pub(super) async fn daemons(config: &Config) -> Vec<Finding> {
    let rotator = config.rotator.as_ref().map(|rotator| ("rotator", rotator.address.as_str(), "rotctld"));
    let rig = config.rig.as_ref().map(|rig| ("rig", rig.address.as_str(), "rigctld"));
    let mut findings = Vec::new();
    for (check, address, daemon) in [rotator, rig].into_iter().flatten() {
        findings.push(match within(PATIENCE, TcpStream::connect(address)).await {
            Some(Ok(_)) => Finding::ok(check, format!("{daemon} listens at {address}")),
            Some(Err(error)) => Finding::warning(
                check,
                format!("{daemon} does not answer at {address}: {error}"),
                format!("Start {daemon}, or correct {check}.address; docs/antenna.md begins with the first command."),
            ),
            None => Finding::warning(
                check,
                format!("{daemon} does not answer at {address} within 3 s"),
                "Is the address right, and no firewall between?",
            ),
        });
    }
    findings
}

pub(super) async fn server(config: &Config, holder: Option<Option<u32>>) -> Option<Finding> {
    let check = "server";
    let listen = config.http.listen;
    let Some(process) = holder else {
        return Some(match TcpListener::bind(listen).await {
            Ok(_) => Finding::ok(check, format!("not running; {listen} is free")),
            Err(error) => Finding::warning(
                check,
                format!("not running, and {listen} cannot be listened on: {error}"),
                "Stop what listens there (`ss -ltnp`), or give another http.listen.",
            ),
        });
    };
    let process = process.map(|pid| format!(" as process {pid}")).unwrap_or_default();
    if listen.port() == 0 {
        return Some(Finding::ok(check, format!("running{process}, on a port that it chose itself")));
    }
    let address = SocketAddr::new(reachable(listen.ip()), listen.port());
    Some(match within(PATIENCE, get(address, "/readyz")).await {
        Some(Ok((200, _))) => Finding::ok(check, format!("running{process} and ready at {address}")),
        Some(Ok((status, body))) => Finding::warning(
            check,
            format!("running{process} and not ready ({status}): {body}"),
            "Look in its log (`journalctl -u gs-server`).",
        ),
        Some(Err(error)) => Finding::warning(
            check,
            format!("running{process}, and does not answer at {address}: {error}"),
            "Does it listen where the configuration says? Restart it, or look in its log.",
        ),
        None => Finding::warning(
            check,
            format!("running{process}, and does not answer at {address} within 3 s"),
            "Look in its log, and restart it.",
        ),
    })
}

fn reachable(ip: IpAddr) -> IpAddr {
    match ip {
        ip if !ip.is_unspecified() => ip,
        IpAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
    }
}

/// Status and body, as one line.
async fn get(address: SocketAddr, path: &str) -> std::io::Result<(u16, String)> {
    let mut stream = TcpStream::connect(address).await?;
    let request = format!("GET {path} HTTP/1.1\r\nhost: {address}\r\nconnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).await?;
    let mut answer = Vec::new();
    stream.take(ANSWER_MAX).read_to_end(&mut answer).await?;
    let answer = String::from_utf8_lossy(&answer);
    let status = answer.split(' ').nth(1).and_then(|word| word.parse().ok());
    let body = answer.split_once("\r\n\r\n").map_or("", |(_, body)| body).trim().replace(['\r', '\n'], " ");
    match status {
        Some(status) => Ok((status, body.chars().filter(|c| !c.is_control()).take(500).collect())),
        None => Err(std::io::Error::other("that is no HTTP")),
    }
}
