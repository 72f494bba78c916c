//! `gs-server openapi`: the document of the API, for generators and for the snapshot in `docs/openapi.json`.

use super::shell::print_text;
use super::{Exit, Failure};

/// Print the OpenAPI 3.1 document of the API
///
/// The same as a running server tells at /api/v1/openapi.json, where /api/docs shows it as a page.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  gs-server openapi > openapi.json\n  gs-server openapi | jq '.paths | keys'"
)]
pub struct Openapi {
    /// The document is JSON in any case; for scripts that pass --json to every verb
    #[arg(long)]
    json: bool,
}

impl Openapi {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let Self { json: _ } = self;
        print_text(crate::http::openapi::text())?;
        Ok(Exit::Done)
    }
}
