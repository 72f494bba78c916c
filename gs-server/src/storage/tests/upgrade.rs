//! Databases as older programs made them, with rows in them, are brought up to date: from every step there was, on both.

use std::borrow::Cow;

use mission::Stage;
use mission::record::{DownloadState, EventKind, Record};
use protocol::{Downlink, Telecommand};
use sqlx::migrate::Migrator;
use sqlx::{AssertSqlSafe, Connection as _, PgConnection, SqliteConnection};

use super::super::db::{Connection, sql};
use super::super::row::{Row as _, select, upsert};
use super::super::*;
use super::records::*;
use super::{Home as _, Kind, Place, fresh, reopen};

/// What the tables of the first step tell, as text.
async fn told(store: &Store) -> Vec<String> {
    let page = Page { after: Some(0), limit: 1000, ..Page::default() };
    vec![
        format!("{:?}", store.frames(&FrameQuery { page, ..FrameQuery::default() }).await.unwrap()),
        format!("{:?}", store.events(&EventQuery { page, ..EventQuery::default() }).await.unwrap()),
        format!("{:?}", store.command(1).await.unwrap()),
        format!("{:?}", store.image(1).await.unwrap()),
        format!("{:?}", store.downloads(&Scope::default(), &page).await.unwrap()),
        format!("{:?}", store.latest("pixelsat-1").await.unwrap()),
        format!("{:?}", store.audit(&During::default(), &page).await.unwrap()),
        format!("{:?}", store.counts().await.unwrap()),
    ]
}

async fn fill(store: &Store) {
    for id in 1..=5 {
        store.apply(&batch(heard(id))).await.unwrap();
    }
    let records = vec![
        Record::Frame(frame_of(6, &Downlink::Pong, &route())),
        Record::Image(image(1, 6, 30)),
        Record::Chunk(chunk(1, 0, 6, 1, false)),
        Record::Download(download(1, Some(1), DownloadState::Active)),
        Record::Command(command(1, Telecommand::Ping)),
        Record::Stage(stage(1, 1, Stage::Sealed, NOON_US)),
        Record::Sealed(sealed(1, 1, 77)),
        Record::CounterFloor(floor(100)),
        Record::Audit(audit("a")),
        Record::Intent(receipt("once", mission::Accepted::Done)),
        Record::Event(event(EventKind::Station, "filled")),
    ];
    store.apply(&batch(records)).await.unwrap();
}

/// The connection to an empty database with the first `steps` steps.
async fn old(place: &Place, steps: usize) -> (Connection, Vec<String>) {
    std::fs::create_dir(place.folder()).unwrap();
    let first = |all: &Migrator| {
        let migrations: Vec<_> = all.iter().take(steps).cloned().collect();
        Migrator { migrations: Cow::Owned(migrations), ..Migrator::DEFAULT }
    };
    match &place.database {
        Some(database) => {
            let mut made = PgConnection::connect(&database.address().unwrap()).await.unwrap();
            first(&migrations::POSTGRES).run(&mut made).await.unwrap();
            let tables = sql("select table_name::text from information_schema.tables
                 where table_schema = 'public' and table_name <> '_sqlx_migrations'")
            .scalars(&mut made)
            .await
            .unwrap();
            (Connection::Pg(Box::new(made)), tables)
        }
        None => {
            let address = format!("sqlite://{}?mode=rwc", place.folder().join(DATABASE).display());
            let mut made = SqliteConnection::connect(&address).await.unwrap();
            first(&migrations::SQLITE).run(&mut made).await.unwrap();
            let tables = sql("select name from sqlite_schema where type = 'table'
                 and name not like 'sqlite~_%' escape '~' and name <> '_sqlx_migrations'")
            .scalars(&mut made)
            .await
            .unwrap();
            (Connection::Lite(made), tables)
        }
    }
}

/// Copies the rows of these tables, whatever triggers and references say, and signs the tables as that program did.
async fn copy(from: &Place, to: &Place, mut connection: Connection, tables: &[String]) {
    let meta = match &mut connection {
        Connection::Pg(connection) => {
            let (from, to) = (from.database.as_ref().unwrap(), to.database.as_ref().unwrap());
            tables.iter().for_each(|table| to.copy_rows(from, table).unwrap());
            super::super::pg::schema_crc(connection).await.unwrap()
        }
        Connection::Lite(connection) => {
            let filled = from.folder().join(DATABASE);
            let attach = format!("attach '{}' as filled", filled.display());
            let run = [attach, "pragma foreign_keys = off".to_owned()];
            let copies = tables
                .iter()
                .map(|table| format!("insert or replace into main.{table} select * from filled.{table}"));
            for statement in run.into_iter().chain(copies) {
                sqlx::query(AssertSqlSafe(statement)).execute(&mut *connection).await.unwrap();
            }
            super::super::lite::schema_crc(connection).await.unwrap()
        }
    };
    let row = sql(select::<MetaRow>("where id = 1")).fetch_one(&mut connection).await.unwrap();
    let meta = MetaRow { schema_crc: meta, ..MetaRow::read(&row).unwrap() };
    meta.bind(sql(upsert::<MetaRow>("id"))).execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
}

both!(every_older_database_is_brought_up_to_date_with_all_that_is_in_it);
async fn every_older_database_is_brought_up_to_date_with_all_that_is_in_it(kind: Kind) {
    let (filled, store) = fresh(kind).await;
    fill(&store).await;
    let before = told(&store).await;
    store.close().await.unwrap();
    drop(store);
    let newest = usize::try_from(migrations::newest_sqlite()).unwrap();
    for steps in 1..=newest {
        let place = Place::new(kind);
        let (connection, tables) = old(&place, steps).await;
        assert!(tables.len() > 10, "{tables:?}");
        copy(&filled, &place, connection, &tables).await;

        let store = reopen(&place).await.unwrap();
        assert_eq!(told(&store).await, before, "from step {steps}");
        let report = store.redecode(|_| {}).await.unwrap();
        assert_eq!((report.frames, report.damaged), (6, 0), "from step {steps}: {report:?}");
        let next = store.apply(&batch(heard(7))).await.unwrap();
        assert_eq!(next[0].sequence, 12, "from step {steps}");
    }
}
