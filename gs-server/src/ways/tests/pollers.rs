//! The pollers against a stand-in that lists, pages, freezes, hangs, refuses and talks nonsense as the real ones were seen to.

use std::sync::{Arc, Mutex};

use api::Time;
use mission::UtcUs;
use serde_json::{Value, json};

use super::bench::*;
use crate::elements::tests::source::{Asked, Source, say, say_with};

const MINUTE_US: u64 = 60_000_000;

/// A packet as the list has it.
fn packet(number: u32, at: UtcUs) -> Value {
    json!({
        "id": format!("01920000-0000-7000-8000-{number:012}"), "serverTime": at.0 / 1_000, "raw": base64(&heartbeat(number * 1_000)),
        "mode": "LoRa", "freq": 435.0, "sf": 9, "bw": 125, "cr": 5, "satellite": "PixelSat-I", "norad": 99_999,
        "stationNumber": 2, "parsed": {"x": [1, {"y": null}]},
    })
}

fn list(packets: &[Value]) -> String {
    json!({"packets": packets, "templates": {}}).to_string()
}

fn ear(source: &Source, more: &str) -> String {
    format!(
        "[[ears]]\nname = \"net\"\nkind = \"tinygs-api\"\nurl = \"http://{}/v3/\"\ntoken_file = \"token.txt\"\n\
         headers = {{ \"x-team\" = \"us\" }}\n{more}",
        source.address
    )
}

async fn home(ears: &str) -> Home {
    let folder = tempfile::tempdir().unwrap();
    private(folder.path(), "token.txt", "hunter2\n");
    Home::within(folder, ears)
}

