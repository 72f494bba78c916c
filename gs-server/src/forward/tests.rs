//! Targets on a stepped clock, with a real archive and far ends on real sockets.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use mission::record::{FrameRecord, ReceptionRecord, Record, Route, Source};
use mission::{Batch, BatchId, Clock as _, FrameId, LinkId, Principal, SatelliteId, StationId, UtcUs};
use protocol::FrameForm;
use tempfile::TempDir;
use tokio_util::sync::CancellationToken;

use super::{ForwardParts, ForwardsHandle, spawn};
use crate::alerts::catchers::Hook;
use crate::clock::{BusyToken, SteppedClock, SteppedOptions, Timer, wall_sleep};
use crate::config::Config;
use crate::lifecycle::Lifecycle;
use crate::storage::{ForwardQuery, ForwardRow, Store, StoreOptions};

/// 2026-11-18T11:06:40Z.
const BEGIN_US: i64 = 1_795_000_000_000_000;
const MINUTE: u64 = 60;

/// A life of the targets: dropped, it ends as by kill -9.
struct Life {
    handle: ForwardsHandle,
    store: Store,
    clock: Arc<SteppedClock>,
    hold: Mutex<Option<BusyToken>>,
    runtime: Option<tokio::runtime::Runtime>,
}

impl Drop for Life {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

impl Life {
    async fn begin(folder: &TempDir, targets: &str, utc_us: i64) -> Self {
        let text = format!(
            "[station]\nname = \"roof\"\ncall_sign = \"HB9XYZ\"\nlatitude_deg = 47.378\nlongitude_deg = 8.548\n[[satellites]]\nname = \"sat\"\n\
             norad_cat_id = 99123\n[[links]]\nname = \"e22\"\nsatellite = \"sat\"\nkind = \"tcp\"\nconnect = \"localhost:9\"\n\
             simulated = true\n[storage]\nfolder = \"data\"\n{targets}"
        );
        let config = Config::from_toml(&text, folder.path()).unwrap();
        config.check().unwrap();
        let options = SteppedOptions { utc_at_origin: UtcUs(utc_us), speed: None };
        let clock = Arc::new(SteppedClock::new(options).unwrap());
        let hold = Mutex::new(Some(clock.busy("test")));
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap();
        let options = StoreOptions {
            folder: config.storage.folder.clone(),
            station: Some(StationId::new("roof").unwrap()),
            simulated: true,
            postgres: None,
            max_page_count: None,
            reserve_bytes: 0,
        };
        // The folder is free when the tasks of the life before are gone.
        let mut tries = 0;
        let store = loop {
            match Store::open(options.clone()).await {
                Ok(store) => break store,
                Err(error) if tries > 200 => panic!("{error}"),
                Err(_) => tries += 1,
            }
            wall_sleep(Duration::from_millis(20)).await;
        };
        let timer: Arc<dyn Timer> = clock.clone();
        let handle = {
            let _inside = runtime.enter();
            let parts = ForwardParts { config: &config, store: &store, timer: &timer, alerts: None };
            spawn(&parts, &Lifecycle::new(&CancellationToken::new()))
        };
        Self { handle, store, clock, hold, runtime: Some(runtime) }
    }

    /// Lets so much simulated time pass; else it stands still.
    async fn pass(&self, seconds: u64) {
        let until = self.clock.now().mono.plus(seconds * 1_000_000);
        let sleep = self.clock.sleep_until(until);
        self.run_free();
        let token = sleep.await;
        *self.hold.lock().unwrap() = Some(token);
    }

    fn run_free(&self) {
        let hold = self.hold.lock().unwrap().take();
        drop(hold);
    }

    /// Our radio hears frame `id`.
    async fn hear(&self, id: u64) {
        let route = Route {
            satellite: SatelliteId::new("sat").unwrap(),
            station: StationId::new("roof").unwrap(),
            link: LinkId::new("e22").unwrap(),
        };
        let at = UtcUs(BEGIN_US + id.cast_signed() * 1_234_567);
        let reception = ReceptionRecord {
            frame: FrameId(id),
            route: route.clone(),
            source: Source::Radio,
            received_at: at,
            rssi_dbm: Some(-107),
        };
        let frame = FrameRecord {
            id: FrameId(id),
            route,
            bytes: [b"PIXELSAT".as_slice(), &[0xC0; 8], &id.to_be_bytes()].concat().into(),
            form: FrameForm::Short,
            packet_type: Some(6),
            tag: None,
            nested: false,
            heard_at: at,
        };
        let records = vec![Record::Frame(frame), Record::Reception(reception)];
        self.store.apply(&Batch { id: BatchId(id), records }).await.unwrap();
    }

    /// Oldest first.
    async fn rows(&self) -> Vec<ForwardRow> {
        let mut rows = self.store.forwards(&ForwardQuery::default()).await.unwrap();
        rows.reverse();
        rows
    }

