//! Clients of the API from outside: a crowd at the stream, and the example in Python.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::process::{Command, Stdio};

use end_to_end::binary::workspace;
use end_to_end::crowd::{Load, run as crowd};
use end_to_end::process::{Process, gs_server, run};
use end_to_end::wait::{PATIENCE, until};

/// A busy machine and a build that is not optimised may take ten times as long as the promise.
const SLACK: f64 = 10.0;

#[test]
fn a_crowd_at_the_stream_misses_nothing_and_disturbs_nobody() {
    let figures = crowd(Load { followers: 60, stalled: 10, hostile: 10, frames_per_s: 20, seconds: 8 });
    println!("{figures}");
    assert_eq!(figures.archived, figures.frames, "{figures}");
    assert_eq!((figures.holes, figures.doubles, figures.lost), (0, 0, 0), "{figures}");
    assert_eq!(figures.told, 60 * figures.frames as u64, "{figures}");
    assert!(figures.p99_ms <= 250.0 * SLACK && figures.jitter_ms() <= 5.0 * SLACK, "{figures}");
    assert!(figures.memory_mib <= 256.0 && figures.attacks >= 10, "{figures}");
}

/// A demo: its time stands still while the machine is busy, so that a loaded machine is no reason to fail.
struct Demo {
    folder: tempfile::TempDir,
    _process: Process,
    address: String,
}

impl Demo {
    fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let (log, data) = (folder.path().join("log"), folder.path().join("data"));
        let mut command = gs_server(["demo", "--mode", "always", "--speed", "20", "--data"]);
        let out = std::fs::File::create(folder.path().join("out")).expect("a file");
        command.arg(data).stdout(out);
        let process = Process::start(command, &log);
        let (address, _) = until("the demo says its address", PATIENCE, || {
            let said = std::fs::read_to_string(folder.path().join("out")).ok()? + &process.log();
            let (_, rest) = said.split_once("http://")?;
            let (address, _) = rest.split_once('/')?;
            Some(format!("http://{address}"))
        });
        Self { folder, _process: process, address }
    }

    /// Runs the example: exit code, standard output, standard error.
    fn ground(&self, arguments: &[&str]) -> (i32, String, String) {
        let mut command = Command::new("timeout");
        command
            .args(["60", "python3"])
            .arg(workspace().join("examples/python/ground.py"))
            .args(["--server", &self.address])
            .args(arguments)
            .current_dir(self.folder.path())
            .stdin(Stdio::null());
        run(command)
    }
}

#[test]
fn the_example_in_python_follows_pings_and_fetches_an_image() {
    let demo = Demo::start();
    let (code, out, error) = demo.ground(&["--token", "data/ground/token", "ping"]);
    assert_eq!(code, 0, "{out}{error}");
    assert!(out.contains("is queued") && out.ends_with("answered\n"), "{out}");

    let (code, out, error) = demo.ground(&["follow", "--after", "0", "--until-live"]);
    assert_eq!(code, 0, "{out}{error}");
    assert!(out.lines().next().is_some_and(|line| line.trim_start().starts_with("1 ")), "{out}");
    assert!(out.contains("Ping"), "{out}");

    until("an image is declared and fetched", PATIENCE, || {
        let (code, out, error) = demo.ground(&["image", "1", "image.jpg"]);
        assert!(code == 0 || error.contains("There is no image 1"), "{out}{error}");
        (code == 0).then_some(())
    });
    assert!(std::fs::metadata(demo.folder.path().join("image.jpg")).expect("the file").len() > 100);

    let (code, _, error) = demo.ground(&["ping"]);
    assert!(code == 1 && error.contains("the server refuses"), "{error}");
}
