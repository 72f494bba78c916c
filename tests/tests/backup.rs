//! Backups of a server that works: taken under load, put back elsewhere, broken off, damaged.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed, loudly")]

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use end_to_end::operator::Operator;
use end_to_end::process::{gs_server, run};
use end_to_end::wait::{pause, until};
use end_to_end::{Client, Folder, Process, Server, Twin, journal};
use protocol::SealedUplink;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

fn take(folder: &Folder, target: &Path) -> Value {
    let mut command = gs_server(["backup", "--json", "--config"]);
    let (code, out, error) = run({
        command.arg(folder.file("station.toml")).arg(target);
        command
    });
    assert_eq!((code, error.as_str()), (0, ""), "{out}");
    serde_json::from_str(&out).expect("a manifest")
}

fn verify(file: &Path) -> (i32, String) {
    let mut command = gs_server(["backup", "verify"]);
    command.arg(file);
    let (code, out, error) = run(command);
    (code, format!("{out}{error}"))
}

fn restore(file: &Path, to: &Path) -> (i32, String) {
    let mut command = gs_server(["restore", "--to"]);
    command.arg(to).arg(file);
    let (code, out, error) = run(command);
    (code, format!("{out}{error}"))
}

/// A list as the API tells it, up to this number.
fn list(client: &Client, path: &str, number: &str, last: &Value) -> Vec<Value> {
    let last = last.as_i64().expect("a number");
    let all: Vec<Value> = client.all(path);
    all.into_iter().filter(|item| item[number].as_i64().is_some_and(|n| n <= last)).collect()
}

/// The counters of everything that ground radiated, in order; no nonce twice.
fn counters(folder: &Folder) -> Vec<u64> {
    let entries = journal::read(&folder.journal());
    let mut nonces = HashSet::new();
    let sealed = journal::radiated(&entries).into_iter().filter_map(|packet| {
        let sealed = SealedUplink::from_bytes(packet.try_into().ok()?).ok()?;
        assert!(nonces.insert(sealed.nonce()), "nonce {} was radiated twice", sealed.nonce());
        Some(sealed.nonce().counter().0)
    });
    sealed.collect()
}

#[test]
fn taken_under_load_and_restored_it_is_the_same_archive_and_seals_nothing_until_confirmed() {
    let mut folder = Folder::new();
    folder.heartbeat_s = 10;
    let _twin = Twin::start(&folder, &["--seed", "5"]);
    let server = Server::start(&folder);
    let target = folder.file("ground.tar");
    let done = Arc::new(AtomicBool::new(false));
    let operating = {
        let (operator, done) = (Operator::new(server.client.clone(), 5), Arc::clone(&done));
        std::thread::spawn(move || operator.work(&done))
    };
    until("something was radiated", Duration::from_secs(60), || (counters(&folder).len() >= 3).then_some(()));
    let manifest = take(&folder, &target);
    assert_eq!(target.metadata().expect("a file").permissions().mode() & 0o777, 0o600);
    let at_backup = counters(&folder).len();
    until("more was radiated", Duration::from_secs(60), || {
        (counters(&folder).len() >= at_backup + 3).then_some(())
    });
    done.store(true, Ordering::Relaxed);
    drop(operating.join().expect("the operator"));
    assert_eq!(verify(&target).0, 0);
    let told = |client: &Client| {
        (
            list(client, "/api/v1/events", "sequence", &manifest["last_event"]),
            list(client, "/api/v1/frames", "id", &manifest["last_frame"]),
        )
    };
    let before = told(&server.client);
    assert!(!before.1.is_empty(), "no frame was heard before the backup");
    server.stop();
    let lost = counters(&folder);

    // Another folder, under the name that the configuration has.
    std::fs::rename(folder.data(), folder.file("lost")).expect("renamed");
    let (code, says) = restore(&target, &folder.data());
    assert_eq!(code, 0, "{says}");
    assert!(says.contains("confirmed"), "{says}");
    is_a_moment_of(&archive(&folder.data()), &archive(&folder.file("lost")));
    let server = Server::start(&folder);
    assert_eq!(told(&server.client), before, "the archive is the same up to the backup");

    assert!(server.station().sealing[0].locked.as_deref().is_some_and(|why| why.contains("restored")));
    let body = r#"{"command":"Ping"}"#;
    assert_eq!(server.client.post("/api/v1/commands", "locked", body).expect("an answer").status, 201);
    until("the satellite was heard again", Duration::from_secs(60), || {
        server.station().satellites[0].in_contact.then_some(())
    });
    pause(Duration::from_secs(5));
    assert_eq!(counters(&folder).len(), lost.len(), "sealed without confirmation");
    let path = format!("/api/v1/keys/{}/confirm-counter", folder.key().id());
    let confirmed = server.client.post(&path, "confirm", "{}").expect("an answer");
    assert!(matches!(confirmed.status, 200 | 201), "{}", confirmed.text());
    until("commands go out again", Duration::from_secs(60), || {
        (counters(&folder).len() >= lost.len() + 3).then_some(())
    });
    let after = counters(&folder);
    let highest = lost.iter().max().expect("something was radiated");
    assert!(after[lost.len()..].iter().all(|counter| counter > highest), "{highest}: {after:?}");
    server.stop();
    // Confirmed once is confirmed for good.
    let server = Server::start(&folder);
    assert_eq!(server.station().sealing[0].locked, None);
    server.stop();
    restored_it_is_equal_in_every_table(&folder);
}

