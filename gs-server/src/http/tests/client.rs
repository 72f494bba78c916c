//! The typed client against a real server: every operation, and a stream over losses.

use std::collections::BTreeMap;
use std::time::Duration;

use api::client::{Client, ClientError, EventStream, Filter, IdempotencyKey, StreamItem, StreamOptions};
use api::{CommandRequest, OutcomeWord, ProblemKind, StreamMessage, StreamRequest, Topic};
use serde_json::json;
use tokio::io::AsyncWriteExt as _;
use tokio::net::{TcpListener, TcpStream};
use tokio_util::sync::CancellationToken;

use super::{Bench, TOKEN, chunk, heartbeat, image_info, station};
use crate::clock::within;

fn client(address: std::net::SocketAddr) -> Client {
    Client::new(&format!("http://{address}"), Some(TOKEN)).unwrap()
}

async fn next(stream: &mut EventStream) -> StreamItem {
    within(Duration::from_secs(20), stream.next()).await.expect("an item in time")
}

#[tokio::test]
async fn every_read_is_understood() {
    let (bench, address) = Bench::on_a_socket().await;
    bench.hear(&heartbeat(20.0)).await;
    bench.hear(&image_info(500)).await;
    bench.hear(&chunk(&[7; 500], 0)).await;
    bench.frames(3).await;
    let (client, all) = (client(address), Filter::new());
    assert_eq!(client.version().await.unwrap().station, "bench");
    assert!(client.health().await.unwrap().ready);
    assert_eq!(client.station().await.unwrap().links.len(), 1);
    assert_eq!(client.antenna().await.unwrap().rotator, None);
    assert!(client.parameters().await.unwrap().items.len() > 20);
    assert!(client.limits().await.unwrap().items.is_empty());
    assert!(client.plans().await.unwrap().items.is_empty());
    assert_eq!(client.schedule().await.unwrap().station, "bench");
    assert!(client.sources().await.unwrap().items.is_empty());
    assert_eq!(client.frames(&all.clone().limit(2)).await.unwrap().items.len(), 2);
    assert!(client.frame(1).await.unwrap().packet.is_some());
    let temp = all.clone().with("parameter", "heartbeat.temp");
    assert_eq!(client.telemetry(&temp).await.unwrap().samples[0].value, Some(20.0));
    assert!(!client.latest(&all).await.unwrap().items.is_empty());
    assert!(client.commands(&all).await.unwrap().items.is_empty());
    assert!(client.downloads(&all).await.unwrap().items.is_empty());
    assert_eq!(client.images(&all).await.unwrap().items[0].held, 1);
    assert_eq!(client.image(1).await.unwrap().chunks, 3);
    assert_eq!(client.image_chunks(1).await.unwrap().map, "#..");
    let file = client.image_file(1, None).await.unwrap().unwrap();
    assert_eq!((file.bytes.len(), file.complete, file.contiguous_bytes), (500, false, 222));
    assert_eq!(client.image_file(1, file.tag.as_deref()).await.unwrap(), None);
    let heard = client.events(&all.clone().with("kind", "frame-heard")).await.unwrap();
    assert_eq!(heard.items.len(), 3);
    assert!(client.audit(&all).await.unwrap().items.is_empty());
    assert!(client.elements(&all).await.unwrap().items.is_empty());
    assert!(client.passes_history(&all).await.unwrap().items.is_empty());
    assert!(client.runs(&all).await.unwrap().items.is_empty());
    for refused in [client.passes(&all).await.unwrap_err(), client.look(&all).await.unwrap_err()] {
        assert_eq!(refused.kind(), Some(ProblemKind::NoPlace));
    }
    assert_eq!(client.run(1).await.unwrap_err().kind(), Some(ProblemKind::NotFound));
}

