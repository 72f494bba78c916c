//! The real daemons, rotctld and rigctld of Debian's `libhamlib-utils` with their dummy models, through a whole pass.

use std::process::{Child, Command, Stdio};
use std::time::Duration;

use mission::pointing::Position;

use super::*;
use crate::clock::{ScaledClock, SystemClock, wall_sleep};
use crate::config::{RigSection, RotatorSection};

struct Real {
    child: Child,
    address: String,
}

impl Real {
    async fn start(program: &str, options: &[&str]) -> Self {
        // Somebody else may take the port between the look and the daemon's start: the daemon then ends at once.
        for _ in 0..10 {
            let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
            let child = Command::new(program)
                .args(["-m", "1", "-T", "127.0.0.1", "-t", &port.to_string()])
                .args(options)
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap_or_else(|error| {
                    panic!("{program}: {error}; install libhamlib-utils (scripts/setup.sh tools)")
                });
            let mut daemon = Self { child, address: format!("127.0.0.1:{port}") };
            if daemon.listens(port).await {
                return daemon;
            }
        }
        panic!("{program} does not listen");
    }

    /// Waits until this very process listens at the port; false when it ended. Nothing connects: a daemon opens its device for the
    /// first that connects and closes it behind the last, which would meet the test's own connection.
    async fn listens(&mut self, port: u16) -> bool {
        let place = format!("0100007F:{port:04X}");
        for _ in 0..3_000 {
            if self.child.try_wait().unwrap().is_some() {
                return false;
            }
            let table = std::fs::read_to_string("/proc/net/tcp").unwrap();
            let is_there = |line: &str| {
                let mut words = line.split_whitespace().skip(1);
                words.next() == Some(&place) && words.nth(1) == Some("0A")
            };
            let listens = table.lines().any(is_there);
            wall_sleep(Duration::from_millis(10)).await;
            if listens {
                return self.child.try_wait().unwrap().is_none();
            }
        }
        false
    }
}