/// Every table of the archive in this folder.
fn archive(folder: &Path) -> BTreeMap<String, BTreeSet<String>> {
    migrations::tables::all(&folder.join("ground.sqlite3")).expect("an archive")
}

/// Tables whose rows change while the server works; a row of all others is never changed.
const CHANGING: [&str; 17] = [
    "alert_deliveries",
    "alert_progress",
    "alerts",
    "approvals",
    "downloads",
    "forward_targets",
    "forwards",
    "frames",
    "images",
    "limits",
    "passes",
    "plan_runs",
    "plans",
    "receptions",
    "sessions",
    "user_links",
    "users",
];

/// What was taken under load is the archive as it was at one moment: no row that it never had, none of another form.
fn is_a_moment_of(taken: &BTreeMap<String, BTreeSet<String>>, later: &BTreeMap<String, BTreeSet<String>>) {
    assert!(later.len() > 30, "{:?}", later.keys());
    assert!(taken.keys().eq(later.keys()), "{:?}", taken.keys());
    for (table, rows) in later {
        let then = &taken[table];
        assert!(then.len() <= rows.len(), "{table}: {} rows, later {}", then.len(), rows.len());
        let strangers: Vec<_> = then.difference(rows).collect();
        let may_differ = CHANGING.contains(&table.as_str());
        assert!(strangers.is_empty() || may_differ, "{table}: {strangers:?} were never there");
    }
    for table in ["events", "audit", "audit_links", "commands", "command_stages", "sealed_frames"] {
        let (then, now) = (taken[table].len(), later[table].len());
        assert!(then > 0 && then < now, "{table}: {then} rows, later {now}: there was no load");
    }
}

/// What a restore changes on purpose: what waited to be passed on may have gone since. The rest of it stands beside the database.
const CHANGED_BY_RESTORE: [&str; 1] = ["forwards"];

/// Every other row of every table is as it was.
fn restored_it_is_equal_in_every_table(folder: &Folder) {
    let (target, to) = (folder.file("quiet.tar"), folder.file("elsewhere"));
    take(folder, &target);
    let (code, says) = restore(&target, &to);
    assert_eq!(code, 0, "{says}");
    let (here, there) = (archive(&folder.data()), archive(&to));
    assert!(here.keys().eq(there.keys()), "{:?}", there.keys());
    for (table, rows) in &here {
        assert_eq!(there[table].len(), rows.len(), "{table}");
        let may_differ = CHANGED_BY_RESTORE.contains(&table.as_str());
        assert!(
            may_differ || there[table] == *rows,
            "{table}: {:?}",
            rows.symmetric_difference(&there[table]).next()
        );
    }
    let files: BTreeSet<String> = to
        .read_dir()
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        // Of our own look into it.
        .filter(|name| !name.ends_with("-wal") && !name.ends_with("-shm"))
        .collect();
    // No lock, token, reserve or head of the audit; the witness is marked, and locks every key until it is confirmed.
    assert!(files.iter().eq(["ground.sqlite3", "restored-station.toml", "witness"]), "{files:?}");
    assert!(to.join("witness/restored").exists());
}

/// A data folder with something in it, and no server.
fn idle_folder() -> Folder {
    let folder = Folder::new();
    Server::start(&folder).stop();
    folder
}

