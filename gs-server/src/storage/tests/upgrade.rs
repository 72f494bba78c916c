//! Databases as older programs made them, with rows in every table, are brought up to date: from every step there was, on both.

use std::borrow::Cow;

use sqlx::migrate::Migrator;
use sqlx::{AssertSqlSafe, Connection as _, PgConnection, SqliteConnection};

use super::super::db::{Connection, sql};
use super::super::row::{Row as _, select, upsert};
use super::super::*;
use super::records::*;
use super::{Home as _, Kind, Place, fresh, reopen, upgrade_rows};

/// What opening changes on purpose: the tables are signed anew, and a station has a new life.
const CHANGED_BY_OPENING: [(&str, &str); 5] = [
    ("meta", "schema_crc"),
    ("meta", "crc"),
    ("stations", "life"),
    ("stations", "batch"),
    ("stations", "first_event"),
];

/// What the store tells of these tables, as text.
async fn told(store: &Store, tables: &[String]) -> Vec<String> {
    let page = Page { after: Some(0), limit: 1000, ..Page::default() };
    let all = Scope::default();
    let has = |table: &str| tables.iter().any(|name| name == table);
    let mut told = vec![
        format!("{:?}", store.frames(&FrameQuery { page, ..FrameQuery::default() }).await.unwrap()),
        format!("{:?}", store.events(&EventQuery { page, ..EventQuery::default() }).await.unwrap()),
        format!("{:?}", store.command(1).await.unwrap()),
        format!("{:?}", store.image(1).await.unwrap()),
        format!("{:?}", store.downloads(&all, &page).await.unwrap()),
        format!("{:?}", store.latest("pixelsat-1").await.unwrap()),
        format!("{:?}", store.audit(&During::default(), &page).await.unwrap()),
        format!("{:?}", store.counts().await.unwrap()),
    ];
    if has("elements") {
        told.push(format!("{:?}", store.elements(&all, &page).await.unwrap()));
        told.push(format!(
            "{:?}",
            store.snapshot(&[route().satellite], &[]).await.unwrap().satellites[0].pass
        ));
    }
    if has("plans") {
        told.push(format!("{:?}", store.plans(&page).await.unwrap()));
        told.push(format!("{:?}", store.runs(&all, &page).await.unwrap()));
        told.push(format!("{:?}", store.command_condition(1).await.unwrap()));
    }
    if has("users") {
        told.push(format!("{:?}", store.users().await.unwrap()));
        told.push(format!("{:?}", store.sessions_of("ada").await.unwrap()));
        told.push(format!("{:?}", store.tokens().await.unwrap()));
        told.push(format!("{:?}", store.approval(1).await.unwrap()));
        told.push(format!("{:?}", store.station_licence("oslo").await.unwrap()));
    }
    if has("alerts") {
        told.push(format!("{:?}", store.alert(1).await.unwrap()));
        told.push(format!("{:?}", store.deliveries(None, &page).await.unwrap()));
        told.push(format!("{:?}", store.alert_progress().await.unwrap()));
    }
    if has("outside_receptions") {
        told.push(format!(
            "{:?}",
            store.outside(&OutsideQuery { page, ..OutsideQuery::default() }).await.unwrap()
        ));
    }
    told
}

/// A connection beside the store.
async fn beside(place: &Place) -> Connection {
    match &place.database {
        Some(database) => {
            let made = PgConnection::connect(&database.address().unwrap()).await.unwrap();
            Connection::Pg(Box::new(made))
        }
        None => {
            let address = format!("sqlite://{}?mode=rwc", place.folder().join(DATABASE).display());
            Connection::Lite(SqliteConnection::connect(&address).await.unwrap())
        }
    }
}

/// A table with those of its columns that opening leaves alone, and what is in them.
#[derive(Debug, PartialEq)]
struct Table {
    name: String,
    columns: Vec<String>,
    rows: Vec<String>,
}

