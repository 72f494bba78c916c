//! When was it received: the best of the times that a report carries, and how far it can be relied on.

use super::{Doubt, Doubts};
use crate::clock::UtcUs;

/// A board whose clock is nearer than this to the server's is believed, microseconds.
const AGREES_US: u64 = 5_000_000;
/// Clocks of others may be ahead of ours by so much, microseconds.
const AHEAD_US: i64 = 60_000_000;
/// No satellite of ours flew before 2000-01-01T00:00:00Z.
const EARLIEST: UtcUs = UtcUs(946_684_800_000_000);
/// What a synchronised board clock is off by, with the packet's own time on the air, microseconds.
const BOARD_ERROR_US: u64 = 1_000_000;
/// The server's time of a packet was seen up to 16 s beside the packet's other time.
const SERVER_ERROR_US: u64 = 16_000_000;
/// A message that comes while it is waited for: some seconds on the way, or a reconnection of the board.
const ARRIVAL_ERROR_US: u64 = 30_000_000;

/// All times that a report carries. `None`: it carries none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Times {
    /// The clock of the board.
    pub board: Option<UtcUs>,
    /// Whether that clock was read when the packet was received (firmware 2603242 and later) and not when the message
    /// was sent; `None`: nobody knows.
    pub board_read_at_reception: Option<bool>,
    /// What the network's server says.
    pub server: Option<UtcUs>,
    /// What the message says without naming a clock, or the person who hands it in.
    pub stated: Option<UtcUs>,
    /// How that stated time is known, and how far off it may be in microseconds, where an archive wrote it down; `None`:
    /// nobody said.
    pub stated_as: Option<(TimeBasis, Option<u64>)>,
    /// When the message came in here, for one that was waited for. `None` for a file.
    pub arrived: Option<UtcUs>,
}

/// How the time of a reception is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TimeBasis {
    /// The board's clock, read at the reception, and agreeing with another clock.
    BoardAtReception,
    /// The board's clock, read when the message was sent or nobody knows when, agreeing with another clock.
    Board,
    /// The time of the network's server.
    Server,
    /// The message says so, without naming a clock.
    Stated,
    /// The board's clock alone; nothing agrees with it and nothing contradicts it.
    BoardAlone,
    /// When the message came in here.
    Arrival,
    /// Not at all: it is the time of the import.
    Import,
}

impl TimeBasis {
    /// All.
    pub const ALL: [Self; 7] = [
        Self::BoardAtReception,
        Self::Board,
        Self::Server,
        Self::Stated,
        Self::BoardAlone,
        Self::Arrival,
        Self::Import,
    ];

    /// The word in the database and on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::BoardAtReception => "board-at-reception",
            Self::Board => "board",
            Self::Server => "server",
            Self::Stated => "stated",
            Self::BoardAlone => "board-alone",
            Self::Arrival => "arrival",
            Self::Import => "import",
        }
    }

    /// How far off such a time usually is, microseconds; `None`: nobody knows.
    pub const fn usual_error_us(self) -> Option<u64> {
        match self {
            Self::BoardAtReception | Self::Stated => Some(BOARD_ERROR_US),
            Self::Board => Some(AGREES_US),
            Self::Server => Some(SERVER_ERROR_US),
            Self::Arrival => Some(ARRIVAL_ERROR_US),
            Self::BoardAlone | Self::Import => None,
        }
    }

    /// The basis of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|basis| basis.name() == name)
    }
}

