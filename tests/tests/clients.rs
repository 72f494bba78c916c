//! Clients of the API from outside: a crowd at the stream, and the example in Python.

use std::process::{Command, Stdio};

use end_to_end::binary::workspace;
use end_to_end::crowd::{Load, run as crowd};
use end_to_end::process::run;
use end_to_end::wait::{PATIENCE, until};
use end_to_end::{Folder, Server, Twin};

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

fn ground(server: &Server, arguments: &[&str]) -> Command {
    let mut command = Command::new("python3");
    command
        .arg(workspace().join("examples/python/ground.py"))
        .args(["--server", &format!("http://{}", server.client.address)])
        .args(arguments)
        .stdin(Stdio::null());
    command
}

#[test]
fn the_example_in_python_follows_pings_and_fetches_an_image() {
    let mut folder = Folder::new();
    folder.speed = Some(20.0);
    folder.heartbeat_s = 20;
    let _twin = Twin::start(&folder, &["--mode", "always"]);
    let server = Server::start(&folder);
    let token = folder.data().join("token").display().to_string();

    let (code, out, error) = run(ground(&server, &["--token", &token, "ping"]));
    assert_eq!(code, 0, "{out}{error}");
    assert!(out.contains("is queued") && out.ends_with("answered\n"), "{out}");

    let (code, out, error) = run(ground(&server, &["follow", "--after", "0", "--until-live"]));
    assert_eq!(code, 0, "{out}{error}");
    assert!(out.lines().next().is_some_and(|line| line.trim_start().starts_with("1 ")), "{out}");
    assert!(out.contains("Ping"), "{out}");

    let (code, _, error) = run(ground(&server, &["image", "1", "nowhere.jpg"]));
    assert!(code == 1 && error.contains("There is no image 1"), "{error}");
    let ordered = server.client.post("/api/v1/downloads", "k", "{}").expect("an answer");
    assert_eq!(ordered.status, 201, "{}", ordered.text());
    until("an image is declared", PATIENCE, || {
        let answer = server.client.get("/api/v1/images/1/file").expect("an answer");
        (answer.status == 200).then_some(())
    });
    let file = folder.file("image.jpg").display().to_string();
    let (code, out, error) = run(ground(&server, &["image", "1", &file]));
    assert_eq!(code, 0, "{out}{error}");
    assert!(std::fs::metadata(&file).expect("the file").len() > 100, "{out}");

    let (code, _, error) = run(ground(&server, &["ping"]));
    assert!(code == 1 && error.contains("the server refuses"), "{error}");
}
