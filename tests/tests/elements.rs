//! Elements from the command line, without a server and beside one; sources that count who asks.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener};

use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use end_to_end::process::{gs_server, run};
use end_to_end::wait::{PATIENCE, until};
use end_to_end::{Folder, Server};
use serde_json::Value;

/// A set of our satellite (it is called `sat`) with this epoch.
fn sat(epoch: &str) -> String {
    format!(
        r#"{{"OBJECT_NAME":"SAT","OBJECT_ID":"2026-101C","EPOCH":"{epoch}","MEAN_MOTION":15.2,"ECCENTRICITY":0.001,
        "INCLINATION":97.4,"RA_OF_ASC_NODE":10,"ARG_OF_PERICENTER":20,"MEAN_ANOMALY":30,"EPHEMERIS_TYPE":0,
        "CLASSIFICATION_TYPE":"U","NORAD_CAT_ID":100123,"ELEMENT_SET_NO":999,"REV_AT_EPOCH":7,"BSTAR":0.0001,
        "MEAN_MOTION_DOT":0.00001,"MEAN_MOTION_DDOT":0}}"#
    )
}

fn group(epoch: &str) -> String {
    let stranger = sat(epoch).replace("100123", "100124").replace("SAT", "STRANGER");
    format!("[{stranger},{}]", sat(epoch))
}

/// `elements VERB --config … ARGUMENTS`: exit code, standard output, standard error.
fn elements(folder: &Folder, verb: &str, arguments: &[&str]) -> (i32, String, String) {
    let mut command = gs_server(["elements", verb, "--config"]);
    command.arg(folder.write_config()).args(arguments);
    run(command)
}

fn check(text: &str, arguments: &[&str]) -> (i32, String, String) {
    let folder = Folder::new();
    let file = folder.file("elements");
    std::fs::write(&file, text).expect("a file");
    let mut command = gs_server(["elements", "check"]);
    command.arg(file).args(arguments);
    run(command)
}

fn json((code, out, error): (i32, String, String)) -> Value {
    assert_eq!(code, 0, "{out}{error}");
    assert_eq!(out.lines().count(), 1, "{out}");
    serde_json::from_str(&out).expect("JSON")
}

fn file(folder: &Folder, name: &str, text: &str) -> String {
    let path = folder.file(name);
    std::fs::write(&path, text).expect("a file");
    path.display().to_string()
}

/// A source that counts; with no answer it keeps who asks waiting.
struct Source {
    address: SocketAddr,
    asked: Arc<AtomicUsize>,
}

impl Source {
    fn new(answer: Option<String>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let (address, asked) = (listener.local_addr().expect("an address"), Arc::new(AtomicUsize::new(0)));
        let count = Arc::clone(&asked);
        std::thread::spawn(move || {
            let mut kept = Vec::new();
            for stream in listener.incoming() {
                let Ok(mut stream) = stream else { return };
                let mut request = [0; 4096];
                let _ = stream.read(&mut request);
                count.fetch_add(1, Ordering::SeqCst);
                match &answer {
                    Some(answer) => drop(stream.write_all(answer.as_bytes())),
                    None => kept.push(stream),
                }
            }
        });
        Self { address, asked }
    }

    fn saying(status: &str, body: &str) -> Self {
        Self::new(Some(format!(
            "HTTP/1.1 {status}\r\ncontent-length: {}\r\nconnection: close\r\n\r\n{body}",
            body.len()
        )))
    }

    fn count(&self) -> usize {
        self.asked.load(Ordering::SeqCst)
    }

    fn section(&self) -> String {
        format!("[elements]\nfetch = [\"http://{}/gp.php?GROUP=x\"]\n", self.address)
    }
}

#[test]
fn elements_are_added_and_listed_without_a_server_and_beside_one_by_the_same_road() {
    let mut folder = Folder::new();
    folder.storage = "reserve_bytes = 65536\n".to_owned();
    let first = file(&folder, "first.json", &group("2026-11-20T00:00:00"));
    let report = json(elements(&folder, "add", &[&first, "--json"]));
    assert_eq!(
        (&report["satellites"][0]["added"], &report["satellites"][0]["of_others"]),
        (&1.into(), &1.into())
    );
    let (code, out, _) = elements(&folder, "add", &[&first]);
    assert_eq!(
        (code, out.as_str()),
        (0, "sat: 0 added, 1 held already, newest epoch 2026-11-20T00:00:00.000000Z\n")
    );

    let server = Server::start(&folder);
    let second = file(&folder, "second.json", &group("2026-11-21T00:00:00"));
    let report = json(elements(&folder, "add", &[&second, "--json"]));
    assert_eq!(report["satellites"][0]["added"], 1);
    let beside = json(elements(&folder, "list", &["--json"]));
    assert_eq!(beside["elements"].as_array().expect("a list").len(), 2);
    assert_eq!(beside["elements"][0]["source"], "file second.json");
    assert_eq!(beside["elements"][0]["added_by"], "local");
    let events = server.client.get("/api/v1/events?limit=1000").expect("an answer").text();
    assert!(events.contains("file second.json"), "{events}");
    server.stop();

    let alone = json(elements(&folder, "list", &["--json", "--satellite", "sat"]));
    let ids = |list: &Value| {
        list["elements"].as_array().map(|all| all.iter().map(|e| e["id"].clone()).collect::<Vec<_>>())
    };
    assert_eq!(ids(&alone), ids(&beside));
    let (code, out, _) = elements(&folder, "list", &["--limit", "1"]);
    assert!(code == 0 && out.lines().count() == 2 && out.contains("100123"), "{out}");
}

