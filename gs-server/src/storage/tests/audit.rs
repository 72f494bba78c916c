//! The audit's chain: whoever changes, drops, moves or cuts off rows is found out.

use std::path::{Path, PathBuf};

use mission::record::Record;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{AssertSqlSafe, Connection as _};

use super::super::*;
use super::records::*;
use super::{Dice, Kind, Place, fresh, options, reopen};

const ROWS: i64 = 12;

async fn written() -> (Place, PathBuf) {
    let (parent, store) = fresh(Kind::Lite).await;
    for _ in 0..ROWS / 2 {
        let two = vec![Record::Audit(audit("command.create")), Record::Audit(audit("uplink.radiate"))];
        store.apply(&batch(two)).await.unwrap();
    }
    let folder = store.folder().to_path_buf();
    // Waits for the head, too.
    store.close().await.unwrap();
    (parent, folder)
}

/// Somebody with the file and without our program.
async fn tamper(folder: &Path, sql: &str) {
    let connect = SqliteConnectOptions::new().filename(folder.join(DATABASE)).foreign_keys(false);
    let mut db = SqliteConnection::connect_with(&connect).await.unwrap();
    let drop = "drop trigger audit_is_kept; drop trigger audit_is_never_changed;
        drop trigger audit_links_are_kept; drop trigger audit_links_are_never_changed;";
    sqlx::raw_sql(AssertSqlSafe(format!("{drop}{sql}"))).execute(&mut db).await.unwrap();
    db.close().await.unwrap();
}

async fn verdict(folder: &Path) -> AuditVerdict {
    verify_audit(folder, &[]).await.unwrap()
}

#[tokio::test]
async fn what_was_written_is_right_and_its_head_is_noted() {
    let (_parent, folder) = written().await;
    let right = verdict(&folder).await;
    assert_eq!((right.rows, right.wrong), (ROWS as u64, 0), "{:?}", right.findings);
    let head = right.head.unwrap();
    assert_eq!(head.row, ROWS);
    assert_eq!(head.to_string().parse(), Ok(head));
    assert_eq!(std::fs::read_to_string(folder.join("audit-head")).unwrap().trim(), head.to_string());
}

#[tokio::test]
async fn the_chain_goes_on_over_a_restart() {
    let (parent, folder) = written().await;
    let old = verdict(&folder).await.head.unwrap();
    let store = reopen(&parent).await.unwrap();
    store.apply(&batch(vec![Record::Audit(audit("clock.vouch"))])).await.unwrap();
    store.close().await.unwrap();
    let right = verify_audit(&folder, &[old]).await.unwrap();
    assert_eq!((right.rows, right.wrong), (ROWS as u64 + 1, 0), "{:?}", right.findings);
}

#[tokio::test]
async fn every_kind_of_tampering_is_found() {
    let cases = [
        ("update audit set who = 'eve' where id = 5", "row of audit"),
        ("update audit set crc = crc + 1 where id = 5", "row of audit"),
        ("delete from audit where id = 5", "row 5 is missing"),
        ("delete from audit where id = 5; delete from audit_links where audit = 5", "row 5 is missing"),
        (
            "delete from audit where id > 9; delete from audit_links where audit > 9",
            "audit-head ends at row 12",
        ),
        ("delete from audit where id > 9", "audit-head ends at row 12"),
        ("delete from audit_links where audit = 5", "row 5 is tied to nothing"),
        ("delete from audit_links", "row 1 is tied to nothing"),
        ("update audit_links set hash = zeroblob(32) where audit = 5", "row 5 is not what was written"),
        (
            "update audit set id = 100 where id = 5; update audit set id = 5 where id = 6; update audit set id = 6 where id = 100",
            "row of audit",
        ),
    ];
    for (sql, expected) in cases {
        let (_parent, folder) = written().await;
        tamper(&folder, sql).await;
        let verdict = verdict(&folder).await;
        assert!(verdict.wrong > 0, "not noticed: {sql}");
        assert!(
            verdict.findings.iter().any(|finding| finding.contains(expected)),
            "{sql}: {:?}",
            verdict.findings
        );
    }
}

