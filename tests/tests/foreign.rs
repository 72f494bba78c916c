//! Any program that speaks the ICD on a pseudo-terminal can be the satellite: here one in Python, which shares no line
//! with ours, and the example configuration that operators are told to copy.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use api::{CommandView, DownloadView, FrameView, ImageView, Outcome, Page};
use end_to_end::binary::workspace;
use end_to_end::wait::{PATIENCE, until};
use end_to_end::{Client, Folder, Process, Server};
use sha2::{Digest as _, Sha256};

const EXAMPLE: &str = include_str!("../../examples/strapped-pty.toml");
/// Seconds between heartbeats: a minute would make the test one of minutes.
const PERIOD_S: u32 = 8;

#[test]
fn a_program_that_is_not_ours_is_heard_commanded_and_asked_for_its_image() {
    let folder = Folder::new();
    let image: Vec<u8> = (0..222 * 4 + 57_u32).map(|i| (i * 31 % 251) as u8).collect();
    std::fs::write(folder.file("image.jpg"), &image).expect("an image");
    let satellite = satellite(&folder);
    let server = serve_the_example(&folder);
    let client = &server.client;
    server.until_link("ok", PATIENCE);

    // Heard: the values stand where the ICD says.
    let (beat, _) = until("a heartbeat", PATIENCE, || newest(client, 6));
    let frame: FrameView = client.read(&format!("/api/v1/frames/{}", beat.id));
    let packet = frame.packet.expect("a decoded packet");
    let value = |name: &str| packet.fields.iter().find(|f| f.name == name).map(|f| f.value.clone());
    assert_eq!((packet.name.as_str(), frame.length), ("Heartbeat", 133));
    assert_eq!(value("temp"), Some(17.25.into()));
    assert_eq!(value("r_teme.x"), Some(6878.0.into()));
    assert_eq!(value("cam"), Some(true.into()));

    // Commanded.
    let answer = client.post("/api/v1/commands", "ping-1", r#"{"command":"Ping"}"#).expect("an answer");
    assert_eq!(answer.status, 201, "{}", answer.text());
    let ping = answer.json::<Outcome>().command.expect("a command");
    let (ping, took) = until("Pong", PATIENCE, || {
        let command: CommandView = client.read(&format!("/api/v1/commands/{ping}"));
        (command.stage == "answered").then_some(command)
    });
    let proof = ping.stages.and_then(|stages| stages.last()?.frame).expect("the frame that proves it");
    let pong: FrameView = client.read(&format!("/api/v1/frames/{proof}"));
    assert_eq!((pong.packet_name.as_deref(), pong.form.as_str()), (Some("Pong"), "short"));

    // The image, whole and byte for byte.
    let answer = client.post("/api/v1/downloads", "image-1", "{}").expect("an answer");
    assert_eq!(answer.status, 201, "{}", answer.text());
    let download = answer.json::<Outcome>().download.expect("a download");
    let (download, _) = until("the image is home", 3 * PATIENCE, || {
        let download: DownloadView = client.read(&format!("/api/v1/downloads/{download}"));
        (download.state == "complete").then_some(download)
    });
    let id = download.image.expect("its image");
    let view: ImageView = client.read(&format!("/api/v1/images/{id}"));
    let file = client.get(&format!("/api/v1/images/{id}/file")).expect("the file");
    assert_eq!((view.chunks, view.held, view.conflicts), (5, 5, 0));
    assert_eq!(file.body, image);
    assert_eq!(view.sha256, Some(hex::encode(Sha256::digest(&image))));
    assert_eq!(file.header("x-image-complete"), Some("true"));

    eprintln!("Pong after {took:?}; image in {} requests", download.requests);
    assert!(!satellite.log().contains("refused"), "the satellite refused something: {}", satellite.log());
    server.stop();
}

fn newest(client: &Client, packet_type: u8) -> Option<FrameView> {
    let page: Page<FrameView> = client.read(&format!("/api/v1/frames?packet_type={packet_type}&limit=1"));
    page.items.into_iter().next()
}

/// The example as it stands, but for places and the minute between heartbeats.
fn serve_the_example(folder: &Folder) -> Server {
    let places = [
        ("/tmp/pixelsat", folder.port().display().to_string()),
        ("127.0.0.1:8700", folder.address.to_string()),
        ("heartbeat_period_s = 60", format!("heartbeat_period_s = {PERIOD_S}")),
        ("workbench.key", "twin.key".to_owned()),
        ("workbench-data", "data".to_owned()),
    ];
    let config = places.iter().fold(EXAMPLE.to_owned(), |text, (here, there)| {
        assert!(text.contains(here), "the example says nothing of {here}");
        text.replace(here, there)
    });
    let path = folder.file("station.toml");
    std::fs::write(&path, config).expect("a configuration");
    let mut command = end_to_end::process::gs_server(["serve", "--config"]);
    command.arg(path);
    Server::start_by(folder, command)
}

fn satellite(folder: &Folder) -> Process {
    let mut command = Command::new(python());
    command.arg(workspace().join("tests/foreign/satellite.py")).arg(folder.port());
    command.arg("--key-file").arg(folder.file("twin.key")).arg("--image").arg(folder.file("image.jpg"));
    command.args(["--frame", "0.3", "--period", &PERIOD_S.to_string()]);
    let log = folder.file("satellite.log");
    let told = std::fs::File::create(&log).expect("a log file");
    let process = Process::start(
        {
            command.stdout(told);
            command
        },
        &log,
    );
    until("the foreign satellite is ready", Duration::from_secs(30), || {
        process.log().contains("ready").then_some(())
    });
    process
}

/// A Python that has `cryptography`: the project's own (scripts/setup.sh makes it), or the machine's.
fn python() -> PathBuf {
    let candidates = [workspace().join(".venv/bin/python"), Path::new("python3").to_path_buf()];
    let works = |python: &PathBuf| {
        let mut command = Command::new(python);
        command.args(["-c", "import cryptography"]).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    candidates
        .into_iter()
        .find(works)
        .unwrap_or_else(|| panic!("no Python with cryptography: run scripts/setup.sh python"))
}
