//! The module behind a TCP connection.

use std::time::Duration;

use gs_server::config::Config;
use gs_server::run::RunOptions;
use mission::LinkState;
use tokio::io::AsyncWriteExt as _;
use tokio::net::TcpListener;

use crate::support::{Folder, Server, heartbeat, until};

const SOON: Duration = Duration::from_secs(20);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_far_end_that_comes_goes_and_returns_is_heard_each_time() {
    let folder = Folder::new();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let text = format!(
        r#"
        [station]
        name = "test"
        [[satellites]]
        name = "sat"
        key_file = "test.key"
        [[links]]
        name = "tcp"
        satellite = "sat"
        kind = "tcp"
        connect = "{address}"
        simulated = true
        rssi = false
        [storage]
        folder = "data"
        reserve_bytes = 65536
        [simulation]
        speed = 2.0
        "#
    );
    let config = Config::from_toml(&text, folder.dir.path()).unwrap();
    let server = Server::start(RunOptions::new(config)).await.unwrap();
    for round in 1..=2 {
        let (mut far, _) = listener.accept().await.unwrap();
        server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
        far.write_all(&heartbeat(round * 1_000)).await.unwrap();
        until("heard", SOON, async || server.status().links[0].frames == u64::from(round)).await;
        drop(far);
        server.until_link("gone", SOON, |state| matches!(state, LinkState::Unavailable { .. })).await;
    }
    drop(listener);
    server
        .until_link("told why", SOON, |state| match state {
            LinkState::Unavailable { reason } => reason.contains("cannot be reached"),
            _ => false,
        })
        .await;
    server.stop().await;
}
