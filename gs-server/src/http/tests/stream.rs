//! The stream over a real socket.

use std::net::SocketAddr;
use std::time::Duration;

use futures_util::{SinkExt as _, StreamExt as _};
use serde_json::Value;
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

use super::{Bench, heartbeat};
use crate::clock::within;

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

async fn open(address: SocketAddr, query: &str) -> Socket {
    connect_async(format!("ws://{address}/api/v1/stream{query}")).await.unwrap().0
}

async fn next(socket: &mut Socket) -> Value {
    loop {
        let message = within(Duration::from_secs(10), socket.next()).await.expect("a message in time");
        match message.unwrap().unwrap() {
            Message::Text(text) => return serde_json::from_str(&text).unwrap(),
            Message::Close(frame) => {
                return serde_json::json!({"type": "close", "code": frame.map(|f| u16::from(f.code))});
            }
            _ => {}
        }
    }
}

/// Sequence numbers until so many events have come.
async fn events(socket: &mut Socket, count: usize) -> Vec<i64> {
    let mut found = Vec::new();
    while found.len() < count {
        let message = next(socket).await;
        if message["type"] == "event" {
            found.push(message["sequence"].as_i64().unwrap());
        }
    }
    found
}

#[tokio::test]
async fn a_stream_begins_with_hello_and_tells_the_status() {
    let (_bench, address) = Bench::on_a_socket().await;
    let mut socket = open(address, "").await;
    let hello = next(&mut socket).await;
    assert_eq!((&hello["type"], &hello["reset"]), (&"hello".into(), &false.into()));
    assert_eq!(next(&mut socket).await["type"], "live");
    let status = next(&mut socket).await;
    assert_eq!((&status["type"], &status["station"]), (&"status".into(), &"bench".into()));
    assert_eq!(status.get("sequence"), None);
}

#[tokio::test]
async fn events_come_once_each_in_order_across_archive_and_live() {
    let (bench, address) = Bench::on_a_socket().await;
    for temp in 0..20u8 {
        bench.hear(&heartbeat(f32::from(temp))).await;
    }
    bench.frames(20).await;
    let mut socket = open(address, "?after=0").await;
    // More arrives while the archive is still being read.
    for temp in 20..60u8 {
        bench.hear(&heartbeat(f32::from(temp))).await;
    }
    bench.frames(60).await;
    let last = bench.store.last_event_seq().await.unwrap();
    let all = events(&mut socket, usize::try_from(last).unwrap()).await;
    assert_eq!(all, (1..=last).collect::<Vec<_>>());

    let mut resumed = open(address, "?after=5").await;
    assert_eq!(events(&mut resumed, 3).await, [6, 7, 8]);
}

#[tokio::test]
async fn what_the_hub_left_out_is_read_from_the_archive() {
    let (bench, address) = Bench::on_a_socket().await;
    let mut socket = open(address, "?after=0").await;
    while next(&mut socket).await["type"] != "live" {}
    bench.hear(&heartbeat(1.0)).await;
    bench.frames(1).await;
    let first = events(&mut socket, 1).await;
    // The same event for the second time, as after a lag: it is not sent again.
    let stored = bench.store.events(&crate::storage::EventQuery::default()).await.unwrap();
    for event in stored {
        bench.hub.publish(event);
    }
    bench.hear(&heartbeat(2.0)).await;
    bench.frames(2).await;
    let last = bench.store.last_event_seq().await.unwrap();
    let rest = events(&mut socket, usize::try_from(last - first[0]).unwrap()).await;
    assert_eq!(rest, (first[0] + 1..=last).collect::<Vec<_>>());
}

#[tokio::test]
async fn what_was_said_lately_is_told_without_the_archive() {
    let (bench, address) = Bench::on_a_socket().await;
    let mut witness = open(address, "?after=0&topics=events").await;
    bench.hear(&heartbeat(1.0)).await;
    bench.frames(1).await;
    let mut stored = bench.store.events(&crate::storage::EventQuery::default()).await.unwrap();
    // The archive does not know of it: who tells it has it at hand.
    let mut last = stored.remove(0);
    last.sequence += 1;
    let newest = last.sequence;
    assert_eq!(events(&mut witness, usize::try_from(newest - 1).unwrap()).await.last(), Some(&(newest - 1)));
    bench.hub.publish(last);
    assert_eq!(events(&mut witness, 1).await, [newest]);
    let mut late = open(address, "?topics=events").await;
    let hello = next(&mut late).await;
    assert_eq!((&hello["last_sequence"], &hello["after"]), (&newest.into(), &newest.into()));
    assert_eq!(next(&mut late).await["type"], "live");
    let mut behind = open(address, "?topics=events&after=1").await;
    assert_eq!(next(&mut behind).await["after"], 1);
    let told = events(&mut behind, usize::try_from(newest - 1).unwrap()).await;
    assert_eq!(told, (2..=newest).collect::<Vec<_>>());
    assert_eq!(next(&mut behind).await["type"], "live");
}

#[tokio::test]
async fn who_knows_more_than_the_archive_is_told_to_begin_anew() {
    let (_bench, address) = Bench::on_a_socket().await;
    let mut socket = open(address, "?after=4711").await;
    let hello = next(&mut socket).await;
    assert_eq!((&hello["reset"], &hello["after"]), (&true.into(), &hello["last_sequence"]));
}

