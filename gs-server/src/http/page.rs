//! The pages, one for now and one for the coming days: static files that are compiled in. No request of it leaves this server.

use axum::extract::Path;
use axum::http::HeaderMap;
use axum::response::Response;

use super::conditional;
use super::problem::Failure;

macro_rules! files {
    ($($name:literal)*) => {
        /// Name and content of each file.
        pub(super) const FILES: &[(&str, &str)] = &[$(($name, include_str!(concat!("page/", $name)))),*];
    };
}

files! {
    "agenda.js" "alerts.js" "api.js" "approvals.js" "begin.js" "coming.js" "commands.js" "console.css" "days.js"
    "docs.css" "docs.js" "dom.js" "door.css" "door.js" "ears.js" "events.js" "favicon.svg" "format.js" "hands.js" "heartbeat.js"
    "held.js" "links.js" "login.js" "main.js" "model.js" "notice.js" "passes.js" "picture.js" "plan.css" "plan.js"
    "report.css" "runs.js" "session.js" "stream.js" "tokens.css" "top.js" "welcome.js"
}

pub(super) async fn index(headers: HeaderMap) -> Response {
    answer("text/html; charset=utf-8", include_str!("page/index.html"), &headers)
}

/// Who gets which pass of the coming days, and what became of it.
pub(super) async fn plan(headers: HeaderMap) -> Response {
    answer("text/html; charset=utf-8", include_str!("page/plan.html"), &headers)
}

pub(super) async fn login(headers: HeaderMap) -> Response {
    answer("text/html; charset=utf-8", include_str!("page/login.html"), &headers)
}

pub(super) async fn welcome(headers: HeaderMap) -> Response {
    answer("text/html; charset=utf-8", include_str!("page/welcome.html"), &headers)
}

pub(super) async fn favicon(headers: HeaderMap) -> Response {
    answer("image/svg+xml", include_str!("page/favicon.svg"), &headers)
}

pub(super) async fn file(Path(name): Path<String>, headers: HeaderMap) -> Result<Response, Failure> {
    let found = FILES.iter().find(|(known, _)| *known == name);
    let (name, content) =
        found.ok_or_else(|| Failure::new(api::ProblemKind::NotFound, "The page has no such file."))?;
    let media_type = match name.rsplit_once('.') {
        Some((_, "css")) => "text/css; charset=utf-8",
        Some((_, "svg")) => "image/svg+xml",
        _ => "text/javascript; charset=utf-8",
    };
    Ok(answer(media_type, content, &headers))
}

/// Kept by the browser, but asked for each time: a new server brings its new page at once.
pub(super) fn answer(media_type: &'static str, content: &'static str, headers: &HeaderMap) -> Response {
    conditional::answer(media_type, content, headers)
}
