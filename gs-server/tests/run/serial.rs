//! The serial link over real pseudo-terminals.

use std::time::Duration;

use crate::support::{Folder, Pty, Server, heartbeat, pause, ping, until};
use gs_server::run::RunOptions;
use gs_server::storage::FrameQuery;
use mission::{Accepted, LinkState, Principal};

const SOON: Duration = Duration::from_secs(3);

fn is_unavailable(state: &LinkState) -> bool {
    matches!(state, LinkState::Unavailable { .. })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_unknown_port_is_told_with_the_ports_there_are_and_taken_when_it_comes() {
    let folder = Folder::new();
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    server
        .until_link("told that the port is missing", SOON, |state| match state {
            LinkState::Unavailable { reason } => reason.contains("is not there; ") && reason.contains("port"),
            _ => false,
        })
        .await;
    let _pty = Pty::at(&folder.port());
    let took = server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    assert!(took < Duration::from_secs(2), "{took:?}");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn frames_in_pieces_become_durable_before_they_are_shown() {
    let folder = Folder::new();
    let mut pty = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    let mut events = server.ready.hub.subscribe();
    server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    let first = heartbeat(1_000);
    let (head, tail) = first.split_at(100);
    pty.write(b"junk before");
    pty.write(head);
    pause(Duration::from_millis(30)).await;
    pty.write(tail);
    until("a frame in the status", SOON, async || server.status().links[0].frames == 1).await;
    let frames = server.ready.store.frames(&FrameQuery::default()).await.unwrap();
    assert_eq!(frames.len(), 1);
    let stored = server.ready.store.last_event_seq().await.unwrap();
    let mut last = 0;
    while let Ok(event) = events.try_recv() {
        assert!(event.sequence > last && event.sequence <= stored, "in order, and committed");
        last = event.sequence;
    }
    assert!(last > 0);
    server.stop().await;
}

/// A program that is not our twin: it only knows where the bytes are.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_foreign_program_can_be_the_satellite() {
    let folder = Folder::new();
    let mut pty = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    pty.write(&heartbeat(1_000));
    until("heard", SOON, async || server.status().satellites[0].in_contact).await;
    let intent = ping();
    let ask = async || {
        server.ready.engine.intent(Principal::new("test"), "k1".into(), [7; 32], intent.clone()).await
    };
    let done = ask().await.unwrap();
    assert!(!done.replayed && matches!(done.accepted, Accepted::Command(_)));
    let again = ask().await.unwrap();
    assert!(again.replayed && again.accepted == done.accepted, "the same key counts once");

    let mut up = Vec::new();
    until("a telecommand at the far end", Duration::from_secs(10), async || {
        up.extend(pty.read());
        up.len() >= 243
    })
    .await;
    assert_eq!(&up[..3], &[0xDE, 0x69, 0x19], "the fixed-point header: address and channel");
    assert_eq!(&up[3..11], b"DESTINY_");
    // What was radiated is in the archive.
    let Accepted::Command(id) = done.accepted else { unreachable!() };
    let life = server.ready.store.command(i64::try_from(id.0).unwrap()).await.unwrap().unwrap();
    assert!(format!("{life:?}").contains("radiating"), "{life:?}");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_that_goes_is_noticed_within_a_second_and_taken_back_within_two() {
    let folder = Folder::new();
    let mut pty = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    for round in 1..=3 {
        pty.write(&heartbeat(round)[..120]); // half a frame in flight
        std::fs::remove_file(folder.port()).unwrap();
        drop(pty);
        let seen = server.until_link("seen as gone", SOON, is_unavailable).await;
        assert!(seen < Duration::from_secs(1), "{seen:?}");
        pty = Pty::at(&folder.port());
        let back = server.until_link("back", SOON, |state| *state == LinkState::Ok).await;
        assert!(back < Duration::from_secs(2), "{back:?}");
        pty.write(&heartbeat(1_000 * round));
        until("heard again", SOON, async || server.status().links[0].frames == u64::from(round)).await;
    }
    server.stop().await;
}

/// The device stays, but its name leads elsewhere: another adapter has taken its place.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_whose_name_leads_elsewhere_is_left_for_the_new_one() {
    let folder = Folder::new();
    let _old = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    let mut new = Pty::at(&folder.port());
    server.until_link("left", SOON, is_unavailable).await;
    server.until_link("up again", SOON, |state| *state == LinkState::Ok).await;
    new.write(&heartbeat(5));
    until("heard", SOON, async || server.status().links[0].frames == 1).await;
    server.stop().await;
}

/// Lines and AUX on a pseudo-terminal, which has none: said so, and not tried in a circle.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn modem_lines_that_are_not_there_are_named() {
    let folder = Folder::new();
    let _pty = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.config("mode_pins = \"lines\""))).await.unwrap();
    server
        .until_link("told", SOON, |state| match state {
            LinkState::Unavailable { reason } => reason.contains("mode_pins = \"software\""),
            _ => false,
        })
        .await;
    server.stop().await;
}

/// Bytes were handed to a port that went: what became of them is not known, and nothing is repeated behind our back.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_that_goes_while_a_frame_is_on_the_air_leaves_it_unknown_not_lost() {
    let folder = Folder::new();
    let mut pty = Pty::at(&folder.port());
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    server.until_link("up", SOON, |state| *state == LinkState::Ok).await;
    pty.write(&heartbeat(1_000));
    until("heard", SOON, async || server.status().satellites[0].in_contact).await;
    let done = server.ready.engine.intent(Principal::new("test"), "k".into(), [7; 32], ping()).await.unwrap();
    let Accepted::Command(id) = done.accepted else { unreachable!() };
    until("on the air", Duration::from_secs(10), async || !pty.read().is_empty()).await;
    std::fs::remove_file(folder.port()).unwrap();
    drop(pty);
    until("settled as unknown", SOON, async || {
        let life = server.ready.store.command(i64::try_from(id.0).unwrap()).await.unwrap().unwrap();
        let stages: Vec<String> = life.stages.iter().map(|stage| stage.stage.to_string()).collect();
        assert!(!stages.contains(&"failed".to_owned()), "{stages:?}");
        stages.contains(&"unknown".to_owned())
    })
    .await;
    server.stop().await;
}