#[test]
fn what_fits_no_satellite_or_several_is_told_and_nothing_is_added() {
    let folder = Folder::new();
    let two = format!(
        "[{},{}]",
        sat("2026-11-20T00:00:00"),
        sat("2026-11-20T00:00:00").replace("100123", "100124")
    );
    let none = sat("2026-11-20T00:00:00").replace("\"SAT\"", "\"OBJECT C\"");
    for (name, text, arguments, code, says) in [
        ("two", two.as_str(), &[][..], 1, "norad_cat_id"),
        ("none", none.as_str(), &[], 1, "'sat' is not among the 1 sets"),
        ("html", "<html><title>Sorry</title></html>", &[], 1, "web page"),
        ("empty", "", &[], 1, "empty"),
        ("unknown", none.as_str(), &["--satellite", "sputnik"], 2, "there is sat"),
    ] {
        let path = file(&folder, name, text);
        let (got, out, error) = elements(&folder, "add", &[&[path.as_str()][..], arguments].concat());
        assert_eq!((got, out.as_str()), (code, ""), "{name}: {error}");
        assert!(error.contains(says) && error.lines().count() == 1, "{name}: {error}");
    }
    let (code, _, error) = elements(&folder, "add", &["/nowhere/gp.json"]);
    assert!(code == 1 && error.contains("/nowhere/gp.json cannot be opened"), "{error}");
    // An operator who names the satellite is believed.
    let path = file(&folder, "chosen", &none);
    let report = json(elements(&folder, "add", &[&path, "--satellite", "sat", "--json"]));
    assert_eq!(report["satellites"][0]["added"], 1);
    let (code, _, error) = elements(&folder, "fetch", &[]);
    assert!(code == 2 && error.contains("[elements]"), "{error}");
}

#[test]
fn a_source_is_asked_once_by_verb_and_server_together_and_after_a_kill() {
    let source = Source::saying("200 OK", &group("2026-11-21T12:00:00"));
    let mut folder = Folder::new();
    folder.storage = source.section();
    let report = json(elements(&folder, "fetch", &["--json"]));
    assert_eq!(report["sources"][0]["outcome"], "downloaded", "{report}");
    assert_eq!(report["sources"][0]["added"][0]["added"], 1, "{report}");
    let (code, out, _) = elements(&folder, "fetch", &[]);
    assert!(code == 0 && out.contains("sources block who asks more often"), "{out}");
    let server = Server::start(&folder);
    let report = json(elements(&folder, "fetch", &["--json"]));
    assert_eq!(report["sources"][0]["outcome"], "too-early", "{report}");
    server.stop();
    assert_eq!(source.count(), 1);
    let listed = json(elements(&folder, "list", &["--json"]));
    assert_eq!(
        (&listed["sources"][0]["state"], &listed["elements"][0]["added_by"]),
        (&"good".into(), &"fetch".into())
    );

    // Killed while it waits for an answer: that was a request, too.
    let silent = Source::new(None);
    let mut folder = Folder::new();
    folder.storage = silent.section();
    let mut server = Server::start(&folder);
    until("the source is asked", PATIENCE, || (silent.count() == 1).then_some(()));
    server.process.kill9();
    let server = Server::start(&folder);
    let report = json(elements(&folder, "fetch", &["--json"]));
    assert_eq!(report["sources"][0]["outcome"], "too-early", "{report}");
    server.stop();
    assert_eq!(silent.count(), 1);
}

#[test]
fn a_source_that_refuses_is_named_with_the_remedy_and_left_alone() {
    let source = Source::saying("404 Not Found", "no such page");
    let mut folder = Folder::new();
    folder.storage = source.section();
    let (code, out, error) = elements(&folder, "fetch", &[]);
    assert!(code == 1 && out.contains("404") && out.contains("look at the address"), "{out}{error}");
    let (code, out, _) = elements(&folder, "list", &[]);
    assert!(code == 0 && out.contains("STOPPED") && out.contains("not asked again by itself"), "{out}");
    let server = Server::start(&folder);
    let (_, out, _) = elements(&folder, "fetch", &[]);
    assert!(out.contains("may be asked again at"), "{out}");
    server.stop();
    assert_eq!(source.count(), 1);
}

