//! The coming passes as a table that can be sorted.

use std::cmp::Ordering;

use api::PassView;
use egui::Ui;
use egui_extras::{Column, TableBuilder};
use ui::format;

use super::Choice;
use crate::model::Model;
use crate::orbit::{span_us, timestamp};

/// What a table is sorted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum By {
    #[default]
    Aos,
    Elevation,
    Length,
}

/// How the table is sorted, and its rows so far.
#[derive(Debug, Default)]
pub(super) struct Table {
    by: By,
    of: Option<(u64, By)>,
    rows: Vec<usize>,
}

const HEADS: [&str; 9] = ["AOS", "TCA", "LOS", "up to", "from", "over", "to", "min", "light"];

impl Table {
    /// Returns what is to be attached or detached.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        model: &Model,
        now_us: i64,
        plan: Option<&str>,
    ) -> Option<Choice> {
        let Some(list) = model.passes.value() else {
            let words = model.passes.failure().unwrap_or("Waiting for the passes");
            ui.weak(words);
            return None;
        };
        ui.horizontal(|ui| {
            ui.weak("Passes by");
            for (by, word) in [(By::Aos, "time"), (By::Elevation, "elevation"), (By::Length, "length")] {
                ui.selectable_value(&mut self.by, by, word);
            }
        });
        let of = (model.passes.revision(), self.by);
        if self.of != Some(of) {
            self.of = Some(of);
            self.rows = sorted(&list.passes, self.by);
        }
        let view =
            model.plans.value().and_then(|page| page.items.iter().find(|view| Some(&*view.name) == plan));
        let mut choice = None;
        TableBuilder::new(ui)
            .id_salt("passes")
            .striped(true)
            .vscroll(false)
            .column(Column::auto().at_least(150.0))
            .columns(Column::auto().at_least(64.0), HEADS.len() - 1)
            .column(Column::remainder())
            .header(20.0, |mut header| {
                for head in HEADS.into_iter().chain([""]) {
                    header.col(|ui| {
                        ui.weak(head);
                    });
                }
            })
            .body(|body| {
                body.rows(20.0, self.rows.len(), |mut row| {
                    let Some(pass) = self.rows.get(row.index()).and_then(|index| list.passes.get(*index))
                    else {
                        return;
                    };
                    for text in cells(pass) {
                        row.col(|ui| {
                            ui.monospace(text);
                        });
                    }
                    row.col(|ui| {
                        let Some(view) = view else { return };
                        let (aos_us, los_us) = span_us(pass);
                        if los_us < now_us || view.satellite != pass.satellite {
                            return;
                        }
                        let picked =
                            view.picks.iter().any(|pick| (aos_us..=los_us).contains(&pick.unix_us()));
                        let at = format::utc(timestamp(aos_us));
                        let word = if picked { "Detach" } else { "Attach" };
                        let button = ui.button(format!("{word} {}", view.name));
                        if button.on_hover_text(format!("The pass of {at}")).clicked() {
                            let at_us = pass.tca.unix_us();
                            choice = Some(Choice { plan: view.name.clone(), at_us, attach: !picked });
                        }
                    });
                });
            });
        choice
    }
}

fn cells(pass: &PassView) -> [String; 9] {
    let (aos_us, los_us) = span_us(pass);
    let azimuth = |value: f64| format!("{value:.0}°");
    let light = match pass.tca_sunlit {
        Some(true) => "sunlit",
        Some(false) => "shadow",
        None => format::UNKNOWN,
    };
    [
        format::utc(timestamp(aos_us)),
        format::time(timestamp(pass.tca.unix_us())),
        format::time(timestamp(los_us)),
        format::degrees(Some(pass.max_elevation_deg)).to_string(),
        azimuth(pass.aos_azimuth_deg),
        azimuth(pass.tca_azimuth_deg),
        azimuth(pass.los_azimuth_deg),
        format::number((los_us - aos_us) as f64 / 60e6, 1),
        light.to_owned(),
    ]
}

fn sorted(passes: &[PassView], by: By) -> Vec<usize> {
    let mut rows: Vec<usize> = (0..passes.len()).collect();
    let greatest = |a: f64, b: f64| b.partial_cmp(&a).unwrap_or(Ordering::Equal);
    rows.sort_by(|&a, &b| {
        let (Some(a), Some(b)) = (passes.get(a), passes.get(b)) else { return Ordering::Equal };
        match by {
            By::Aos => a.aos.cmp(&b.aos),
            By::Elevation => greatest(a.max_elevation_deg, b.max_elevation_deg),
            By::Length => greatest(a.duration_s, b.duration_s),
        }
    });
    rows
}
