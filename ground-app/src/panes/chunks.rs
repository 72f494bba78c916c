//! The chunks of an image: which are here, who brought them, and those that came in versions that differ.

use std::collections::BTreeMap;

use api::{ChunkMap, FrameView};
use egui::{Role, WidgetInfo};
use protocol::{DownFrame, Downlink};
use ui::chunk_grid::{Cell, ChunkGrid, chunk_grid_ui};
use ui::{Theme, fonts};

use super::album::{Album, Heard, Version};
use super::{Scene, blank, words};
use crate::link::Pending;

/// Versions of one chunk that are shown.
const VERSIONS_MAX: usize = 4;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    grid: ChunkGrid,
    /// Image, map of chunks, sources: of which the grid is.
    of: Option<(u64, u64, u64)>,
    chosen: Option<u16>,
    /// Frames of the versions that are shown, and their bytes once they came.
    bytes: BTreeMap<u64, Answer>,
}

enum Answer {
    Asked(Pending<FrameView>),
    Bytes(Vec<u8>),
    Failed(String),
}

pub(super) fn show(ui: &mut egui::Ui, scene: &mut Scene<'_>) {
    let Some(satellite) = scene.satellite().map(|satellite| satellite.satellite.clone()) else {
        return blank::show(ui, scene);
    };
    let mut album = std::mem::take(&mut scene.kept.album);
    let mut state = std::mem::take(&mut scene.kept.chunks);
    album.turn(scene, ui.ctx());
    match &album.chunks {
        Some(map) => {
            let of = (map.image, album.revision, album.sources.revision);
            if state.of != Some(of) {
                if state.of.is_none_or(|(image, ..)| image != map.image) {
                    state = State::default();
                }
                fill(&mut state.grid, map, &album);
                state.of = Some(of);
            }
            let clicked = grid(ui, scene, &mut state, map, &album);
            state.chosen = clicked.or(state.chosen);
            conflicts(ui, scene, &mut state, map, &album);
        }
        None if album.image(scene.model, &satellite).is_none() => {
            ui.weak("No image was declared yet");
        }
        None => drop(ui.weak(album.failure().unwrap_or("Waiting for the chunks"))),
    }
    scene.kept.chunks = state;
    scene.kept.album = album;
}

fn fill(grid: &mut ChunkGrid, map: &ChunkMap, album: &Album) {
    grid.resize(map.chunks as usize);
    for (chunk, letter) in map.map.bytes().enumerate() {
        let source = map.frames.get(chunk).copied().flatten().and_then(|frame| album.sources.of(frame));
        let cell = match letter {
            b'!' => Cell::Conflict,
            b'#' => source.map_or(Cell::Own, |heard| heard.cell),
            _ => Cell::Missing,
        };
        grid.set(chunk, cell);
    }
}

fn grid(
    ui: &mut egui::Ui,
    scene: &Scene<'_>,
    state: &mut State,
    map: &ChunkMap,
    album: &Album,
) -> Option<u16> {
    let height = (ui.available_height() - if map.conflicts > 0 { 200.0 } else { 40.0 }).max(80.0);
    let told = |heard: &Heard| {
        let at = ui::format::utc(super::history::at(heard.at_us));
        let age = scene.now_us.map_or(String::new(), |now| format!(", {} ago", words::age(heard.at_us, now)));
        format!("{at}{age}, {}", heard.who)
    };
    let detail = |chunk: usize| {
        let frame = map.frames.get(chunk).copied().flatten();
        let heard = frame.and_then(|frame| album.sources.of(frame));
        match (frame, heard) {
            (Some(frame), Some(heard)) => format!("frame {frame}: {}", told(heard)),
            (Some(frame), None) => format!("frame {frame}"),
            _ => String::new(),
        }
    };
    let mut clicked = None;
    egui::ScrollArea::vertical().max_height(height + 40.0).show(ui, |ui| {
        clicked = chunk_grid_ui(ui, &mut state.grid, height, detail).clicked;
    });
    clicked.and_then(|chunk| u16::try_from(chunk).ok())
}

