//! What lies on the desk: top bar, lamps, buttons, alarms.

use egui::Ui;
use jiff::{SignedDuration, Timestamp};
use ui::alarms::{Alarm, AlarmList, State};
use ui::format::Quantity;
use ui::hold::{Hold, TypedWord, hold_button, typed_word};
use ui::lamps::{self, Connection, Link, PassTimes, Transmitter};
use ui::value::{Freshness, Heard, Over, ValueRow, link_meter, value_row};
use ui::{Level, Theme};

pub(crate) fn now() -> Timestamp {
    // 2026-11-22T14:03:07Z
    Timestamp::from_second(1_795_356_187).unwrap_or(Timestamp::UNIX_EPOCH)
}

pub(crate) fn seconds(count: i64) -> SignedDuration {
    SignedDuration::from_secs(count)
}

fn bar(ui: &mut Ui, pass: PassTimes, transmitter: Transmitter, is_simulated: bool, day_of_year: bool) {
    let theme = Theme::current(ui);
    let rect = egui::Rect::from_min_size(ui.cursor().min, egui::vec2(ui.available_width(), 44.0));
    if is_simulated {
        lamps::simulated_hatch(ui.painter(), rect, theme);
    }
    ui.horizontal(|ui| {
        ui.set_height(44.0);
        ui.spacing_mut().item_spacing.x = 16.0;
        ui.label("PixelSat I");
        if is_simulated {
            lamps::simulated_word(ui);
        }
        lamps::utc_clock(ui, now(), &mut { day_of_year });
        lamps::countdown(ui, now(), Some(pass));
        lamps::link_lamp(ui, "Radio", Link::Ok, Some(seconds(4)));
        lamps::transmitter_lamp(ui, transmitter);
        lamps::alarm_counts(ui, [2, 1, 0, 1, 0]);
    });
}

pub(crate) fn top_bar(ui: &mut Ui) {
    let before = PassTimes { aos: now() + seconds(252), los: now() + seconds(700) };
    bar(ui, before, Transmitter::Safe, false, false);
    let within = PassTimes { aos: now() - seconds(300), los: now() + seconds(130) };
    bar(ui, within, Transmitter::OnAir, true, true);
}

pub(crate) fn lamps(ui: &mut Ui) {
    for (link, age) in [
        (Link::Ok, Some(4)),
        (Link::Quiet, Some(5_400)),
        (Link::Unavailable, Some(90)),
        (Link::Disabled, None),
        (Link::Failed, Some(400)),
    ] {
        ui.horizontal(|ui| {
            lamps::link_lamp(ui, "TinyGS", link, age.map(seconds));
            ui.add_space(24.0);
            if let Some(level) = Level::ALL.get(link as usize) {
                ui::level::mark(ui, *level);
            }
        });
    }
    ui.horizontal(|ui| {
        for transmitter in [Transmitter::Safe, Transmitter::Armed, Transmitter::OnAir, Transmitter::Unknown] {
            lamps::transmitter_lamp(ui, transmitter);
        }
    });
    let server = || "station.example".to_owned();
    for connection in [
        Connection::Live { server: server(), person: "ada".into() },
        Connection::Lost { server: server(), since: Some(seconds(12)), next_try: Some(seconds(3)) },
        Connection::Refused { server: server(), why: "the token is not known there".into() },
    ] {
        lamps::connection(ui, &connection);
    }
}

pub(crate) fn hold(ui: &mut Ui) {
    let theme = Theme::current(ui);
    ui.horizontal(|ui| {
        hold_button(ui, &mut Hold::default(), "Fire Reset", theme.critical);
        ui.add_enabled_ui(false, |ui| {
            hold_button(ui, &mut Hold::default(), "Cease transmission", theme.on_air)
        });
    });
    ui.add_space(8.0);
    typed_word(ui, &mut TypedWord { text: "RESE".into() }, "RESET", "Fire");
}

pub(crate) fn alarms(ui: &mut Ui) {
    let texts = [
        (Level::Watch, "Elements", "9 days old: the times of passes may be off by 4 s", State::New, 90_000),
        (Level::Severe, "Battery voltage", "6.21 V, below 6.40 V", State::New, 37),
        (Level::Warning, "Clock", "no time server has answered", State::Acknowledged, 4_000),
        (Level::Critical, "Radio", "the module does not answer", State::Returned, 200),
        (Level::Distress, "OBC temperature", "61.0 °C, above 60.0 °C", State::Shelved, 7_300),
    ];
    let alarms: Vec<Alarm> = texts
        .into_iter()
        .map(|(level, name, text, state, age)| Alarm {
            id: name.into(),
            level,
            name: name.into(),
            text: text.into(),
            since: now() - seconds(age),
            state,
            person: (state == State::Acknowledged).then(|| "ada".into()),
        })
        .collect();
    let mut list = AlarmList::default();
    list.selected = Some("Clock".into());
    list.show(ui, &alarms, 0, now());
}

pub(crate) fn values(ui: &mut Ui) {
    let out = Freshness::OutOfView { age: seconds(5_400), until: Some(now() + seconds(1_740)) };
    for (label, value, level, freshness) in [
        ("Battery voltage", Quantity::of(Some(7.41), 2, "V"), None, Freshness::Fresh),
        (
            "OBC temperature",
            Quantity::of(Some(61.0), 1, "°C"),
            Some((Level::Distress, Over::Above)),
            Freshness::Fresh,
        ),
        ("Bus current", Quantity::of(Some(-0.312), 3, "A"), None, Freshness::Stale(seconds(95))),
        ("Yaw", Quantity::of(Some(182.4), 1, "°"), None, out),
        ("Magnetometer X", Quantity::of(None, 1, "µT"), None, Freshness::Never),
    ] {
        value_row(ui, &ValueRow { label, value, level, freshness }, now());
    }
    ui.add_space(8.0);
    let heard: Vec<Heard> = (0..60_i16)
        .filter(|frame| frame % 7 != 3)
        .map(|frame| {
            let arch = (f32::from(frame) / 60.0 * std::f32::consts::PI).sin();
            let at = now() + seconds(i64::from(frame) * 10 - 600);
            Heard { at, rssi_dbm: Some(-128.0 + 18.0 * arch), snr_db: Some(-14.0 + 16.0 * arch) }
        })
        .collect();
    link_meter(ui, &heard, now(), seconds(600));
}