#[tokio::test]
async fn another_origin_gets_no_stream_and_the_own_one_does() {
    let (_bench, address) = Bench::on_a_socket().await;
    for (origin, may) in [
        ("http://evil.example".to_owned(), false),
        ("null".to_owned(), false),
        (format!("http://{address}"), true),
    ] {
        let mut request = format!("ws://{address}/api/v1/stream").into_client_request().unwrap();
        request.headers_mut().insert("origin", origin.parse().unwrap());
        match connect_async(request).await {
            Ok(_) => assert!(may, "{origin}"),
            Err(Error::Http(response)) => {
                assert!(!may, "{origin}");
                assert_eq!(response.status(), 403);
            }
            Err(error) => panic!("{origin}: {error}"),
        }
    }
}

#[tokio::test]
async fn a_client_that_speaks_is_let_go_and_a_stopping_server_says_so() {
    let (bench, address) = Bench::on_a_socket().await;
    let mut talker = open(address, "").await;
    talker.send(Message::text("hello")).await.unwrap();
    let mut listener = open(address, "").await;
    let end = |mut socket: Socket| async move {
        loop {
            let message = next(&mut socket).await;
            if message["type"] == "close" {
                return message["code"].clone();
            }
        }
    };
    assert_eq!(end(talker).await, 1003);
    next(&mut listener).await;
    bench.stop.cancel();
    assert_eq!(end(listener).await, 1001);
}

#[tokio::test]
async fn a_65th_stream_is_refused_and_a_closed_one_makes_room() {
    let (_bench, address) = Bench::on_a_socket().await;
    let mut sockets = Vec::new();
    for _ in 0..64 {
        sockets.push(open(address, "").await);
    }
    let refused = connect_async(format!("ws://{address}/api/v1/stream")).await;
    assert!(matches!(refused, Err(Error::Http(response)) if response.status() == 503));
    drop(sockets.pop());
    for attempt in 0.. {
        if connect_async(format!("ws://{address}/api/v1/stream")).await.is_ok() {
            break;
        }
        assert!(attempt < 200, "the place never became free");
        crate::clock::wall_sleep(Duration::from_millis(10)).await;
    }
}

/// What the server says when it closes.
async fn end(mut socket: Socket) -> (u16, String) {
    loop {
        match within(Duration::from_secs(20), socket.next()).await.expect("an end in time") {
            Some(Ok(Message::Close(Some(frame)))) => return (frame.code.into(), frame.reason.to_string()),
            Some(Ok(_)) => {}
            other => panic!("no word at the end: {other:?}"),
        }
    }
}

#[tokio::test]
async fn hostile_clients_are_let_go_with_a_word_and_harm_nobody() {
    let (bench, address) = Bench::on_a_socket().await;
    let mut friend = open(address, "?after=0&topics=events").await;
    let cases = [
        (Message::text("x".repeat(5000)), 1009, "4096"),
        (Message::text("{\"type\":\"subscribe\",\"topics\":[\"all\"]}"), 1003, "understand"),
        (Message::text("{\"type\":\"subscribe\",\"topics\":[],\"satellites\":[\"moon\"]}"), 1008, "moon"),
        (Message::text(format!("{}1{}", "[".repeat(2000), "]".repeat(2000))), 1003, "understand"),
        (Message::binary(vec![0; 10]), 1003, "understand"),
    ];
    for (message, code, word) in cases {
        let mut socket = open(address, "?topics=commands").await;
        socket.send(message).await.unwrap();
        let (found, reason) = end(socket).await;
        assert_eq!(found, code, "{reason}");
        assert!(reason.contains(word), "{reason}");
    }
    let mut flood = open(address, "?topics=commands").await;
    for _ in 0..100 {
        let _ = flood.send(Message::Ping(vec![1; 100].into())).await;
    }
    assert_eq!(end(flood).await, (1008, "too many messages".to_owned()));
    bench.hear(&heartbeat(1.0)).await;
    assert_eq!(events(&mut friend, 2).await, [1, 2]);
}

#[tokio::test]
async fn what_is_asked_wrongly_is_refused_before_the_stream_opens() {
    let bench = Bench::new().await;
    for (query, problem) in [
        ("topics=events,all", "bad-parameter"),
        ("topic=events", "bad-parameter"),
        ("satellite=moon", "unknown-satellite"),
    ] {
        assert_eq!(bench.get(&format!("/api/v1/stream?{query}")).await.problem(), problem, "{query}");
    }
}

#[tokio::test]
async fn an_event_is_written_once_for_all_streams() {
    use super::super::stream::Prepared;
    let (bench, _) = Bench::on_a_socket().await;
    bench.hear(&heartbeat(1.0)).await;
    bench.frames(1).await;
    let events = bench.store.events(&crate::storage::EventQuery::default()).await.unwrap();
    let heard = events.into_iter().find(|event| event.record.subject.frame.is_some()).unwrap();
    let prepared = Prepared::new(std::sync::Arc::new(heard));
    for topic in [api::Topic::Events, api::Topic::Frames, api::Topic::Telemetry] {
        let first = prepared.text(topic, &bench.store).await.unwrap().unwrap();
        let second = prepared.text(topic, &bench.store).await.unwrap().unwrap();
        assert_eq!(first.as_str().as_ptr(), second.as_str().as_ptr(), "{topic}");
    }
    assert_eq!(prepared.text(api::Topic::Commands, &bench.store).await.unwrap(), None);
}
