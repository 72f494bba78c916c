//! `/api/v1/commands`: telecommands, asked for, looked at, withdrawn.

use api::{
    CommandRequest, CommandView, GateWord, Nothing, Page, Problem, ProblemKind, StageView, telecommand,
};
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use mission::{CommandId, CommandIntent, Gate, Intent, LinkId, Stage, UtcUs};

use super::App;
use super::extract::{Id, Query, list_query, number, paged, satellite, scope, small, time};
use super::problem::Failure;
use super::write::Write;
use crate::plan::condition_of;
use crate::storage::{CommandLife, CommandQuery, CommandRow, StageRow, StoreError};

list_query! { Asked { satellite: String, station: String, link: String, key: String, stage: String } }

pub(super) async fn list(
    State(app): State<App>,
    Query(asked): Query<Asked>,
) -> Result<Json<Page<CommandView>>, Failure> {
    let stage = asked.stage.as_deref().map(str::parse::<Stage>).transpose();
    let page = asked.page()?;
    let query = CommandQuery {
        scope: scope(&asked.satellite, &asked.station, &asked.link, asked.during()?),
        key: asked.key,
        stage: stage
            .map_err(|error| Failure::field(ProblemKind::BadParameter, "stage", error.to_string()))?,
        page,
    };
    let commands = app.state.store.commands(&query).await?;
    let views = commands
        .iter()
        .map(|now| view(&now.command, now.last.as_ref()))
        .collect::<Result<_, StoreError>>()?;
    Ok(Json(paged(views, &query.page, |command: &CommandView| command.id)))
}

pub(super) async fn get(State(app): State<App>, id: Id) -> Result<Json<CommandView>, Failure> {
    let life = app.state.store.command(id.row()).await?;
    let life = life.ok_or_else(|| Failure::no_such("command", id.0))?;
    whole_life(&life).map(Json)
}

/// A command with all its stages.
pub(super) fn whole_life(life: &CommandLife) -> Result<CommandView, Failure> {
    let mut command = view(&life.command, life.stages.last())?;
    command.stages = Some(life.stages.iter().map(stage_view).collect());
    Ok(command)
}

/// A command with its last stage alone.
pub(super) fn short_life(life: &CommandLife) -> Result<CommandView, StoreError> {
    view(&life.command, life.stages.last())
}

pub(super) async fn create(
    State(app): State<App>,
    write: Write<CommandRequest>,
) -> Result<Response, Failure> {
    let intent = Intent::Command(intent(&app, &write.body)?);
    write.submit(&app, intent).await
}

pub(super) async fn cancel(
    State(app): State<App>,
    id: Id,
    write: Write<Nothing>,
) -> Result<Response, Failure> {
    write.submit(&app, Intent::Cancel(CommandId(id.0))).await
}

pub(super) fn intent(app: &App, request: &CommandRequest) -> Result<CommandIntent, Failure> {
    let telecommand = telecommand::parse(&request.command, &request.arguments).map_err(|errors| {
        let told: Vec<String> = errors.iter().map(ToString::to_string).collect();
        let problem = Problem::new(ProblemKind::BadArgument, told.join("; "));
        let problem =
            errors.into_iter().fold(problem, |problem, error| problem.with_field(error.field, error.message));
        Failure(Box::new(problem))
    })?;
    if request.attempts == Some(0) {
        return Err(Failure::field(ProblemKind::BadArgument, "attempts", "must be at least 1, or null"));
    }
    let when = request
        .when
        .as_ref()
        .map(|when| condition_of("when", when))
        .transpose()
        .map_err(|findings| Failure::findings(ProblemKind::BadArgument, &findings))?;
    Ok(CommandIntent {
        satellite: satellite(app, request.satellite.as_deref())?,
        link: request.link.as_deref().map(link).transpose()?,
        telecommand,
        priority: request.priority,
        gate: match request.gate {
            GateWord::Heard => Gate::Heard,
            GateWord::Blind => Gate::Blind,
        },
        when: when.map(Box::new),
        expires_at: request.expires_at.map(|time| UtcUs(time.unix_us())),
        attempts_allowed: request.attempts,
        confirmation: request.confirm.clone(),
    })
}

/// A link's name; whether there is such a link is the engine's business.
pub(super) fn link(name: &str) -> Result<LinkId, Failure> {
    LinkId::new(name).map_err(|error| Failure::field(ProblemKind::UnknownLink, "link", error.to_string()))
}

fn view(row: &CommandRow, last: Option<&StageRow>) -> Result<CommandView, StoreError> {
    let arguments = telecommand::arguments(&row.telecommand()?);
    Ok(CommandView {
        id: number(row.id),
        satellite: row.satellite.clone(),
        station: row.station.clone(),
        link: row.link.clone(),
        key: row.key.clone(),
        principal: row.principal.clone(),
        download: row.download.map(number),
        command: row.name.clone(),
        arguments,
        priority: small(row.priority),
        gate: if row.gate == Gate::Blind.name() { GateWord::Blind } else { GateWord::Heard },
        attempts_allowed: small(row.attempts_allowed),
        created_at: time(row.created_at_us),
        expires_at: row.expires_at_us.map(time),
        stage: last.map_or_else(|| Stage::Queued.name().to_owned(), |last| last.stage.clone()),
        stage_at: time(last.map_or(row.created_at_us, |last| last.at_us)),
        attempt: last.map_or(0, |last| small(last.attempt)),
        stages: None,
    })
}

fn stage_view(row: &StageRow) -> StageView {
    StageView {
        satellite: row.satellite.clone(),
        station: row.station.clone(),
        link: row.link.clone(),
        key: row.key.clone(),
        attempt: small(row.attempt),
        stage: row.stage.clone(),
        at: time(row.at_us),
        who: row.who.clone(),
        why: row.why.clone(),
        frame: row.frame.map(number),
    }
}
