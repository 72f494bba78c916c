//! A disk that is full: hearing goes on, sending does not, and nothing that was heard is lost.

use std::time::Duration;

use gs_server::run::RunOptions;
use mission::{LinkState, Principal};

use crate::support::{Folder, Pty, Server, heartbeat, pause, ping, until};

const SOON: Duration = Duration::from_secs(5);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_disk_is_told_within_a_second_stops_the_uplink_and_loses_no_frame() {
    let folder = Folder::new();
    let mut pty = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    pty.write(&heartbeat(1));
    until("heard", SOON, async || server.status().links[0].frames == 1).await;

    server.ready.store.set_max_page_count(1).await.unwrap();
    let mut sent = 1;
    let mut failing = || {
        sent += 1;
        // As fast as a radio could at most.
        pty.write(&heartbeat(sent));
        server.status().storage.failing.is_some()
    };
    // The pages that the file already has are filled first.
    until("the failure is told", Duration::from_secs(20), async || {
        pause(Duration::from_millis(20)).await;
        failing()
    })
    .await;
    let refused = server.ready.engine.intent(Principal::new("test"), "p".into(), [0; 32], ping()).await;
    assert!(refused.is_err(), "{refused:?}");
    pause(Duration::from_millis(300)).await;
    let up = pty.read();
    assert!(up.is_empty(), "radiated without a record: {up:02x?}");

    server.ready.store.set_max_page_count(1 << 20).await.unwrap();
    until("recovered", Duration::from_secs(10), async || server.status().storage.failing.is_none()).await;
    until("every frame is stored", SOON, async || {
        server.ready.store.counts().await.unwrap().frames == i64::from(sent)
    })
    .await;
    let (took, _) = server.stop().await;
    assert!(took < Duration::from_secs(5), "{took:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn frames_of_the_reserve_come_back_at_the_next_start() {
    let folder = Folder::new();
    let mut pty = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    server.ready.store.set_max_page_count(1).await.unwrap();
    let mut sent = 0;
    until("frames are in the reserve", Duration::from_secs(20), async || {
        pause(Duration::from_millis(20)).await;
        if server.status().storage.reserved < 3 {
            sent += 1;
            pty.write(&heartbeat(sent));
        }
        server.status().storage.reserved >= 3
    })
    .await;
    // What was written last is on its way through.
    pause(Duration::from_millis(300)).await;
    let (took, _) = server.stop().await;
    assert!(took < Duration::from_secs(5), "{took:?}");

    let again = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    until("every frame is stored", SOON, async || {
        again.ready.store.counts().await.unwrap().frames == i64::from(sent)
    })
    .await;
    until("the reserve is given up", SOON, async || {
        again.ready.store.reserve_read().await.unwrap().is_empty()
    })
    .await;
    again.stop().await;
}
