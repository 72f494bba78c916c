//! What the window says when the server is away.

use ground_app::model::Connection;

use crate::common::{Seat, SeatOptions};

#[test]
fn a_server_that_dies_in_a_pass_is_missed() {
    let mut seat = Seat::take_with(SeatOptions { draws: true, ..SeatOptions::default() });
    seat.until_in_pass();
    assert!(seat.picture("pass").width() >= 1280);
    seat.stop_server();
    seat.until("missed", |seat| matches!(seat.model().connection, Connection::Lost { .. }));
    assert!(seat.shows("away"), "{:?}", seat.labels());
}