/// The archive is large enough that each step lasts, and the kill comes when the step is seen under way.
#[test]
fn killed_in_the_middle_it_leaves_the_old_one_whole() {
    let folder = idle_folder();
    let target = folder.file("ground.tar");
    take(&folder, &target);
    let old = std::fs::read(&target).expect("a backup");
    let archive = folder.data().join("ground.sqlite3");
    migrations::tables::grow(&archive, 1_000_000).expect("a large archive");
    let full = archive.metadata().expect("a file").len();
    assert!(full > 30_000_000, "{full} bytes");
    let size = |name: &str| folder.file(name).metadata().map_or(0, |meta| meta.len());
    let mut random = ChaCha8Rng::seed_from_u64(3);
    // First while the database is copied, then while it is packed.
    let steps = [".ground.tar.sqlite3", ".ground.tar.new"];
    for step in steps.iter().cycle().take(12) {
        let from = random.random_range(full / 20..full / 2);
        for left in steps {
            let _ = std::fs::remove_file(folder.file(left));
        }
        let mut command = gs_server(["backup", "--config"]);
        command.arg(folder.file("station.toml")).arg(&target).stdout(std::process::Stdio::null());
        let mut backup = Process::start(command, &folder.file("backup.log"));
        until("the step is under way", Duration::from_secs(120), || {
            assert!(backup.ended().is_none(), "{step} never had {from} of {full} bytes: {}", backup.log());
            (size(step) >= from).then_some(())
        });
        backup.kill9();
        let reached = size(step);
        assert!((from..=full).contains(&reached), "{step}: {reached} of {full} bytes");
        assert!(folder.file(steps[1]).exists(), "it was not killed in the middle");
        assert!(std::fs::read(&target).expect("a backup") == old, "the old backup was touched");
    }
    let (code, says) = verify(&target);
    assert_eq!(code, 0, "{says}");
    // What they left behind stands in nobody's way.
    take(&folder, &target);
    assert!(size("ground.tar") > full / 2);
    let (code, says) = verify(&target);
    assert_eq!(code, 0, "{says}");
    let left: Vec<PathBuf> =
        folder.path().read_dir().expect("a folder").flatten().map(|e| e.path()).collect();
    assert!(!left.iter().any(|path| path.to_string_lossy().contains("/.ground.tar")), "{left:?}");
}

#[test]
fn what_is_damaged_or_not_empty_is_refused() {
    let folder = idle_folder();
    let target = folder.file("ground.tar");
    take(&folder, &target);
    let whole = std::fs::read(&target).expect("a backup");

    let (code, says) = restore(&target, &folder.data());
    assert_eq!(code, 3, "{says}");
    assert!(says.contains("is not empty"), "{says}");

    let mut random = ChaCha8Rng::seed_from_u64(4);
    let damaged = folder.file("damaged.tar");
    let to = folder.file("restored");
    for case in 0..12 {
        let mut bytes = whole.clone();
        if case < 4 {
            bytes.truncate(random.random_range(0..bytes.len() - 2048));
        } else {
            // In the content of the database: 512 bytes of header come before.
            let at = random.random_range(512..whole.len() * 9 / 10);
            bytes[at] ^= 1 << random.random_range(0..8);
        }
        std::fs::write(&damaged, bytes).expect("written");
        for (code, says) in [verify(&damaged), restore(&damaged, &to)] {
            assert_eq!(code, 1, "case {case}: {says}");
        }
        assert!(to.read_dir().expect("a folder").next().is_none(), "something was left behind");
    }
    let (code, says) = verify(&folder.file("station.toml"));
    assert_eq!(code, 1, "{says}");
    let mut command = gs_server(["backup", "--data"]);
    command.arg(folder.file("nowhere")).arg(&target);
    assert_eq!(run(command).0, 2);
}

#[test]
fn keys_are_in_no_backup_and_in_a_file_of_their_own_on_demand() {
    let folder = idle_folder();
    let (target, keys) = (folder.file("ground.tar"), folder.file("keys.tar"));
    let with_keys = || {
        let mut command = gs_server(["backup", "--config"]);
        command.arg(folder.file("station.toml")).arg(&target).arg("--with-keys").arg(&keys);
        run(command)
    };
    assert_eq!(with_keys().0, 0);
    assert_eq!(keys.metadata().expect("a file").permissions().mode() & 0o777, 0o600);
    let text = |path: &Path| String::from_utf8_lossy(&std::fs::read(path).expect("a file")).into_owned();
    let (key, token) = (text(&folder.file("twin.key")), text(&folder.data().join("token")));
    let digits = key.lines().next().expect("a key");
    assert!(text(&keys).contains(digits));
    let backup = text(&target);
    assert!(!backup.contains(digits) && !backup.contains(token.trim()));
    assert!(backup.contains("[station]"), "the configuration is there");
    let (code, _, says) = with_keys();
    assert_eq!(code, 3, "{says}");
}
