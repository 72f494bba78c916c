//! What every request passes: the Host check, and on the way out problems, security headers and the cache rule.

use api::ProblemKind;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};

use super::App;
use super::accept::check_accept;
use super::hosts::is_same_origin;
use super::problem::{Failure, render};

/// No inline script or style, nothing from elsewhere, in nobody's frame.
const CONTENT_SECURITY_POLICY: &str = "default-src 'self'; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'none'; object-src 'none'";

const HEADERS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// The outermost layer.
pub(super) async fn guard(State(app): State<App>, request: Request, next: Next) -> Response {
    let path = request.uri().path().to_owned();
    let allowed = check_host(&app, &request).and_then(|()| check_accept(&path, request.headers()));
    let response = match allowed {
        Ok(()) => next.run(request).await,
        Err(failure) => failure.into_response(),
    };
    let mut response = render(response, &path);
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    // Data of a live station is old at once; what may be kept says so itself.
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}

fn check_host(app: &App, request: &Request) -> Result<(), Failure> {
    let mut hosts = request.headers().get_all(header::HOST).iter();
    let host = hosts.next().and_then(|host| host.to_str().ok()).unwrap_or("");
    // A proxy's request line may carry a name of its own.
    let line = request.uri().authority().map_or(host, |authority| authority.as_str());
    if hosts.next().is_none() && app.hosts.allows(host) && app.hosts.allows(line) {
        return Ok(());
    }
    Err(Failure::new(
        ProblemKind::HostRefused,
        "The Host header names a host that is not in the list. Use localhost, or add the name to http.allowed_hosts.",
    ))
}

/// Pages of another origin may not write nor follow the stream: browsers do not apply the same-origin rule to
/// WebSockets. Programs send no Origin.
pub(super) fn check_origin(headers: &HeaderMap, https: bool) -> Result<(), Failure> {
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or("");
    let is_own =
        |origin: &HeaderValue| origin.to_str().is_ok_and(|origin| is_same_origin(origin, host, https));
    if headers.get_all(header::ORIGIN).iter().all(is_own) {
        return Ok(());
    }
    Err(Failure::new(
        ProblemKind::OriginRefused,
        "The Origin header names another page than this server's own. Open the page from this very address.",
    ))
}
