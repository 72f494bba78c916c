//! Two days and one pass on a timeline.

use egui::Ui;
use ui::Level;
use ui::lane::{Item, Kind, Lane};
use ui::timeline::{ItemRef, Timeline};

use crate::desk::{now, seconds};

fn item(id: &str, from_s: i64, length_s: i64, kind: Kind, label: &str) -> Item {
    Item {
        id: id.into(),
        start: now() + seconds(from_s),
        end: now() + seconds(from_s + length_s),
        kind,
        label: label.into(),
        hover: String::new(),
        conflict: None,
        can_be_dragged: matches!(kind, Kind::Plan),
    }
}

fn lanes() -> Vec<Lane> {
    let passes = (-6..14_i64).filter(|pass| pass.rem_euclid(7) < 4).map(|pass| {
        let highest = [12, 48, 83, 27][pass.rem_euclid(7) as usize % 4];
        let quality = highest as f32 / 90.0;
        item(&format!("pass {pass}"), pass * 5_700 - 260, 560, Kind::Pass { quality }, &format!("{highest}°"))
    });
    let mut clash = item("downlink", 5_700 * 2 - 200, 900, Kind::Plan, "Image 14");
    clash.conflict = Some("overlaps with CHESS".into());
    vec![
        Lane::new("Passes", passes.collect()).taking_drops(),
        Lane::new(
            "Plans",
            vec![
                item("run", -200, 400, Kind::Run, "Heartbeat and image 12"),
                clash,
                item("later", 5_700 * 7, 3_000, Kind::Plan, "Schedule"),
            ],
        ),
        Lane::new(
            "Contacts",
            vec![
                item("c1", -190, 120, Kind::Contact, "14 frames"),
                item("c2", -34_000, 300, Kind::Contact, "31 frames"),
            ],
        ),
        Lane::new(
            "Commands",
            vec![
                item("k1", -150, 0, Kind::Command, "Ping"),
                item("k2", -90, 0, Kind::Command, "GetImageInfo"),
                item("k3", -40, 0, Kind::Command, "GetChunks"),
                item("k4", 60, 0, Kind::Command, "GetChunks"),
            ],
        ),
        Lane::new(
            "Alarms",
            vec![
                item("a1", -30_000, 9_000, Kind::Alarm(Level::Warning), "Clock"),
                item("a2", -120, 90, Kind::Alarm(Level::Severe), "Battery voltage"),
            ],
        ),
    ]
}

pub(crate) fn days(ui: &mut Ui) {
    let mut timeline = Timeline::from(now() - seconds(40_000), 130_000.0);
    timeline.show(ui, &lanes(), now());
}

pub(crate) fn one_pass(ui: &mut Ui) {
    let mut timeline = Timeline::from(now() - seconds(300), 720.0);
    timeline.selected = Some(ItemRef { lane: 1, id: "run".into() });
    timeline.show(ui, &lanes(), now());
}