    async fn states(&self) -> Vec<String> {
        self.rows().await.into_iter().map(|row| row.state).collect()
    }
}

fn secret(folder: &TempDir) {
    use std::io::Write as _;
    use std::os::unix::fs::OpenOptionsExt as _;
    let mut options = std::fs::OpenOptions::new();
    let file = options.write(true).create(true).truncate(true).mode(0o600).open(folder.path().join("key"));
    writeln!(file.unwrap(), "correct-horse-battery").unwrap();
}

fn target(kind: &str, hook: &Hook, more: &str) -> String {
    format!(
        "[[forward]]\nname = \"db\"\nkind = \"{kind}\"\nurl = \"{}\"\nsecret_file = \"key\"\nsince = \"2026-01-01T00:00:00Z\"\n{more}\n",
        hook.url
    )
}

const FIRST: &str = "noradID=99123&source=HB9XYZ&timestamp=2026-11-18T11%3A06%3A41.234Z&frame=504958454C534154C0C0C0C0C0C0C0C00000000000000001\
    &locator=longLat&longitude=8.54800E&latitude=47.37800N&version=PixelSat+Ground+";

#[tokio::test(flavor = "multi_thread")]
async fn a_dry_run_shows_the_exact_request_and_sends_nothing() {
    let folder = tempfile::tempdir().unwrap();
    secret(&folder);
    let hook = Hook::saying(201).await;
    let life = Life::begin(&folder, &target("sids", &hook, ""), BEGIN_US).await;
    life.hear(1).await;
    life.pass(5 * MINUTE).await;
    assert_eq!((life.states().await, hook.count()), (vec!["dry".to_owned()], 0));
    let form = life.handle.form(&life.rows().await[0]).await.unwrap().unwrap();
    assert!(form.body.starts_with(FIRST), "{}", form.body);
    drop(life);
    // Made live, it does not send what was only a rehearsal; what is sent is what was shown.
    let life = Life::begin(&folder, &target("sids", &hook, "live = true"), BEGIN_US).await;
    life.hear(2).await;
    life.pass(5 * MINUTE).await;
    assert_eq!(life.states().await, ["dry", "sent"]);
    let posted = hook.wait(1).await.remove(0);
    let form = life.handle.form(&life.rows().await[1]).await.unwrap().unwrap();
    assert_eq!((posted.body.as_str(), posted.line.as_str()), (form.body.as_str(), "POST /hook"));
    assert_eq!(posted.header("content-type"), "application/x-www-form-urlencoded");
    assert_eq!(posted.header("authorization"), "Token correct-horse-battery");
}

#[tokio::test(flavor = "multi_thread")]
async fn sids_is_sent_once_and_what_nobody_knows_waits_for_a_person() {
    let folder = tempfile::tempdir().unwrap();
    secret(&folder);
    let hook = Hook::saying(201).await;
    let live = target("sids", &hook, "live = true");
    let life = Life::begin(&folder, &live, BEGIN_US).await;
    life.hear(1).await;
    life.pass(MINUTE).await;
    assert_eq!((life.states().await, hook.count()), (vec!["sent".to_owned()], 1));
    // Something in between failed; the far end may have it.
    hook.now_says(502);
    life.hear(2).await;
    life.pass(30 * MINUTE).await;
    assert_eq!((life.states().await[1].as_str(), hook.count()), ("unknown", 2));
    // It dies while the far end has the request and does not answer.
    hook.now_says(0);
    life.hear(3).await;
    life.run_free();
    hook.wait(3).await;
    drop(life);
    hook.now_says(201);
    let life = Life::begin(&folder, &live, BEGIN_US + 7_200_000_000).await;
    life.pass(30 * MINUTE).await;
    assert_eq!(
        (life.states().await, hook.count()),
        (["sent", "unknown", "unknown"].map(str::to_owned).to_vec(), 3)
    );
    // A person has looked: one of them is not there.
    let id = life.rows().await[2].id;
    assert!(life.handle.retry(id, &Principal::new("anna")).await.unwrap().is_some());
    life.pass(MINUTE).await;
    assert_eq!((life.states().await[2].as_str(), hook.count()), ("sent", 4));
    assert!(life.handle.retry(id, &Principal::new("anna")).await.unwrap().is_none());
    let posted = hook.wait(4).await;
    assert_eq!(posted[3].body, posted[2].body);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_webhook_is_asked_again_under_the_same_number() {
    let folder = tempfile::tempdir().unwrap();
    secret(&folder);
    let hook = Hook::saying(500).await;
    let live = target("webhook", &hook, "live = true");
    let life = Life::begin(&folder, &live, BEGIN_US).await;
    life.hear(1).await;
    life.pass(2 * MINUTE).await;
    let tries = hook.count();
    assert!((3..=5).contains(&tries), "{tries} attempts in two minutes");
    // It dies in the next one.
    hook.now_says(0);
    life.run_free();
    hook.wait(tries + 1).await;
    drop(life);
    hook.now_says(204);
    let life = Life::begin(&folder, &live, BEGIN_US + 7_200_000_000).await;
    life.pass(MINUTE).await;
    assert_eq!((life.states().await, hook.count()), (vec!["sent".to_owned()], tries + 2));
    let posted = hook.wait(tries + 2).await;
    for other in &posted {
        assert_eq!(other.body, posted[0].body);
        assert_eq!(other.header("webhook-id"), posted[0].header("webhook-id"));
        // Of the attempt, and signed anew: who checks takes nothing that is minutes old.
        assert!(other.header("webhook-signature").starts_with("v1,"));
    }
    let seconds =
        |posted: &crate::alerts::catchers::Posted| posted.header("webhook-timestamp").parse::<i64>().unwrap();
    assert!(seconds(&posted[tries + 1]) >= seconds(&posted[0]) + 7_200 - 60);
    assert_ne!(posted[0].header("webhook-signature"), posted[tries + 1].header("webhook-signature"));
    let body: serde_json::Value = serde_json::from_str(&posted[0].body).unwrap();
    assert_eq!(body["id"], posted[0].header("webhook-id"));
    assert_eq!(body["data"]["rssi_dbm"], -107.0);
    assert_eq!(body["data"]["simulated"], true);
    assert_eq!(body["data"]["snr_db"], serde_json::Value::Null);
}

#[tokio::test(flavor = "multi_thread")]
async fn refused_ones_hold_up_nobody_and_a_pause_holds_all() {
    let folder = tempfile::tempdir().unwrap();
    secret(&folder);
    let hook = Hook::saying(400).await;
    let live = target("sids", &hook, "live = true\nper_minute = 600");
    let life = Life::begin(&folder, &live, BEGIN_US).await;
    life.hear(1).await;
    life.pass(MINUTE).await;
    let row = life.rows().await.remove(0);
    assert_eq!((row.state.as_str(), row.attempts), ("refused", 1));
    assert!(row.error.unwrap().contains("400 Bad Request, 'said the catcher'"));
    let anna = Principal::new("anna");
    assert_eq!(life.handle.pause("db", true, &anna).await.unwrap(), Some(true));
    assert_eq!(life.handle.pause("nobody", true, &anna).await.unwrap(), None);
    assert_eq!(life.states().await, ["refused"]);
    hook.now_says(201);
    for id in 2..8 {
        life.hear(id).await;
    }
    life.pass(10 * MINUTE).await;
    assert_eq!(hook.count(), 1);
    life.handle.pause("db", false, &anna).await.unwrap();
    life.pass(MINUTE).await;
    assert_eq!(hook.count(), 7);
    assert_eq!(life.states().await[1..], ["sent"; 6].map(str::to_owned));
    // The far end is busy: nothing is sent twice, nothing is lost, and it is left alone for longer and longer.
    hook.now_says(429);
    life.hear(8).await;
    life.pass(10 * MINUTE).await;
    let tries = hook.count() - 7;
    assert!((4..=8).contains(&tries), "{tries} attempts in ten minutes");
    assert!(life.handle.targets()[0].failing.as_deref().unwrap().contains("429"));
    hook.now_says(201);
    life.pass(60 * MINUTE).await;
    assert_eq!((life.states().await[7].as_str(), hook.count()), ("sent", 8 + tries));
    assert_eq!(life.handle.targets()[0].failing, None);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pause_holds_what_is_in_hand_as_well() {
    let folder = tempfile::tempdir().unwrap();
    secret(&folder);
    let hook = Hook::saying(201).await;
    let life = Life::begin(&folder, &target("sids", &hook, "live = true\nper_minute = 6"), BEGIN_US).await;
    for id in 1..=20 {
        life.hear(id).await;
    }
    life.pass(25).await;
    let sent = hook.count();
    assert!((2..=4).contains(&sent), "{sent}");
    life.handle.pause("db", true, &Principal::new("anna")).await.unwrap();
    life.pass(10 * MINUTE).await;
    assert_eq!(hook.count(), sent);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_target_is_not_told_more_than_it_takes_in_a_minute() {
    let folder = tempfile::tempdir().unwrap();
    secret(&folder);
    let hook = Hook::saying(201).await;
    let life = Life::begin(&folder, &target("sids", &hook, "live = true\nper_minute = 6"), BEGIN_US).await;
    for id in 1..=20 {
        life.hear(id).await;
    }
    life.pass(MINUTE).await;
    assert!((6..=8).contains(&hook.count()), "{} in a minute", hook.count());
    life.pass(5 * MINUTE).await;
    assert_eq!(hook.count(), 20);
    let frames: Vec<_> = hook.wait(20).await.iter().map(|posted| posted.body.clone()).collect();
    assert!(frames[0].starts_with(FIRST) && frames.is_sorted(), "the oldest first");
}
