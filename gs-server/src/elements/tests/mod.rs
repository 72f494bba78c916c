//! Real requests to a real server that counts them, on a clock that stands still.

mod bench;
pub(crate) mod source;

use std::time::Duration;

use api::{FetchWord, SourceWord};
use bench::{HOUR_US, Home, START, everything_in, group, iss};
use mission::sky::SETS_AT_ONCE;
use mission::{Intent, SatelliteId, UtcUs};
use reqwest::Url;
use source::{Source, say, say_with};

use super::client::{Answer, PATIENCE, ask};
use super::door::{Adder, Door};
use super::memory::{Memory, State};
use crate::config::FetchSource;

const NOT_UPDATED: &str = "GP data has not updated since your last successful download of GROUP=cubesat at 2020-07-13 \
    20:00:00 UTC.\nData is updated once every 2 hours.\n";

fn quoted(source: &Source) -> String {
    format!("{:?}", source.url())
}

#[tokio::test(flavor = "multi_thread")]
async fn elements_are_fetched_at_start_reach_the_status_and_are_not_asked_for_again_across_restarts() {
    let source = Source::saying(200, &group(194.5)).await;
    let home = Home::new(&quoted(&source));
    let data = home.data();
    source.now_says(move |_| {
        let known = everything_in(&data.join("elements"));
        assert!(known.contains("asked_at_us\": 15946"), "asked before it was written down: {known}");
        Some(say(200, &group(194.5)))
    });
    let mut bench = home.serve(START).await;
    bench.until_epoch(194.5).await;
    assert_eq!(source.count(), 1);
    let asked = source.asked().remove(0);
    assert_eq!(asked.line, "GET /gp.php?GROUP=cubesat&FORMAT=json");
    assert!(asked.headers["user-agent"].to_str().unwrap().starts_with("gs-server/"));
    assert!(!asked.headers.contains_key("cookie") && !asked.headers.contains_key("authorization"));

    let report = bench.fetch().await;
    assert_eq!(report.sources[0].outcome, FetchWord::TooEarly);
    bench.advance(HOUR_US).await;
    let at = bench.end().await;
    let mut bench = home.serve(at).await;
    bench.until_epoch(194.5).await;
    bench.source(|source| source.state == SourceWord::Good).await;
    assert_eq!(bench.fetch().await.sources[0].outcome, FetchWord::TooEarly);
    assert_eq!(source.count(), 1, "a restart asked again");

    // Two hours after the request an operator may, six hours after it the server does.
    bench.advance(HOUR_US - 60_000_000).await;
    assert_eq!(bench.fetch().await.sources[0].outcome, FetchWord::TooEarly);
    bench.advance(120_000_000).await;
    source.now_says(|_| Some(say(200, &group(196.5))));
    assert_eq!(bench.fetch().await.sources[0].outcome, FetchWord::Downloaded);
    bench.until_epoch(194.5).await;
    assert_eq!(source.count(), 2);
    bench.advance(5 * HOUR_US).await;
    assert_eq!(source.count(), 2);
    bench.advance(2 * HOUR_US).await;
    assert_eq!(source.count(), 3);
    bench.advance(24 * HOUR_US).await;
    bench.until_epoch(196.5).await;
    assert!((6..=7).contains(&source.count()), "{} requests in a day and a half", source.count());
    let held = bench.ask("GET", "elements", "").await;
    let held: api::Page<api::HeldElements> = serde_json::from_str(&held).unwrap();
    assert_eq!(held.items.len(), 2, "what was held was added again");
    assert_eq!((held.items[0].added_by.as_str(), held.items[0].in_use), ("fetch", true));
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn not_updated_since_is_one_request_and_the_cache_stays() {
    let source = Source::saying(200, &group(194.5)).await;
    let home = Home::new(&quoted(&source));
    let mut bench = home.serve(START).await;
    bench.until_epoch(194.5).await;
    source.now_says(|_| Some(say(403, NOT_UPDATED)));
    bench.advance(2 * HOUR_US + 1).await;
    let report = bench.fetch().await;
    assert_eq!(report.sources[0].outcome, FetchWord::NotUpdated, "{report:?}");
    assert_eq!(source.count(), 2);
    let state = bench.source(|source| source.detail.as_deref().is_some_and(|d| d.contains("newer"))).await;
    assert_eq!(state.state, SourceWord::Good);
    bench.advance(HOUR_US).await;
    let at = bench.end().await;
    let mut bench = home.serve(at).await;
    bench.until_epoch(194.5).await;
    bench.advance(HOUR_US).await;
    assert_eq!(source.count(), 2);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn any_other_answer_stops_it_until_an_operator_says_so_across_restarts() {
    let elsewhere = Source::saying(200, &group(194.5)).await;
    for (status, says) in
        [(301, "has moved"), (302, "has moved"), (403, "403"), (404, "404"), (500, "500"), (204, "204")]
    {
        let target = elsewhere.url();
        let script = {
            let target = target.clone();
            move |_: &source::Asked| {
                let headers = [("location", target.as_str())];
                Some(say_with(
                    status,
                    if (300..400).contains(&status) { &headers } else { &[] },
                    "nope, sorry",
                ))
            }
        };
        let source = Source::new(script).await;
        let home = Home::new(&quoted(&source));
        let mut bench = home.serve(START).await;
        let stopped = bench.source(|source| source.state == SourceWord::Stopped).await;
        let detail = stopped.detail.unwrap();
        assert!(detail.contains(says) && detail.contains("elements fetch"), "{status}: {detail}");
        assert!(!(300..400).contains(&status) || detail.contains(&target), "{detail}");
        assert_eq!(stopped.next_at, None);
        bench.advance(13 * HOUR_US).await;
        let at = bench.end().await;
        let mut bench = home.serve(at).await;
        bench.advance(13 * HOUR_US).await;
        assert_eq!(source.count(), 1, "{status}: asked again by itself");
        // An operator may, but no loop hammers it.
        let report = bench.fetch().await;
        assert_eq!(report.sources[0].outcome, FetchWord::Stopped, "{status}");
        let report = bench.fetch().await;
        assert_eq!(report.sources[0].outcome, FetchWord::TooEarly, "{status}");
        assert_eq!(source.count(), 2);
        source.now_says(|_| Some(say(200, &group(194.5))));
        bench.advance(HOUR_US).await;
        assert_eq!(bench.fetch().await.sources[0].outcome, FetchWord::Downloaded);
        bench.until_epoch(194.5).await;
        bench.advance(7 * HOUR_US).await;
        assert_eq!(source.count(), 4, "{status}: it goes on by itself after a success");
        bench.end().await;
    }
    assert_eq!(elsewhere.count(), 0, "a redirect was followed");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_no_elements_is_a_failed_download_and_the_old_ones_stay() {
    let broken = group(195.0).replace("\"MEAN_MOTION\":15.49507896", "\"MEAN_MOTION\":-1");
    for body in [
        "<!DOCTYPE html><html><title>Maintenance</title>",
        "No GP data found",
        "",
        " \n",
        "[]",
        "{\"error\":1}",
        &broken,
    ] {
        let source = Source::saying(200, &group(194.5)).await;
        let home = Home::new(&quoted(&source));
        let mut bench = home.serve(START).await;
        bench.until_epoch(194.5).await;
        let good = everything_in(&home.data().join("elements"));
        assert!(good.contains("2020-07-12T12:00:00"), "{good}");
        let body = body.to_owned();
        source.now_says(move |_| Some(say(200, &body)));
        bench.advance(2 * HOUR_US + 1).await;
        let report = bench.fetch().await;
        assert_eq!(report.sources[0].outcome, FetchWord::Failed, "{report:?}");
        let failed = bench.source(|source| source.state == SourceWord::Failed).await;
        assert!(failed.downloaded_at < failed.asked_at && failed.next_at.is_some(), "{failed:?}");
        assert!(everything_in(&home.data().join("elements")).contains("2020-07-12T12:00:00"));
        bench.advance(HOUR_US).await;
        assert_eq!(source.count(), 2, "asked again within the minimum age");
        bench.until_epoch(194.5).await;
        bench.end().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_kill_between_download_and_adding_loses_nothing_and_asks_nobody() {
    let source = Source::saying(500, "").await;
    let home = Home::new(&quoted(&source));
    std::fs::create_dir(home.data()).unwrap();
    let memory = Memory::open(&home.data()).unwrap();
    let asked = State { url: source.url(), asked_at_us: Some(START.0 - HOUR_US), ..State::default() };
    memory.write_state(&asked).unwrap();
    memory.write_body(&source.url(), group(194.5).as_bytes()).unwrap();
    let mut bench = home.serve(START).await;
    bench.until_epoch(194.5).await;
    assert_eq!(source.count(), 0);
    bench.end().await;
    let mut bench = home.serve(UtcUs(START.0 + 1)).await;
    bench.until_epoch(194.5).await;
    let held = bench.ask("GET", "elements", "").await;
    assert_eq!(
        serde_json::from_str::<serde_json::Value>(&held).unwrap()["items"].as_array().unwrap().len(),
        1
    );
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn without_network_nothing_counts_as_asked_and_it_is_tried_again_ever_more_rarely() {
    // A port that nobody listens on.
    let home = Home::new("\"http://127.0.0.1:1/gp\"");
    let mut bench = home.serve(START).await;
    let failed = bench.source(|source| source.state == SourceWord::Failed).await;
    assert_eq!(failed.asked_at, None, "{failed:?}");
    assert!(failed.detail.unwrap().contains("cannot be reached"));
    let wait = |source: &api::ElementsSource, now: UtcUs| source.next_at.unwrap().unix_us() - now.0;
    let soon = bench.source(|_| true).await;
    assert!(wait(&soon, bench.now()) <= HOUR_US / 4 + 1000);
    bench.advance(48 * HOUR_US).await;
    let later = bench.source(|_| true).await;
    assert!(wait(&later, bench.now()) > HOUR_US / 4, "{later:?}");
    // The operator's network is back: no waiting.
    assert_eq!(bench.fetch().await.sources[0].outcome, FetchWord::Failed);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_logs_in_with_a_file_whose_content_goes_nowhere_else() {
    use std::os::unix::fs::PermissionsExt as _;
    let source = Source::new(|asked| {
        Some(match asked.line.as_str() {
            "POST /ajaxauth/login" => {
                say_with(200, &[("set-cookie", "chocolatechip=abc123; path=/; httponly")], "\"\"")
            }
            _ => say(200, &group(194.5)),
        })
    })
    .await;
    let home = Home::new(&format!("{{ url = {}, credentials_file = \"login\" }}", quoted(&source)));
    let login = home.folder.path().join("login");
    std::fs::write(&login, "me@uni.ch\nhunter two\n").unwrap();
    std::fs::set_permissions(&login, std::fs::Permissions::from_mode(0o600)).unwrap();
    let mut bench = home.serve(START).await;
    bench.advance(HOUR_US).await;
    bench.until_epoch(194.5).await;
    let asked = source.asked();
    assert_eq!(asked.len(), 2);
    assert_eq!(asked[0].body, "identity=me%40uni.ch&password=hunter%20two");
    assert_eq!(asked[1].headers["cookie"], "chocolatechip=abc123");
    let state = bench.source(|source| source.state == SourceWord::Good).await;
    let minute = state.next_at.unwrap().unix_us() / 60_000_000 % 30;
    assert!((5..=25).contains(&minute), "{state:?}");
    source.now_says(|_| Some(say(200, "{\"Login\":\"Failed\"}")));
    bench.advance(8 * HOUR_US).await;
    let state = bench.source(|source| source.state == SourceWord::Stopped).await;
    assert!(state.detail.unwrap().contains("login was refused"));
    bench.end().await;
    let left = everything_in(&home.data());
    assert!(!left.contains("hunter") && !left.contains("chocolatechip"));
}

#[tokio::test]
async fn answers_that_come_too_slowly_or_are_too_long_end() {
    let source = Source::new(|_| None).await;
    let fetch = FetchSource { url: source.url(), credentials_file: None };
    let url = Url::parse(&source.url()).unwrap();
    let answer = ask(&fetch, &url, Duration::from_millis(300)).await;
    assert!(matches!(&answer, Answer::Lost(why) if why.contains("in time")), "{answer:?}");
    let long = "1".repeat(11 << 20);
    source.now_says(move |_| Some(say(200, &long)));
    let answer = ask(&fetch, &url, PATIENCE).await;
    assert!(matches!(&answer, Answer::Refused(why) if why.contains("10 MB")), "{answer:?}");
    source.now_says(|_| {
        use futures_util::stream;
        // No length is told: 11 pieces of a megabyte.
        let pieces = (0..11).map(|_| Ok::<_, std::io::Error>(vec![b'1'; 1 << 20]));
        Some(axum::response::Response::new(axum::body::Body::from_stream(stream::iter(pieces))))
    });
    let answer = ask(&fetch, &url, PATIENCE).await;
    assert!(matches!(&answer, Answer::Refused(why) if why.contains("10 MB")), "{answer:?}");
    assert_eq!(source.count(), 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_rest_of_a_long_history_is_added_after_a_kill_in_between() {
    let home = Home::new("");
    let bench = home.serve(START).await;
    let door = Door { engine: bench.ready.engine.clone(), store: bench.ready.store.clone() };
    let satellite = SatelliteId::new("iss").unwrap();
    let days = (0..SETS_AT_ONCE + 3).map(|at| iss(100.0 + at as f64 / 24.0)).collect::<Vec<_>>().join(",");
    let text =
        super::SetsOfText::read(format!("[{days}]").as_bytes(), tle::formats::Checksums::Strict).unwrap();
    let sets: Vec<_> = text.sets.iter().map(|found| &found.elements).collect();
    let adder = Adder::of("test", &satellite, &sets);
    let first = Intent::AddElements {
        satellite: satellite.clone(),
        elements: sets[..SETS_AT_ONCE].iter().map(|set| (*set).clone()).collect(),
        source: "history".to_owned(),
    };
    door.engine.intent(adder.principal.clone(), adder.key.clone(), adder.digest, first).await.unwrap();
    let (added, _) = door.add(&satellite, &sets, "history", &adder).await.unwrap();
    assert_eq!((added.added, added.held), (3, SETS_AT_ONCE as u64));
    let (added, _) = door.add(&satellite, &sets, "history", &adder).await.unwrap();
    assert_eq!((added.added, added.held), (0, sets.len() as u64), "told as added, and not held");
    bench.end().await;
}
