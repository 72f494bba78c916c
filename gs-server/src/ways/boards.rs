//! What boards of one's own say of themselves: in `welcome`, `ping` and `status`, and by reporting packets.
//!
//! Kept in memory only: a board says hello on every connection and pings each minute, so a restart knows all of it soon.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use api::{BoardView, Time};
use mission::UtcUs;
use serde_json::{Map, Value};

use super::status::BoardPlace;
use crate::ingest::formats::Topic;

/// Boards that are remembered; of more, the one that was silent longest is forgotten.
const MOST: usize = 256;
/// A board pings each minute: after so long without a word it is gone.
const GONE_US: i64 = 180_000_000;
/// Characters of a text that are kept.
const TEXT_MAX: usize = 64;
/// Firmware that reads its clock when a packet is received, and not when the message is sent.
const READS_AT_RECEPTION: i64 = 2_603_242;

/// All boards. Cheap to clone.
#[derive(Clone, Default)]
pub(super) struct Boards(Arc<Mutex<BTreeMap<String, Board>>>);

struct Board {
    seen: UtcUs,
    welcome: Option<UtcUs>,
    left: bool,
    place: BoardPlace,
    view: BoardView,
}

/// What a message of a board was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Told {
    /// It is there (again).
    Welcome,
    /// Something of its health.
    Health,
    /// It went away.
    Left,
    /// Nothing that is kept.
    Nothing,
}

impl Boards {
    fn with<T>(&self, topic: &Topic, way: &str, now: UtcUs, change: impl FnOnce(&mut Board) -> T) -> T {
        let mut boards = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let key = format!("{}/{}", topic.user, topic.station);
        if !boards.contains_key(&key) && boards.len() >= MOST {
            let quietest = boards.iter().min_by_key(|(_, board)| board.seen).map(|(key, _)| key.clone());
            quietest.and_then(|key| boards.remove(&key));
        }
        let board = boards.entry(key).or_insert_with(|| Board {
            seen: now,
            welcome: None,
            left: false,
            place: BoardPlace::default(),
            view: BoardView::default(),
        });
        way.clone_into(&mut board.view.way);
        topic.station.clone_into(&mut board.place.station);
        board.seen = board.seen.max(now);
        change(board)
    }

    /// A message other than a packet.
    pub(super) fn told(&self, topic: &Topic, way: &str, payload: &[u8], now: UtcUs) -> Told {
        let object = || match serde_json::from_slice(payload) {
            Ok(Value::Object(object)) => Some(object),
            _ => None,
        };
        match (topic.kind.as_str(), topic.name.as_str()) {
            // The board's last will; a broker publishes it when the board is gone.
            ("tele", "status") => {
                self.with(topic, way, now, |board| board.left = payload.trim_ascii() == b"0");
                Told::Left
            }
            ("tele", "welcome") => {
                let Some(object) = object() else { return Told::Nothing };
                self.with(topic, way, now, |board| {
                    (board.left, board.welcome) = (false, Some(now));
                    board.learn(&object);
                });
                Told::Welcome
            }
            ("tele", "ping") | ("stat", "status") => {
                let Some(object) = object() else { return Told::Nothing };
                self.with(topic, way, now, |board| {
                    board.left = false;
                    board.learn(&object);
                });
                Told::Health
            }
            // Answers to commands, settings, and a request for a credential: nothing to keep.
            _ => Told::Nothing,
        }
    }

    /// It reported a packet.
    pub(super) fn heard(&self, topic: &Topic, way: &str, has_bytes: bool, now: UtcUs) {
        self.with(topic, way, now, |board| {
            board.left = false;
            board.view.packets += 1;
            board.view.crc_errors += u64::from(!has_bytes);
        });
    }

    /// Whether the board reads its clock at the reception; `None` while it has not said what it runs.
    pub(super) fn reads_at_reception(&self, topic: &Topic) -> Option<bool> {
        let boards = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let board = boards.get(&format!("{}/{}", topic.user, topic.station))?;
        board.view.version.map(|version| version >= READS_AT_RECEPTION)
    }

    pub(super) fn views(&self, now: UtcUs) -> Vec<(String, BoardPlace, BoardView)> {
        let boards = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let view = |(key, board): (&String, &Board)| {
            let time = |at: UtcUs| Time::from_unix_us(at.0);
            let view = BoardView {
                online: !board.left && now.0 - board.seen.0 <= GONE_US,
                last_seen_at: Some(time(board.seen)),
                welcome_at: board.welcome.map(time),
                ..board.view.clone()
            };
            (key.clone(), board.place.clone(), view)
        };
        boards.iter().map(view).collect()
    }
}