/// Someone who knows our program as well: a row changed, its checksum made right, and the rest of the chain made anew.
#[tokio::test]
async fn a_chain_made_anew_does_not_end_in_the_head_that_was_noted() {
    let (_parent, folder) = written().await;
    let noted = verdict(&folder).await.head.unwrap();
    let connect = SqliteConnectOptions::new().filename(folder.join(DATABASE));
    let mut db = SqliteConnection::connect_with(&connect).await.unwrap();
    sqlx::raw_sql("drop trigger audit_is_never_changed; drop trigger audit_links_are_kept")
        .execute(&mut db)
        .await
        .unwrap();
    let rows = read_audit(&folder, 5).await.unwrap();
    let forged = AuditRow { who: "eve".into(), ..rows[0].clone() };
    sqlx::query("update audit set who = $1, crc = $2 where id = $3")
        .bind(&forged.who)
        .bind(row::Row::crc(&forged))
        .bind(forged.id)
        .execute(&mut db)
        .await
        .unwrap();
    sqlx::raw_sql("delete from audit_links").execute(&mut db).await.unwrap();
    let mut db = super::super::db::Connection::Lite(db);
    audit_chain::begin(&mut db).await.unwrap();
    db.close().await.unwrap();
    let file = verdict(&folder).await;
    assert!(file.findings.iter().any(|finding| finding.contains("audit-head")), "{:?}", file.findings);
    // The file is not out of reach of whoever can write the database; a notebook is.
    std::fs::remove_file(folder.join("audit-head")).unwrap();
    assert_eq!(verdict(&folder).await.wrong, 0);
    assert_eq!(verify_audit(&folder, &[noted]).await.unwrap().wrong, 1);
}

#[tokio::test]
async fn any_changed_byte_of_a_row_is_found() {
    let (_parent, folder) = written().await;
    let rows = read_audit(&folder, 100).await.unwrap();
    let mut dice = Dice(7);
    for _ in 0..5_000 {
        let row = &rows[dice.below(rows.len() as u64) as usize];
        let before = [dice.below(256) as u8; 32];
        let mut other = row.clone();
        let text = match dice.below(6) {
            0 => {
                other.id ^= 1 << dice.below(62);
                None
            }
            1 => {
                other.at_us ^= 1 << dice.below(62);
                None
            }
            2 => Some(&mut other.station),
            3 => Some(&mut other.who),
            4 => Some(&mut other.action),
            _ => Some(&mut other.detail),
        };
        if let Some(text) = text {
            let at = dice.below(text.len() as u64) as usize;
            let mut bytes = text.clone().into_bytes();
            bytes[at] = if bytes[at] == b'x' { b'y' } else { b'x' };
            *text = String::from_utf8(bytes).unwrap();
        }
        assert_ne!(other, *row);
        assert_ne!(audit_chain::link(&before, &other), audit_chain::link(&before, row));
    }
    // Nor can a letter move from one column to the next.
    let mut moved = rows[0].clone();
    moved.who += &moved.action.remove(0).to_string();
    assert_ne!(audit_chain::link(&[0; 32], &moved), audit_chain::link(&[0; 32], &rows[0]));
}

#[tokio::test]
async fn rows_from_before_the_chain_are_tied_at_the_first_opening() {
    let (parent, folder) = written().await;
    tamper(&folder, "delete from audit_links").await;
    let db = SqliteConnection::connect_with(&SqliteConnectOptions::new().filename(folder.join(DATABASE)))
        .await
        .unwrap();
    let mut db = super::super::db::Connection::Lite(db);
    audit_chain::begin(&mut db).await.unwrap();
    db.close().await.unwrap();
    let right = verdict(&folder).await;
    assert_eq!((right.rows, right.wrong), (ROWS as u64, 0), "{:?}", right.findings);
    drop(options(&parent));
}

#[tokio::test]
async fn a_folder_without_a_database_is_named() {
    let parent = tempfile::tempdir().unwrap();
    let error = verify_audit(parent.path(), &[]).await.unwrap_err();
    assert!(error.to_string().contains(DATABASE), "{error}");
    assert!("17:abc".parse::<AuditHead>().is_err() && "x".parse::<AuditHead>().is_err());
}
