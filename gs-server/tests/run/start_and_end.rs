//! Start, end, and who is refused.

use std::time::Duration;

use crate::support::{Folder, Pty, Server, heartbeat, ping, until};
use gs_server::config::Config;
use gs_server::engine::IntentError;
use gs_server::run::{RunError, RunOptions};
use gs_server::storage::StoreError;
use mission::{LinkState, Principal};

const SOON: Duration = Duration::from_secs(3);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_server_on_the_same_folder_is_refused() {
    let folder = Folder::new();
    let first = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    match Server::start(RunOptions::new(folder.strapped())).await {
        Err(RunError::Store(StoreError::Locked { .. })) => {}
        Err(other) => panic!("{other:?}"),
        Ok(_) => panic!("two servers in one folder"),
    }
    first.stop().await;
    let again = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    again.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn it_stops_within_five_seconds_and_forgets_nothing() {
    let folder = Folder::new();
    let mut pty = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    for beat in 1..=20 {
        pty.write(&heartbeat(beat * 60_000));
    }
    until("heard", SOON, async || server.status().links[0].frames >= 1).await;
    let (took, report) = server.stop().await;
    assert!(took < Duration::from_secs(5), "{took:?}");
    assert_eq!(report.abandoned_tasks, 0);

    let again = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    let frames = again.ready.store.counts().await.unwrap().frames;
    assert!(frames >= 1, "{frames}");
    again.stop().await;
}

/// A frame on the air is sent to its end, and its end is written down.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn it_stops_in_time_while_a_frame_is_on_the_air() {
    let folder = Folder::new();
    let mut pty = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    pty.write(&heartbeat(1_000));
    until("heard", SOON, async || server.status().satellites[0].in_contact).await;
    server.ready.engine.intent(Principal::new("test"), "k".into(), [7; 32], ping()).await.unwrap();
    until("on the air", Duration::from_secs(10), async || !pty.read().is_empty()).await;
    let engine = server.ready.engine.clone();
    let (took, report) = server.stop().await;
    assert!(took < Duration::from_secs(5), "{took:?}");
    assert_eq!(report.abandoned_tasks, 0);
    let refused = engine.intent(Principal::new("test"), "later".into(), [7; 32], ping()).await;
    assert_eq!(refused, Err(IntentError::Stopping));

    let again = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    let life = again.ready.store.command(1).await.unwrap().unwrap();
    let stages: Vec<String> = life.stages.iter().map(|stage| stage.stage.to_string()).collect();
    assert!(stages.contains(&"radiated".to_owned()), "{stages:?}");
    again.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn it_stops_in_time_with_open_streams_and_missing_links() {
    let folder = Folder::new();
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    // A client that connects and says nothing.
    let _silent = tokio::net::TcpStream::connect(server.ready.address).await.unwrap();
    let (took, _) = server.stop().await;
    assert!(took < Duration::from_secs(5), "{took:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn simulated_keys_and_folders_are_refused_by_real_links() {
    let folder = Folder::new();
    let mut real = folder.strapped();
    real.links[0].simulated = false;
    match Server::start(RunOptions::new(real.clone())).await {
        Err(RunError::KeyKind { simulated: true, .. }) => {}
        Err(other) => panic!("{other:?}"),
        Ok(_) => panic!("a simulated key on a real link"),
    }
    Server::start(RunOptions::new(folder.strapped())).await.unwrap().stop().await;
    real.satellites[0].key_file = None;
    match Server::start(RunOptions::new(real.clone())).await {
        Err(RunError::Store(StoreError::SimulatedMark { .. })) => {}
        Err(other) => panic!("{other:?}"),
        Ok(_) => panic!("a simulated folder with a real link"),
    }
    let clock = gs_server::clock::ScaledClock::new(2.0);
    let mut options = RunOptions::new(Config { storage: Folder::new().strapped().storage, ..real });
    options.timer = Some(std::sync::Arc::new(clock));
    assert!(matches!(Server::start(options).await, Err(RunError::ClockKind)));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bad_configuration_never_opens_anything() {
    let folder = Folder::new();
    let mut config = folder.strapped();
    config.links[0].channel = 99;
    assert!(matches!(Server::start(RunOptions::new(config)).await, Err(RunError::Config(_))));
    assert!(!folder.dir.path().join("data").exists());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recording_is_heard_once() {
    let folder = Folder::new();
    let mut recording = b"noise".to_vec();
    for beat in 1..=30u32 {
        recording.extend(heartbeat(beat * 1_000));
    }
    std::fs::write(folder.dir.path().join("recording.bin"), recording).unwrap();
    let text = r#"
        [station]
        name = "archive"
        [[satellites]]
        name = "sat"
        [[links]]
        name = "file"
        satellite = "sat"
        kind = "replay"
        file = "recording.bin"
        rssi = false
        [storage]
        folder = "archive"
    "#;
    let config = Config::from_toml(text, folder.dir.path()).unwrap();
    let server = Server::start(RunOptions::new(config)).await.unwrap();
    until("all frames", SOON, async || server.ready.store.counts().await.unwrap().frames == 30).await;
    server.until_link("at its end", SOON, |state| *state == LinkState::Disabled).await;
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_reload_arms_a_link_without_a_restart() {
    let folder = Folder::new();
    let mut config = folder.strapped();
    config.links[0].armed = false;
    let (send, reload) = tokio::sync::mpsc::channel(1);
    let mut options = RunOptions::new(config.clone());
    options.reload = Some(reload);
    let server = Server::start(options).await.unwrap();
    assert!(!server.status().links[0].armed);
    config.links[0].armed = true;
    config.links[0].channel = 99; // refused as a whole
    send.send(config.clone()).await.unwrap();
    config.links[0].channel = 25;
    send.send(config).await.unwrap();
    until("armed", SOON, async || server.status().links[0].armed).await;
    server.stop().await;
}