#[tokio::test]
async fn a_write_under_the_same_key_is_done_once_and_refusals_are_problems() {
    let (bench, address) = Bench::on_a_socket().await;
    let (client, key) = (client(address), IdempotencyKey::fresh());
    let ping: CommandRequest = serde_json::from_value(json!({"command": "Ping"})).unwrap();
    let first = client.send_command(&ping, &key).await.unwrap();
    assert_eq!((first.outcome, first.command), (OutcomeWord::CommandQueued, Some(1)));
    assert_eq!(client.send_command(&ping, &key).await.unwrap(), first);
    assert_eq!(bench.store.counts().await.unwrap().commands, 1);
    let other: CommandRequest = serde_json::from_value(json!({"command": "GetAdcsInfo"})).unwrap();
    let refused = client.send_command(&other, &key).await.unwrap_err();
    assert_eq!(refused.kind(), Some(ProblemKind::IdempotencyKeyReused));
    assert!(!refused.is_temporary());
    assert_eq!(client.command(1).await.unwrap().command, "Ping");
    let new = IdempotencyKey::fresh;
    assert_eq!(client.cancel_command(1, &new()).await.unwrap().outcome, OutcomeWord::CommandCancelled);
    let ordered = client.order_download(&api::DownloadRequest::default(), &new()).await.unwrap();
    assert_eq!(client.download(ordered.download.unwrap()).await.unwrap().state, "active");
    client.cancel_download(ordered.download.unwrap(), &new()).await.unwrap();
    client.disarm_link("e22", &new()).await.unwrap();
    client.arm_link("e22", &new()).await.unwrap();
    client.vouch_clock(&new()).await.unwrap();
    assert!(client.fetch_elements(&new()).await.unwrap().sources.is_empty());
    let kind = |error: ClientError| error.kind().unwrap();
    assert_eq!(kind(client.arm_link("no/such", &new()).await.unwrap_err()), ProblemKind::UnknownLink);
    assert_eq!(kind(client.hold("pixelsat-1", &new()).await.unwrap_err()), ProblemKind::NothingRuns);
    assert_eq!(kind(client.arm_plan("none", &new()).await.unwrap_err()), ProblemKind::UnknownPlan);
    assert_eq!(kind(client.withdraw_plan("none", &new()).await.unwrap_err()), ProblemKind::UnknownPlan);
    let reader = Client::new(&format!("http://{address}"), None).unwrap();
    assert_eq!(kind(reader.vouch_clock(&new()).await.unwrap_err()), ProblemKind::LoginRequired);
    let nobody = Client::new("http://127.0.0.1:1", None).unwrap();
    assert!(nobody.version().await.unwrap_err().is_temporary());
}

