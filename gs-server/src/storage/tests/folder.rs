//! Who may open the folder, and what an unsuitable one says.

use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use sqlx::Connection as _;

use super::super::db::sql;
use super::super::{DATABASE, Store, StoreError, StoreOptions};
use super::records::*;
use super::{Kind, fresh, options, reopen};

fn mode(path: &Path) -> u32 {
    path.metadata().unwrap().permissions().mode() & 0o777
}

#[tokio::test]
async fn nobody_else_may_read_the_folder() {
    let (parent, store) = fresh(Kind::Lite).await;
    store.apply(&batch(heard(1))).await.unwrap();
    store.raise_witness(key(), protocol::Counter(1)).await.unwrap();
    let folder = parent.path().join("data");
    assert_eq!(mode(&folder), 0o700);
    let mut files = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        assert_eq!(mode(&path), if path.is_dir() { 0o700 } else { 0o600 }, "{}", path.display());
        files += 1;
    }
    assert_eq!(files, 6, "database, -wal, -shm, lock, reserve.bin, witness");
}

#[tokio::test]
async fn the_log_is_synced_at_each_commit() {
    let (_parent, store) = fresh(Kind::Lite).await;
    let mut writer = store.0.writer.lock().await;
    let mut connection = writer.begin().await.unwrap();
    let synchronous: i64 = sql("pragma synchronous").scalar(&mut connection).await.unwrap();
    let journal: String = sql("pragma journal_mode").scalar(&mut connection).await.unwrap();
    let foreign_keys: i64 = sql("pragma foreign_keys").scalar(&mut connection).await.unwrap();
    assert_eq!((synchronous, journal.as_str(), foreign_keys), (2, "wal", 1));
}

#[tokio::test]
async fn readers_cannot_write() {
    let (_parent, store) = fresh(Kind::Lite).await;
    let error = sql("delete from limits").execute(&store.0.readers).await.unwrap_err();
    assert!(matches!(error, StoreError::Permission { .. }), "{error:?}");
}

#[tokio::test]
async fn a_second_server_is_refused_and_told_who_is_there() {
    let (parent, store) = fresh(Kind::Lite).await;
    let error = reopen(&parent).await.unwrap_err();
    assert!(matches!(error, StoreError::Locked { holder: Some(pid), .. } if pid == std::process::id()));
    assert!(error.to_string().contains("use another data folder"), "{error}");
    drop(store);
    reopen(&parent).await.unwrap();
}

#[tokio::test]
async fn simulated_and_real_do_not_meet() {
    let (parent, store) = fresh(Kind::Lite).await;
    drop(store);
    let simulated = StoreOptions { simulated: true, ..options(&parent) };
    let error = Store::open(simulated).await.unwrap_err();
    assert!(matches!(error, StoreError::SimulatedMark { simulated: false, .. }));
    assert!(error.to_string().ends_with("was made by a real station: use another data folder"), "{error}");

    let other = tempfile::tempdir().unwrap();
    let store = Store::open(StoreOptions { simulated: true, ..options(&other) }).await.unwrap();
    assert!(store.is_simulated());
    drop(store);
    let error = reopen(&other).await.unwrap_err();
    assert!(error.to_string().ends_with("was made by a simulation: use another data folder"), "{error}");
}

#[tokio::test]
async fn a_newer_schema_is_refused() {
    let (parent, store) = fresh(Kind::Lite).await;
    store.close().await.unwrap();
    drop(store);
    let path = parent.path().join("data").join(DATABASE);
    let mut other = sqlx::SqliteConnection::connect(path.to_str().unwrap()).await.unwrap();
    sqlx::query(
        "insert into _sqlx_migrations (version, description, success, checksum, execution_time)
         values (99, 'from the future', true, x'00', 0)",
    )
    .execute(&mut other)
    .await
    .unwrap();
    other.close().await.unwrap();
    let error = reopen(&parent).await.unwrap_err();
    assert!(matches!(error, StoreError::NewerSchema { found: 99, .. }));
    assert!(error.to_string().contains("start the newer program"), "{error}");
}

#[tokio::test]
async fn tables_that_are_not_ours_are_refused() {
    let (parent, store) = fresh(Kind::Lite).await;
    store.close().await.unwrap();
    drop(store);
    let path = parent.path().join("data").join(DATABASE);
    let mut other = sqlx::SqliteConnection::connect(path.to_str().unwrap()).await.unwrap();
    sqlx::query("drop trigger frames_are_kept").execute(&mut other).await.unwrap();
    other.close().await.unwrap();
    assert!(matches!(reopen(&parent).await.unwrap_err(), StoreError::Damaged { .. }));
}

#[tokio::test]
async fn a_file_that_is_no_database_is_refused() {
    let parent = tempfile::tempdir().unwrap();
    std::fs::create_dir(parent.path().join("data")).unwrap();
    std::fs::write(parent.path().join("data").join(DATABASE), "Dear diary, ".repeat(1000)).unwrap();
    let error = reopen(&parent).await.unwrap_err();
    assert!(matches!(error, StoreError::Damaged { .. }), "{error:?}");
    assert!(error.to_string().contains("put a backup in its place"), "{error}");
}

#[tokio::test]
async fn a_file_that_lost_everything_is_refused() {
    let (parent, store) = fresh(Kind::Lite).await;
    store.close().await.unwrap();
    drop(store);
    let path = parent.path().join("data").join(DATABASE);
    std::fs::write(&path, "").unwrap();
    assert!(matches!(reopen(&parent).await.unwrap_err(), StoreError::Damaged { .. }));
    // Moved away by hand, it is a new beginning; the witness will tell.
    std::fs::remove_file(&path).unwrap();
    reopen(&parent).await.unwrap();
}

#[tokio::test]
async fn a_folder_that_is_not_ours_is_told() {
    if rustix::process::geteuid().is_root() {
        // Nothing is forbidden to root; a file in the way is the nearest thing.
        let parent = tempfile::tempdir().unwrap();
        std::fs::write(parent.path().join("data"), "").unwrap();
        assert!(reopen(&parent).await.is_err());
        return;
    }
    let parent = tempfile::tempdir().unwrap();
    std::fs::create_dir(parent.path().join("data")).unwrap();
    std::fs::set_permissions(parent.path().join("data"), std::fs::Permissions::from_mode(0o500)).unwrap();
    let error = reopen(&parent).await.unwrap_err();
    assert!(matches!(error, StoreError::Permission { .. }), "{error:?}");
}

#[tokio::test]
async fn the_reserve_stands_beside_the_database() {
    let (parent, store) = fresh(Kind::Lite).await;
    let frame = mission::ReservedFrame {
        route: route(),
        source: mission::Source::Radio,
        received_at: mission::UtcUs(NOON_US),
        rssi_dbm: Some(-101),
        bytes: vec![5; 17].into(),
    };
    store.reserve_push(frame.clone()).await.unwrap();
    drop(store);
    let store = reopen(&parent).await.unwrap();
    assert_eq!(store.reserve_read().await.unwrap(), std::slice::from_ref(&frame));
    store.reserve_clear().await.unwrap();
    assert_eq!(store.reserve_read().await.unwrap(), []);
    drop(store);
    let none = StoreOptions { reserve_bytes: 0, ..options(&parent) };
    let store = Store::open(none).await.unwrap();
    assert!(store.reserve_push(frame).await.is_err());
    assert_eq!(store.reserve_read().await.unwrap(), []);
    store.reserve_clear().await.unwrap();
}
