//! The task and its outboxes on a stepped clock, with a real archive and far ends on real sockets. What the station does
//! is said by the test.

mod delivery;
mod life;

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use mission::alert::{Alert, AlertKind, Condition};
use mission::status::{LinkStatus, StorageStatus};
use mission::{
    Clock as _, Level, LinkConfig, LinkId, LinkState, MonoUs, Profile, SatelliteConfig, SatelliteId,
};
use mission::{StationConfig, StationId, Status, UtcUs};
use radio::airtime::LinkTiming;
use tempfile::TempDir;
use tokio::sync::{mpsc, watch};
use tokio_util::sync::CancellationToken;

use super::catchers::{Hook, Mailbox};
use super::{AlertsHandle, AlertsParts, AlertsTask, Watched};
use crate::clock::{BusyToken, SteppedClock, SteppedOptions, Timer, wall_sleep};
use crate::config::Config;
use crate::engine::EngineHandle;
use crate::hub::Hub;
use crate::lifecycle::Lifecycle;
use crate::storage::{AlertQuery, DeliveryRow, Page, Store, StoreOptions};

/// Noon of some day.
const NOON_US: i64 = 20_000 * 86_400_000_000 + 43_200_000_000;

/// A life of the alerts: dropped, it ends as by kill -9, with nothing done at the end.
struct Life {
    handle: AlertsHandle,
    store: Store,
    clock: Arc<SteppedClock>,
    status: watch::Sender<Arc<Status>>,
    hub: Hub,
    /// The test's hand on the clock.
    hold: Mutex<Option<BusyToken>>,
    runtime: Option<tokio::runtime::Runtime>,
}