/// One call of each operation that the tests above do not have, against a real server.
#[tokio::test]
async fn people_alerts_reports_rehearsals_and_receptions_are_understood() {
    let (bench, address) = Bench::on_a_socket().await;
    let (client, all, new) = (client(address), Filter::new(), IdempotencyKey::fresh);
    let kind = |error: ClientError| error.kind().unwrap();
    let body = |value: serde_json::Value| value.to_string();
    // People.
    assert_eq!(client.session().await.unwrap().name.as_deref(), Some("local"));
    assert!(client.first_link(&new()).await.unwrap().link.starts_with("/welcome#code="));
    let wanted: api::UserRequest =
        serde_json::from_str(&body(json!({"name": "otto", "role": "operator"}))).unwrap();
    assert_eq!(client.add_user(&wanted, &new()).await.unwrap().name, "otto");
    let change = api::UserChange { call_sign: Some("DL1OTT".to_owned()), ..Default::default() };
    assert_eq!(
        client.change_user("otto", &change, &new()).await.unwrap().call_sign.as_deref(),
        Some("DL1OTT")
    );
    assert!(client.user_link("otto", &new()).await.unwrap().link.starts_with("/welcome#code="));
    assert_eq!(client.users(&all).await.unwrap().items.len(), 1);
    let wanted = json!({"name": "script", "scopes": ["look"], "days": 3, "owner": "otto"});
    let wanted: api::TokenRequest = serde_json::from_value(wanted).unwrap();
    let made = client.new_token(&wanted, &new()).await.unwrap();
    let machine = Client::new(&format!("http://{address}"), Some(&made.secret)).unwrap();
    assert_eq!(machine.session().await.unwrap().rights, ["look"]);
    assert_eq!(client.tokens(&all).await.unwrap().items[0].name, "script");
    client.revoke_token("script", &new()).await.unwrap();
    assert_eq!(kind(machine.session().await.unwrap_err()), ProblemKind::TokenRefused);
    // What waits for a second person: nothing here.
    assert!(client.approvals(&all.clone().with("open", true)).await.unwrap().items.is_empty());
    assert!(client.transmissions(&all).await.unwrap().items.is_empty());
    assert_eq!(kind(client.approval(1).await.unwrap_err()), ProblemKind::NotFound);
    let yes: api::ApproveRequest = serde_json::from_value(json!({"digest": "00"})).unwrap();
    assert_eq!(kind(client.approve(1, &yes, &new()).await.unwrap_err()), ProblemKind::NotFound);
    let no = api::RefuseRequest::default();
    assert_eq!(kind(client.refuse(1, &no, &new()).await.unwrap_err()), ProblemKind::NotFound);
    // Alerts.
    assert!(client.alerts(&all.clone().with("state", "all")).await.unwrap().items.is_empty());
    assert!(client.alert_targets().await.unwrap().items.is_empty());
    let note = api::AlertNote { note: None };
    let shelve: api::ShelveRequest =
        serde_json::from_value(json!({"until": "2026-12-02T06:00:00Z"})).unwrap();
    let assign: api::AssignRequest = serde_json::from_value(json!({"to": "otto"})).unwrap();
    assert_eq!(kind(client.alert(1).await.unwrap_err()), ProblemKind::NotFound);
    for refused in [
        client.acknowledge_alert(1, &note, &new()).await,
        client.shelve_alert(1, &shelve, &new()).await,
        client.unshelve_alert(1, &note, &new()).await,
        client.assign_alert(1, &assign, &new()).await,
    ] {
        assert!([404, 409, 422].contains(&kind(refused.unwrap_err()).status()));
    }
    assert_eq!(kind(client.test_target("none", &new()).await.unwrap_err()), ProblemKind::UnknownTarget);
    // Reports.
    bench.hear(&heartbeat(20.0)).await;
    bench.frames(1).await;
    assert_eq!(client.handover(&all).await.unwrap().now.station, "bench");
    assert!(client.handover_page(&all).await.unwrap().starts_with("<!doctype html>"));
    assert!(client.handover_text(&all).await.unwrap().starts_with('#'));
    assert_eq!(client.month_report("2026-11").await.unwrap().month, "2026-11");
    assert_eq!(kind(client.pass_report(1).await.unwrap_err()).status(), 404);
    // Rehearsals.
    assert!(client.rehearsals(&all).await.unwrap().items.is_empty());
    let wanted: api::RehearsalRequest = serde_json::from_value(json!({"name": "none", "runs": 1})).unwrap();
    assert!(client.rehearse(&wanted, &new()).await.is_err());
    assert_eq!(kind(client.rehearsal(1).await.unwrap_err()).status(), 404);
    assert_eq!(kind(client.cancel_rehearsal(1, &new()).await.unwrap_err()).status(), 404);
    // What others heard.
    assert!(client.receptions(&all).await.unwrap().items.is_empty());
    assert_eq!(client.ears().await.unwrap().next, None);
    let handed: api::ImportRequest = serde_json::from_value(json!({"items": []})).unwrap();
    let handed = client.import_receptions(&handed, &new()).await;
    assert!(handed.is_ok() || kind(handed.unwrap_err()) == ProblemKind::BadArgument);
    // What is passed on: nothing, to nobody.
    assert!(client.forwards(&all).await.unwrap().items.is_empty());
    assert!(client.forward_targets().await.unwrap().items.is_empty());
    assert_eq!(kind(client.forward(1).await.unwrap_err()).status(), 404);
    assert!(kind(client.retry_forward(1, &new()).await.unwrap_err()).status() < 500);
    assert!(kind(client.pause_forwards("none", &new()).await.unwrap_err()).status() < 500);
    assert!(kind(client.resume_forwards("none", &new()).await.unwrap_err()).status() < 500);
    // The sky of a station that nobody told its place, and the document.
    for refused in
        [client.calendar(&all).await, client.sky_plot(&all).await, client.timeline_plot(&all).await]
    {
        assert_eq!(kind(refused.unwrap_err()), ProblemKind::NoPlace);
    }
    assert_eq!(client.openapi().await.unwrap()["openapi"], "3.1.0");
    let at = "2026-11-22T00:00:00Z".parse().unwrap();
    assert_eq!(kind(client.attach_plan("none", at, &new()).await.unwrap_err()), ProblemKind::UnknownPlan);
    assert_eq!(kind(client.detach_plan("none", at, &new()).await.unwrap_err()), ProblemKind::UnknownPlan);
    assert_eq!(kind(client.disarm_plan("none", &new()).await.unwrap_err()), ProblemKind::UnknownPlan);
    assert_eq!(kind(client.release("pixelsat-1", &new()).await.unwrap_err()), ProblemKind::NothingRuns);
    assert_eq!(
        kind(client.confirm_counter("0000", None, &new()).await.unwrap_err()),
        ProblemKind::UnknownKey
    );
    let plan: api::PlanText = serde_json::from_value(
        json!({"name": "p", "satellite": "other", "attach": {}, "steps": [{"do": "listen", "for_s": 2}]}),
    )
    .unwrap();
    assert!(client.add_plan(&plan, &new()).await.is_err());
    let elements: api::ElementsRequest = serde_json::from_value(json!({"text": "none"})).unwrap();
    assert!(client.add_elements(&elements, &new()).await.is_err());
}