impl Board {
    /// Values that make sense; what does not is left as it was.
    fn learn(&mut self, object: &Map<String, Value>) {
        let number = |key: &str| object.get(key).and_then(Value::as_f64).filter(|value| value.abs() < 1e9);
        let whole = |key: &str, range: std::ops::RangeInclusive<i64>| {
            object.get(key).and_then(Value::as_i64).filter(|value| range.contains(value))
        };
        let text = |key: &str| {
            let text = object.get(key).and_then(Value::as_str)?;
            let text: String = text.chars().filter(|c| !c.is_control()).take(TEXT_MAX).collect();
            (!text.is_empty()).then_some(text)
        };
        let view = &mut self.view;
        let keep = |old: &mut Option<_>, new: Option<_>| {
            if new.is_some() {
                *old = new;
            }
        };
        let is_mac = |mac: &String| mac.len() == 12 && mac.bytes().all(|byte| byte.is_ascii_hexdigit());
        let mac = text("mac").filter(is_mac).map(|mac| mac.to_ascii_uppercase());
        if mac.is_some() {
            view.mac = mac;
        }
        if let Some(sat) = text("sat").or_else(|| text("satellite")) {
            view.listening_to = Some(sat);
        }
        let keep_whole = |old: &mut Option<i64>, new: Option<i64>| *old = new.or(*old);
        keep_whole(&mut view.version, whole("version", 1..=99_999_999));
        keep_whole(&mut view.memory_bytes, whole("Mem", 0..=1 << 40));
        keep_whole(&mut view.uptime_s, whole("seconds", 0..=1 << 40));
        keep_whole(&mut view.radio, whole("radio", -100_000..=100_000));
        keep(&mut view.battery_raw, number("Vbat"));
        keep(&mut view.noise_dbm, number("InstRSSI").filter(|dbm| (-200.0..=50.0).contains(dbm)));
        keep(&mut view.wifi_dbm, number("RSSI").filter(|dbm| (-200.0..=50.0).contains(dbm)));
        if let Some(Value::Array(pair)) = object.get("station_location")
            && let [latitude, longitude] = pair.as_slice()
            && let (Some(latitude), Some(longitude)) = (latitude.as_f64(), longitude.as_f64())
            && latitude.abs() <= 90.0
            && longitude.abs() <= 180.0
        {
            self.place.place = Some((latitude, longitude));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: UtcUs = UtcUs(1_790_000_000_000_000);

    fn topic(name: &str) -> Topic {
        Topic::parse(&format!("tinygs/team/roof/tele/{name}")).unwrap()
    }

    #[test]
    fn a_board_is_known_by_its_welcome_and_gone_by_its_will_or_by_silence() {
        let boards = Boards::default();
        assert_eq!(boards.reads_at_reception(&topic("rx")), None);
        let welcome = br#"{"station_location":[12.971,77.594],"version":2603242,"sat":"PixelSat-I","mac":"a0b1c2d3e4f5","Vbat":1890,"seconds":7}"#;
        assert_eq!(boards.told(&topic("welcome"), "own", welcome, NOW), Told::Welcome);
        assert_eq!(boards.reads_at_reception(&topic("rx")), Some(true));
        let ping = br#"{"Vbat":1880,"Mem":150000,"RSSI":-61,"radio":0,"InstRSSI":-110.5}"#;
        assert_eq!(boards.told(&topic("ping"), "own", ping, NOW.plus(60_000_000)), Told::Health);
        let (id, place, view) = boards.views(NOW.plus(61_000_000)).remove(0);
        assert_eq!((id.as_str(), place.place), ("team/roof", Some((12.971, 77.594))));
        assert!(view.online);
        assert_eq!((view.mac.as_deref(), view.battery_raw), (Some("A0B1C2D3E4F5"), Some(1880.0)));
        assert_eq!((view.wifi_dbm, view.noise_dbm, view.radio), (Some(-61.0), Some(-110.5), Some(0)));
        assert!(!boards.views(NOW.plus(300_000_000))[0].2.online, "silent for four minutes");
        assert_eq!(boards.told(&topic("status"), "own", b"0", NOW.plus(62_000_000)), Told::Left);
        assert!(!boards.views(NOW.plus(62_000_000))[0].2.online);
        boards.heard(&topic("rx"), "own", false, NOW.plus(63_000_000));
        let view = &boards.views(NOW.plus(63_000_000))[0].2;
        assert!(view.online && view.packets == 1 && view.crc_errors == 1);
    }

    #[test]
    fn nonsense_changes_nothing_and_many_names_take_no_room() {
        let boards = Boards::default();
        let nonsense =
            br#"{"version":"new","Vbat":[1],"station_location":[900,0],"mac":"<script>","RSSI":1e300}"#;
        boards.told(&topic("welcome"), "own", nonsense, NOW);
        boards.told(&topic("welcome"), "own", b"[[[[", NOW);
        let (_, place, view) = boards.views(NOW).remove(0);
        assert_eq!((place.place, view.version, view.mac, view.wifi_dbm), (None, None, None, None));
        for number in 0..1_000 {
            let topic = Topic::parse(&format!("tinygs/team/{number}/tele/ping")).unwrap();
            boards.told(&topic, "own", b"{}", NOW.plus(number));
        }
        assert_eq!(boards.views(NOW).len(), MOST);
    }
}
