//! `/api/v1/session`, `/api/v1/welcome`: the door. Logging in and out, and who one is.

use api::{LoginRequest, Nothing, PasswordRequest, SessionView, WelcomeRequest};
use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse as _, Response};

use super::App;
use super::admit::{From, cookie, cookie_name};
use super::extract::time;
use super::problem::Failure;
use super::write::Write;
use crate::people::{Caller, Right, Secret, Welcome};

/// Who asks. A session that is old gets a new cookie here.
pub(super) async fn get(
    State(app): State<App>,
    caller: Caller,
    headers: HeaderMap,
) -> Result<Response, Failure> {
    let people = &app.state.people;
    let old = cookie(&headers, people.settings().https).filter(|_| caller.role.is_some());
    let Some(old) = old else { return Ok(Json(view(&app, &caller, None)).into_response()) };
    match people.renew(&old).await? {
        Some(new) => Ok(answer(&app, &caller, &new)),
        None => Ok(Json(view(&app, &caller, Some(&old))).into_response()),
    }
}

pub(super) async fn log_in(
    State(app): State<App>,
    from: From,
    write: Write<LoginRequest>,
) -> Result<Response, Failure> {
    let (token, caller) = app.state.people.log_in(&write.body.name, &write.body.password, from.0).await?;
    Ok(answer(&app, &caller, &token))
}

pub(super) async fn welcome(
    State(app): State<App>,
    from: From,
    write: Write<WelcomeRequest>,
) -> Result<Response, Failure> {
    let WelcomeRequest { code, name, password, call_sign, licence } = &write.body;
    let said = Welcome {
        code,
        name: name.as_deref(),
        password,
        call_sign: call_sign.as_deref(),
        licence: licence.as_deref(),
    };
    let (token, caller) = app.state.people.welcome(said, from.0).await?;
    Ok(answer(&app, &caller, &token))
}

pub(super) async fn change_password(
    State(app): State<App>,
    caller: Caller,
    from: From,
    write: Write<PasswordRequest>,
) -> Result<Response, Failure> {
    let PasswordRequest { old, new } = &write.body;
    let (token, caller) = app.state.people.change_password(&caller, old, new, from.0).await?;
    Ok(answer(&app, &caller, &token))
}

pub(super) async fn log_out(
    State(app): State<App>,
    caller: Caller,
    _: Write<Nothing>,
) -> Result<Response, Failure> {
    app.state.people.log_out(&caller).await?;
    gone(&app).await
}

pub(super) async fn log_out_everywhere(
    State(app): State<App>,
    caller: Caller,
    _: Write<Nothing>,
) -> Result<Response, Failure> {
    app.state.people.log_out_everywhere(&caller).await?;
    gone(&app).await
}

/// Nobody any more, and the cookie is taken away.
async fn gone(app: &App) -> Result<Response, Failure> {
    let nobody = app.state.people.nobody().await?;
    let mut response = Json(view(app, &nobody, None)).into_response();
    set_cookie(&mut response, app, "", 0);
    Ok(response)
}

/// Who it is, with the cookie.
fn answer(app: &App, caller: &Caller, token: &Secret) -> Response {
    let mut response = Json(view(app, caller, Some(token.reveal()))).into_response();
    // For as long as the longest session.
    let age_s = app.state.people.settings().session.max_us / 1_000_000;
    set_cookie(&mut response, app, token.reveal(), age_s);
    response
}

fn set_cookie(response: &mut Response, app: &App, value: &str, age_s: i64) {
    let https = app.state.people.settings().https;
    let secure = if https { "; Secure" } else { "" };
    let name = cookie_name(https);
    let cookie = format!("{name}={value}; Path=/; HttpOnly; SameSite=Strict; Max-Age={age_s}{secure}");
    if let Ok(mut cookie) = HeaderValue::try_from(cookie) {
        cookie.set_sensitive(true);
        response.headers_mut().append(header::SET_COOKIE, cookie);
    }
}

fn view(app: &App, caller: &Caller, cookie: Option<&str>) -> SessionView {
    let people = &app.state.people;
    SessionView {
        name: caller.principal.as_ref().map(ToString::to_string),
        role: caller.role.map(|role| role.name().to_owned()),
        rights: caller.rights.iter().map(Right::name).map(str::to_owned).collect(),
        csrf: cookie.map(|cookie| people.csrf_of(cookie)),
        expires_at: caller.expires_at_us.map(time),
        two_person: if people.settings().two_person { "critical" } else { "off" }.to_owned(),
    }
}
