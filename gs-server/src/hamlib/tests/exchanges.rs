//! One command, its answer, and every way in which that goes wrong. These wait in wall time: a tenth of a second.

use std::sync::Arc;
use std::time::Duration;

use mission::pointing::Position;

use super::daemon::{Daemon, Manner};
use super::*;
use crate::clock::SystemClock;

const PATIENCE: Patience = Patience { connect: Duration::from_secs(2), reply: Duration::from_millis(100) };

fn timer() -> Arc<dyn Timer> {
    Arc::new(SystemClock::new())
}

async fn connected(manner: Manner) -> (Daemon, RotatorClient) {
    let timer = timer();
    let daemon = Daemon::start(&timer, Manner::Good).await;
    let client = RotatorClient::connect(&daemon.address, PATIENCE, &timer).await.unwrap();
    daemon.set(manner);
    (daemon, client)
}

#[tokio::test]
async fn a_good_daemon_tells_name_limits_and_position_and_turns() {
    let (daemon, mut client) = connected(Manner::Good).await;
    assert_eq!(client.info(), Some("our own"));
    let limits = client.limits().unwrap();
    assert_eq!((limits.azimuth_deg, limits.elevation_deg), ((-180.0, 450.0), (0.0, 90.0)));
    client.set_position(Position { azimuth_deg: 12.345_6, elevation_deg: -0.001 }).await.unwrap();
    assert_eq!(daemon.asked("set_pos")[0].1, "set_pos 12.35 0.00", "fixed decimals, no negative zero");
    client.stop().await.unwrap();
    client.park().await.unwrap();
    let _ = client.position().await.unwrap();
}

#[tokio::test]
async fn slow_pieces_of_lines_make_an_answer_but_not_beyond_the_limit() {
    let (_daemon, mut client) = connected(Manner::Dripping).await;
    client.position().await.unwrap();
    let (_daemon, mut client) = connected(Manner::Saying("get_pos:\nAzimuth: 1".into())).await;
    let error = client.position().await.unwrap_err();
    assert!(matches!(error, HamlibError::Silent { .. }), "{error}");
}

#[tokio::test]
async fn after_silence_the_connection_takes_nothing_more_so_a_late_answer_is_nobodys() {
    let (daemon, mut client) = connected(Manner::Silent).await;
    let error = client.position().await.unwrap_err();
    assert!(
        matches!(error, HamlibError::Silent { after_ms: 100, .. }) && error.breaks_connection(),
        "{error}"
    );
    assert!(error.to_string().contains("does not know the command"), "{error}");
    daemon.set(Manner::Good);
    let error = client.position().await.unwrap_err();
    assert!(matches!(error, HamlibError::OutOfStep { .. }), "{error}");
}

#[tokio::test]
async fn an_exchange_that_was_dropped_in_the_middle_spoils_the_connection() {
    let (daemon, mut client) = connected(Manner::Silent).await;
    assert!(crate::clock::within(Duration::from_millis(20), client.position()).await.is_none());
    daemon.set(Manner::Good);
    assert!(matches!(client.stop().await, Err(HamlibError::OutOfStep { .. })));
    assert!(daemon.asked("stop").is_empty());
}

#[tokio::test]
async fn answers_that_do_not_fit_cost_the_connection() {
    let long = "x".repeat(5_000);
    let many = format!("get_pos:\n{}", "Azimuth: 1.00\n".repeat(1_000));
    for (text, end) in [
        ("180.00\n45.00\n", "out of step"),
        ("RPRT 0\n", "out of step"),
        ("set_pos: 1 2\nRPRT 0\n", "out of step"),
        ("get_pos:\nRPRT 0x\n", "out of step"),
        ("get_pos:\nRPRT 7\n", "out of step"),
        ("\n", "out of step"),
        ("HTTP/1.1 400 Bad Request\n", "out of step"),
        (&long, "without end"),
        (&many, "without end"),
    ] {
        let (_daemon, mut client) = connected(Manner::Saying(text.into())).await;
        let error = client.position().await.unwrap_err();
        assert!(error.to_string().contains(end) && error.breaks_connection(), "{text:.20}: {error}");
    }
    let (daemon, mut client) = connected(Manner::Cutting).await;
    let error = client.position().await.unwrap_err();
    assert!(matches!(error, HamlibError::Closed { .. }), "{error}");
    drop(daemon);
    let (_daemon, mut client) = connected(Manner::Repeating).await;
    let _first = client.position().await.unwrap();
    let error = client.stop().await.unwrap_err();
    assert!(matches!(error, HamlibError::OutOfStep { .. }), "{error}");
}