/// The time of a reception, how it is known, and how far off it may be in microseconds.
///
/// A board's clock that agrees with the server (or, without one, with the arrival) within 5 s, else the server's, else
/// what was stated, else the arrival; a board's clock alone when there is nothing else. Nothing from before `earliest`
/// or more than 60 s after `now` counts at all. A stated time of which an archive wrote down how it is known stays known
/// like that: it gets no better by being carried about.
pub fn choose_time(
    times: &Times,
    now: UtcUs,
    earliest: Option<UtcUs>,
    doubts: &mut Doubts,
) -> (UtcUs, TimeBasis, Option<u64>) {
    let earliest = earliest.unwrap_or(EARLIEST).max(EARLIEST);
    let mut usable = |time: Option<UtcUs>| {
        let time = time?;
        if time < earliest {
            doubts.add(Doubt::TimeTooEarly);
            None
        } else if time > now.plus(AHEAD_US) {
            doubts.add(Doubt::TimeInFuture);
            None
        } else {
            Some(time)
        }
    };
    let (board, server) = (usable(times.board), usable(times.server));
    let (stated, arrived) = (usable(times.stated), usable(times.arrived));
    if let (Some(stated), Some((basis, error_us))) = (stated, times.stated_as) {
        return (stated, basis, error_us);
    }
    let reference = server.or(stated).or(arrived);
    match (board, reference) {
        (Some(board), Some(reference)) if board.0.abs_diff(reference.0) <= AGREES_US => {
            let basis = match times.board_read_at_reception {
                Some(true) => TimeBasis::BoardAtReception,
                _ => TimeBasis::Board,
            };
            let error_us =
                if times.board_read_at_reception == Some(true) { BOARD_ERROR_US } else { AGREES_US };
            return (board, basis, Some(error_us));
        }
        (Some(_), Some(_)) => doubts.add(Doubt::ClockDisagrees),
        _ => {}
    }
    match (server, stated, board, arrived) {
        (Some(server), ..) => (server, TimeBasis::Server, Some(SERVER_ERROR_US)),
        (None, Some(stated), ..) => (stated, TimeBasis::Stated, Some(BOARD_ERROR_US)),
        (None, None, board, Some(arrived)) => {
            // A board that kept the message over a reconnection shows by how much.
            let behind = board.map_or(0, |board| u64::try_from(arrived.0 - board.0).unwrap_or(0));
            let error_us =
                if behind <= 3_600_000_000 { behind.max(ARRIVAL_ERROR_US) } else { ARRIVAL_ERROR_US };
            (arrived, TimeBasis::Arrival, Some(error_us))
        }
        (None, None, Some(board), None) => (board, TimeBasis::BoardAlone, None),
        (None, None, None, None) => (now, TimeBasis::Import, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: UtcUs = UtcUs(1_790_000_000_000_000);

    fn chosen(times: Times) -> (UtcUs, TimeBasis, Option<u64>, Vec<Doubt>) {
        let mut doubts = Doubts::default();
        let (at, basis, error) = choose_time(&times, NOW, None, &mut doubts);
        (at, basis, error, doubts.iter().collect())
    }

    #[test]
    fn a_board_is_believed_when_it_agrees_with_the_server() {
        let board = Some(NOW.plus(-4_000_000));
        let times =
            Times { board, server: Some(NOW), board_read_at_reception: Some(true), ..Times::default() };
        assert_eq!(
            chosen(times),
            (NOW.plus(-4_000_000), TimeBasis::BoardAtReception, Some(BOARD_ERROR_US), vec![])
        );
        let times = Times { board: Some(NOW.plus(-6_000_000)), ..times };
        assert_eq!(
            chosen(times),
            (NOW, TimeBasis::Server, Some(SERVER_ERROR_US), vec![Doubt::ClockDisagrees])
        );
        let times = Times { board, arrived: Some(NOW), ..Times::default() };
        assert_eq!(chosen(times).1, TimeBasis::Board);
    }

    #[test]
    fn a_clock_of_1970_or_of_tomorrow_counts_for_nothing() {
        for (board, doubt) in
            [(UtcUs(31_000_000), Doubt::TimeTooEarly), (NOW.plus(60_000_001), Doubt::TimeInFuture)]
        {
            let times = Times { board: Some(board), arrived: Some(NOW.plus(-5)), ..Times::default() };
            assert_eq!(
                chosen(times),
                (NOW.plus(-5), TimeBasis::Arrival, Some(ARRIVAL_ERROR_US), vec![doubt])
            );
            let times = Times { board: Some(board), ..Times::default() };
            assert_eq!(chosen(times), (NOW, TimeBasis::Import, None, vec![doubt]));
        }
        let extremes =
            Times { board: Some(UtcUs(i64::MIN)), server: Some(UtcUs(i64::MAX)), ..Times::default() };
        assert_eq!(chosen(extremes).1, TimeBasis::Import);
    }

    #[test]
    fn a_message_that_waited_in_its_board_is_that_uncertain() {
        let waited = Times { board: Some(NOW.plus(-600_000_000)), arrived: Some(NOW), ..Times::default() };
        assert_eq!(chosen(waited), (NOW, TimeBasis::Arrival, Some(600_000_000), vec![Doubt::ClockDisagrees]));
    }

    #[test]
    fn what_an_archive_wrote_down_stays_as_it_is_known() {
        for basis in TimeBasis::ALL {
            for error_us in [None, Some(42)] {
                let times = Times {
                    stated: Some(NOW.plus(-7)),
                    stated_as: Some((basis, error_us)),
                    arrived: Some(NOW),
                    ..Times::default()
                };
                assert_eq!(chosen(times), (NOW.plus(-7), basis, error_us, vec![]));
                let times = Times { stated: Some(UtcUs(31_000_000)), arrived: None, ..times };
                assert_eq!(chosen(times).1, TimeBasis::Import, "not believed, whatever it says of itself");
            }
        }
    }

    #[test]
    fn nothing_from_before_the_launch() {
        let mut doubts = Doubts::default();
        let times = Times { stated: Some(NOW.plus(-10)), ..Times::default() };
        let (_, basis, _) = choose_time(&times, NOW, Some(NOW.plus(-9)), &mut doubts);
        assert_eq!(basis, TimeBasis::Import);
        assert!(doubts.has(Doubt::TimeTooEarly));
    }
}
