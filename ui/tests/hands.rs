//! What hands do to the widgets, by mouse and by keyboard, found by accessible label.

use egui_kittest::{Harness, kittest::Queryable as _};
use ui::alarms::{Alarm, AlarmList, Deed, State};
use ui::hold::{Hold, TypedWord, hold_button, typed_word};
use ui::{Level, Mode};

const STEP_S: f32 = 0.1;

#[derive(Default)]
struct Desk {
    hold: Hold,
    typed: TypedWord,
    fired: usize,
    confirmed: usize,
}

fn desk<'a>() -> Harness<'a, Desk> {
    Harness::builder().with_size([600.0, 200.0]).with_step_dt(STEP_S).build_ui_state(
        |ui, desk: &mut Desk| {
            ui::install(ui.ctx(), Mode::Dark);
            if hold_button(ui, &mut desk.hold, "Fire Reset", ui::Theme::current(ui).critical) {
                desk.fired += 1;
            }
            if typed_word(ui, &mut desk.typed, "RESET", "Fire by word") {
                desk.confirmed += 1;
            }
        },
        Desk::default(),
    )
}

fn press(harness: &Harness<'_, Desk>, pressed: bool) {
    let pos = harness.get_by_label("Fire Reset (hold)").rect().center();
    harness.hover_at(pos);
    harness.event(egui::Event::PointerButton {
        pos,
        button: egui::PointerButton::Primary,
        pressed,
        modifiers: egui::Modifiers::NONE,
    });
}

#[test]
fn held_by_the_mouse_it_fires_once_and_a_short_press_does_nothing() {
    let mut harness = desk();
    harness.run_steps(2);
    press(&harness, true);
    harness.run_steps(4);
    press(&harness, false);
    harness.run_steps(2);
    assert_eq!(harness.state().fired, 0, "let go after half the time");
    press(&harness, true);
    harness.run_steps(14);
    assert_eq!(harness.state().fired, 1);
    press(&harness, false);
    harness.run_steps(2);
    assert_eq!(harness.state().fired, 1);
}

#[test]
fn moving_away_gives_up() {
    let mut harness = desk();
    harness.run_steps(2);
    press(&harness, true);
    harness.run_steps(4);
    harness.hover_at(egui::pos2(500.0, 190.0));
    harness.run_steps(14);
    assert_eq!(harness.state().fired, 0);
}

#[test]
fn the_space_bar_holds_it_and_enter_never_fires() {
    let mut harness = desk();
    harness.run_steps(2);
    harness.get_by_label("Fire Reset (hold)").focus();
    harness.run_steps(2);
    harness.key_down(egui::Key::Enter);
    harness.run_steps(15);
    harness.key_up(egui::Key::Enter);
    harness.get_by_label("Fire Reset (hold)").click_accesskit();
    harness.run_steps(15);
    assert_eq!(harness.state().fired, 0);
    harness.key_down(egui::Key::Space);
    harness.run_steps(5);
    harness.key_press(egui::Key::Escape);
    harness.run_steps(15);
    assert_eq!(harness.state().fired, 0, "Esc is away from danger");
    harness.key_up(egui::Key::Space);
    harness.run_steps(2);
    harness.get_by_label("Fire Reset (hold)").focus();
    harness.run_steps(2);
    harness.key_down(egui::Key::Space);
    harness.run_steps(14);
    assert_eq!(harness.state().fired, 1);
}

#[test]
fn a_typed_word_wakes_the_button_and_enter_fires_it_from_nowhere() {
    let mut harness = desk();
    harness.run_steps(2);
    harness.get_by_label("Fire by word").click();
    harness.run_steps(3);
    assert_eq!(harness.state().confirmed, 0, "asleep without the word");
    harness.get_by_label("Type RESET to confirm").focus();
    harness.run_steps(2);
    harness.get_by_label("Type RESET to confirm").type_text("RESET");
    harness.run_steps(2);
    harness.key_press(egui::Key::Enter);
    harness.run_steps(2);
    harness.get_by_label("Fire by word").focus();
    harness.run_steps(2);
    harness.key_press(egui::Key::Enter);
    harness.run_steps(3);
    assert_eq!(harness.state().confirmed, 0);
    harness.get_by_label("Fire by word").click();
    harness.run_steps(3);
    assert_eq!(harness.state().confirmed, 1);
    assert_eq!(harness.state().typed.text, "");
}

#[test]
fn ten_thousand_alarms_show_the_worst_first_and_return_what_was_asked() {
    struct Board {
        list: AlarmList,
        alarms: Vec<Alarm>,
        asked: Option<(usize, Deed)>,
    }
    let now = "2026-11-22T14:00:00Z".parse().unwrap();
    let alarm = |index: usize| Alarm {
        id: format!("a{index}"),
        level: if index == 7_777 { Level::Severe } else { Level::Watch },
        name: format!("value {index}"),
        text: "above its limit".into(),
        since: now,
        state: State::New,
        person: None,
    };
    let board = Board { list: AlarmList::default(), alarms: (0..10_000).map(alarm).collect(), asked: None };
    let mut harness = Harness::builder().with_size([700.0, 400.0]).build_ui_state(
        |ui, board: &mut Board| {
            ui::install(ui.ctx(), Mode::Dark);
            let asked = board.list.show(ui, &board.alarms, 1, now);
            board.asked = asked.or(board.asked);
        },
        board,
    );
    harness.run_steps(3);
    let drawn = harness.get_all_by_role(egui::Role::ListItem).count();
    assert!((5..20).contains(&drawn), "{drawn} rows were laid out");
    harness.get_by_label("Ack value 7777").click();
    harness.run_steps(3);
    assert_eq!(harness.state().asked, Some((7_777, Deed::Acknowledge)));
}
