//! Reports: what a pass brought, what the next shift must know, what a month came to. Read here, or saved to a file.

use std::path::PathBuf;
use std::time::Instant;

use api::client::Filter;
use api::{Page, PassKept, Time};
use egui::{RichText, ScrollArea, TextEdit, Ui};
use ui::Theme;

use super::Scene;
use crate::link::Pending;
use crate::model::Fetched;

/// Passes to choose from.
const PASSES: u32 = 50;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    passes: Fetched<Page<PassKept>>,
    asking_passes: Option<Pending<Page<PassKept>>>,
    passes_at: Option<Instant>,
    hours: String,
    month: String,
    /// Its name below the reports, and what came.
    report: Option<(String, String)>,
    asking: Option<(String, Pending<String>)>,
    /// The page of what is read, to be saved.
    saving: Option<(PathBuf, Pending<String>)>,
    told: String,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let mut state = std::mem::take(&mut scene.kept.reports);
    answers(scene, &mut state);
    choose(ui, scene, &mut state);
    save(ui, scene, &mut state);
    let theme = Theme::current(ui);
    if !state.told.is_empty() {
        ui.add(egui::Label::new(RichText::new(&state.told).color(theme.dim)).wrap());
    }
    ui.separator();
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        if let Some((_, text)) = &state.report {
            lines(ui, text);
        } else {
            ui.label(RichText::new("Choose a report.").color(theme.dim));
        }
    });
    scene.kept.reports = state;
}

/// Markdown as plain text: headings stand out, tables keep their columns.
fn lines(ui: &mut Ui, text: &str) {
    let theme = Theme::current(ui);
    for line in text.lines() {
        if let Some(heading) = line.strip_prefix('#') {
            ui.strong(heading.trim_start_matches('#').trim());
        } else if line.starts_with('|') {
            ui.add(egui::Label::new(RichText::new(line).monospace().small()).extend());
        } else if !line.starts_with("![") && !line.trim().is_empty() {
            ui.add(egui::Label::new(RichText::new(line).color(theme.text)).wrap());
        }
    }
}

fn choose(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State) {
    let theme = Theme::current(ui);
    if state.hours.is_empty() {
        state.hours = "8".to_owned();
    }
    if state.month.is_empty()
        && let Some(now) = scene.now_us
    {
        state.month = Time::from_unix_us(now).to_string().chars().take(7).collect();
    }
    let mut wanted = None;
    ui.horizontal_wrapped(|ui| {
        let hours = TextEdit::singleline(&mut state.hours).desired_width(32.0);
        if ui.button("Shift handover").clicked() {
            wanted = Some("handover".to_owned());
        }
        ui.label(RichText::new("of the last").color(theme.dim));
        ui.add(hours).accessible_name("Hours of the handover");
        ui.label(RichText::new("hours").color(theme.dim));
        ui.separator();
        if ui.button("Month").clicked() {
            wanted = Some(format!("months/{}", state.month.trim()));
        }
        ui.add(TextEdit::singleline(&mut state.month).desired_width(64.0))
            .accessible_name("Month of the report");
        ui.separator();
        let held = state.passes.value().map_or(&[][..], |page| &page.items);
        ui.menu_button(format!("Passes ({})", held.len()), |ui| {
            ScrollArea::vertical().max_height(300.0).show(ui, |ui| {
                for pass in held {
                    let text = format!("{} {} from {}", pass.id, pass.satellite, pass.aos);
                    if ui.button(text).clicked() {
                        wanted = Some(format!("passes/{}", pass.id));
                        ui.close();
                    }
                }
            });
        });
        if let Some(pass) = held.first()
            && ui.button("Last pass").clicked()
        {
            wanted = Some(format!("passes/{}", pass.id));
        }
    });
    if let Some(name) = wanted.filter(|_| state.asking.is_none()) {
        let filter = since(scene, state, &name);
        let path = format!("reports/{name}.md");
        let asked = scene.courier.ask(move |client| async move { client.text(&path, &filter).await });
        state.asking = Some((name, asked));
        state.told = "The report is being made.".to_owned();
    }
}

fn since(scene: &Scene<'_>, state: &State, name: &str) -> Filter {
    let hours = state.hours.trim().parse::<f64>().ok().filter(|hours| (0.1..=8760.0).contains(hours));
    match (name, hours.zip(scene.now_us)) {
        ("handover", Some((hours, now))) => {
            Filter::new().with("since", Time::from_unix_us(now - (hours * 3600e6) as i64))
        }
        _ => Filter::new(),
    }
}

/// What is read, as a file: Markdown as it stands here, or the page with its pictures.
fn save(ui: &mut Ui, scene: &mut Scene<'_>, state: &mut State) {
    let Some((name, text)) = state.report.clone() else { return };
    if scene.desk.report_folder.is_empty() {
        let home = std::env::home_dir().unwrap_or_else(std::env::temp_dir);
        scene.desk.report_folder = home.display().to_string();
    }
    let file = |ending: &str| {
        PathBuf::from(scene.desk.report_folder.trim()).join(format!("{}.{ending}", name.replace('/', "-")))
    };
    let (markdown, page) = (file("md"), file("html"));
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new("folder").color(Theme::current(ui).dim));
        ui.add(TextEdit::singleline(&mut scene.desk.report_folder).desired_width(180.0))
            .accessible_name("Folder for reports");
        if ui.button("Save Markdown").clicked() {
            state.told = written(&markdown, &text);
        }
        if ui.button("Save page").on_hover_text("HTML, to be opened in a browser").clicked()
            && state.saving.is_none()
        {
            let (path, filter) = (format!("reports/{name}.html"), since(scene, state, &name));
            let asked = scene.courier.ask(move |client| async move { client.text(&path, &filter).await });
            state.saving = Some((page, asked));
        }
    });
}

fn written(path: &std::path::Path, text: &str) -> String {
    match std::fs::write(path, text) {
        Ok(()) => format!("Saved as {}", path.display()),
        Err(error) => format!("{}: {error}; choose another folder", path.display()),
    }
}

fn answers(scene: &mut Scene<'_>, state: &mut State) {
    if let Some((name, answer)) =
        state.asking.as_ref().and_then(|(name, asked)| Some((name.clone(), asked.take()?)))
    {
        state.asking = None;
        match answer {
            Ok(text) => {
                state.told.clear();
                state.report = Some((name, text));
            }
            Err(error) => state.told = error.to_string(),
        }
    }
    if let Some((path, answer)) =
        state.saving.as_ref().and_then(|(path, asked)| Some((path.clone(), asked.take()?)))
    {
        state.saving = None;
        state.told = match answer {
            Ok(page) => written(&path, &page),
            Err(error) => error.to_string(),
        };
    }
    if let Some(answer) = state.asking_passes.as_ref().and_then(Pending::take) {
        state.asking_passes = None;
        state.passes.settle(answer, scene.now);
    }
    let due = state.passes_at.is_none_or(|at| scene.now.saturating_duration_since(at).as_secs() > 15);
    if due && state.asking_passes.is_none() && scene.model.connection.is_live() {
        state.passes_at = Some(scene.now);
        let newest = Filter::new().limit(PASSES);
        state.asking_passes =
            Some(scene.courier.ask(move |client| async move { client.passes_history(&newest).await }));
    }
}
