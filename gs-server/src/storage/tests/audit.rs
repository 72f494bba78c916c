//! The audit's chain: whoever changes, drops, moves or cuts off rows is found out.

use mission::record::Record;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{AssertSqlSafe, Connection as _, PgConnection};

use super::super::db::{Connection, sql};
use super::super::*;
use super::records::*;
use super::{Dice, Home as _, Kind, Place, fresh, reopen};

const ROWS: i64 = 12;

async fn written(kind: Kind) -> (Place, Archive) {
    let (place, store) = fresh(kind).await;
    for _ in 0..ROWS / 2 {
        let two = vec![Record::Audit(audit("command.create")), Record::Audit(audit("uplink.radiate"))];
        store.apply(&batch(two)).await.unwrap();
    }
    // Waits for the head, too.
    store.close().await.unwrap();
    let archive = Archive { folder: place.folder(), postgres: place.postgres() };
    (place, archive)
}

/// Somebody with the database and without our program.
async fn tamper(place: &Place, sql: &str) {
    if let Some(database) = &place.database {
        let sql = sql.replace("zeroblob(32)", "decode(repeat('00', 32), 'hex')");
        // No trigger and no reference holds.
        database.tell(&format!("set session_replication_role = replica; {sql}")).unwrap();
        return;
    }
    let connect = SqliteConnectOptions::new().filename(place.folder().join(DATABASE)).foreign_keys(false);
    let mut db = SqliteConnection::connect_with(&connect).await.unwrap();
    let drop = "drop trigger audit_is_kept; drop trigger audit_is_never_changed;
        drop trigger audit_links_are_kept; drop trigger audit_links_are_never_changed;";
    sqlx::raw_sql(AssertSqlSafe(format!("{drop}{sql}"))).execute(&mut db).await.unwrap();
    db.close().await.unwrap();
}

/// A connection for whoever writes rows of our program's own form.
async fn connection(place: &Place) -> Connection {
    if let Some(database) = &place.database {
        let mut db = PgConnection::connect(&database.address().unwrap()).await.unwrap();
        sqlx::query("set session_replication_role = replica").execute(&mut db).await.unwrap();
        return Connection::Pg(Box::new(db));
    }
    let connect = SqliteConnectOptions::new().filename(place.folder().join(DATABASE)).foreign_keys(false);
    Connection::Lite(SqliteConnection::connect_with(&connect).await.unwrap())
}

async fn verdict(archive: &Archive) -> AuditVerdict {
    verify_audit(archive, &[]).await.unwrap()
}

both!(what_was_written_is_right_and_its_head_is_noted);
async fn what_was_written_is_right_and_its_head_is_noted(kind: Kind) {
    let (_place, archive) = written(kind).await;
    let right = verdict(&archive).await;
    assert_eq!((right.rows, right.wrong), (ROWS as u64, 0), "{:?}", right.findings);
    let head = right.head.unwrap();
    assert_eq!(head.row, ROWS);
    assert_eq!(head.to_string().parse(), Ok(head));
    assert_eq!(std::fs::read_to_string(archive.folder.join("audit-head")).unwrap().trim(), head.to_string());
}

both!(the_chain_goes_on_over_a_restart);
async fn the_chain_goes_on_over_a_restart(kind: Kind) {
    let (place, archive) = written(kind).await;
    let old = verdict(&archive).await.head.unwrap();
    let store = reopen(&place).await.unwrap();
    store.apply(&batch(vec![Record::Audit(audit("clock.vouch"))])).await.unwrap();
    store.close().await.unwrap();
    let right = verify_audit(&archive, &[old]).await.unwrap();
    assert_eq!((right.rows, right.wrong), (ROWS as u64 + 1, 0), "{:?}", right.findings);
}

both!(every_kind_of_tampering_is_found);
async fn every_kind_of_tampering_is_found(kind: Kind) {
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
        let (place, archive) = written(kind).await;
        tamper(&place, sql).await;
        let verdict = verdict(&archive).await;
        assert!(verdict.wrong > 0, "not noticed: {sql}");
        assert!(
            verdict.findings.iter().any(|finding| finding.contains(expected)),
            "{sql}: {:?}",
            verdict.findings
        );
    }
}

// Someone who knows our program as well: a row changed, its checksum made right, and the rest of the chain made anew.
both!(a_chain_made_anew_does_not_end_in_the_head_that_was_noted);
async fn a_chain_made_anew_does_not_end_in_the_head_that_was_noted(kind: Kind) {
    let (place, archive) = written(kind).await;
    let noted = verdict(&archive).await.head.unwrap();
    tamper(&place, "").await;
    let mut db = connection(&place).await;
    let rows = read_audit(&archive, 5).await.unwrap();
    let forged = AuditRow { who: "eve".into(), ..rows[0].clone() };
    sql("update audit set who = $1, crc = $2 where id = $3")
        .bind(&forged.who)
        .bind(row::Row::crc(&forged))
        .bind(forged.id)
        .execute(&mut db)
        .await
        .unwrap();
    sql("delete from audit_links").execute(&mut db).await.unwrap();
    audit_chain::begin(&mut db).await.unwrap();
    db.close().await.unwrap();
    let file = verdict(&archive).await;
    assert!(file.findings.iter().any(|finding| finding.contains("audit-head")), "{:?}", file.findings);
    // The file is not out of reach of whoever can write the database; a notebook is.
    std::fs::remove_file(archive.folder.join("audit-head")).unwrap();
    assert_eq!(verdict(&archive).await.wrong, 0);
    assert_eq!(verify_audit(&archive, &[noted]).await.unwrap().wrong, 1);
}

#[tokio::test]
async fn any_changed_byte_of_a_row_is_found() {
    let (_place, archive) = written(Kind::Lite).await;
    let rows = read_audit(&archive, 100).await.unwrap();
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

both!(rows_from_before_the_chain_are_tied_at_the_first_opening);
async fn rows_from_before_the_chain_are_tied_at_the_first_opening(kind: Kind) {
    let (place, archive) = written(kind).await;
    tamper(&place, "delete from audit_links").await;
    let mut db = connection(&place).await;
    audit_chain::begin(&mut db).await.unwrap();
    db.close().await.unwrap();
    let right = verdict(&archive).await;
    assert_eq!((right.rows, right.wrong), (ROWS as u64, 0), "{:?}", right.findings);
}

#[tokio::test]
async fn a_folder_without_a_database_is_named() {
    let parent = tempfile::tempdir().unwrap();
    let error = verify_audit(&Archive::in_folder(parent.path()), &[]).await.unwrap_err();
    assert!(error.to_string().contains(DATABASE), "{error}");
    assert!("17:abc".parse::<AuditHead>().is_err() && "x".parse::<AuditHead>().is_err());
}

#[tokio::test]
async fn a_database_without_an_archive_is_named() {
    let place = Place::new(Kind::Pg);
    let archive = Archive { folder: place.folder(), postgres: place.postgres() };
    let error = verify_audit(&archive, &[]).await.unwrap_err();
    assert!(error.to_string().contains("postgres://"), "{error}");
}