/// Everything in a stream until `count` events have come: which messages by sequence.
async fn collect(stream: &mut EventStream, until: i64, into: &mut BTreeMap<i64, Vec<&'static str>>) -> u32 {
    let mut losses = 0;
    loop {
        match next(stream).await {
            StreamItem::Message(message) => {
                let kind = match &*message {
                    StreamMessage::Event(_) => "event",
                    StreamMessage::Frame { .. } => "frame",
                    StreamMessage::Telemetry { .. } => "telemetry",
                    _ => continue,
                };
                into.entry(message.sequence().unwrap()).or_default().push(kind);
            }
            StreamItem::Lost { .. } => losses += 1,
            StreamItem::Live { sequence } if sequence >= until => {}
            StreamItem::Gap { .. } => panic!("it is the same archive"),
            _ => {}
        }
        let whole = into.last_key_value().is_some_and(|(last, kinds)| *last >= until && kinds.len() == 3);
        if whole {
            return losses;
        }
    }
}

/// A line that breaks after so many bytes, again and again.
async fn brittle(to: std::net::SocketAddr, bytes: usize, stop: CancellationToken) -> std::net::SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    tokio::spawn(async move {
        let mut allowed = bytes;
        while let Some(Ok((mut near, _))) = stop.run_until_cancelled(listener.accept()).await {
            let mut far = TcpStream::connect(to).await.unwrap();
            let (mut read_near, mut write_near) = near.split();
            let (mut read_far, mut write_far) = far.split();
            let up = tokio::io::copy(&mut read_near, &mut write_far);
            let mut bounded = tokio::io::AsyncReadExt::take(&mut read_far, allowed as u64);
            let down = tokio::io::copy(&mut bounded, &mut write_near);
            tokio::select! { _ = up => {}, _ = down => {} }
            let _ = near.shutdown().await;
            allowed += bytes / 3 + 1;
        }
    });
    address
}