/// How many requests went to such a path.
fn count(source: &Source, part: &str) -> usize {
    source.asked().iter().filter(|asked| asked.line.contains(part)).count()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pages_and_overlaps_lose_nothing_and_stations_are_asked_for_one_by_one() {
    let packets: Arc<Mutex<Vec<Value>>> = Arc::default();
    let served = Arc::clone(&packets);
    let source = Source::new(move |asked: &Asked| {
        let packets = served.lock().unwrap();
        if let Some(id) = asked.line.split("/packet/").nth(1) {
            let mut one = packets.iter().find(|packet| packet["id"] == id)?.clone();
            one["stations"] = json!([
                {"name": "alpha", "userId": 7, "location": [10.0, 20.0], "receptionParams": {"rssi": -120.0, "snr": -9.0, "frequency_error": 500.0}},
                {"name": "beta", "userId": 8, "location": [11.0, 21.0], "crc_error": true, "receptionParams": {"rssi": -130.0, "snr": -15.0, "frequency_error": 400.0}},
            ]);
            return Some(say(200, &one.to_string()));
        }
        // Version 3: five a page, newest first, older ones before a time.
        let before = asked.line.split("before=").nth(1).and_then(|ms| ms.parse().ok()).unwrap_or(i64::MAX);
        let mut page: Vec<Value> = packets.iter().filter(|packet| packet["serverTime"].as_i64() < Some(before)).cloned().collect();
        page.sort_by_key(|packet| -packet["serverTime"].as_i64().unwrap());
        page.truncate(5);
        Some(if page.is_empty() { say(404, "{}") } else { say(200, &list(&page)) })
    })
    .await;
    let home = home(&ear(&source, "paging = true\n")).await;
    for number in 1..=12 {
        packets.lock().unwrap().push(packet(number, START.plus(-i64::from(number) * 60_000_000)));
    }
    let mut bench = home.serve(START).await;
    bench.until_heard_count(12).await;
    let first = &source.asked()[0];
    assert_eq!(first.line, "GET /v3/packets?satellite=PixelSat-I");
    assert_eq!(first.headers["authorization"], "Bearer hunter2");
    assert_eq!(first.headers["x-team"], "us");
    // Twenty packets while nobody looked, the next looks go back until they meet what is known.
    for number in 101..=120 {
        packets.lock().unwrap().push(packet(number, START.plus(i64::from(number - 100) * 60_000_000)));
    }
    bench.pass(40 * MINUTE_US).await;
    bench.until_heard_count(32).await;
    // One a minute, 25 in half an hour, each once, those heard last first.
    bench.pass(120 * MINUTE_US).await;
    let details = count(&source, "/packet/");
    assert_eq!(details, 32, "each packet once");
    let receivers = bench.get("receivers?start=2020-01-01T00:00:00Z").await;
    let alpha =
        receivers["items"].as_array().unwrap().iter().find(|who| who["id"] == "alpha@7").unwrap().clone();
    assert_eq!((&alpha["frames"], &alpha["median_snr_db"]), (&json!(32), &json!(-9.0)), "{receivers}");
    let way = bench.way("net", |way| way["state"] == "working").await;
    assert!(way["counts"]["requests"].as_u64() < Some(160), "60 in each of 160 minutes at most: {way}");
    assert!(!way.to_string().contains("hunter2"));
    bench.stop().await;

    // A restart asks for nothing again that is known, and not before it is due.
    let asked = source.count();
    let bench = home.serve(START.plus(161 * 60_000_000)).await;
    bench.way("net", |way| !way["next_at"].is_null()).await;
    assert_eq!(source.count(), asked);
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_frozen_list_is_told_and_what_it_hid_comes_in_when_it_thaws() {
    let frozen = list(&[packet(1, START.plus(-60_000_000))]);
    let said = frozen.clone();
    let last_ms = START.0 / 1_000 + 4 * 3_600_000;
    let answer = move |asked: &Asked, body: &str| {
        let page = json!({"name": "PixelSat-I", "lastPacketTime": last_ms}).to_string();
        Some(say(200, if asked.line.contains("/satellite/") { &page } else { body }))
    };
    let source = Source::new(move |asked| answer(asked, &said)).await;
    let home = home(&ear(&source, "details = false\n")).await;
    let mut bench = home.serve(START).await;
    bench.until_heard_count(1).await;
    bench.pass(300 * MINUTE_US).await;
    let way = bench.way("net", |way| way["state"] == "stale").await;
    assert!(way["note"].as_str().unwrap().contains("frozen"), "{way}");
    let all: Vec<Value> =
        (0..30).map(|n| packet(n + 1, START.plus(-60_000_000 + i64::from(n) * 480_000_000))).collect();
    let thawed = list(&all);
    source.now_says(move |asked| answer(asked, &thawed));
    bench.pass(40 * MINUTE_US).await;
    bench.until_heard_count(30).await;
    bench.way("net", |way| way["state"] == "working").await;
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn whatever_a_source_says_it_is_asked_less_and_nothing_is_lost() {
    let source = Source::saying(200, "<html><title>Just a moment...</title></html>").await;
    let home = home(&ear(&source, "details = false\n")).await;
    let mut bench = home.serve(START).await;
    let failing = async |bench: &Bench, words: &str| {
        bench
            .way("net", |way| {
                way["state"] == "failing" && way["error"].as_str().unwrap_or("").contains(words)
            })
            .await
    };
    failing(&bench, "no JSON but '<html>").await;
    assert_eq!(source.count(), 1);
    // A list that is cut: what is whole of it is kept.
    let whole = list(&[packet(1, START), packet(2, START.plus(-60_000_000))]);
    let cut = whole[..whole.len() * 3 / 4].to_owned();
    source.now_says(move |_| Some(say(200, &cut)));
    bench.pass(3 * MINUTE_US).await;
    failing(&bench, "cut").await;
    assert_eq!(bench.heard().await.0, 1);
    // Two megabytes.
    source.now_says(|_| Some(say(200, &format!("[{}1]", "1,".repeat(1 << 20)))));
    bench.pass(6 * MINUTE_US).await;
    failing(&bench, "longer than 1024 KiB").await;
    // No answer at all.
    source.now_says(|_| None);
    bench.pass(10 * MINUTE_US).await;
    failing(&bench, "gave no answer within 2 s; TinyGS lets requests hang").await;
    // No such list: the address and what to look at are told, and it does not count as working.
    source.now_says(|_| Some(say(404, "{}")));
    bench.pass(20 * MINUTE_US).await;
    failing(&bench, "/v3/packets?satellite=PixelSat-I is not there (404)").await;
    failing(&bench, "Look at url").await;
    // A pause of two hours is kept to.
    source.now_says(|_| Some(say_with(429, &[("retry-after", "7200")], "slow down")));
    bench.pass(40 * MINUTE_US).await;
    failing(&bench, "429").await;
    let asked = source.count();
    bench.pass(75 * MINUTE_US).await;
    assert_eq!(source.count(), asked, "it asked for two hours");
    source.now_says(move |_| Some(say(200, &whole)));
    bench.pass(80 * MINUTE_US).await;
    bench.way("net", |way| way["state"] == "working").await;
    assert_eq!(bench.heard().await.0, 2);
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_refusal_ends_the_asking_and_a_new_token_begins_it_again() {
    let source = Source::saying(403, "forbidden").await;
    let home = home(&ear(&source, "details = false\n")).await;
    let mut bench = home.serve(START).await;
    bench.way("net", |way| way["state"] == "refused").await;
    bench.pass(10 * 60 * MINUTE_US).await;
    assert_eq!(source.count(), 1, "once, in ten hours");
    let alerts = bench.get("alerts").await;
    let told = alerts["items"].as_array().unwrap().iter().find(|alert| alert["kind"] == "ear");
    assert!(told.is_some_and(|alert| alert["subject"] == "net"), "{alerts}");
    bench.stop().await;
    // A restart does not ask either.
    let mut bench = home.serve(START.plus(11 * 3_600_000_000)).await;
    bench.way("net", |way| way["state"] == "refused").await;
    assert_eq!(source.count(), 1);
    home.write("token.txt", "correct horse\n");
    source.now_says(|_| Some(say(200, "{\"packets\":[]}")));
    bench.pass(40 * MINUTE_US).await;
    bench.way("net", |way| way["state"] == "working").await;
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn satnogs_is_read_page_by_page_on_its_own_host_only() {
    let own: Arc<Mutex<String>> = Arc::default();
    let host = Arc::clone(&own);
    let frame = |number: u32, at: UtcUs| {
        json!({"norad_cat_id": 98_765, "frame": hex::encode_upper(heartbeat(number * 1_000)), "observer": format!("DL{number}ABC-JO62qn"),
            "timestamp": Time::from_unix_us(at.0).to_string(), "app_source": "sids", "decoded": ""})
    };
    let source = Source::new(move |asked| {
        let page = if asked.line.contains("page=2") { 2 } else { 1 };
        let rows: Vec<Value> = (1..=25)
            .map(|row| frame(page * 100 + row, START.plus(-i64::from(page * 100 + row) * 60_000_000)))
            .collect();
        let link = format!("<http://{}/api/telemetry/?page=2>; rel=\"next\"", host.lock().unwrap());
        Some(if page == 1 {
            say_with(200, &[("link", &link)], &json!({"results": rows}).to_string())
        } else {
            say(200, &json!(rows).to_string())
        })
    })
    .await;
    *own.lock().unwrap() = source.address.to_string();
    let more = format!(
        "[[ears]]\nname = \"db\"\nkind = \"satnogs-db\"\nurl = \"http://{}/api/telemetry/\"\ntoken_file = \"token.txt\"\n",
        source.address
    );
    let home = home(&more).await;
    let mut bench = home.serve(START).await;
    bench.pass(MINUTE_US).await;
    bench.until_heard_count(50).await;
    let first = &source.asked()[0];
    assert_eq!(first.headers["authorization"], "Token hunter2");
    assert!(first.line.contains("satellite=98765&start=2026-09-14T14%3A13%3A20"), "{}", first.line);
    // Another host is not followed, and no token goes there.
    let elsewhere = Source::saying(200, "[]").await;
    *own.lock().unwrap() = elsewhere.address.to_string();
    bench.pass(80 * MINUTE_US).await;
    let way = bench.way("db", |way| way["state"] == "failing").await;
    assert!(way["error"].as_str().unwrap().contains("not followed"), "{way}");
    assert_eq!(elsewhere.count(), 0);
    // A database that says nothing is not told of as if it were TinyGS.
    source.now_says(|_| None);
    bench.pass(200 * MINUTE_US).await;
    let way = bench
        .way("db", |way| way["error"].as_str().is_some_and(|words| words.contains("gave no answer within")))
        .await;
    assert!(!way.to_string().contains("TinyGS"), "{way}");
    bench.stop().await;
}

/// Polls often while the satellite is over our station and for 20 minutes after, seldom otherwise: held against the passes
/// that the search for passes finds.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn looks_follow_the_passes() {
    let clock: Arc<Mutex<Option<crate::clock::SteppedClock>>> = Arc::default();
    let looks: Arc<Mutex<Vec<i64>>> = Arc::default();
    let (shared, noted) = (Arc::clone(&clock), Arc::clone(&looks));
    let source = Source::new(move |_| {
        use mission::Clock as _;
        let at = shared.lock().unwrap().as_ref().map_or(START, |clock| clock.now().utc);
        noted.lock().unwrap().push(at.0);
        Some(say(200, &list(&[])))
    })
    .await;
    let home = home(&ear(&source, "every_min = 60\nnear_pass_every_min = 5\n")).await;
    let mut bench = home.serve(START).await;
    *clock.lock().unwrap() = Some(bench.clock.clone());
    let omm = r#"[{"OBJECT_NAME":"PIXELSAT-1","OBJECT_ID":"2026-098A","EPOCH":"2026-09-21T12:00:00.000000","MEAN_MOTION":15.19,
        "ECCENTRICITY":0.0004,"INCLINATION":97.5,"RA_OF_ASC_NODE":21.3,"ARG_OF_PERICENTER":89.2,"MEAN_ANOMALY":80.4,"EPHEMERIS_TYPE":0,
        "CLASSIFICATION_TYPE":"U","NORAD_CAT_ID":98765,"ELEMENT_SET_NO":999,"REV_AT_EPOCH":2,"BSTAR":0.00003,"MEAN_MOTION_DOT":0,"MEAN_MOTION_DDOT":0}]"#;
    let added = bench.post("elements", &json!({"text": omm})).await;
    assert_eq!(added["added"], 1, "{added}");
    let passes = bench.get("passes?stop=2026-09-22T14:13:20Z").await;
    for _ in 0..24 {
        bench.pass(60 * MINUTE_US).await;
    }
    bench.stop().await;
    let time = |value: &Value| value.as_str().unwrap().parse::<jiff::Timestamp>().unwrap().as_microsecond();
    let windows: Vec<(i64, i64)> = passes["passes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|pass| (time(&pass["aos"]), time(&pass["los"]) + 20 * MINUTE_US as i64))
        .collect();
    assert!(windows.len() >= 4, "{passes}");
    let looks = looks.lock().unwrap().clone();
    for (from, until) in &windows {
        let inside = looks.iter().filter(|at| (*from..*until).contains(at)).count();
        assert!(inside as i64 >= (until - from) / (8 * MINUTE_US as i64), "{inside} looks in a window");
    }
    let slack = 7 * MINUTE_US as i64;
    let far = |at: i64| windows.iter().all(|(from, until)| at < from - slack || at > until + slack);
    for pair in looks.windows(2).filter(|pair| far(pair[0]) && far(pair[1]) && pair[0] > START.0) {
        assert!(pair[1] - pair[0] >= 55 * MINUTE_US as i64, "{} min", (pair[1] - pair[0]) / MINUTE_US as i64);
    }
    assert!(looks.len() > 40 && looks.len() < 140, "{}", looks.len());
}
