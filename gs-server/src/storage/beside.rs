//! An archive as somebody beside its servers looks at it: through a connection of its own that writes nothing.

use std::io;
use std::path::PathBuf;

use sqlx::sqlite::SqlitePoolOptions;
use sqlx::{Connection as _, SqliteConnection};

use super::db::{Connection, Pool, sql};
use super::{DATABASE, Postgres, StoreError, lite};

/// Where an archive is.
#[derive(Debug, Clone)]
pub struct Archive {
    /// The data folder of a station.
    pub folder: PathBuf,
    /// The database, when it is not a file in the folder.
    pub postgres: Option<Postgres>,
}

impl Archive {
    /// The file in this data folder.
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), postgres: None }
    }

    /// A connection that reads; servers may be writing.
    pub(super) async fn reading(&self) -> Result<Connection, StoreError> {
        let Some(postgres) = &self.postgres else {
            let path = self.folder.join(DATABASE);
            if !path.is_file() {
                let missing = "there is no database in this folder; one in PostgreSQL is named by --config";
                return Err(StoreError::from_io(&path, io::Error::new(io::ErrorKind::NotFound, missing)));
            }
            return Ok(Connection::Lite(
                SqliteConnection::connect_with(&lite::reader_of(&self.folder)).await?,
            ));
        };
        let mut connection = postgres.connect_to_read().await?;
        let tables = "select count(*) from information_schema.tables
             where table_schema = current_schema() and table_name = 'meta'";
        if sql(tables).scalar::<i64>(&mut connection).await? == 0 {
            let missing = "there is no archive in this database yet: the first start of a server makes it";
            let what = postgres.url().to_owned();
            return Err(StoreError::Io { what, source: io::Error::new(io::ErrorKind::NotFound, missing) });
        }
        Ok(Connection::Pg(Box::new(connection)))
    }

    /// The same as a pool of one connection, for whoever reads on and on.
    pub(super) async fn readers(&self) -> Result<Pool, StoreError> {
        // It is there, and can be read.
        drop(self.reading().await?);
        match &self.postgres {
            Some(postgres) => postgres.pool_to_read(),
            None => Ok(Pool::Lite(
                SqlitePoolOptions::new().max_connections(1).connect_lazy_with(lite::reader_of(&self.folder)),
            )),
        }
    }
}