#[test]
fn check_says_what_is_in_a_file_and_what_is_wrong_with_it() {
    let good = group("2026-11-20T00:00:00");
    let (code, out, _) = check(&good, &[]);
    assert!(
        code == 0
            && out.contains("STRANGER 100124")
            && out.ends_with("2 sets of 2 objects (OMM JSON), 0 with warnings, 0 broken\n"),
        "{out}"
    );
    let broken = good.replacen("\"MEAN_MOTION\":15.2", "\"MEAN_MOTION\":0", 1);
    let (code, out, _) = check(&broken, &[]);
    assert!(
        code == 1 && out.contains("BROKEN line") && out.contains("MEAN_MOTION") && out.contains("1 broken"),
        "{out}"
    );
    let (code, out, _) = check(&broken, &["--json"]);
    let verdict: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(
        (code, &verdict["ok"], &verdict["summary"]["sets"], &verdict["summary"]["broken"]),
        (1, &false.into(), &1.into(), &1.into())
    );
    let xp = good.replace("\"EPHEMERIS_TYPE\":0", "\"EPHEMERIS_TYPE\":4");
    let (code, out, _) = check(&xp, &[]);
    assert!(code == 1 && out.contains("not for SGP4"), "{out}");
    let tle = "1 25544U 98067A   20194.88612269 -.00002218  00000-0 -31515-4 0  9993\n\
        2 25544  51.6461 221.2784 0001413  89.1723 280.4612 15.49507896236008\n";
    let (code, out, _) = check(tle, &[]);
    assert!(code == 1 && out.contains("checksum of TLE line 1 is 3, but the line adds up to 2"), "{out}");
    let (code, out, _) = check(tle, &["--lenient"]);
    assert!(code == 0 && out.contains("odd:") && out.contains("1 with warnings"), "{out}");
    for (text, says) in [
        ("<!DOCTYPE html><html>", "web page"),
        ("", "empty"),
        ("{\"error\":\"x\"}", "message"),
        ("hello", "no form"),
    ] {
        let (code, out, error) = check(text, &["--json"]);
        assert_eq!((code, out.as_str()), (1, ""), "{error}");
        assert!(error.contains(says) && error.lines().count() == 1, "{error}");
    }
}

#[test]
fn elements_before_launch_come_from_a_state_vector_and_follow_a_delay() {
    let state = "6878.14,0,0,0,0.995,7.547";
    let make = |arguments: &[&str]| {
        let mut command = gs_server(["elements", "prelaunch", "--satellite", "sat"]);
        command.args(arguments);
        run(command)
    };
    let nominal = make(&["--epoch", "2026-12-01T10:00:00Z", "--state", state]);
    let set: Value = serde_json::from_str(&nominal.1).expect("JSON");
    let folder = Folder::new();
    let path = file(&folder, "nominal.json", &nominal.1);
    let later: Value =
        serde_json::from_str(&make(&["--elements", &path, "--delay", "1800"]).1).expect("JSON");
    let number = |set: &Value, key: &str| set[0][key].as_f64().expect("a number");
    assert_eq!(later[0]["EPOCH"], "2026-12-01T10:30:00.000000");
    let turned = (number(&later, "RA_OF_ASC_NODE") - number(&set, "RA_OF_ASC_NODE")).rem_euclid(360.0);
    assert!((turned - 7.5205).abs() < 1e-3, "{turned}");

    let (code, out, error) = elements(
        &folder,
        "prelaunch",
        &["--satellite", "sat", "--epoch", "2026-12-01T10:00:00Z", "--state", state],
    );
    assert_eq!(
        (code, out.as_str()),
        (0, "sat: 1 added, 0 held already, newest epoch 2026-12-01T10:00:00.000000Z\n"),
        "{error}"
    );
    let listed = json(elements(&folder, "list", &["--json"]));
    assert_eq!(listed["elements"][0]["source"], "prelaunch");

    for (arguments, code, says) in [
        (&["--epoch", "2026-12-01T10:00:00Z", "--state", "1,2,3,4,5"][..], 2, "six"),
        (&["--epoch", "2026-12-01T10:00:00Z", "--state", "7000,0,0,0,12,0"], 1, "no closed orbit"),
        (&["--epoch", "2026-12-01T10:00:00Z", "--state", "6400,0,0,0,5,0"], 1, "comes down again"),
        (&["--epoch", "tomorrow", "--state", state], 2, "tomorrow"),
        (&["--state", state], 2, "--epoch"),
        (&["--elements", "/nowhere", "--delay", "5"], 1, "/nowhere"),
        (&["--elements", &path, "--delay", "1e9"], 2, "30 days"),
        (&[], 2, "--state"),
    ] {
        let (got, out, error) = make(arguments);
        assert_eq!((got, out.as_str()), (code, ""), "{arguments:?}: {error}");
        assert!(error.contains(says), "{arguments:?}: {error}");
    }
}

#[test]
fn standard_input_is_a_file_too() {
    let mut command = gs_server(["elements", "check", "-"]);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("it starts");
    child.stdin.take().expect("a pipe").write_all(group("2026-11-20T00:00:00").as_bytes()).expect("written");
    let output = child.wait_with_output().expect("its end");
    assert!(output.status.success(), "{output:?}");
}
