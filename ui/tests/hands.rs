//! What hands do to the widgets, by mouse and by keyboard, found by accessible label.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

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

mod planning {
    use ui::lane::{Item, Kind, Lane};
    use ui::timeline::{ItemRef, Timeline, Touched};

    use super::*;

    struct Plan {
        timeline: Timeline,
        lanes: Vec<Lane>,
        touched: Touched,
    }

    fn item(id: &str, start_s: i64, kind: Kind) -> Item {
        let start = jiff::Timestamp::from_second(1_795_356_000 + start_s).unwrap();
        Item {
            id: id.into(),
            start,
            end: start + jiff::SignedDuration::from_secs(600),
            kind,
            label: id.into(),
            hover: String::new(),
            conflict: None,
            can_be_dragged: kind == Kind::Plan,
        }
    }

    fn harness<'a>() -> Harness<'a, Plan> {
        let passes = vec![
            item("first", 1_000, Kind::Pass { quality: 0.3 }),
            item("second", 3_000, Kind::Pass { quality: 0.9 }),
        ];
        let lanes = vec![
            Lane::new("Passes", passes).taking_drops(),
            Lane::new("Plans", vec![item("image", 0, Kind::Plan)]),
        ];
        let now = jiff::Timestamp::from_second(1_795_356_000).unwrap();
        let timeline = Timeline::from(now, 4_000.0);
        Harness::builder().with_size([900.0, 160.0]).build_ui_state(
            move |ui, plan: &mut Plan| {
                ui::install(ui.ctx(), Mode::Dark);
                let touched = plan.timeline.show(ui, &plan.lanes, now);
                if touched.clicked.is_some() || touched.dropped.is_some() {
                    plan.touched = touched;
                }
            },
            Plan { timeline, lanes, touched: Touched::default() },
        )
    }

    #[test]
    fn a_plan_is_dropped_on_a_pass() {
        let mut harness = harness();
        harness.run_steps(2);
        let from = harness.get_by_label("Plans image").rect().center();
        let to = harness.get_by_label("Passes second").rect().center();
        harness.drag_at(from);
        harness.run_steps(2);
        harness.hover_at(from.lerp(to, 0.5));
        harness.run_steps(2);
        harness.hover_at(to);
        harness.run_steps(2);
        harness.drop_at(to);
        harness.run_steps(2);
        let onto = ItemRef { lane: 0, id: "second".into() };
        assert_eq!(harness.state().touched.dropped, Some(("image".into(), onto)));
        assert_eq!(harness.state().timeline.start_s, Some(1_795_356_000.0), "the view did not move along");
    }

    #[test]
    fn a_click_chooses_and_a_drag_of_the_ground_moves_time() {
        let mut harness = harness();
        harness.run_steps(2);
        harness.get_by_label("Passes first").click();
        harness.run_steps(2);
        assert_eq!(harness.state().timeline.selected, Some(ItemRef { lane: 0, id: "first".into() }));
        let before = harness.state().timeline.start_s.unwrap();
        harness.drag_at(egui::pos2(600.0, 90.0));
        harness.run_steps(2);
        harness.hover_at(egui::pos2(500.0, 90.0));
        harness.run_steps(2);
        harness.drop_at(egui::pos2(500.0, 90.0));
        harness.run_steps(2);
        assert!(harness.state().timeline.start_s.unwrap() > before + 200.0);
    }

    #[test]
    fn the_wheel_zooms_at_the_pointer() {
        let mut harness = harness();
        harness.run_steps(2);
        let pass = harness.get_by_label("Passes second").rect();
        harness.hover_at(pass.left_center() + egui::vec2(2.0, 0.0));
        harness.run_steps(1);
        for _ in 0..5 {
            harness.event(egui::Event::MouseWheel {
                unit: egui::MouseWheelUnit::Point,
                delta: egui::vec2(0.0, 60.0),
                phase: egui::TouchPhase::Move,
                source: egui::MouseWheelSource::Wheel,
                modifiers: egui::Modifiers::NONE,
            });
            harness.run_steps(10);
        }
        assert!(harness.state().timeline.span_s < 2_000.0, "{}", harness.state().timeline.span_s);
        let moved = harness.get_by_label("Passes second").rect();
        assert!((moved.left() - pass.left()).abs() < 6.0, "{pass:?} {moved:?}");
        assert!(moved.width() > 1.5 * pass.width());
    }
}