impl Table {
    /// The table as it stands, with these columns or all.
    async fn read(connection: &mut Connection, name: &str, columns: Option<Vec<String>>) -> Self {
        let columns = match columns {
            Some(columns) => columns,
            None => {
                let of = match connection {
                    Connection::Lite(_) => "select name from pragma_table_info(?) order by cid",
                    Connection::Pg(_) => {
                        "select column_name::text from information_schema.columns where table_schema = 'public'
                           and table_name = ? order by ordinal_position"
                    }
                };
                let columns: Vec<String> = sql(of).bind(name).scalars(&mut *connection).await.unwrap();
                let stays = |column: &String| !CHANGED_BY_OPENING.contains(&(name, column.as_str()));
                columns.into_iter().filter(stays).collect()
            }
        };
        let value = |column: &String| match connection {
            Connection::Lite(_) => format!("quote({column})"),
            Connection::Pg(_) => format!("quote_nullable({column}::text)"),
        };
        let values: Vec<String> = columns.iter().map(value).collect();
        let statement = format!("select {} from {name}", values.join(" || ', ' || "));
        let mut rows: Vec<String> = sql(AssertSqlSafe(statement)).scalars(connection).await.unwrap();
        rows.sort_unstable();
        Self { name: name.to_owned(), columns, rows }
    }

    async fn read_all(connection: &mut Connection, names: &[String]) -> Vec<Self> {
        let mut tables = Vec::new();
        for name in names {
            tables.push(Self::read(connection, name, None).await);
        }
        tables
    }
}

/// The connection to an empty database with the first `steps` steps.
async fn old(place: &Place, steps: usize) -> (Connection, Vec<String>) {
    std::fs::create_dir(place.folder()).unwrap();
    let first = |all: &Migrator| {
        let migrations: Vec<_> = all.iter().take(steps).cloned().collect();
        Migrator { migrations: Cow::Owned(migrations), ..Migrator::DEFAULT }
    };
    let mut connection = beside(place).await;
    let tables = match &mut connection {
        Connection::Pg(made) => {
            first(&migrations::POSTGRES).run(&mut **made).await.unwrap();
            "select table_name::text from information_schema.tables
                 where table_schema = 'public' and table_name <> '_sqlx_migrations'"
        }
        Connection::Lite(made) => {
            first(&migrations::SQLITE).run(&mut *made).await.unwrap();
            "select name from sqlite_schema where type = 'table'
                 and name not like 'sqlite~_%' escape '~' and name <> '_sqlx_migrations'"
        }
    };
    let tables = sql(tables).scalars(&mut connection).await.unwrap();
    (connection, tables)
}

/// Copies the rows of these tables, whatever triggers and references say, and signs the tables as that program did.
async fn copy(from: &Place, to: &Place, mut connection: Connection, tables: &[String]) -> Vec<Table> {
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
    let copied = Table::read_all(&mut connection, tables).await;
    connection.close().await.unwrap();
    copied
}

both!(every_older_database_is_brought_up_to_date_with_all_that_is_in_it);
async fn every_older_database_is_brought_up_to_date_with_all_that_is_in_it(kind: Kind) {
    let (filled, store) = fresh(kind).await;
    let mut connection = beside(&filled).await;
    upgrade_rows::fill(kind, &store, &mut connection).await;
    connection.close().await.unwrap();
    let events = store.counts().await.unwrap().events;
    let newest = usize::try_from(migrations::newest_sqlite()).unwrap();
    for steps in 1..=newest {
        let place = Place::new(kind);
        let (connection, tables) = old(&place, steps).await;
        let before = copy(&filled, &place, connection, &tables).await;
        for table in &before {
            let name = &table.name;
            assert!(!table.rows.is_empty(), "step {steps}: {name} is empty: upgrade_rows.rs gives it no row");
        }

        let upgraded = reopen(&place).await.unwrap();
        let mut connection = beside(&place).await;
        for table in before {
            let after = Table::read(&mut connection, &table.name, Some(table.columns.clone())).await;
            assert_eq!(after, table, "from step {steps}");
        }
        connection.close().await.unwrap();
        assert_eq!(told(&upgraded, &tables).await, told(&store, &tables).await, "from step {steps}");
        let report = upgraded.redecode(|_| {}).await.unwrap();
        assert_eq!((report.frames, report.damaged), (6, 0), "from step {steps}: {report:?}");
        let next = upgraded.apply(&batch(heard(7))).await.unwrap();
        assert_eq!(next[0].sequence, events + 1, "from step {steps}");
    }
}
