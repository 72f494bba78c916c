//! Values, plots, images, frames, what was found: on a real server with a simulated satellite.

use std::path::{Path, PathBuf};

use api::client::{Client, Filter};
use ground_app::desk::{Desk, Layout};

use crate::common::{Seat, SeatOptions};

/// As fast as a pass goes by in some seconds.
const FAST: Option<f64> = Some(60.0);

fn seat(layout: Layout, folder: &Path, draws: bool) -> Seat {
    let mut desk = Desk { layout, ..Desk::default() };
    desk.plots.folder = Some(folder.display().to_string());
    desk.plots.plots = vec![vec!["heartbeat.temp".to_owned()]];
    Seat::take_with(SeatOptions { speed: FAST, operates: true, desk, draws, ..SeatOptions::default() })
}

/// Asks the server beside the window.
fn ask<T>(seat: &Seat, question: impl AsyncFnOnce(Client) -> T) -> T {
    let server = seat.embedded.as_ref().unwrap().server();
    let client = Client::new(&server.address, server.token.as_deref()).unwrap();
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(question(client))
}

/// The files in a folder that end so.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let all = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    all.filter(|path| path.to_string_lossy().ends_with(ending)).collect()
}

#[test]
fn values_appear_with_their_age_are_searched_and_plotted_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let mut seat = seat(Layout::Satellite, folder.path(), true);
    seat.until("a heartbeat's values", |seat| seat.shows("heartbeat.temp ") && seat.shows("heartbeat, "));
    assert!(seat.labels().iter().any(|label| label.contains("heartbeat.temp") && label.contains("°C")));
    seat.until("its age, or why there is none", |seat| {
        seat.labels().iter().any(|label| {
            label.starts_with("heartbeat, ")
                && (label.contains(" ago") || label.contains("no contact expected"))
        })
    });
    seat.until("the plot has values", |seat| {
        seat.labels().iter().any(|label| label.starts_with("Plot: heartbeat.temp ") && label.contains("°C"))
    });
    seat.picture("values-and-plots");

    seat.type_into("Search values", "rad");
    seat.until("only what fits", |seat| seat.shows("heartbeat.rad") && !seat.shows("heartbeat.accel.x "));
    let row = seat.labels().into_iter().find(|label| label.starts_with("heartbeat.rad ")).unwrap();
    seat.click(&row);
    assert_eq!(seat.harness.state().desk().plots.plots[0], ["heartbeat.rad"], "a click plots it");

    for (button, ending) in [
        ("Export CSV", ".csv"),
        ("Export Parquet", ".parquet"),
        ("Export PNG", ".png"),
        ("Export SVG", ".svg"),
    ] {
        seat.click(button);
        seat.until(button, |seat| {
            seat.shows("Written: ") && files(folder.path(), ending).len() == 1 && !seat.shows("Fetching")
        });
    }
    let csv = std::fs::read_to_string(&files(folder.path(), ".csv")[0]).unwrap();
    let page = ask(&seat, async |client| {
        client.telemetry(&Filter::new().with("parameter", "heartbeat.temp")).await.unwrap()
    });
    let first = &page.samples[0];
    let line = csv.lines().find(|line| line.contains("heartbeat.temp")).unwrap();
    assert!(
        line.starts_with(&first.at.to_string()) && line.ends_with(&format!(",{}", first.frame)),
        "{line}"
    );
    assert!(image::open(&files(folder.path(), ".png")[0]).is_ok());
}

#[test]
fn an_image_completes_in_the_window_byte_for_byte() {
    let folder = tempfile::tempdir().unwrap();
    let mut seat = seat(Layout::Images, folder.path(), true);
    seat.until("the first chunks", |seat| seat.shows("Chunks: ") && seat.shows("Image 1, incomplete"));
    let begun = ground_app::clock::instant();
    while !seat.shows("Image 1, complete")
        && ground_app::clock::instant().duration_since(begun).as_secs() < 240
    {
        seat.harness.run_steps(4);
        std::thread::yield_now();
    }
    seat.until("the picture is whole", |seat| seat.shows("Picture 1, complete"));
    seat.picture("images");
    seat.click("Save the JPEG");
    seat.until("it is written", |_| files(folder.path(), "image-1.jpg").len() == 1);
    let written = std::fs::read(&files(folder.path(), "image-1.jpg")[0]).unwrap();
    let (image, file) = ask(&seat, async |client| {
        (client.image(1).await.unwrap(), client.image_file(1, None).await.unwrap().unwrap())
    });
    assert!(image.complete && file.complete);
    assert_eq!(written, file.bytes, "what the window shows is what the server holds: {:?}", image.sha256);
    assert_eq!(written.len(), image.size_bytes as usize);
}

#[test]
fn frames_are_found_opened_stepped_through_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let mut seat = seat(Layout::Archive, folder.path(), true);
    seat.until("frames", |seat| seat.labels().iter().any(|label| label.starts_with("Heartbeat ")));
    let row = seat.labels().into_iter().find(|label| label.starts_with("Heartbeat ")).unwrap();
    seat.click(&row);
    seat.until("the frame", |seat| seat.shows("CRC right") && seat.shows("Who heard it"));
    seat.picture("archive");
    let opened = |seat: &Seat| {
        seat.labels()
            .into_iter()
            .find(|label| label.starts_with("Frame ") && label.len() < 14)
            .unwrap_or_default()
    };
    let first = opened(&seat);
    seat.click("Previous frame");
    seat.until("another one", |seat| opened(seat) != first || seat.shows("There is no further one"));

    seat.click("Search events");
    seat.until("events", |seat| seat.labels().iter().any(|label| label.starts_with("frame-heard ")));
    seat.click("Export NDJSON");
    seat.until("they are written", |_| files(folder.path(), ".ndjson").len() == 1);
    let text = std::fs::read_to_string(&files(folder.path(), ".ndjson")[0]).unwrap();
    let back: Vec<api::EventView> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let known = ask(&seat, async |client| {
        let filter = Filter::new().after(back.last().unwrap().sequence - 1).limit(1);
        client.events(&filter).await.unwrap().items
    });
    assert_eq!(known.first(), back.last(), "the file has what the server has");
}
