//! `/api/v1/users`, `/api/v1/tokens`: who may come in.

use api::{
    LinkMade, Nothing, Page, ProblemKind, TokenMade, TokenRequest, TokenView, UserChange, UserRequest,
    UserView,
};
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;

use super::App;
use super::extract::{Name, Query, Within, time, whole};
use super::problem::Failure;
use super::write::Write;
use crate::people::{Caller, Rights, Role, TokenWanted, UserChanged, UserWanted};
use crate::storage::{TokenRow, UserRow};

pub(super) async fn users(
    State(app): State<App>,
    Query(asked): Query<Within>,
) -> Result<Json<Page<UserView>>, Failure> {
    let during = asked.during()?;
    let mut users = app.state.people.users().await?;
    users.retain(|(user, _)| during.holds(user.created_at_us));
    Ok(Json(whole(users.into_iter().map(|(user, sessions)| user_view(user, sessions)).collect())))
}

pub(super) async fn add_user(
    State(app): State<App>,
    caller: Caller,
    write: Write<UserRequest>,
) -> Result<(StatusCode, Json<UserView>), Failure> {
    let UserRequest { name, role: word, call_sign, licence } = write.body;
    let wanted = UserWanted {
        name,
        role: role(&word)?,
        call_sign: call_sign.unwrap_or_default(),
        licence: licence.unwrap_or_default(),
    };
    let user = app.state.people.add_user(&caller, wanted).await?;
    Ok((StatusCode::CREATED, Json(user_view(user, 0))))
}

pub(super) async fn change_user(
    State(app): State<App>,
    Name(name): Name,
    caller: Caller,
    write: Write<UserChange>,
) -> Result<Json<UserView>, Failure> {
    let UserChange { role: word, call_sign, licence, disabled } = write.body;
    let wanted = UserChanged { role: word.as_deref().map(role).transpose()?, call_sign, licence, disabled };
    let user = app.state.people.change_user(&caller, &name, wanted).await?;
    Ok(Json(user_view(user, 0)))
}

pub(super) async fn user_link(
    State(app): State<App>,
    Name(name): Name,
    caller: Caller,
    _: Write<Nothing>,
) -> Result<Json<LinkMade>, Failure> {
    link(&app, &caller, Some(&name)).await
}

/// The link of the first administrator, while there is nobody.
pub(super) async fn first_link(
    State(app): State<App>,
    caller: Caller,
    _: Write<Nothing>,
) -> Result<Json<LinkMade>, Failure> {
    link(&app, &caller, None).await
}

async fn link(app: &App, caller: &Caller, user: Option<&str>) -> Result<Json<LinkMade>, Failure> {
    let (code, row) = app.state.people.new_link(caller.name(), user).await?;
    Ok(Json(LinkMade {
        user: row.user_name,
        link: format!("/welcome#code={}", code.reveal()),
        expires_at: time(row.expires_at_us),
    }))
}

pub(super) async fn tokens(
    State(app): State<App>,
    Query(asked): Query<Within>,
) -> Result<Json<Page<TokenView>>, Failure> {
    let during = asked.during()?;
    let mut tokens = app.state.people.tokens().await?;
    tokens.retain(|token| during.holds(token.created_at_us));
    Ok(Json(whole(tokens.into_iter().map(token_view).collect())))
}

pub(super) async fn new_token(
    State(app): State<App>,
    caller: Caller,
    write: Write<TokenRequest>,
) -> Result<(StatusCode, Json<TokenMade>), Failure> {
    let TokenRequest { name, scopes, days, owner } = write.body;
    let scopes = Rights::from_words(&scopes.join(" "))
        .map_err(|error| Failure::field(ProblemKind::BadArgument, "scopes", error.to_string()))?;
    let (secret, row) =
        app.state.people.new_token(&caller, TokenWanted { name, scopes, days, owner }).await?;
    let made = TokenMade { secret: secret.reveal().to_owned(), token: token_view(row) };
    Ok((StatusCode::CREATED, Json(made)))
}

pub(super) async fn revoke_token(
    State(app): State<App>,
    Name(name): Name,
    caller: Caller,
    _: Write<Nothing>,
) -> Result<Json<Nothing>, Failure> {
    app.state.people.revoke_token(&caller, &name).await?;
    Ok(Json(Nothing {}))
}

fn role(word: &str) -> Result<Role, Failure> {
    word.parse().map_err(|error: crate::people::NoSuchRole| {
        Failure::field(ProblemKind::BadArgument, "role", error.to_string())
    })
}

fn filled(text: String) -> Option<String> {
    Some(text).filter(|text| !text.is_empty())
}

fn user_view(user: UserRow, sessions: u64) -> UserView {
    UserView {
        name: user.name,
        role: user.role,
        call_sign: filled(user.call_sign),
        licence: filled(user.licence),
        disabled: user.disabled,
        has_password: user.password.is_some(),
        created_at: time(user.created_at_us),
        created_by: user.created_by,
        sessions,
    }
}

fn token_view(token: TokenRow) -> TokenView {
    TokenView {
        name: token.name,
        owner: token.owner,
        scopes: token.scopes.split(' ').map(str::to_owned).collect(),
        created_at: time(token.created_at_us),
        created_by: token.created_by,
        expires_at: time(token.expires_at_us),
        revoked_at: token.revoked_at_us.map(time),
    }
}
