//! What the window says when the server is away.

use ground_app::link::{NOTICED_WITHIN, Server};
use ground_app::model::Connection;

use crate::common::{Seat, SeatOptions};

#[test]
fn a_server_that_dies_in_a_pass_is_missed() {
    let mut seat = Seat::take_with(SeatOptions { draws: true, ..SeatOptions::default() });
    seat.until_in_pass();
    assert!(seat.picture("pass").width() >= 1280);
    seat.stop_server();
    let gone = ground_app::clock::instant();
    seat.until("said", |seat| seat.shows("The server is away. All that is shown is"));
    let said_after = ground_app::clock::instant().duration_since(gone);
    assert!(said_after <= NOTICED_WITHIN, "{said_after:?}");
    assert!(matches!(seat.model().connection, Connection::Lost { .. }));
    let unknown = format!("Transmitter {}", ui::lamps::Transmitter::Unknown.word());
    assert!(seat.has(&unknown), "what it does now nobody knows: {:?}", seat.labels());
    seat.picture("lost");
}

#[test]
fn a_wrong_address_is_told_with_what_to_do() {
    // Nobody listens there: it was free a moment ago
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let server = Server { address: format!("http://{free}"), token: None };
    let mut seat = Seat::at(&server, SeatOptions::default());
    seat.until("told", |seat| seat.shows("Is the address right, and does gs-server run there?"));
    assert!(seat.shows("not reached"));
}

#[test]
fn a_bad_token_is_told_with_what_to_do_and_is_not_shown() {
    let owner = Seat::take();
    let address = owner.model().address.clone();
    let server = Server { address, token: Some("never-a-good-token-0000".to_owned()) };
    let mut seat = Seat::at(&server, SeatOptions::default());
    seat.until("told", |seat| seat.shows("Give a good token"));
    assert!(seat.shows("refused"), "{:?}", seat.labels());
    assert!(!seat.shows("never-a-good-token"));
}