#[tokio::test]
async fn positions_that_are_no_numbers_are_told_and_the_connection_stays() {
    for (azimuth, elevation) in
        [("nan", "5.00"), ("180,5", "45.00"), ("inf", "0.00"), ("", "0.00"), ("4.0", "1e9")]
    {
        let text = format!("get_pos:\nAzimuth: {azimuth}\nElevation: {elevation}\nRPRT 0\n");
        let (daemon, mut client) = connected(Manner::Saying(text)).await;
        let error = client.position().await.unwrap_err();
        assert!(matches!(error, HamlibError::Malformed { .. }) && !error.breaks_connection(), "{error}");
        daemon.set(Manner::Good);
        client.position().await.unwrap();
    }
}

#[tokio::test]
async fn nonsense_is_never_sent_though_the_daemon_would_say_that_all_is_well() {
    let (daemon, mut client) = connected(Manner::Good).await;
    for (azimuth_deg, elevation_deg) in
        [(f64::NAN, 5.0), (5.0, f64::INFINITY), (500.0, 10.0), (10.0, 95.0), (10.0, -5.0), (-181.0, 0.0)]
    {
        let error = client.set_position(Position { azimuth_deg, elevation_deg }).await.unwrap_err();
        assert!(matches!(error, HamlibError::Refused { code: -1, .. }), "{error}");
        assert!(error.to_string().contains("outside the rotator's limits"), "{error}");
    }
    assert!(daemon.asked("set_pos").is_empty());
}

#[tokio::test]
async fn refusals_are_told_with_their_meaning_and_the_connection_stays() {
    let (_daemon, mut client) = connected(Manner::Broken(-6)).await;
    let error = client.position().await.unwrap_err();
    assert!(!error.breaks_connection() && error.to_string().contains("between daemon and device"), "{error}");
    let error = client.stop().await.unwrap_err();
    assert!(error.to_string().contains("refuses 'stop'") && error.to_string().contains("RPRT -6"), "{error}");
}

#[tokio::test]
async fn a_daemon_that_is_not_there_is_told_with_what_to_do() {
    let timer = timer();
    let daemon = Daemon::start(&timer, Manner::Good).await;
    daemon.die().await;
    let Err(error) = RotatorClient::connect(&daemon.address, PATIENCE, &timer).await else {
        panic!("connected")
    };
    assert!(matches!(error, HamlibError::Unreachable { .. }), "{error}");
    assert!(
        error.told().contains("is the daemon running") && error.told().contains("refused"),
        "{}",
        error.told()
    );
}

#[tokio::test]
async fn a_daemon_that_knows_no_limits_is_taken_by_a_second_connection() {
    let timer = timer();
    let daemon = Daemon::start(&timer, Manner::Old).await;
    let mut client = RotatorClient::connect(&daemon.address, PATIENCE, &timer).await.unwrap();
    assert_eq!((client.limits(), client.info()), (None, Some("our own")));
    client.position().await.unwrap();
    assert_eq!(daemon.state.lock().unwrap().connections, 2);
}

#[tokio::test]
async fn several_clients_share_one_daemon() {
    let (daemon, mut first) = connected(Manner::Good).await;
    let mut second = RotatorClient::connect(&daemon.address, PATIENCE, &timer()).await.unwrap();
    for _ in 0..20 {
        let (a, b) = tokio::join!(first.position(), second.position());
        assert!(a.is_ok() && b.is_ok());
    }
}
