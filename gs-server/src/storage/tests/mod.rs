//! Tests of the storage as a whole; each has a folder of its own, and those made by [`both`] run on a file and on a
//! PostgreSQL database of their own, from one body.

/// A test on each database.
macro_rules! both {
    ($name:ident) => {
        mod $name {
            #[tokio::test]
            async fn sqlite() {
                super::$name(super::super::Kind::Lite).await;
            }

            #[tokio::test]
            async fn postgres() {
                super::$name(super::super::Kind::Pg).await;
            }
        }
    };
}

mod alerts;
mod audit;
mod bulk;
mod conformance;
mod damage;
mod folder;
mod forwards;
mod full;
mod kill;
mod plans;
mod records;
mod redecode;
mod refusals;
mod reports;
mod shared;
mod sky;
mod snapshot;
mod telemetry;
mod upgrade;
mod upgrade_rows;

use std::path::PathBuf;

use super::{DATABASE, Postgres, Store, StoreError, StoreOptions};

/// Which database.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Lite,
    Pg,
}

/// Where a store is, to be opened again.
trait Home {
    fn folder(&self) -> PathBuf;

    fn postgres(&self) -> Option<Postgres> {
        None
    }
}

impl Home for tempfile::TempDir {
    fn folder(&self) -> PathBuf {
        self.path().join("data")
    }
}

/// A folder, and a database when it is not in the folder; both go away with it.
struct Place {
    parent: tempfile::TempDir,
    database: Option<migrations::cluster::Database>,
}

impl Home for Place {
    fn folder(&self) -> PathBuf {
        self.parent.folder()
    }

    fn postgres(&self) -> Option<Postgres> {
        self.database.as_ref().map(|database| Postgres::new(&database.address().unwrap()).unwrap())
    }
}

impl Place {
    fn new(kind: Kind) -> Self {
        let database = (kind == Kind::Pg).then(|| migrations::cluster::Database::fresh().unwrap());
        Self { parent: tempfile::tempdir().unwrap(), database }
    }

    fn path(&self) -> &std::path::Path {
        self.parent.path()
    }

    /// Carries a statement out beside the store; what the database says against it.
    async fn meddle(&self, statement: &'static str) -> Result<(), String> {
        use sqlx::Connection as _;
        if let Some(database) = &self.database {
            return database.tell(statement).map(drop).map_err(|error| error.to_string());
        }
        let path = self.folder().join(DATABASE);
        let mut other = sqlx::SqliteConnection::connect(path.to_str().unwrap()).await.unwrap();
        sqlx::query(statement).execute(&mut other).await.map(drop).map_err(|error| error.to_string())
    }
}

/// A store in a place that goes away with it.
async fn fresh(kind: Kind) -> (Place, Store) {
    let place = Place::new(kind);
    let store = Store::open(options(&place)).await.unwrap();
    (place, store)
}

fn options(home: &impl Home) -> StoreOptions {
    StoreOptions {
        folder: home.folder(),
        station: Some(records::route().station),
        simulated: false,
        max_page_count: None,
        postgres: home.postgres(),
        reserve_bytes: 64 * 1024,
    }
}

async fn reopen(home: &impl Home) -> Result<Store, StoreError> {
    Store::open(options(home)).await
}

/// The same numbers in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: u64) -> u64 {
        // splitmix64
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % bound
    }
}
