//! What every write passes behind the door ([`super::admit`]), in this order: idempotency key, media type, size, JSON,
//! shape.
//!
//! [`guard_write`] lies around every route that the table declares as a write, so a new one cannot forget it; the
//! [`Write`] extractor only works behind it.

use api::{Outcome, OutcomeWord, Problem, ProblemKind};
use axum::Json;
use axum::body::to_bytes;
use axum::extract::{FromRequestParts, Request};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use mission::{Accepted, Intent, Principal};
use serde::de::DeserializeOwned;
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use super::App;
use super::problem::Failure;
use super::release::{Came, Pass, pass};
use crate::people::Caller;

/// Bytes that a body may have.
pub(super) const BODY_MAX: usize = 64 * 1024;
/// Bytes of reports that are handed in together.
pub(super) const REPORTS_MAX: usize = 512 * 1024;
/// Characters that an idempotency key may have.
const KEY_MAX: usize = 128;

const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");
pub(super) const IDEMPOTENCY_REPLAYED: HeaderName = HeaderName::from_static("idempotency-replayed");

/// Who writes what, checked.
#[derive(Clone)]
struct Checked {
    caller: Caller,
    principal: Principal,
    idempotency_key: String,
    digest: [u8; 32],
    body: Value,
}

/// Around every write.
pub(super) async fn guard_write(request: Request, next: Next) -> Response {
    guarded(request, next, true).await
}

/// Around the doors, where nobody is known yet and nothing is done twice: the same, without idempotency key.
pub(super) async fn guard_door(request: Request, next: Next) -> Response {
    guarded(request, next, false).await
}

async fn guarded(request: Request, next: Next, wants_key: bool) -> Response {
    match check(request, wants_key).await {
        Ok(request) => next.run(request).await,
        Err(failure) => failure.into_response(),
    }
}

async fn check(request: Request, wants_key: bool) -> Result<Request, Failure> {
    let (mut parts, body) = request.into_parts();
    let caller = parts.extensions.get::<Caller>().cloned().ok_or_else(|| {
        tracing::error!(path = parts.uri.path(), "A write is outside the table.");
        Failure::new(ProblemKind::Internal, "This path cannot be written.")
    })?;
    let principal = Principal::new(caller.name());
    let idempotency_key = if wants_key { idempotency_key(&parts.headers)? } else { String::new() };
    let declared = parts.headers.get(header::CONTENT_TYPE);
    let is_json = declared.and_then(|value| value.to_str().ok()).is_some_and(is_json);
    if declared.is_some() && !is_json {
        return Err(wrong_media_type());
    }
    let most = if parts.uri.path() == super::receptions::PATH { REPORTS_MAX } else { BODY_MAX };
    let body = to_bytes(body, most).await.map_err(|_| {
        Failure::new(ProblemKind::BodyTooLarge, format!("A body may have {most} bytes at most."))
    })?;
    let body = match body.is_empty() {
        true => Value::Object(serde_json::Map::new()),
        false if !is_json => return Err(wrong_media_type()),
        false => serde_json::from_slice(&body)
            .map_err(|error| Failure::new(ProblemKind::BadJson, format!("The body is not JSON: {error}.")))?,
    };
    parts.extensions.insert(Checked {
        caller,
        principal,
        idempotency_key,
        digest: digest(&parts, &body),
        body,
    });
    Ok(Request::from_parts(parts, axum::body::Body::empty()))
}

fn idempotency_key(headers: &HeaderMap) -> Result<String, Failure> {
    let mut keys = headers.get_all(IDEMPOTENCY_KEY).iter();
    let key = keys.next().and_then(|key| key.to_str().ok()).unwrap_or("");
    if keys.next().is_none()
        && (1..=KEY_MAX).contains(&key.len())
        && key.bytes().all(|b| b.is_ascii_graphic())
    {
        return Ok(key.to_owned());
    }
    Err(Failure::new(
        ProblemKind::IdempotencyKeyRequired,
        format!(
            "Send 'Idempotency-Key: KEY' with 1 to {KEY_MAX} visible characters, new for each intent (a UUID serves) and \
             the same when you ask again because no answer came."
        ),
    ))
}

fn is_json(media_type: &str) -> bool {
    let essence = media_type.split(';').next().unwrap_or("");
    essence.trim().eq_ignore_ascii_case("application/json")
}

fn wrong_media_type() -> Failure {
    Failure::new(ProblemKind::WrongMediaType, "Send the body with 'Content-Type: application/json'.")
}

/// SHA-256 of what is asked for. Spacing and the order of fields make no difference, an empty body is `{}`.
fn digest(parts: &Parts, body: &Value) -> [u8; 32] {
    let mut hash = Sha256::new();
    for part in [parts.method.as_str(), parts.uri.path()] {
        hash.update(part);
        hash.update([0]);
    }
    // Maps of serde_json are ordered by name. No second copy of a long body is made for it.
    struct Into<'a>(&'a mut Sha256);
    impl std::fmt::Write for Into<'_> {
        fn write_str(&mut self, text: &str) -> std::fmt::Result {
            self.0.update(text);
            Ok(())
        }
    }
    // A hash takes everything.
    let _ = std::fmt::Write::write_fmt(&mut Into(&mut hash), format_args!("{body}"));
    hash.finalize().into()
}

