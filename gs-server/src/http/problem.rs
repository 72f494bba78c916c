//! The one place where errors become [`api::Problem`]s. What is inside goes to the log, never out.

use api::{Problem, ProblemKind};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use mission::Refusal;
use mission::plan::Finding;

use crate::engine::IntentError;
use crate::people::PeopleError;
use crate::storage::StoreError;

/// What a handler answers when it cannot do what it was asked.
///
/// The body is written by [`render`], which knows the path and is reached by every answer of the server.
#[derive(Debug, Clone)]
pub(super) struct Failure(pub(super) Box<Problem>);

impl Failure {
    pub(super) fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        Self(Box::new(Problem::new(kind, detail)))
    }

    pub(super) fn field(kind: ProblemKind, field: impl Into<String>, message: impl Into<String>) -> Self {
        let (field, message) = (field.into(), message.into());
        Self(Box::new(Problem::new(kind, format!("{field}: {message}")).with_field(field, message)))
    }

    /// Everything that is wrong with a plan or a condition, each with its place and remedy.
    pub(super) fn findings(kind: ProblemKind, findings: &[Finding]) -> Self {
        let told: Vec<String> = findings.iter().map(ToString::to_string).collect();
        let problem = Problem::new(kind, told.join("; "));
        let field = |problem: Problem, finding: &Finding| {
            problem.with_field(finding.place.clone(), format!("{}. {}", finding.problem, finding.remedy))
        };
        Self(Box::new(findings.iter().fold(problem, field)))
    }

    /// Nothing under this number.
    pub(super) fn no_such(what: &str, id: u64) -> Self {
        Self::new(ProblemKind::NotFound, format!("There is no {what} {id}."))
    }
}

impl IntoResponse for Failure {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.0.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let mut response = status.into_response();
        response.extensions_mut().insert(self);
        response
    }
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        let detail = if error.is_temporary() {
            tracing::warn!(
                error = &error as &dyn std::error::Error,
                "The archive could not be read for a request."
            );
            return Self::new(
                ProblemKind::StorageFailing,
                "The archive cannot be read at present. Try again.",
            );
        } else {
            "The archive could not be read; the server's log says more."
        };
        tracing::error!(
            error = &error as &dyn std::error::Error,
            "The archive could not be read for a request."
        );
        Self::new(ProblemKind::Internal, detail)
    }
}

impl From<PeopleError> for Failure {
    fn from(error: PeopleError) -> Self {
        let told = error.to_string();
        let (kind, field) = match error {
            PeopleError::Store(error) => return error.into(),
            PeopleError::NoRandomness => (ProblemKind::Internal, None),
            PeopleError::Busy => (ProblemKind::Overloaded, None),
            PeopleError::BadPassword { .. } => (ProblemKind::BadPassword, Some("password")),
            PeopleError::WrongPassword => (ProblemKind::WrongPassword, None),
            PeopleError::RateLimited { seconds } => {
                let mut problem = Problem::new(ProblemKind::RateLimited, told);
                problem.retry_after_s = Some(seconds);
                return Self(Box::new(problem));
            }
            PeopleError::SessionReplayed => (ProblemKind::SessionReplayed, None),
            PeopleError::LinkRefused => (ProblemKind::LinkRefused, None),
            PeopleError::BadName { .. } | PeopleError::NameMissing => {
                (ProblemKind::BadArgument, Some("name"))
            }
            PeopleError::BadText { field } | PeopleError::Wrong { field, .. } => {
                (ProblemKind::BadArgument, Some(field))
            }
            PeopleError::UnknownUser(_) => (ProblemKind::UnknownUser, None),
            PeopleError::NameTaken(_) => (ProblemKind::UserExists, Some("name")),
            PeopleError::LastAdministrator(_) => (ProblemKind::LastAdministrator, None),
            PeopleError::UnknownToken(_) | PeopleError::UnknownApproval(_) => (ProblemKind::NotFound, None),
            PeopleError::TooMuch(_) => (ProblemKind::Forbidden, Some("scopes")),
            PeopleError::NotApproved(_) => (ProblemKind::ApprovalRefused, None),
        };
        let problem = Problem::new(kind, told.clone());
        Self(Box::new(match field {
            Some(field) => problem.with_field(field, told),
            None => problem,
        }))
    }
}