impl Drop for Life {
    fn drop(&mut self) {
        // Tasks are cut off where they wait.
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

fn station() -> StationConfig {
    let satellite = SatelliteId::new("sat").unwrap();
    StationConfig {
        station: StationId::new("roof").unwrap(),
        site: None,
        times: Default::default(),
        satellites: vec![SatelliteConfig {
            id: satellite.clone(),
            profile: Profile::default(),
            key: None,
            limits: Vec::new(),
        }],
        links: vec![LinkConfig {
            id: LinkId::new("e22").unwrap(),
            satellite,
            timing: LinkTiming::default(),
            armed: false,
            receive_only: false,
        }],
    }
}

fn status(state: LinkState) -> Status {
    Status {
        station: StationId::new("roof").unwrap(),
        at: mission::Now { mono: MonoUs(0), utc: UtcUs(0) },
        links: vec![LinkStatus {
            link: LinkId::new("e22").unwrap(),
            satellite: SatelliteId::new("sat").unwrap(),
            state,
            armed: false,
            on_air: false,
            frames: 0,
            skipped_bytes: 0,
            bad: 0,
            radiated: 0,
            airtime_us: 0,
            rssi_dbm: None,
        }],
        satellites: Vec::new(),
        sealing: Vec::new(),
        storage: StorageStatus::default(),
        plans: Vec::new(),
        schedule: Arc::default(),
        runs: Vec::new(),
        antenna: None,
    }
}

/// How full the disk of the test's machine is is no matter.
const QUIET_DISK: &str = "[[alerts.rules]]\nkind = \"disk\"\nenabled = false\n";

fn config(folder: &Path, alerts: &str) -> Config {
    let text = format!(
        "[station]\nname = \"roof\"\n[[satellites]]\nname = \"sat\"\n[[links]]\nname = \"e22\"\nsatellite = \"sat\"\n\
         kind = \"tcp\"\nconnect = \"localhost:9\"\nsimulated = true\n[storage]\nfolder = \"data\"\n{alerts}\n{QUIET_DISK}"
    );
    let config = Config::from_toml(&text, folder).unwrap();
    config.check().unwrap();
    config
}

impl Life {
    /// In this folder, with these lines of configuration, from this instant on.
    async fn begin(folder: &TempDir, alerts: &str, utc: UtcUs) -> Self {
        let config = config(folder.path(), alerts);
        let clock = Arc::new(SteppedClock::new(SteppedOptions { utc_at_origin: utc, speed: None }).unwrap());
        let hold = clock.busy("test");
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap();
        let (sender, receiver) = watch::channel(Arc::new(status(LinkState::Ok)));
        let (requests, _) = mpsc::channel(1);
        let (probes, _) = mpsc::channel(1);
        let options = StoreOptions {
            folder: config.storage.folder.clone(),
            station: Some(StationId::new("roof").unwrap()),
            simulated: true,
            postgres: None,
            max_page_count: None,
            reserve_bytes: 0,
        };
        // The folder is free when the tasks of the life before are gone.
        let store = {
            let mut tries = 0;
            loop {
                match Store::open(options.clone()).await {
                    Ok(store) => break store,
                    Err(error) if tries > 200 => panic!("{error}"),
                    Err(_) => tries += 1,
                }
                wall_sleep(Duration::from_millis(20)).await;
            }
        };
        let timer: Arc<dyn Timer> = clock.clone();
        let hub = Hub::new();
        let (task, handle) = AlertsTask::new(AlertsParts {
            config: &config,
            watched: Watched::of(&station()),
            store: store.clone(),
            engine: EngineHandle {
                requests,
                probes,
                metrics: Default::default(),
                status: receiver,
                timer: Arc::clone(&timer),
            },
            hub: hub.clone(),
            timer,
        })
        .unwrap();
        let stop = CancellationToken::new();
        {
            let _inside = runtime.enter();
            task.spawn(&Lifecycle::new(&stop));
        }
        let hold = Mutex::new(Some(hold));
        Self { handle, store, clock, status: sender, hub, hold, runtime: Some(runtime) }
    }

    /// The station's status is another, and says so as the engine does.
    fn show(&self, status: Status) {
        self.status.send_replace(Arc::new(status));
        self.hub.ring();
    }

    fn report(&self, level: Level) {
        let message = format!("the backup failed: {level}");
        let condition = Condition::new(AlertKind::Backup, "nightly", level, message);
        self.handle.report("backup", Some(condition));
    }

    fn now(&self) -> UtcUs {
        self.clock.now().utc
    }

    /// Lets so much simulated time pass; else it stands still.
    async fn pass(&self, seconds: u64) {
        let until = self.clock.now().mono.plus(seconds * 1_000_000);
        let sleep = self.clock.sleep_until(until);
        self.run_free();
        let token = sleep.await;
        *self.hold.lock().unwrap() = Some(token);
    }

    /// Lets time pass until somebody else holds it.
    fn run_free(&self) {
        let hold = self.hold.lock().unwrap().take();
        drop(hold);
    }

    async fn alerts(&self) -> Vec<Alert> {
        self.store.alerts(&AlertQuery::default()).await.unwrap()
    }

    /// Oldest first.
    async fn deliveries(&self) -> Vec<DeliveryRow> {
        let mut rows = self.store.deliveries(None, &Page::default()).await.unwrap();
        rows.reverse();
        rows
    }
}

/// A file that only its owner can read.
fn secret_file(folder: &TempDir, name: &str, secret: &str) {
    use std::io::Write as _;
    use std::os::unix::fs::OpenOptionsExt as _;
    let mut options = std::fs::OpenOptions::new();
    let file = options.write(true).create(true).truncate(true).mode(0o600).open(folder.path().join(name));
    writeln!(file.unwrap(), "{secret}").unwrap();
}

/// A webhook whose key stands in the folder.
fn webhook(folder: &TempDir, name: &str, hook: &Hook) -> String {
    secret_file(folder, "hook.key", "correct horse battery staple");
    format!(
        "[[alerts.targets]]\nname = \"{name}\"\nkind = \"webhook\"\nurl = \"{}\"\nsecret_file = \"hook.key\"\n",
        hook.url
    )
}

fn mail(name: &str, mailbox: &Mailbox) -> String {
    format!(
        "[[alerts.targets]]\nname = \"{name}\"\nkind = \"email\"\nserver = \"{}\"\nsecurity = \"none\"\n\
         from = \"ground@example.org\"\nto = [\"ops@example.org\"]\n",
        mailbox.address
    )
}

/// An error that the satellite reports, as the engine would keep it.
fn event(at: UtcUs, level: Level, message: &str) -> mission::Batch {
    use mission::record::{EventKind, EventRecord, Record, Subject};
    let record = Record::Event(EventRecord {
        at,
        kind: EventKind::SatelliteError,
        level,
        satellite: Some(SatelliteId::new("sat").unwrap()),
        station: StationId::new("roof").unwrap(),
        link: None,
        key: None,
        subject: Subject::default(),
        message: message.to_owned(),
    });
    mission::Batch { id: mission::BatchId(1), records: vec![record] }
}
