//! `rotator` and `rig` by the real program, against the real daemons of Debian's `libhamlib-utils` with their dummy models.
//! What the tasks do in a pass, and what they do when a daemon misbehaves, is tested in `gs-server/src/hamlib/tests`.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use end_to_end::process::{gs_server, run};
use end_to_end::wait::{PATIENCE, until};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

struct Daemon {
    child: Child,
    address: String,
}

impl Daemon {
    fn start(program: &str, options: &[&str]) -> Self {
        let port = free_port();
        let child = Command::new(program)
            .args(["-m", "1", "-T", "127.0.0.1", "-t", &port.to_string()])
            .args(options)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|error| {
                panic!("{program}: {error}; scripts/setup.sh tools installs libhamlib-utils")
            });
        let daemon = Self { child, address: format!("127.0.0.1:{port}") };
        let _took =
            until(&format!("{program} listens"), PATIENCE, || TcpStream::connect(&daemon.address).ok());
        daemon
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        let _gone = self.child.kill();
        let _status = self.child.wait();
    }
}

fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("its address").port()
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

fn verb(words: &[&str], address: &str) -> (i32, String, String) {
    let mut command = gs_server(words);
    command.args(["--address", address]);
    run(command)
}

#[test]
fn a_rotator_is_probed_pointed_stopped_and_parked() {
    let daemon = Daemon::start("rotctld", &[]);
    let at = |words: &[&str]| verb(words, &daemon.address);
    let (code, out, err) = at(&["rotator", "probe", "--json"]);
    assert_eq!(code, 0, "{err}");
    let told = json(&out);
    assert_eq!(told["info"], "Dummy rotator");
    assert_eq!(told["limits"]["azimuth_deg"], serde_json::json!([-180.0, 450.0]));
    assert_eq!(told["azimuth_deg"], 0.0);
    let (code, out, err) = at(&["rotator", "point", "20,10", "--json"]);
    assert_eq!(code, 0, "{err}");
    let told = json(&out);
    assert!((told["azimuth_deg"].as_f64().expect("a number") - 20.0).abs() <= 0.5, "arrived: {told}");
    let (code, out, _) = at(&["rotator", "point", "-90,5", "--wait", "0"]);
    assert_eq!((code, out.trim()), (0, "accepted"));
    let (code, out, _) = at(&["rotator", "stop"]);
    assert!(code == 0 && out.starts_with("stopped"), "{out}");
    let stands = || json(&at(&["rotator", "probe", "--json"]).1)["azimuth_deg"].as_f64().expect("a number");
    let first = stands();
    assert!(first > -80.0, "it was stopped on its way: {first}");
    assert!((stands() - first).abs() < 0.05, "and stays");
    let (code, out, _) = at(&["rotator", "park"]);
    assert!(code == 0 && out.starts_with("parks"), "{out}");
}

#[test]
fn positions_outside_the_limits_are_refused_and_nonsense_is_wrong_usage() {
    let daemon = Daemon::start("rotctld", &[]);
    for outside in ["500,10", "10,95", "10,-5"] {
        let (code, out, err) = verb(&["rotator", "point", outside], &daemon.address);
        assert_eq!((code, out.as_str()), (3, ""), "{err}");
        assert!(err.contains("outside the rotator's limits"), "{err}");
    }
    for nonsense in ["180", "nan,5", "180;45", "180,5,45", "inf,0"] {
        let (code, _, err) = verb(&["rotator", "point", nonsense], &daemon.address);
        assert!(code == 2 && err.contains("180,45.5"), "{nonsense}: {code} {err}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("station.toml");
    let config = |rotator: &str| {
        let text = format!(
            "[station]\nname = \"roof\"\n[[satellites]]\nname = \"s\"\n[[links]]\nname = \"l\"\nsatellite = \"s\"\n\
             kind = \"serial\"\nport = \"/dev/null\"\n[storage]\nfolder = \"data\"\n{rotator}"
        );
        std::fs::write(&path, text).expect("a configuration");
        let mut command = gs_server(["rotator", "point", "350,10", "--wait", "0", "--config"]);
        command.arg(&path);
        run(command)
    };
    let address = &daemon.address;
    let (code, _, err) =
        config(&format!("[rotator]\naddress = \"{address}\"\nazimuth_range = [-180, 180]\n"));
    assert!(code == 3 && err.contains("outside the configured range: azimuth -180 to 180"), "{code} {err}");
    let (code, _, err) = config(&format!("[rotator]\naddress = \"{address}\"\n"));
    assert_eq!(code, 0, "{err}");
    let (code, _, err) = config("");
    assert!(code == 2 && err.contains("no section [rotator]"), "{code} {err}");
    let (code, _, err) = config("[rotator]\npark = [999, 0]\n");
    assert!(code == 2 && err.contains("rotator.park"), "{code} {err}");
}

#[test]
fn ctrl_c_stops_a_rotator_on_its_way() {
    let daemon = Daemon::start("rotctld", &[]);
    let mut command = gs_server(["rotator", "point", "400,80", "--address", &daemon.address]);
    let child = command.stdout(Stdio::piped()).spawn().expect("gs-server");
    let stands = || json(&verb(&["rotator", "probe", "--json"], &daemon.address).1)["azimuth_deg"].as_f64();
    let _on_its_way = until("the rotator turns", PATIENCE, || stands().filter(|azimuth| *azimuth > 3.0));
    let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw).expect("a process number");
    kill_process(pid, Signal::INT).expect("a signal");
    let output = child.wait_with_output().expect("its end");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("stopped"));
    let first = stands();
    end_to_end::wait::pause(Duration::from_millis(300));
    assert_eq!(stands(), first, "it stays");
}

#[test]
fn a_rig_is_probed_and_tuned_also_where_commands_name_a_vfo() {
    for options in [&[][..], &["-o"][..]] {
        let daemon = Daemon::start("rigctld", options);
        let (code, out, err) = verb(&["rig", "tune", "437_800_000", "--json"], &daemon.address);
        assert_eq!(code, 0, "{err}");
        assert_eq!(json(&out)["receive_hz"], 437_800_000.0);
        let (code, out, _) = verb(&["rig", "probe"], &daemon.address);
        assert!(code == 0 && out.contains("Nothing much (dummy)") && out.contains("437800000 Hz"), "{out}");
    }
    let (code, _, err) = verb(&["rig", "tune", "-5"], "127.0.0.1:1");
    assert!(code == 2, "{err}");
    let (code, _, err) = verb(&["rig", "tune", "437.8"], "127.0.0.1:1");
    assert!(code == 2 && err.contains("whole Hz"), "{err}");
}

#[test]
fn where_nobody_listens_the_remedy_is_told() {
    for words in [&["rotator", "probe"][..], &["rotator", "stop"], &["rig", "probe"]] {
        let (code, out, err) = verb(words, &format!("127.0.0.1:{}", free_port()));
        assert_eq!((code, out.as_str()), (1, ""));
        assert!(err.contains("is the daemon running") && err.contains("refused"), "{err}");
    }
}