impl From<IntentError> for Failure {
    fn from(error: IntentError) -> Self {
        let kind = match error {
            IntentError::Refused(refusal) => return refusal.into(),
            IntentError::KeyReused => ProblemKind::IdempotencyKeyReused,
            IntentError::Stopping => ProblemKind::Stopping,
            IntentError::Overloaded => ProblemKind::Overloaded,
            IntentError::Storage => ProblemKind::StorageFailing,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<Refusal> for Failure {
    fn from(refusal: Refusal) -> Self {
        let (kind, field) = match &refusal {
            Refusal::UnknownSatellite(_) => (ProblemKind::UnknownSatellite, Some("satellite")),
            Refusal::UnknownLink(_) => (ProblemKind::UnknownLink, Some("link")),
            Refusal::UnknownCommand(_) => (ProblemKind::UnknownCommand, None),
            Refusal::UnknownDownload(_) => (ProblemKind::UnknownDownload, None),
            Refusal::UnknownKey(_) => (ProblemKind::UnknownKey, None),
            Refusal::NoKey(_) => (ProblemKind::NoKey, None),
            Refusal::Argument(_) => (ProblemKind::BadArgument, Some("arguments")),
            Refusal::NotInProfile(_) => (ProblemKind::NotInProfile, Some("command")),
            Refusal::NeedsConfirmation(_) => (ProblemKind::NeedsConfirmation, Some("confirm")),
            Refusal::TooLate { .. } => (ProblemKind::TooLate, None),
            Refusal::AlreadyExpired => (ProblemKind::AlreadyExpired, Some("expires_at")),
            Refusal::QueueFull(_) => (ProblemKind::QueueFull, None),
            Refusal::Storage(_) => (ProblemKind::StorageFailing, None),
            Refusal::NotLocked(_) => (ProblemKind::NotLocked, None),
            Refusal::ClockNotVouched(_) => (ProblemKind::ClockNotVouched, None),
            Refusal::FloorNeeded { .. } => (ProblemKind::FloorNeeded, Some("above")),
            Refusal::FloorOutOfRange { .. } => (ProblemKind::BadArgument, Some("above")),
            Refusal::UnknownPlan(_) => (ProblemKind::UnknownPlan, Some("plan")),
            Refusal::Plan(_) => (ProblemKind::PlanRefused, Some("plan")),
            Refusal::PlansFull(_) => (ProblemKind::PlansFull, None),
            Refusal::Pass(_) => (ProblemKind::PassRefused, Some("at")),
            Refusal::NothingRuns(_) => (ProblemKind::NothingRuns, Some("satellite")),
            Refusal::Stopping => (ProblemKind::Stopping, None),
        };
        let message = refusal.to_string();
        let mut problem = Problem::new(kind, message.clone());
        if let Some(field) = field {
            problem = problem.with_field(field, message);
        }
        Self(Box::new(problem))
    }
}

/// What an error of the router or of axum itself is called.
fn kind_of(status: StatusCode) -> (ProblemKind, &'static str) {
    match status {
        StatusCode::NOT_FOUND => {
            (ProblemKind::NotFound, "This path leads nowhere; docs/api.md lists the paths.")
        }
        StatusCode::METHOD_NOT_ALLOWED => {
            (ProblemKind::MethodNotAllowed, "The header Allow names the methods that this path takes.")
        }
        StatusCode::NOT_ACCEPTABLE => {
            (ProblemKind::NotAcceptable, "This path has no answer in a form that Accept names.")
        }
        StatusCode::PAYLOAD_TOO_LARGE => (ProblemKind::BodyTooLarge, "A body may have 65536 bytes at most."),
        StatusCode::UNSUPPORTED_MEDIA_TYPE => {
            (ProblemKind::WrongMediaType, "Send Content-Type: application/json.")
        }
        StatusCode::UPGRADE_REQUIRED => (ProblemKind::UpgradeRequired, "Open this path as a WebSocket."),
        status if status.is_client_error() => {
            (ProblemKind::BadParameter, "The request could not be understood.")
        }
        _ => (ProblemKind::Internal, "The server failed; its log says more."),
    }
}

/// Writes the body of an answer that is an error. Every answer of the server passes here.
pub(super) fn render(mut response: Response, path: &str) -> Response {
    let status = response.status();
    if !(status.is_client_error() || status.is_server_error()) {
        return response;
    }
    let mut problem = match response.extensions_mut().remove::<Failure>() {
        Some(Failure(problem)) => *problem,
        // Health tells its reasons in its own shape.
        None if response.extensions().get::<OwnBody>().is_some() => return response,
        None => {
            let (kind, detail) = kind_of(status);
            Problem::new(kind, detail)
        }
    };
    problem.instance = Some(path.to_owned());
    let retry_after_s = problem.retry_after_s;
    let body = serde_json::to_vec(&problem).unwrap_or_default();
    let status = StatusCode::from_u16(problem.status).unwrap_or(status);
    let mut rendered = (status, body).into_response();
    // What the router says beside the body (Allow, ...) stays.
    for (name, value) in response.headers() {
        if name != header::CONTENT_LENGTH && name != header::CONTENT_TYPE {
            rendered.headers_mut().insert(name.clone(), value.clone());
        }
    }
    let headers = rendered.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
    if status == StatusCode::UNAUTHORIZED {
        headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    }
    if matches!(status, StatusCode::TOO_MANY_REQUESTS | StatusCode::SERVICE_UNAVAILABLE) {
        headers.insert(header::RETRY_AFTER, HeaderValue::from(retry_after_s.unwrap_or(1)));
    }
    rendered
}

/// Marks an error answer that brings its own body.
#[derive(Clone, Copy)]
pub(super) struct OwnBody;