#[tokio::test]
async fn a_stream_over_a_line_that_breaks_everywhere_has_no_hole_and_no_double() {
    let (bench, address) = Bench::on_a_socket_that_answers_to_any_port().await;
    let line = brittle(address, 20_000, bench.stop.clone()).await;
    let topics = vec![Topic::Events, Topic::Frames, Topic::Telemetry];
    let options = StreamOptions { after: Some(0), topics, satellites: Vec::new() };
    let mut stream = client(line).stream(options);
    let mut found = BTreeMap::new();
    let mut losses = 0;
    for round in 0..4u8 {
        for temp in 0..25u8 {
            bench.hear(&heartbeat(f32::from(round) * 100.0 + f32::from(temp))).await;
        }
        bench.frames(i64::from(round + 1) * 25).await;
        let last = bench.store.last_event_seq().await.unwrap();
        losses += collect(&mut stream, last, &mut found).await;
    }
    assert!(losses >= 3, "the line broke {losses} times only");
    let last = bench.store.last_event_seq().await.unwrap();
    assert_eq!(found.keys().copied().collect::<Vec<_>>(), (1..=last).collect::<Vec<_>>());
    let heard = bench.get("/api/v1/events?kind=frame-heard&limit=1000").await.ok();
    let heard: Vec<i64> =
        heard["items"].as_array().unwrap().iter().map(|event| event["sequence"].as_i64().unwrap()).collect();
    assert_eq!(heard.len(), 100);
    for (sequence, kinds) in &found {
        let expected: &[&str] =
            if heard.contains(sequence) { &["event", "frame", "telemetry"] } else { &["event"] };
        assert_eq!(kinds, expected, "event {sequence}");
    }
}

#[tokio::test]
async fn topics_and_satellites_are_changed_on_the_way_and_another_archive_is_a_gap() {
    let (bench, address) = Bench::on_a_socket().await;
    let options = StreamOptions { after: Some(4711), topics: vec![Topic::Commands], satellites: vec![] };
    let mut stream = client(address).stream(options);
    assert!(matches!(next(&mut stream).await, StreamItem::Gap { had: 4711, .. }));
    assert!(matches!(next(&mut stream).await, StreamItem::Live { .. }));
    stream
        .ask(StreamRequest::Subscribe {
            topics: vec![Topic::Telemetry],
            satellites: Some(vec!["pixelsat-1".into()]),
        })
        .await;
    let StreamItem::Message(told) = next(&mut stream).await else { panic!("no answer") };
    let StreamMessage::Subscribed { topics, satellites, .. } = *told else { panic!("{told:?}") };
    assert_eq!(
        (topics, satellites),
        (vec![Topic::Telemetry, Topic::Commands], vec!["pixelsat-1".to_owned()])
    );
    bench.hear(&heartbeat(21.5)).await;
    let StreamItem::Message(told) = next(&mut stream).await else { panic!("no values") };
    let StreamMessage::Telemetry { values, .. } = *told else { panic!("{told:?}") };
    assert!(values.iter().any(|value| value.parameter == "heartbeat.temp" && value.value == Some(21.5)));
    stream.ask(StreamRequest::Unsubscribe { topics: vec![Topic::Telemetry] }).await;
    assert!(matches!(next(&mut stream).await, StreamItem::Message(_)));
    bench.hear(&heartbeat(22.5)).await;
    bench.frames(2).await;
    let ping: CommandRequest = serde_json::from_value(json!({"command": "Ping"})).unwrap();
    client(address).send_command(&ping, &IdempotencyKey::fresh()).await.unwrap();
    let StreamItem::Message(told) = next(&mut stream).await else { panic!("no command") };
    let StreamMessage::Command { command, .. } = *told else { panic!("{told:?}") };
    assert_eq!((command.command.as_str(), command.id), ("Ping", 1));
    bench.stop.cancel();
    loop {
        if let StreamItem::Lost { why, .. } = next(&mut stream).await {
            assert_eq!(why, "the server is stopping");
            return;
        }
    }
}

impl Bench {
    /// Behind a line the client names the line's port.
    async fn on_a_socket_that_answers_to_any_port() -> (Self, std::net::SocketAddr) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let bench = Self::listening(station(), address).await;
        let router = bench.router.clone().layer(axum::middleware::map_request(
            move |mut request: axum::extract::Request| async move {
                let host = address.to_string().parse().unwrap();
                request.headers_mut().insert(axum::http::header::HOST, host);
                request
            },
        ));
        tokio::spawn(super::serve(listener, router, bench.stop.clone()));
        (bench, address)
    }
}
