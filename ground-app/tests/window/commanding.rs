//! Commands and reports, as operators handle them.

use egui::{Key, Modifiers};
use ground_app::desk::{Asked, Desk, Draft, Layout};
use ground_app::link::Server;
use ground_app::model::Connection;

use crate::common::{Seat, SeatOptions};

/// Opens the form of a command by the palette.
fn open(seat: &mut Seat, typed: &str) {
    seat.press_with(Modifiers::COMMAND, Key::K);
    seat.type_into("Find", typed);
    seat.press(Key::Enter);
    seat.harness.run_steps(4);
}

fn stages(seat: &Seat, name: &str) -> Vec<String> {
    let model = seat.model();
    model
        .all_commands()
        .filter(|command| command.command == name)
        .map(|command| command.stage.clone())
        .collect()
}

/// Presses what has this label and holds it so long, seconds of the window.
fn hold(seat: &mut Seat, label: &str, seconds: f32) {
    use egui_kittest::kittest::Queryable as _;
    let pos = seat.harness.get_by_label(label).rect().center();
    let button = |pressed| egui::Event::PointerButton {
        pos,
        button: egui::PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    seat.harness.hover_at(pos);
    seat.harness.event(button(true));
    seat.harness.run_steps((seconds / 0.05) as usize);
    seat.harness.event(button(false));
    seat.harness.run_steps(3);
}

#[test]
fn a_ping_is_sent_by_a_click_and_answered_with_its_stages_seen() {
    let mut seat = Seat::take_with(SeatOptions { draws: true, speed: Some(12.0), ..SeatOptions::default() });
    seat.until_in_pass();
    // Low over the horizon much is lost.
    let high = "2027-03-20T12:03:30Z".parse::<api::Time>().unwrap().unix_us();
    seat.until("high in the sky", |seat| {
        seat.model().clock.now_us(ground_app::clock::instant()).is_some_and(|now| now > high)
    });
    open(&mut seat, "ping");
    seat.press(Key::Enter);
    assert_eq!(stages(&seat, "Ping"), [""; 0], "the palette sends nothing, and Enter neither");
    seat.click("Send Ping");
    seat.until("queued", |seat| seat.shows("Ping is queued: command"));
    seat.until("answered", |seat| stages(seat, "Ping") == ["answered"]);
    seat.until("its lights", |seat| seat.has("answered: reached") && seat.shows("frame "));
    seat.picture("commands");
}

#[test]
fn what_is_critical_is_armed_and_fired_by_a_hold_alone() {
    let mut seat = Seat::take();
    open(&mut seat, "reset");
    assert!(!seat.has("Send Reset"), "{:?}", seat.labels());
    seat.click("Arm Reset");
    seat.press(Key::Enter);
    seat.click("Fire Reset (hold)");
    hold(&mut seat, "Fire Reset (hold)", 0.4);
    assert_eq!(stages(&seat, "Reset"), [""; 0], "armed, clicked, held too short, Enter: nothing is sent");
    seat.press(Key::Escape);
    assert!(seat.has("Arm Reset") && !seat.has("Fire Reset (hold)"), "Esc disarms");
    seat.click("Arm Reset");
    hold(&mut seat, "Fire Reset (hold)", 1.2);
    seat.until("fired", |seat| seat.shows("Reset is queued: command"));
    seat.until("listed", |seat| stages(seat, "Reset").len() == 1);
}

#[test]
fn a_value_out_of_its_range_is_said_at_its_field_and_cannot_be_sent() {
    let mut seat = Seat::take();
    open(&mut seat, "getimagechunk 3 100");
    assert!(seat.shows("must be a whole number from 1 to 64, found 100"), "{:?}", seat.labels());
    seat.click("Send GetImageChunk");
    assert!(seat.shows("the fields above are not right yet"));
    open(&mut seat, "getimagechunk 3 10");
    assert!(seat.shows("Bytes: type 0x02, 4 of payload"), "{:?}", seat.labels());
    assert_eq!(stages(&seat, "GetImageChunk"), [""; 0]);
}

#[test]
fn without_the_right_buttons_are_grey_and_name_it() {
    let host = Seat::take();
    let address = host.embedded.as_ref().unwrap().server().address.clone();
    let mut seat = Seat::at(&Server { address, token: None }, SeatOptions::default());
    seat.until("connected", |seat| {
        seat.model().session.value().is_some() && seat.model().connection.is_live()
    });
    open(&mut seat, "ping");
    assert!(seat.shows("this needs the right 'command'"), "{:?}", seat.labels());
    seat.click("Send Ping");
    seat.harness.run_steps(10);
    assert!(!seat.shows("is queued") && !seat.shows("waiting for the server"));
}

#[test]
fn a_click_without_an_answer_makes_one_command_however_often_it_is_asked_and_drafts_outlive_all() {
    let mut host = Seat::take();
    let server = host.embedded.as_ref().unwrap().server().clone();
    // As a killed window left it: asked for, and no answer was kept
    let mut desk = Desk::default();
    let mut draft = Draft::of("GetImageInfo");
    let request =
        serde_json::from_value(serde_json::json!({"command": "GetImageInfo", "gate": "blind"})).unwrap();
    draft.asked = Some(Asked { key: "the-one-click".into(), request, server: server.address.clone() });
    desk.commands.open(draft);
    let text = serde_json::to_string(&desk).unwrap();
    let again = || serde_json::from_str::<Desk>(&text).unwrap();
    for _ in 0..2 {
        let mut seat = Seat::at(
            &server,
            SeatOptions { desk: again(), size: [1600.0, 1600.0], ..SeatOptions::default() },
        );
        seat.until("connected", |seat| {
            let model = seat.model();
            model.session.value().is_some() && model.status.is_some() && model.connection.is_live()
        });
        seat.press_with(Modifiers::COMMAND, Key::K);
        seat.type_into("Find", "commands");
        seat.press(Key::Enter);
        seat.until("the pane", |seat| seat.shows("no answer came"));
        seat.click("Ask again");
        seat.until("queued", |seat| seat.shows("GetImageInfo is queued: command"));
        assert_eq!(seat.harness.state().desk().commands.drafts[0].asked, None);
    }
    host.until("listed", |seat| !stages(seat, "GetImageInfo").is_empty());
    assert_eq!(stages(&host, "GetImageInfo").len(), 1, "one click, one command");

    open(&mut host, "getimagechunk 7 9");
    host.stop_server();
    host.until("lost", |seat| matches!(seat.model().connection, Connection::Lost { .. }));
    host.harness.run_steps(3);
    assert!(host.shows("the server is away"), "{:?}", host.labels());
    host.click("Send GetImageChunk");
    let kept = serde_json::to_string(host.harness.state().desk()).unwrap();
    let kept: Desk = serde_json::from_str(&kept).unwrap();
    let draft = kept.commands.drafts.iter().find(|draft| draft.command == "GetImageChunk").unwrap();
    assert_eq!((draft.text("first"), draft.text("count"), &draft.asked), ("7", "9", &None));
}

#[test]
fn a_handover_is_read_and_saved_to_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let desk = Desk { report_folder: folder.path().display().to_string(), ..Desk::default() };
    let mut seat = Seat::take_with(SeatOptions { draws: true, desk, ..SeatOptions::default() });
    seat.layout(Layout::Health);
    seat.click("Shift handover");
    seat.until("made", |seat| seat.shows("Handover at"));
    seat.picture("health");
    seat.click("Save Markdown");
    seat.until("saved", |seat| seat.shows("Saved as"));
    let saved = std::fs::read_to_string(folder.path().join("handover.md")).unwrap();
    assert!(saved.contains("Handover at"), "{saved}");
}