/// The versions of a chunk side by side.
fn conflicts(ui: &mut egui::Ui, scene: &mut Scene<'_>, state: &mut State, map: &ChunkMap, album: &Album) {
    if map.conflicts == 0 {
        return;
    }
    let in_conflict: Vec<u16> = (0..=u16::MAX)
        .zip(map.map.bytes())
        .filter(|(_, letter)| *letter == b'!')
        .map(|(chunk, _)| chunk)
        .collect();
    let Some(chunk) =
        state.chosen.filter(|chunk| in_conflict.contains(chunk)).or(in_conflict.first().copied())
    else {
        return;
    };
    let in_use = map.frames.get(usize::from(chunk)).copied().flatten();
    let versions = album.sources.versions(chunk, in_use);
    ui.horizontal(|ui| {
        ui.label(format!("Chunk {chunk} came in {} versions", versions.len().max(2)));
        let place = in_conflict.iter().position(|other| *other == chunk).unwrap_or(0);
        ui.weak(format!("conflict {} of {}", place + 1, in_conflict.len()));
        let mut step = |ui: &mut egui::Ui, words: &str, to: Option<&u16>| {
            if ui.add_enabled(to.is_some(), egui::Button::new(words)).clicked() {
                state.chosen = to.copied();
            }
        };
        step(ui, "Previous conflict", place.checked_sub(1).and_then(|place| in_conflict.get(place)));
        step(ui, "Next conflict", in_conflict.get(place + 1));
    });
    let wanted: Vec<u64> = versions.iter().take(VERSIONS_MAX).map(|version| version.frame).collect();
    state.bytes.retain(|frame, _| wanted.contains(frame));
    for frame in wanted {
        let answer = state.bytes.entry(frame).or_insert_with(|| {
            Answer::Asked(scene.courier.ask(move |client| async move { client.frame(frame).await }))
        });
        if let Answer::Asked(pending) = answer
            && let Some(came) = pending.take()
        {
            *answer = match came {
                Ok(view) => Answer::Bytes(data_of(&view).unwrap_or_default()),
                Err(error) => Answer::Failed(error.to_string()),
            };
        }
    }
    let mut opened = None;
    egui::ScrollArea::both().id_salt("versions").auto_shrink([false, true]).show(ui, |ui| {
        ui.horizontal_top(|ui| {
            for version in versions.iter().take(VERSIONS_MAX) {
                if version_card(ui, state, &versions, version) {
                    opened = Some(version.frame);
                }
            }
        });
    });
    if let Some(frame) = opened {
        scene.kept.open_frame(frame);
    }
}

fn data_of(frame: &FrameView) -> Option<Vec<u8>> {
    let bytes = super::album::bytes_of(&frame.hex)?;
    match DownFrame::parse(&bytes).ok()?.packet().ok()? {
        Downlink::ImageChunk(chunk) => Some(chunk.data.to_vec()),
        _ => None,
    }
}

fn version_card(ui: &mut egui::Ui, state: &State, all: &[Version], version: &Version) -> bool {
    let theme = Theme::current(ui);
    let bytes = |frame: u64| match state.bytes.get(&frame) {
        Some(Answer::Bytes(bytes)) => Some(bytes.as_slice()),
        _ => None,
    };
    let first = all.first().and_then(|first| bytes(first.frame));
    let mut opened = false;
    egui::Frame::new().fill(theme.raised).corner_radius(4.0).inner_margin(8.0).show(ui, |ui| {
        ui.vertical(|ui| {
            ui.horizontal(|ui| {
                let link = ui.link(format!("frame {}", version.frame));
                link.widget_info(|| {
                    let use_ = if version.in_use { "in use" } else { "not in use" };
                    WidgetInfo::labeled(
                        Role::Link,
                        true,
                        format!("Version of frame {}, {use_}", version.frame),
                    )
                });
                opened = link.clicked();
                if version.in_use {
                    ui.label("in use");
                }
            });
            ui.weak(format!("from {}", version.who.join(", ")));
            match state.bytes.get(&version.frame) {
                Some(Answer::Bytes(mine)) => {
                    let other = if version.frame == all[0].frame {
                        all.get(1).and_then(|other| bytes(other.frame))
                    } else {
                        first
                    };
                    ui.label(dump(theme, mine, other));
                }
                Some(Answer::Failed(why)) => drop(ui.weak(why)),
                _ => drop(ui.weak("Waiting for the bytes")),
            }
        });
    });
    opened
}

/// The bytes in hex, those that differ in colour.
fn dump(theme: &Theme, mine: &[u8], other: Option<&[u8]>) -> egui::text::LayoutJob {
    let mut job = egui::text::LayoutJob::default();
    for (place, byte) in mine.iter().enumerate() {
        let differs = other.is_some_and(|other| other.get(place) != Some(byte));
        let colour = if differs { theme.critical } else { theme.dim };
        let end = if place % 16 == 15 { '\n' } else { ' ' };
        let format = egui::TextFormat::simple(fonts::small_figures(), colour);
        job.append(&format!("{byte:02x}{end}"), 0.0, format);
    }
    job
}
