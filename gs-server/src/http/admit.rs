//! Who asks, and whether they may: around every route lies [`admit`] with the route's own [`Policy`].
//!
//! Its order: the origin of what is not a plain read, who asks, the right that the policy names. A handler that wants to
//! know who asks takes a [`Caller`].

use api::ProblemKind;
use axum::extract::{FromRequestParts, Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use mission::Principal;

use super::App;
use super::guard::check_origin;
use super::problem::Failure;
use super::routes::Access;
use crate::people::{Right, Rights};

/// Who may take a route. Every row of the table has one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Policy {
    /// Anybody: pages without data, and the door itself.
    Anyone,
    /// Whoever has this right.
    Needs(Right),
}

/// Who asks, checked.
#[derive(Debug, Clone)]
pub(super) struct Caller {
    /// As records name them; `None` for somebody who has shown nothing.
    pub(super) principal: Option<Principal>,
    /// What they may do.
    pub(super) rights: Rights,
}

impl Caller {
    /// Whoever has shown the token of the server's own file.
    fn local() -> Self {
        Self { principal: Some(Principal::new("local")), rights: Rights::all() }
    }

    fn nobody() -> Self {
        Self { principal: None, rights: [Right::Look].into_iter().collect() }
    }

    /// Whether they have this right.
    ///
    /// # Errors
    /// Log in first; or who could give it.
    pub(super) fn may(&self, right: Right) -> Result<(), Failure> {
        if self.rights.has(right) {
            return Ok(());
        }
        Err(match &self.principal {
            None => Failure::new(
                ProblemKind::LoginRequired,
                "Log in at /login, or send 'Authorization: Bearer TOKEN' with the token of the server's token file.",
            ),
            Some(principal) => Failure::new(
                ProblemKind::Forbidden,
                format!(
                    "{principal} lacks the right '{right}', which the role {} brings: an administrator can give it.",
                    right.least_role()
                ),
            ),
        })
    }
}

impl FromRequestParts<App> for Caller {
    type Rejection = Failure;

    async fn from_request_parts(parts: &mut Parts, _: &App) -> Result<Self, Failure> {
        // Behind `admit` there is always one.
        parts.extensions.get::<Self>().cloned().ok_or_else(|| {
            tracing::error!(path = parts.uri.path(), "A route is outside the table.");
            Failure::new(ProblemKind::Internal, "This path cannot be taken.")
        })
    }
}

/// Around every route.
pub(super) async fn admit(
    State((app, policy, access)): State<(App, Policy, Access)>,
    mut request: Request,
    next: Next,
) -> Response {
    match check(&app, policy, access, request.headers()) {
        Ok(caller) => {
            request.extensions_mut().insert(caller);
            next.run(request).await
        }
        Err(failure) => failure.into_response(),
    }
}

fn check(app: &App, policy: Policy, access: Access, headers: &HeaderMap) -> Result<Caller, Failure> {
    if access != Access::Read {
        check_origin(headers)?;
    }
    let caller = identify(app, headers)?;
    match policy {
        Policy::Anyone => {}
        Policy::Needs(right) => caller.may(right)?,
    }
    Ok(caller)
}

fn identify(app: &App, headers: &HeaderMap) -> Result<Caller, Failure> {
    let given = headers.get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
    let bearer = given
        .and_then(|value| value.split_once(' '))
        .filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
    match bearer {
        Some((_, token)) if app.state.token.matches(token.trim()) => Ok(Caller::local()),
        Some(_) => Err(Failure::new(
            ProblemKind::TokenRefused,
            "This is not the token of this server. It stands in its token file.",
        )),
        None => Ok(Caller::nobody()),
    }
}
