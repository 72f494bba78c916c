//! The rooms of the house and who may know whom, as one table. docs/architecture.md tells the reasons.
//!
//! The order is the foundation first: a room knows only rooms that are listed before it, so no arrow can ever
//! turn round unnoticed. Rooms that are not built yet stand in the table already; their walls are decided.

/// Which of our crates a room may name in its manifest.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Knows {
    /// Exactly these, for product code and for tests alike.
    Only(&'static [&'static str]),
    /// All crates: these crates exist to test the others.
    Everyone,
}

/// One crate and its walls.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Room {
    pub(crate) name: &'static str,
    pub(crate) knows: Knows,
    /// Known only as an optional dependency, behind a feature.
    pub(crate) behind_feature: &'static [&'static str],
    /// Known by tests and benches only.
    pub(crate) dev_only: &'static [&'static str],
    /// Must say `#![no_std]`.
    pub(crate) no_std: bool,
}

const fn room(name: &'static str, knows: &'static [&'static str]) -> Room {
    Room { name, knows: Knows::Only(knows), behind_feature: &[], dev_only: &[], no_std: false }
}

const fn no_std_room(name: &'static str) -> Room {
    Room { no_std: true, ..room(name, &[]) }
}

/// The table. A member crate that is missing here is a finding.
pub(crate) const ROOMS: &[Room] = &[
    no_std_room("protocol"),
    no_std_room("fprime"),
    no_std_room("autonomy"),
    room("tle", &[]),
    room("migrations", &[]),
    room("ui", &[]),
    room("radio", &["protocol"]),
    // mission takes airtime from radio and nothing else: see `sources`.
    room("mission", &["protocol", "fprime", "tle", "autonomy", "radio"]),
    room("satellite", &["protocol", "fprime", "tle", "autonomy", "radio"]),
    room("rehearsal", &["protocol", "fprime", "tle", "autonomy", "radio", "mission", "satellite"]),
    room("api", &["protocol"]),
    room(
        "gs-server",
        &[
            "protocol",
            "fprime",
            "autonomy",
            "tle",
            "migrations",
            "radio",
            "mission",
            "satellite",
            "rehearsal",
            "api",
        ],
    ),
    Room {
        behind_feature: &["gs-server"],
        ..room("ground-app", &["protocol", "autonomy", "tle", "ui", "api"])
    },
    Room { knows: Knows::Everyone, ..room("fuzz", &[]) },
    Room { knows: Knows::Everyone, ..room("end-to-end", &[]) },
    room("check", &[]),
];

/// Crates of the registry that are walls themselves: who may name them, in tests too.
///
/// Without tokio and sqlx in reach, nobody can quietly make the engine or a rehearsal wait for a socket or a disk.
pub(crate) const WALLED_OUTSIDERS: &[(&str, &[&str])] = &[
    // migrations: its tests run a database.
    ("tokio", &["migrations", "gs-server", "api", "ground-app", "end-to-end"]),
    ("axum", &["gs-server", "end-to-end"]),
    ("sqlx", &["migrations", "gs-server"]),
    ("serialport", &["gs-server", "end-to-end"]),
    ("clap", &["gs-server", "ground-app", "end-to-end"]),
    ("egui", &["ui", "ground-app"]),
    ("eframe", &["ui", "ground-app"]),
];

pub(crate) fn find(name: &str) -> Option<&'static Room> {
    ROOMS.iter().find(|room| room.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_room_knows_only_rooms_listed_before_it() {
        for (index, room) in ROOMS.iter().enumerate() {
            let Knows::Only(known) = room.knows else { continue };
            for other in known.iter().chain(room.behind_feature) {
                assert!(
                    ROOMS[..index].iter().any(|earlier| earlier.name == *other),
                    "{} knows {other}, which is not listed before it",
                    room.name
                );
            }
        }
    }

    #[test]
    fn mission_and_satellite_never_know_each_other() {
        for (one, other) in [("mission", "satellite"), ("satellite", "mission")] {
            let room = find(one).unwrap();
            let Knows::Only(known) = room.knows else { panic!("{one} has walls") };
            assert!(
                !known.contains(&other)
                    && !room.dev_only.contains(&other)
                    && !room.behind_feature.contains(&other)
            );
        }
    }

    #[test]
    fn no_room_is_listed_twice() {
        for (index, room) in ROOMS.iter().enumerate() {
            assert!(ROOMS[..index].iter().all(|earlier| earlier.name != room.name), "{} twice", room.name);
        }
    }
}
