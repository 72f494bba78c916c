//! Who asks, and whether they may: around every route lies [`admit`] with the route's own [`Policy`].
//!
//! Its order: the origin, who asks (a bearer's token, else a session's cookie), for a cookie's
//! write the session's own word (`X-CSRF-Token`), then the right that the policy names. A handler that wants to know who
//! asks takes a [`Caller`].

use std::net::{IpAddr, SocketAddr};

use api::ProblemKind;
use axum::extract::{ConnectInfo, FromRequestParts, Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};

use super::App;
use super::guard::check_origin;
use super::problem::Failure;
use super::routes::Access;
use crate::people::{Caller, Credential, Right};

const CSRF: HeaderName = HeaderName::from_static("x-csrf-token");
const FORWARDED_FOR: HeaderName = HeaderName::from_static("x-forwarded-for");

/// Who may take a route. Every row of the table has one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Policy {
    /// Anybody: pages without data, and the door itself.
    Anyone,
    /// Whoever is logged in, for what is their own.
    LoggedIn,
    /// Whoever has this right.
    Needs(Right),
}

/// Where a request came from, as far as that is known.
#[derive(Debug, Clone, Copy)]
pub(super) struct From(pub(super) Option<IpAddr>);

/// Whether the caller has a right.
///
/// # Errors
/// Log in first; or who could give it.
pub(super) fn may(caller: &Caller, right: Right) -> Result<(), Failure> {
    if caller.rights.has(right) {
        return Ok(());
    }
    if caller.credential == Credential::Nobody {
        return Err(log_in_first());
    }
    let detail = format!(
        "{} lacks the right '{right}', which the role {} brings: an administrator can give it.",
        caller.name(),
        right.least_role()
    );
    Err(Failure::new(ProblemKind::Forbidden, detail))
}

fn log_in_first() -> Failure {
    Failure::new(
        ProblemKind::LoginRequired,
        "Log in at /login, or send 'Authorization: Bearer TOKEN' with a token of yours or the one of the server's token \
         file. A session that was not used for a while, or is too old ([people] session_idle_min, session_max_h), has ended.",
    )
}

macro_rules! extracted {
    ($($type:ty),*) => {
        $(
            impl FromRequestParts<App> for $type {
                type Rejection = Failure;

                async fn from_request_parts(parts: &mut Parts, _: &App) -> Result<Self, Failure> {
                    // Behind `admit` there is always one.
                    parts.extensions.get::<Self>().cloned().ok_or_else(|| {
                        tracing::error!(path = parts.uri.path(), "A route is outside the table.");
                        Failure::new(ProblemKind::Internal, "This path cannot be taken.")
                    })
                }
            }
        )*
    };
}

extracted!(Caller, From);

/// Around every route.
pub(super) async fn admit(
    State((app, policy, access)): State<(App, Policy, Access)>,
    mut request: Request,
    next: Next,
) -> Response {
    let from = From(address(&app, &request));
    match check(&app, policy, access, request.headers(), from).await {
        Ok(caller) => {
            request.extensions_mut().insert(caller);
            request.extensions_mut().insert(from);
            next.run(request).await
        }
        Err(failure) => failure.into_response(),
    }
}

async fn check(
    app: &App,
    policy: Policy,
    access: Access,
    headers: &HeaderMap,
    from: From,
) -> Result<Caller, Failure> {
    let https = app.state.people.settings().https;
    // Reads too: nothing is shared with pages of others.
    check_origin(headers, https)?;
    let caller = match identify(app, access, headers, from).await {
        // Whoever looks after the server hears of its health while the archive cannot be read.
        Err(failure) if policy == Policy::Anyone && failure.0.status >= 500 => Caller::nobody(false),
        caller => caller?,
    };
    match policy {
        Policy::Anyone => {}
        Policy::LoggedIn if matches!(caller.credential, Credential::Session(_)) => {}
        Policy::LoggedIn => return Err(log_in_first()),
        Policy::Needs(right) => may(&caller, right)?,
    }
    Ok(caller)
}

async fn identify(app: &App, access: Access, headers: &HeaderMap, from: From) -> Result<Caller, Failure> {
    let people = &app.state.people;
    if let Some(token) = bearer(headers) {
        if app.state.token.matches(token) {
            return Ok(Caller::local());
        }
        if let Some(caller) = people.by_token(token).await? {
            return Ok(caller);
        }
        people.failed(from.0);
        people.may_try(from.0)?;
        return Err(Failure::new(
            ProblemKind::TokenRefused,
            "This token is none of this server's, or it is expired or revoked. Its own stands in its token file.",
        ));
    }
    let Some(cookie) = cookie(headers, https(app)) else { return Ok(people.nobody().await?) };
    let Some(caller) = people.by_cookie(&cookie).await? else {
        return Ok(people.nobody().await?);
    };
    // Browsers send cookies along whoever asks them to.
    if matches!(access, Access::Write | Access::Remove) {
        let given = headers.get(CSRF).and_then(|value| value.to_str().ok()).unwrap_or("");
        if !headers.contains_key(header::ORIGIN) || !people.is_csrf_of(&cookie, given) {
            return Err(Failure::new(
                ProblemKind::Csrf,
                "Send Origin, and X-CSRF-Token with what GET /api/v1/session tells; it changes with the session's cookie.",
            ));
        }
    }
    Ok(caller)
}

fn https(app: &App) -> bool {
    app.state.people.settings().https
}

fn bearer(headers: &HeaderMap) -> Option<&str> {
    let given = headers.get(header::AUTHORIZATION)?.to_str().ok()?;
    let (scheme, token) = given.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim())
}

/// Name of the session's cookie. Browsers take `__Host-` from this very host over TLS only.
pub(super) const fn cookie_name(https: bool) -> &'static str {
    if https { "__Host-session" } else { "session" }
}

/// The session's cookie. Of two of that name one was slipped in by somebody else: then neither counts.
pub(super) fn cookie(headers: &HeaderMap, https: bool) -> Option<String> {
    let pairs = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
    let mut found = pairs
        .flat_map(|pairs| pairs.split(';'))
        .filter_map(|pair| pair.trim().split_once('='))
        .filter(|(name, _)| *name == cookie_name(https));
    let (_, value) = found.next()?;
    found.next().is_none().then(|| value.to_owned())
}

/// Where the request came from. Proxies with TLS on this machine are believed, and nobody else: each appends whom it saw
/// itself, so the last one that is not of this machine counts. What stands before it was said by whoever asks.
fn address(app: &App, request: &Request) -> Option<IpAddr> {
    let peer = request.extensions().get::<ConnectInfo<SocketAddr>>()?.0.ip();
    if !https(app) {
        return Some(peer);
    }
    let mut nearest = peer;
    let told = request.headers().get_all(FORWARDED_FOR).iter().rev();
    let mut hops = told.flat_map(|value| value.to_str().unwrap_or("?").rsplit(','));
    while nearest.to_canonical().is_loopback() {
        let Some(Some(before)) = hops.next().map(hop) else { break };
        nearest = before;
    }
    Some(nearest)
}

/// Proxies write an address, some with its port.
fn hop(text: &str) -> Option<IpAddr> {
    let text = text.trim();
    let with_port = || text.parse::<SocketAddr>().map(|address| address.ip());
    text.parse().or_else(|_| with_port()).ok()
}
