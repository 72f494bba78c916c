//! What the document says about people, what needs a second of them, and rehearsals.

use api::ProblemKind as K;
use api::{
    ApprovalView, ApproveRequest, LinkMade, LoginRequest, Nothing, Outcome, PasswordRequest, RefuseRequest,
    RehearsalRequest, RehearsalView, SessionView, TokenMade, TokenRequest, TokenView, TransmissionView,
    UserChange, UserRequest, UserView, WelcomeRequest,
};

use super::operation::{Doc, Kind, delete, get, param, post};
use super::table::{AFTER, BEFORE, FROM, INTENT, LIMIT, LIST, UNTIL};

pub(super) fn people() -> Vec<Doc> {
    vec![
        get("/api/v1/session", "people", "session", "Who asks, and what they may do").json::<SessionView>(),
        post("/api/v1/session", "people", "log_in", "Log in; the cookie comes with the answer")
            .door()
            .body::<LoginRequest>()
            .json::<SessionView>()
            .problems(&[K::WrongPassword, K::RateLimited]),
        delete("/api/v1/session", "people", "log_out", "Log out").json::<Nothing>(),
        post("/api/v1/session/end-all", "people", "log_out_everywhere", "Log out everywhere")
            .body::<Nothing>()
            .json::<Nothing>(),
        post(
            "/api/v1/session/password",
            "people",
            "change_password",
            "Another password; all other sessions end",
        )
        .body::<PasswordRequest>()
        .json::<SessionView>()
        .problems(&[K::WrongPassword, K::BadPassword, K::RateLimited]),
        post("/api/v1/welcome", "people", "welcome", "Open a one-time link: a name, a password, and in")
            .door()
            .body::<WelcomeRequest>()
            .json::<SessionView>()
            .problems(&[K::LinkRefused, K::BadPassword, K::BadArgument, K::UserExists, K::RateLimited]),
        post("/api/v1/welcome/link", "people", "first_link", "The first administrator's one-time link")
            .body::<Nothing>()
            .json::<LinkMade>()
            .problems(&[K::UserExists]),
        get("/api/v1/users", "people", "list_users", "Who there is").query(&[FROM, UNTIL]).page::<UserView>(),
        post("/api/v1/users", "people", "add_user", "Somebody new")
            .body::<UserRequest>()
            .json::<UserView>()
            .creates()
            .problems(&[K::BadArgument, K::UserExists]),
        post("/api/v1/users/{name}", "people", "change_user", "Another role, another call sign, or out")
            .body::<UserChange>()
            .json::<UserView>()
            .problems(&[K::BadArgument, K::UnknownUser, K::LastAdministrator]),
        post("/api/v1/users/{name}/link", "people", "user_link", "A one-time link for somebody")
            .body::<Nothing>()
            .json::<LinkMade>()
            .problems(&[K::UnknownUser]),
        get("/api/v1/tokens", "people", "list_tokens", "Tokens of machines; never their secrets")
            .query(&[FROM, UNTIL])
            .page::<TokenView>(),
        post("/api/v1/tokens", "people", "new_token", "A token for a machine; its secret is told once")
            .body::<TokenRequest>()
            .json::<TokenMade>()
            .creates()
            .problems(&[K::BadArgument, K::UserExists, K::UnknownUser]),
        delete("/api/v1/tokens/{name}", "people", "revoke_token", "Take a machine's token back")
            .json::<Nothing>()
            .problems(&[K::UnknownUser, K::NotFound]),
        get("/api/v1/approvals", "people", "list_approvals", "What waits or waited for a second person")
            .query(&[
                param("open", Kind::OneOf(&["true", "false"]), "Only what waits still."),
                FROM,
                UNTIL,
                AFTER,
                BEFORE,
                LIMIT,
            ])
            .page::<ApprovalView>(),
        get("/api/v1/approvals/{id}", "people", "get_approval", "One of these")
            .json::<ApprovalView>()
            .problems(&[K::NotFound]),
        post("/api/v1/approvals/{id}/approve", "people", "approve", "Yes to exactly that")
            .body::<ApproveRequest>()
            .json::<Outcome>()
            .problems(&INTENT)
            .problems(&[K::NotFound, K::ApprovalRefused]),
        post("/api/v1/approvals/{id}/refuse", "people", "refuse", "No, or never mind")
            .body::<RefuseRequest>()
            .json::<ApprovalView>()
            .problems(&[K::NotFound, K::ApprovalRefused]),
        get("/api/v1/transmissions", "people", "list_transmissions", "Who answered for each radiation")
            .query(&LIST)
            .page::<TransmissionView>(),
    ]
}

pub(super) fn rehearsals() -> Vec<Doc> {
    vec![
        get("/api/v1/rehearsals", "plans", "list_rehearsals", "Rehearsals that were asked for, newest first")
            .query(&[FROM, UNTIL])
            .page::<RehearsalView>(),
        post("/api/v1/rehearsals", "plans", "rehearse", "Send a plan through its coming pass in simulation")
            .body::<RehearsalRequest>()
            .json::<RehearsalView>()
            .creates()
            .problems(&[
                K::BadArgument,
                K::PlanRefused,
                K::UnknownPlan,
                K::UnknownSatellite,
                K::PassRefused,
                K::NoPlace,
                K::NoElements,
            ]),
        get("/api/v1/rehearsals/{id}", "plans", "get_rehearsal", "How far it is, and what it answers")
            .json::<RehearsalView>()
            .problems(&[K::NotFound]),
        delete("/api/v1/rehearsals/{id}", "plans", "cancel_rehearsal", "Give it up")
            .json::<RehearsalView>()
            .problems(&[K::NotFound]),
    ]
}
