//! `plan add|list|arm|…`, `schedule` and `runs` with a server that runs, and without one.

use std::fs;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Stdio};

use mission::Clock as _;
use serde_json::Value;

use super::{gs_server, json, run};

struct Station {
    config: String,
    plan: String,
    folder: tempfile::TempDir,
    server: Option<Child>,
}

impl Drop for Station {
    fn drop(&mut self) {
        if let Some(server) = &mut self.server {
            let _gone = server.kill();
            let _status = server.wait();
        }
    }
}

impl Station {
    /// A station with a place and elements from an hour ago; its radio is not there.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name).display().to_string();
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let text = format!(
            r#"
            [station]
            name = "test"
            clock = "trust"
            latitude_deg = 46.5
            longitude_deg = 6.6
            [http]
            listen = "127.0.0.1:{port}"
            [[satellites]]
            name = "pixelsat-1"
            key_file = "a.key"
            norad_cat_id = 25544
            [[links]]
            name = "e22"
            satellite = "pixelsat-1"
            kind = "serial"
            port = "absent"
            [storage]
            folder = "data"
            "#
        );
        assert_eq!(run(["key", "new", &file("a.key")]).0, 0);
        fs::write(file("station.toml"), text).unwrap();
        fs::write(file("gp.json"), omm()).unwrap();
        let station = Self { config: file("station.toml"), plan: file("plan.toml"), folder, server: None };
        let gp = station.folder.path().join("gp.json").display().to_string();
        let (code, _, error) = station.verb(&["elements", "add", &gp]);
        assert_eq!(code, 0, "{error}");
        station
    }

    fn verb(&self, words: &[&str]) -> (i32, String, String) {
        run(words.iter().copied().chain(["--config", self.config.as_str()]))
    }

    fn done(&self, words: &[&str]) -> String {
        let (code, out, error) = self.verb(words);
        assert_eq!(code, 0, "{words:?}: {out}{error}");
        out
    }

    fn json(&self, words: &[&str]) -> Value {
        json(&self.done(&[words, &["--json"]].concat()))
    }

    fn serve(&mut self) {
        let mut command = gs_server(["serve", "--log", "error", "--config", self.config.as_str()]);
        self.server = Some(command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
        self.until("it answers", || self.verb(&["plan", "list"]).0 == 0);
    }

    /// Each look is a process of its own, so this waits some ten seconds at least.
    fn until(&self, what: &str, holds: impl Fn() -> bool) {
        assert!((0..500).any(|_| holds()), "never: {what} ({})", self.folder.path().display());
    }

    fn write_plan(&self, template: &str) {
        let (code, text, _) = run(["plan", "new", "--template", template]);
        assert_eq!(code, 0);
        fs::write(Path::new(&self.plan), text).unwrap();
    }
}

fn omm() -> String {
    let now = gs_server::clock::SystemClock::new().now().utc.0;
    let epoch = api::FineTime::from_unix_us(now - 3_600_000_000).to_string();
    serde_json::json!([{
        "OBJECT_NAME": "PIXELSAT", "OBJECT_ID": "1998-067A", "NORAD_CAT_ID": 25_544,
        "EPOCH": epoch.trim_end_matches('Z'), "MEAN_MOTION": 15.495, "ECCENTRICITY": 0.0001413,
        "INCLINATION": 51.6461, "RA_OF_ASC_NODE": 221.2784, "ARG_OF_PERICENTER": 89.1723, "MEAN_ANOMALY": 280.4612,
        "BSTAR": 0.00003,
    }])
    .to_string()
}

#[test]
fn a_plan_is_added_attached_armed_scheduled_and_withdrawn() {
    let mut station = Station::new();
    station.serve();
    station.write_plan("status");
    let plan = station.plan.clone();
    assert!(station.done(&["plan", "add", &plan]).starts_with("plan status for pixelsat-1 is in use"));
    station.until("it is listed", || station.json(&["plan", "list"])["plans"][0]["name"] == "status");
    assert_eq!(station.json(&["plan", "list"])["plans"][0]["armed"], false);
    let attach = ["plan", "attach", "status", "--next"];
    station.until("it knows passes", || station.verb(&attach).0 == 0);
    let said = station.done(&attach);
    assert!(said.starts_with("plan status is attached to the pass at 20"), "{said}");
    station.until("it is scheduled", || {
        station.json(&["schedule"])["contacts"].as_array().is_some_and(|contacts| !contacts.is_empty())
    });
    assert!(station.done(&["schedule"]).contains("not armed"));
    assert_eq!(station.done(&["plan", "arm", "status"]), "plan status is armed\n");
    station.until("a run is planned", || station.json(&["runs"])["runs"][0]["state"] == "planned");
    let list = station.done(&["plan", "list"]);
    assert!(list.contains("by its rule; chosen: 20"), "{list}");
    assert!(station.done(&["schedule"]).contains("an operator chose it for the plan"));
    let report = station.json(&["runs", "1"]);
    assert_eq!((&report["run"]["name"], &report["steps"]), (&"status".into(), &serde_json::json!([])));
    assert!(station.done(&["runs", "1"]).contains("heard: 0 frames"));

    station.done(&["plan", "disarm", "status"]);
    station.until("its runs are dropped", || station.json(&["runs"])["runs"][0]["state"] == "dropped");
    assert!(station.done(&["runs"]).contains("disarmed"));
    station.done(&["plan", "detach", "status", "--next"]);
    station.done(&["plan", "withdraw", "status"]);
    station.until("it is gone", || station.json(&["plan", "list"])["plans"] == serde_json::json!([]));

    // What does not work says why, with the code that goes with it.
    for (words, code, says) in [
        (&["plan", "arm", "status"][..], 3, "there is no plan 'status'"),
        (&["plan", "attach", "status", "--next"], 3, "there is no plan 'status'"),
        (&["plan", "arm", "No Name"], 2, "plan:"),
        (&["plan", "attach", "status"], 2, "--at"),
        (&["runs", "99999"], 3, "There is no run 99999"),
        (&["hold", "pixelsat-1"], 3, "no plan runs for pixelsat-1"),
        (&["release", "pixelsat-1"], 3, "no plan runs for pixelsat-1"),
        (&["hold", "nobody"], 3, "nobody"),
        (&["hold", "../plans"], 2, "satellite:"),
    ] {
        let (found, out, error) = station.verb(words);
        assert_eq!((found, out.as_str()), (code, ""), "{words:?}: {error}");
        assert!(error.contains(says), "{words:?}: {error}");
    }
}

#[test]
fn without_a_server_the_verbs_say_how_to_start_one() {
    let station = Station::new();
    station.write_plan("status");
    let plan = station.plan.clone();
    for words in
        [&["plan", "add", &plan][..], &["plan", "list"], &["schedule"], &["runs"], &["hold", "pixelsat-1"]]
    {
        let (code, out, error) = station.verb(words);
        assert_eq!((code, out.as_str()), (1, ""), "{words:?}: {error}");
        assert!(
            error.contains("no server answers at http://127.0.0.1:") && error.contains("gs-server serve"),
            "{error}"
        );
    }
    fs::write(&plan, fs::read_to_string(&plan).unwrap().replace("wait-for", "wait")).unwrap();
    let (code, _, error) = station.verb(&["plan", "add", &plan]);
    assert_eq!(code, 2, "{error}");
    assert!(error.contains("'wait' is no step") && error.contains("the plan is not taken"), "{error}");
}