impl Drop for Real {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A loaded machine may keep a daemon waiting: what is tested is what it says, not how soon.
fn patience() -> Patience {
    Patience { reply: Duration::from_secs(10), ..Patience::default() }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn rotctld_and_rigctld_are_driven_through_a_whole_pass() {
    /// Simulated seconds per second.
    const SPEED: f64 = 20.0;
    /// The dummy turns by 6 to 7 degrees in one of the machine's.
    const DUMMY_DEG_S: f64 = 5.5;
    let (rotctld, rigctld) = tokio::join!(Real::start("rotctld", &[]), Real::start("rigctld", &[]));
    // A low pass is slow enough for the dummy, and one that begins near north needs no long way.
    let starts_north = |pass: &Pass| {
        let azimuth = pass.aos.look.azimuth_deg;
        pass.tca.look.elevation_deg < 25.0 && !(90.0..=270.0).contains(&azimuth) && pass.duration_s() > 240.0
    };
    let pass = passes()
        .into_iter()
        .filter(starts_north)
        .min_by(|a, b| a.tca.look.elevation_deg.total_cmp(&b.tca.look.elevation_deg))
        .unwrap();
    let tracking = tracking(&pass);
    let timer: Arc<dyn Timer> = Arc::new(ScaledClock::starting_at(SPEED, tracking.aos.plus(-380_000_000)));
    let rotator = RotatorSection {
        address: rotctld.address.clone(),
        azimuth_range: (-180.0, 450.0),
        azimuth_rate_deg_s: DUMMY_DEG_S / SPEED,
        elevation_rate_deg_s: DUMMY_DEG_S / SPEED,
        ..RotatorSection::default()
    };
    let rig = RigSection {
        address: rigctld.address.clone(),
        downlink_hz: 437_800_000,
        uplink_hz: Some(145_990_000),
        resolution_hz: 10,
        step_hz: 50,
        reply_timeout_ms: 2_000,
    };
    let (handle, tasks) = antenna(Some(&rotator), Some(&rig), &timer).unwrap();
    let stop = CancellationToken::new();
    let tasks: Vec<_> = tasks.into_iter().map(|task| tokio::spawn(task.run(stop.clone()))).collect();
    handle.track(tracking.clone());
    let witness_timer: Arc<dyn Timer> = Arc::new(SystemClock::new());
    let mut witness = RotatorClient::connect(&rotctld.address, patience(), &witness_timer).await.unwrap();
    let mut ear = RigClient::connect(&rigctld.address, patience(), &witness_timer).await.unwrap();
    let mount = rotator.mount().unwrap();
    let (mut worst_deg, mut worst_at_s, mut worst_hz, mut samples) = (0.0_f64, 0, 0.0_f64, 0);
    while timer.now().utc < tracking.los {
        wall_sleep(Duration::from_millis(50)).await;
        let position = witness.position().await.unwrap();
        let now = timer.now().utc;
        if now < tracking.aos.plus(5_000_000) || now > tracking.los {
            continue;
        }
        let off_deg = position.direction().angle_deg(mount.wanted(direction(now)));
        if off_deg > worst_deg {
            (worst_deg, worst_at_s) = (off_deg, (now.0 - tracking.aos.0) / 1_000_000);
        }
        let rate = look_at(&Propagator::new(&elements()).unwrap(), &site(), now).unwrap().range_rate_km_s;
        let heard = ear.reading().await.unwrap();
        worst_hz = worst_hz.max((heard.receive_hz - tle::doppler::received_hz(437.8e6, rate)).abs());
        samples += 1;
    }
    let status = handle.status();
    println!(
        "pass of {:.0} degrees, {:.0} s; {samples} looks, at worst {worst_deg:.2} degrees (after {worst_at_s} s) and {worst_hz:.0} Hz off; {} and {} commands; {:?}",
        pass.tca.look.elevation_deg,
        pass.duration_s(),
        status.rotator.as_ref().unwrap().commands,
        status.rig.as_ref().unwrap().commands,
        status.rotator.as_ref().unwrap().trouble,
    );
    assert!(samples > 50, "{samples}");
    // Dead band, and what happens in two seconds of a pass that lasts a twentieth of its time; a loaded machine adds to it.
    assert!(worst_deg < 6.0, "{worst_deg}");
    assert!(worst_hz < 1_000.0, "{worst_hz}");
    assert_eq!(status.rotator.unwrap().info.as_deref(), Some("Dummy rotator"));
    assert!(status.rig.unwrap().commands > 50);
    stop.cancel();
    for task in tasks {
        task.await.unwrap();
    }
    assert_eq!(ear.reading().await.unwrap().receive_hz, 437_800_000.0);
    let first = witness.position().await.unwrap();
    wall_sleep(Duration::from_millis(500)).await;
    let then = witness.position().await.unwrap();
    let home = Position { azimuth_deg: 0.0, elevation_deg: 0.0 };
    assert!(
        then.way_deg(home) < first.way_deg(home) || then.way_deg(home) < 0.1,
        "on its way home: {first:?} {then:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_traps_of_the_real_rotctld() {
    let rotctld = Real::start("rotctld", &[]).await;
    let timer: Arc<dyn Timer> = Arc::new(SystemClock::new());
    let quick = Patience { reply: Duration::from_millis(300), ..Patience::default() };
    let mut connection = connection::Connection::open(&rotctld.address, quick, &timer).await.unwrap();
    let error = connection.ask("nosuch", "").await.unwrap_err();
    assert!(matches!(error, HamlibError::Silent { .. }), "no reply to an unknown command: {error}");
    assert!(connection.ask("get_pos", "").await.is_err(), "and the connection is not used again");
    let mut connection = connection::Connection::open(&rotctld.address, quick, &timer).await.unwrap();
    assert!(
        connection.ask("set_pos", "nan 5").await.is_ok(),
        "nan is answered by RPRT 0; which is why none is sent"
    );
    let mut client = RotatorClient::connect(&rotctld.address, quick, &timer).await.unwrap();
    assert_eq!(client.limits().unwrap().azimuth_deg, (-180.0, 450.0));
    client.stop().await.unwrap();
    let nan = Position { azimuth_deg: f64::NAN, elevation_deg: 5.0 };
    assert!(client.set_position(nan).await.is_err());
    let mut connection = connection::Connection::open(&rotctld.address, quick, &timer).await.unwrap();
    let error = connection.ask("set_pos", "999.00 10.00").await.unwrap_err();
    assert!(matches!(error, HamlibError::Refused { code: -1, .. }), "{error}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_traps_of_the_real_rigctld() {
    let timer: Arc<dyn Timer> = Arc::new(SystemClock::new());
    for options in [&[][..], &["-o"][..]] {
        let rigctld = Real::start("rigctld", options).await;
        let mut client = RigClient::connect(&rigctld.address, patience(), &timer).await.unwrap();
        assert_eq!(client.names_vfo(), !options.is_empty());
        assert_eq!(client.info(), Some("Nothing much (dummy)"));
        assert_eq!(client.tune(435_010_000, 10).await.unwrap(), 435_010_000.0);
        assert_eq!(client.reading().await.unwrap().receive_hz, 435_010_000.0);
    }
    let rigctld = Real::start("rigctld", &[]).await;
    let mut connection = connection::Connection::open(&rigctld.address, patience(), &timer).await.unwrap();
    assert!(connection.ask("set_freq", "nan").await.is_ok(), "as rotctld does");
    let mut client = RigClient::connect(&rigctld.address, patience(), &timer).await.unwrap();
    let error = client.reading().await.unwrap_err();
    assert!(matches!(error, HamlibError::Malformed { .. }), "a negative frequency is read back: {error}");
}
