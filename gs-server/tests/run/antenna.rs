//! The antenna follows: a whole server in scaled time, and the real rotctld of Debian's `libhamlib-utils` with its dummy.

use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use gs_server::clock::{ScaledClock, SystemClock, Timer};
use gs_server::config::{Config, RotatorSection};
use gs_server::hamlib::{Patience, RotatorClient};
use gs_server::plan::{Form, check_text};
use gs_server::run::RunOptions;
use gs_server::storage::EventQuery;
use mission::plan::CheckContext;
use mission::pointing::{Direction, Position, look_at};
use mission::{Intent, PlanName, Principal, SatelliteId, Site, UtcUs};
use tle::formats::{Checksums, sets};
use tle::passes::{Pass, PassFinder, PassSearch};
use tle::{Elements, Propagator};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

use crate::support::{Folder, Server, pause, until};

/// Simulated seconds per second.
const SPEED: f64 = 10.0;
/// The dummy turns by 6 to 7 degrees in one of the machine's seconds.
const DUMMY_DEG_S: f64 = 5.5;
/// A second.
const S: i64 = 1_000_000;

/// rotctld with its dummy rotator.
struct Rotctld {
    child: Child,
    address: String,
}

impl Rotctld {
    async fn start() -> Self {
        let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let child = Command::new("rotctld")
            .args(["-m", "1", "-T", "127.0.0.1", "-t", &port.to_string()])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("rotctld runs (scripts/setup.sh tools installs libhamlib-utils)");
        let daemon = Self { child, address: format!("127.0.0.1:{port}") };
        until("rotctld listens", Duration::from_secs(5), async || {
            tokio::net::TcpStream::connect(&daemon.address).await.is_ok()
        })
        .await;
        daemon
    }

    fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Rotctld {
    fn drop(&mut self) {
        self.kill();
    }
}

fn config(folder: &Folder, rotctld: &Rotctld) -> Config {
    let mut config = folder.strapped();
    config.station.latitude_deg = Some(46.5191);
    config.station.longitude_deg = Some(6.5668);
    config.station.height_m = 410.0;
    config.rotator = Some(RotatorSection {
        address: rotctld.address.clone(),
        azimuth_range: (-180.0, 450.0),
        azimuth_rate_deg_s: DUMMY_DEG_S / SPEED,
        elevation_rate_deg_s: DUMMY_DEG_S / SPEED,
        ..RotatorSection::default()
    });
    config
}

fn elements() -> Elements {
    let text = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9992\n\
                2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";
    sets(text, Checksums::Strict).unwrap().next().unwrap().unwrap().elements
}

/// A low pass that begins in the north: slow enough for the dummy, and not far from where it rests.
fn pass(site: &Site) -> Pass {
    let start: tle::UtcInstant = "2020-07-13T00:00:00Z".parse().unwrap();
    let search = PassSearch::new(start, start.plus_seconds(2.0 * 86_400.0), site.min_elevation_deg);
    let passes = PassFinder::new(&elements()).unwrap().find(std::slice::from_ref(&site.place), &search);
    let starts_north = |pass: &Pass| {
        pass.tca.look.elevation_deg < 25.0
            && !(90.0..=270.0).contains(&pass.aos.look.azimuth_deg)
            && pass.duration_s() > 240.0
    };
    let found = passes.unwrap().stations.remove(0).into_iter().filter(starts_north);
    found.min_by(|a, b| a.tca.look.elevation_deg.total_cmp(&b.tca.look.elevation_deg)).unwrap()
}

async fn start(config: Config, at: UtcUs) -> Server {
    let mut options = RunOptions::new(config);
    options.timer = Some(Arc::new(ScaledClock::starting_at(SPEED, at)));
    Server::start(options).await.unwrap()
}

async fn want(server: &Server, key: &str, intent: Intent) {
    server.ready.engine.intent(Principal::new("test"), key.into(), [7; 32], intent).await.unwrap();
}

async fn give(server: &Server, key: &str, elements: Elements) {
    let satellite = SatelliteId::new("sat").unwrap();
    let source = "a test".to_owned();
    want(server, key, Intent::AddElements { satellite, elements: vec![elements], source }).await;
}

async fn api(server: &Server) -> serde_json::Value {
    let address = server.ready.address;
    let mut stream = tokio::net::TcpStream::connect(address).await.unwrap();
    let request = format!("GET /api/v1/antenna HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    serde_json::from_str(answer.split_once("\r\n\r\n").expect("an answer").1).expect("JSON")
}

/// Waits for an instant of the station.
async fn reach(server: &Server, at: UtcUs) {
    let limit = Duration::from_secs(120);
    until("the time", limit, async || server.ready.timer.now().utc >= at).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_follows_a_pass_by_the_newest_elements_and_parks_when_it_ends() {
    let (folder, rotctld) = (Folder::new(), Rotctld::start().await);
    let config = config(&folder, &rotctld);
    let site = config.station.site().unwrap().unwrap();
    let mount = config.rotator.as_ref().unwrap().mount().unwrap();
    let pass = pass(&site);
    let aos = UtcUs(pass.aos.at.unix_us());
    let server = start(config, aos.plus(-300 * S)).await;
    give(&server, "first", elements()).await;
    let timer: Arc<dyn Timer> = Arc::new(SystemClock::new());
    let mut witness = RotatorClient::connect(&rotctld.address, Patience::default(), &timer).await.unwrap();
    let direction = |elements: &Elements, at: UtcUs| {
        let look = look_at(&Propagator::new(elements).unwrap(), &site, at).unwrap();
        mount.wanted(Direction::new(look.azimuth_deg, look.elevation_deg))
    };

    reach(&server, aos.plus(100 * S)).await;
    let stands = witness.position().await.unwrap().direction();
    let off_deg = stands.angle_deg(direction(&elements(), server.ready.timer.now().utc));
    println!("{:.0} degrees high, {off_deg:.1} degrees off", pass.tca.look.elevation_deg);
    assert!(off_deg < 8.0, "{off_deg}");
    let told = api(&server).await;
    assert_eq!(told["rotator"]["state"], "tracking", "{told}");
    assert_eq!(told["rotator"]["pass"]["satellite"], "sat");
    assert_eq!(told["rotator"]["fault"], serde_json::Value::Null, "{told}");
    assert!(told["rotator"]["target"]["azimuth_deg"].is_number(), "{told}");
    let doppler = &told["doppler"][0];
    assert!(doppler["shift_hz"].is_number() && doppler["offset_hz"].as_f64().unwrap() > 5_000.0, "{told}");
    assert_eq!(server.status().antenna.clone().expect("there is a rotator").fault, None);

    // The satellite is a minute behind what everybody thought.
    let mut later = elements();
    later.epoch = later.epoch.plus_seconds(0.001);
    later.mean_anomaly_deg -= 4.0;
    give(&server, "second", later.clone()).await;
    reach(&server, aos.plus(220 * S)).await;
    let stands = witness.position().await.unwrap().direction();
    let now = server.ready.timer.now().utc;
    let (by_new, by_old) =
        (stands.angle_deg(direction(&later, now)), stands.angle_deg(direction(&elements(), now)));
    println!("{by_new:.1} degrees off by the new elements, {by_old:.1} by the old");
    assert!(by_new < 8.0 && by_old > by_new + 5.0, "{by_new} {by_old}");

    let (took, report) = server.stop().await;
    assert!(took < Duration::from_secs(5) && report.abandoned_tasks == 0, "{took:?}");
    let home = Position { azimuth_deg: 0.0, elevation_deg: 0.0 };
    let before = witness.position().await.unwrap();
    pause(Duration::from_secs(1)).await;
    let after = witness.position().await.unwrap();
    assert!(
        after.way_deg(home) < before.way_deg(home) - 1.0 || after.way_deg(home) < 0.1,
        "{before:?} {after:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rotator_that_dies_is_told_of_before_the_pass() {
    let (folder, mut rotctld) = (Folder::new(), Rotctld::start().await);
    let config = config(&folder, &rotctld);
    let site = config.station.site().unwrap().unwrap();
    let aos = UtcUs(pass(&site).aos.at.unix_us());
    let server = start(config, aos.plus(-420 * S)).await;
    give(&server, "elements", elements()).await;
    let text = "name = \"ear\"\nsatellite = \"sat\"\n[attach]\n[[steps]]\ndo = \"listen\"\nfor_s = 60\n";
    let context = CheckContext { timing: Default::default(), profile: None, pass: None, now: None };
    let checked = check_text(text, Form::Toml, &context);
    let plan = Arc::new(checked.plan.unwrap_or_else(|| panic!("{:?}", checked.findings)));
    want(&server, "plan", Intent::AddPlan { plan, text: text.into() }).await;
    let plan = PlanName::new("ear").unwrap();
    want(&server, "arm", Intent::ArmPlan { plan, armed: true }).await;
    let fault = || server.status().antenna.clone().map(|antenna| antenna.fault);
    let soon = Duration::from_secs(5);
    until("the rotator is well", soon, async || fault() == Some(None)).await;

    rotctld.kill();
    until("the status says that it is not", soon, async || fault().flatten().is_some()).await;
    assert!(server.ready.timer.now().utc < aos.plus(-300 * S), "the machine is too slow for this test");
    let told = async || {
        let events = server.ready.store.events(&EventQuery::default()).await.unwrap();
        events
            .into_iter()
            .map(|event| event.record.message)
            .find(|message| message.starts_with("before the pass"))
    };
    until("the event before the pass", Duration::from_secs(30), async || told().await.is_some()).await;
    let told = told().await.unwrap();
    assert!(told.contains("the rotator:") && told.contains("rotctld"), "{told}");
    let (took, _) = server.stop().await;
    assert!(took < Duration::from_secs(5), "{took:?}");
}