/// A write whose body has the shape `T`.
pub(super) struct Write<T> {
    /// What was sent.
    pub(super) body: T,
    checked: Checked,
}

impl<T> Write<T> {
    /// What was sent, and nothing else: what was kept of the request is let go.
    pub(super) fn into_body(self) -> T {
        self.body
    }
}

impl<T: DeserializeOwned> FromRequestParts<App> for Write<T> {
    type Rejection = Failure;

    async fn from_request_parts(parts: &mut Parts, _: &App) -> Result<Self, Failure> {
        let checked = parts.extensions.remove::<Checked>().ok_or_else(|| {
            tracing::error!(path = parts.uri.path(), "A write route is not declared as one in the table.");
            Failure::new(ProblemKind::Internal, "This path cannot be written.")
        })?;
        // serde would take the fields of an object from a list, too.
        if !checked.body.is_object() {
            let message = "The body must be an object in braces.";
            return Err(Failure::new(ProblemKind::WrongShape, message));
        }
        let body = serde_path_to_error::deserialize(&checked.body).map_err(|error| {
            let (path, inner) = (error.path().to_string(), error.inner().to_string());
            let message = if path == "." { inner } else { format!("{path}: {inner}") };
            let mut problem = Problem::new(ProblemKind::WrongShape, message);
            if path != "." {
                problem = problem.with_field(path, error.inner().to_string());
            }
            Failure(Box::new(problem))
        })?;
        Ok(Self { body, checked })
    }
}

impl<T> Write<T> {
    /// Who writes, under which idempotency key, and the SHA-256 of the request: for writes that are not one intent.
    pub(super) fn who(&self) -> (Principal, String, [u8; 32]) {
        let Checked { principal, idempotency_key, digest, .. } = &self.checked;
        (principal.clone(), idempotency_key.clone(), *digest)
    }

    /// Asks the engine, and answers when what it did is durable.
    pub(super) async fn submit(self, app: &App, intent: Intent) -> Result<Response, Failure> {
        let Checked { caller, principal, idempotency_key, digest, body } = self.checked;
        let came = Came { caller: &caller, idempotency_key: &idempotency_key, digest, body: &body };
        let _same_plans = match pass(app, came, &intent).await? {
            Pass::Go(same_plans) => same_plans,
            Pass::Wait { approval, replayed } => return Ok(awaiting(approval, replayed)),
        };
        let done = app.state.engine.intent(principal, idempotency_key, digest, intent).await?;
        let (outcome, location) = outcome(&done.accepted);
        let status = if location.is_some() && !done.replayed { StatusCode::CREATED } else { StatusCode::OK };
        let mut response = (status, Json(outcome)).into_response();
        if let Some(location) = location.and_then(|location| HeaderValue::try_from(location).ok()) {
            response.headers_mut().insert(header::LOCATION, location);
        }
        if done.replayed {
            response.headers_mut().insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
        }
        Ok(response)
    }
}

/// Nothing is done yet: where to look.
fn awaiting(approval: u64, replayed: bool) -> Response {
    let outcome = Outcome {
        outcome: OutcomeWord::AwaitingApproval,
        command: None,
        download: None,
        approval: Some(approval),
    };
    let mut response = (StatusCode::ACCEPTED, Json(outcome)).into_response();
    let headers = response.headers_mut();
    if let Ok(location) = HeaderValue::try_from(format!("/api/v1/approvals/{approval}")) {
        headers.insert(header::LOCATION, location);
    }
    if replayed {
        headers.insert(IDEMPOTENCY_REPLAYED, HeaderValue::from_static("true"));
    }
    response
}

pub(super) fn outcome(accepted: &Accepted) -> (Outcome, Option<String>) {
    let plain = |outcome| Outcome { outcome, command: None, download: None, approval: None };
    match *accepted {
        Accepted::Command(id) => (
            Outcome { command: Some(id.0), ..plain(OutcomeWord::CommandQueued) },
            Some(format!("/api/v1/commands/{id}")),
        ),
        Accepted::Cancelled(id) => {
            (Outcome { command: Some(id.0), ..plain(OutcomeWord::CommandCancelled) }, None)
        }
        Accepted::Download(id) => (
            Outcome { download: Some(id.0), ..plain(OutcomeWord::DownloadOrdered) },
            Some(format!("/api/v1/downloads/{id}")),
        ),
        Accepted::DownloadCancelled(id) => {
            (Outcome { download: Some(id.0), ..plain(OutcomeWord::DownloadCancelled) }, None)
        }
        Accepted::Done => (plain(OutcomeWord::Done), None),
    }
}
