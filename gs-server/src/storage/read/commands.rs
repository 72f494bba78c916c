//! Telecommands and their lives.

use mission::Stage;

use super::super::{CommandRow, SealedRow, StageRow, Store, StoreError};
use super::{List, Page, Scope, all, one};

/// Which commands.
#[derive(Debug, Clone, Default)]
pub struct CommandQuery {
    /// Whose.
    pub scope: Scope,
    /// Only those of this key, by its id.
    pub key: Option<String>,
    /// Only those whose last stage is this one.
    pub stage: Option<Stage>,
    /// Which part, by command id.
    pub page: Page,
}

/// A command and where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandNow {
    /// The command.
    pub command: CommandRow,
    /// Its last stage.
    pub last: Option<StageRow>,
}

/// A command and all that became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandLife {
    /// The command.
    pub command: CommandRow,
    /// Its stages, in order; the last is where it stands.
    pub stages: Vec<StageRow>,
    /// Its sealed frames, in order.
    pub sealed: Vec<SealedRow>,
}

impl Store {
    /// Commands with their last stage.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn commands(&self, query: &CommandQuery) -> Result<Vec<CommandNow>, StoreError> {
        let commands: Vec<CommandRow> = List::of::<CommandRow>()
            .scope("created_at_us", &query.scope)
            .equal("key", query.key.as_deref())
            .equal(
                "(select stage from command_stages where command = commands.id order by id desc limit 1)",
                query.stage.map(Stage::name),
            )
            .page(self, "id", &query.page)
            .await?;
        let mut with_stage = Vec::with_capacity(commands.len());
        for command in commands {
            let last = one(self, "where command = ? order by id desc limit 1", command.id).await?;
            with_stage.push(CommandNow { command, last });
        }
        Ok(with_stage)
    }

    /// A command and all that became of it.
    ///
    /// # Errors
    /// [`StoreError`] when the database cannot be read.
    pub async fn command(&self, id: i64) -> Result<Option<CommandLife>, StoreError> {
        let Some(command) = one::<CommandRow>(self, "where id = ?", id).await? else { return Ok(None) };
        let stages = all(self, "where command = ? order by id", id).await?;
        let sealed = all(self, "where command = ? order by id", id).await?;
        Ok(Some(CommandLife { command, stages, sealed }))
    }
}
