//! Logging in and out, one-time links, tokens, roles: through the door, as a browser and as a program.

use std::net::SocketAddr;

use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::http::{Method, Request, header};
use futures_util::StreamExt as _;
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;

use super::{Answer, Bench, HOST, request};
use crate::clock::within;
use crate::engine::EngineMessage;
use crate::people::{Role, SessionRules};

/// A browser: a cookie, and the word that goes with it.
#[derive(Debug, Clone)]
pub(super) struct Browser {
    pub(super) cookie: String,
    pub(super) csrf: String,
}

impl Browser {
    /// Out of the answer of a door.
    pub(super) fn of(answer: &Answer) -> Self {
        let set = answer.header("set-cookie");
        let cookie = set.split(';').next().unwrap().to_owned();
        Self { cookie, csrf: answer.ok()["csrf"].as_str().unwrap().to_owned() }
    }

    pub(super) fn read(&self, path: &str) -> Request<Body> {
        request(Method::GET, path).header(header::COOKIE, &self.cookie).body(Body::empty()).unwrap()
    }

    pub(super) fn write(&self, method: Method, path: &str, key: &str, body: &Value) -> Request<Body> {
        request(method, path)
            .header(header::COOKIE, &self.cookie)
            .header("x-csrf-token", &self.csrf)
            .header(header::ORIGIN, format!("http://{HOST}"))
            .header(header::CONTENT_TYPE, "application/json")
            .header("idempotency-key", key)
            .body(Body::from(body.to_string()))
            .unwrap()
    }
}

pub(super) const PASSWORD: &str = "a pass over the roof";

pub(super) fn knock(path: &str, body: &Value) -> Request<Body> {
    request(Method::POST, path)
        .header(header::ORIGIN, format!("http://{HOST}"))
        .header(header::CONTENT_TYPE, "application/json")
        .body(Body::from(body.to_string()))
        .unwrap()
}

impl Bench {
    /// Somebody of this role, logged in, with a password that was never typed.
    pub(super) async fn somebody(&self, name: &str, role: Role) -> Browser {
        let token = self.people.session_of(name, role).await;
        let cookie = format!("session={}", token.reveal());
        let session =
            self.send(Browser { cookie: cookie.clone(), csrf: String::new() }.read("/api/v1/session"));
        let csrf = session.await.ok()["csrf"].as_str().unwrap().to_owned();
        Browser { cookie, csrf }
    }

    pub(super) async fn log_in(&self, name: &str, password: &str) -> Answer {
        self.send(knock("/api/v1/session", &json!({"name": name, "password": password}))).await
    }
}

#[tokio::test]
async fn the_first_administrator_comes_by_a_link_that_works_once() {
    let bench = Bench::new().await;
    // Nobody is there: looking is open, on loopback.
    assert_eq!(bench.get("/api/v1/session").await.ok()["rights"], json!(["look"]));
    let spent = bench.people.first_welcome().await.unwrap().unwrap();
    let link = bench.people.first_welcome().await.unwrap().unwrap();
    let code = |link: &str| link.strip_prefix("/welcome#code=").unwrap().to_owned();
    let say = |code: &str, name: &str, password: &str| {
        knock(
            "/api/v1/welcome",
            &json!({"code": code, "name": name, "password": password, "call_sign": "DL0ABC"}),
        )
    };
    for (bad, problem) in [
        (say(&code(&spent), "verma", PASSWORD), "link-refused"),
        (say("0000", "verma", PASSWORD), "link-refused"),
        (say(&code(&link), "verma", "short"), "bad-password"),
        (say(&code(&link), "local", PASSWORD), "bad-argument"),
        (say(&code(&link), "V erma", PASSWORD), "bad-argument"),
    ] {
        assert_eq!(bench.send(bad).await.problem(), problem);
    }
    let welcome = bench.send(say(&code(&link), "verma", PASSWORD)).await;
    let cookie = welcome.header("set-cookie").to_owned();
    assert!(cookie.contains("; HttpOnly; SameSite=Strict") && cookie.contains("Path=/"), "{cookie}");
    let verma = Browser::of(&welcome);
    assert_eq!(bench.send(say(&code(&link), "other", PASSWORD)).await.problem(), "link-refused");
    // From now on nobody looks without a name.
    assert_eq!(bench.get("/api/v1/station").await.problem(), "login-required");
    bench.send(verma.read("/api/v1/station")).await.ok();
    let session = bench.send(verma.read("/api/v1/session")).await.ok();
    assert_eq!((&session["name"], &session["role"]), (&json!("verma"), &json!("administrator")));
    let users = bench.send(verma.read("/api/v1/users")).await.ok();
    assert_eq!(users["items"][0]["call_sign"], "DL0ABC");
    assert!(bench.people.first_welcome().await.unwrap().is_none());
    // A page may write with the session; what it does stands under the person's name.
    bench.send(verma.write(Method::POST, "/api/v1/links/e22/disarm", "a", &json!({}))).await.ok();
    let audit = bench.send(verma.read("/api/v1/audit?limit=100")).await.ok();
    let told: Vec<String> = audit["items"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| format!("{} {}", row["who"], row["action"]))
        .collect();
    for wanted in [r#""verma" "user.welcome""#, r#""verma" "session.begin""#, r#""verma" "link.disarm""#] {
        assert!(told.iter().any(|row| row == wanted), "{wanted} is not among {told:?}");
    }
    // An old link opens nothing.
    let made = bench.send(verma.write(
        Method::POST,
        "/api/v1/users",
        "b",
        &json!({"name": "otto", "role": "viewer"}),
    ));
    assert_eq!(made.await.status().as_u16(), 201);
    let link = bench.send(verma.write(Method::POST, "/api/v1/users/otto/link", "c", &json!({}))).await.ok();
    bench.hands.pass_h(24.1);
    let late = json!({"code": code(link["link"].as_str().unwrap()), "password": PASSWORD});
    assert_eq!(bench.send(knock("/api/v1/welcome", &late)).await.problem(), "link-refused");
}

#[tokio::test]
async fn name_and_password_open_a_session_and_guessing_is_slowed_down() {
    let bench = Bench::new().await;
    let code = bench.people.first_welcome().await.unwrap().unwrap();
    let body = json!({"code": code.split('=').nth(1), "name": "verma", "password": PASSWORD});
    let first = Browser::of(&bench.send(knock("/api/v1/welcome", &body)).await);
    let second = Browser::of(&bench.log_in("verma", PASSWORD).await);
    assert_ne!(first.cookie, second.cookie);
    for (name, password) in
        [("verma", "a pass over the roog"), ("nobody", PASSWORD), ("", ""), ("VERMA", PASSWORD)]
    {
        assert_eq!(bench.log_in(name, password).await.problem(), "wrong-password", "{name}");
    }
    for _ in 0..4 {
        bench.log_in("verma", "a wrong password").await;
    }
    let paused = bench.log_in("verma", PASSWORD).await;
    assert_eq!((paused.problem().as_str(), paused.header("retry-after")), ("rate-limited", "1"));
    bench.hands.pass_h(0.01);
    bench.log_in("verma", PASSWORD).await.ok();
    // An address that guesses is sent away, for whatever account; others are not.
    let from = |last: u8, name: &str| {
        let mut request = knock("/api/v1/session", &json!({"name": name, "password": "a wrong password"}));
        request.extensions_mut().insert(ConnectInfo(SocketAddr::from(([192, 0, 2, last], 5000))));
        request
    };
    let mut problems = Vec::new();
    for n in 0..22 {
        problems.push(bench.send(from(7, &format!("user-{n}"))).await.problem());
    }
    assert_eq!(problems.iter().filter(|problem| *problem == "wrong-password").count(), 20, "{problems:?}");
    assert_eq!(problems.last().unwrap(), "rate-limited");
    assert_eq!(bench.send(from(8, "user-0")).await.problem(), "wrong-password");
    // A new password ends every session but the one that set it.
    let body = json!({"old": PASSWORD, "new": "another pass over the roof"});
    let changed = bench.send(first.write(Method::POST, "/api/v1/session/password", "p", &body)).await;
    let third = Browser::of(&changed);
    for old in [&first, &second] {
        assert_eq!(bench.send(old.read("/api/v1/station")).await.problem(), "login-required");
    }
    bench.send(third.read("/api/v1/station")).await.ok();
    assert_eq!(bench.log_in("verma", PASSWORD).await.problem(), "wrong-password");
    // Out, and out everywhere.
    let fourth = Browser::of(&bench.log_in("verma", "another pass over the roof").await);
    bench.send(fourth.write(Method::DELETE, "/api/v1/session", "o", &json!({}))).await.ok();
    assert_eq!(bench.send(fourth.read("/api/v1/station")).await.problem(), "login-required");
    bench.send(third.write(Method::POST, "/api/v1/session/end-all", "q", &json!({}))).await.ok();
    assert_eq!(bench.send(third.read("/api/v1/station")).await.problem(), "login-required");
}

#[tokio::test]
async fn a_cookie_is_exchanged_and_a_copy_of_the_old_one_ends_the_session() {
    let bench = Bench::new().await;
    let old = bench.somebody("verma", Role::Operator).await;
    let young = bench.send(old.read("/api/v1/session")).await;
    assert_eq!(young.header("set-cookie"), "");
    bench.hands.pass_h(1.5);
    let new = Browser::of(&bench.send(old.read("/api/v1/session")).await);
    assert_ne!(old.cookie, new.cookie);
    // The answer was lost: the old one goes on for as long as it takes.
    bench.hands.pass_h(0.5);
    bench.send(old.read("/api/v1/station")).await.ok();
    // The new one arrives; what is under way with the old one still counts, for a minute.
    bench.send(new.read("/api/v1/station")).await.ok();
    bench.send(old.read("/api/v1/station")).await.ok();
    assert_eq!(
        bench
            .send(old.write(Method::POST, "/api/v1/links/e22/disarm", "x", &json!({})))
            .await
            .status()
            .as_u16(),
        200
    );
    bench.hands.pass_h(0.05);
    assert_eq!(bench.send(old.read("/api/v1/station")).await.problem(), "session-replayed");
    assert_eq!(bench.send(new.read("/api/v1/station")).await.problem(), "login-required");
}

#[tokio::test]
async fn sessions_end_after_half_an_hour_without_use_and_after_half_a_day() {
    let bench = Bench::with_people(|settings| settings.session = SessionRules::default()).await;
    let minutes = |minutes: f64| bench.hands.pass_h(minutes / 60.0);
    let idle = bench.somebody("verma", Role::Viewer).await;
    for _ in 0..3 {
        minutes(26.9);
        bench.send(idle.read("/api/v1/station")).await.ok();
    }
    minutes(30.1);
    assert_eq!(bench.send(idle.read("/api/v1/station")).await.problem(), "login-required");
    let busy = bench.somebody("otto", Role::Viewer).await;
    let session = bench.send(busy.read("/api/v1/session")).await.ok();
    let ends = session["expires_at"].as_str().unwrap().to_owned();
    for _ in 0..71 {
        minutes(10.0);
        bench.send(busy.read("/api/v1/station")).await.ok();
    }
    assert_eq!(bench.send(busy.read("/api/v1/session")).await.ok()["expires_at"], ends.as_str());
    minutes(10.0);
    assert_eq!(bench.send(busy.read("/api/v1/station")).await.problem(), "login-required");
}

#[tokio::test]
async fn a_station_may_have_other_rules_about_sessions_and_the_cookie_follows_them() {
    let rules = SessionRules { idle_us: 3_600_000_000, max_us: 2 * 3_600_000_000 };
    let bench = Bench::with_people(|settings| settings.session = rules).await;
    let code = bench.people.first_welcome().await.unwrap().unwrap();
    let body = json!({"code": code.split('=').nth(1), "name": "verma", "password": PASSWORD});
    let welcome = bench.send(knock("/api/v1/welcome", &body)).await;
    assert!(welcome.header("set-cookie").contains("; Max-Age=7200"), "{}", welcome.header("set-cookie"));
    let verma = Browser::of(&welcome);
    bench.hands.pass_h(0.9);
    bench.send(verma.read("/api/v1/station")).await.ok();
    bench.hands.pass_h(0.9);
    bench.send(verma.read("/api/v1/station")).await.ok();
    bench.hands.pass_h(0.21);
    assert_eq!(bench.send(verma.read("/api/v1/station")).await.problem(), "login-required");
}

#[tokio::test]
async fn users_change_and_the_last_administrator_stays() {
    let bench = Bench::new().await;
    let root = bench.somebody("root-admin", Role::Administrator).await;
    let otto = bench.somebody("otto", Role::Operator).await;
    let change = |name: &str, key: &str, body: Value| {
        root.write(Method::POST, &format!("/api/v1/users/{name}"), key, &body)
    };
    let last = bench.send(change("root-admin", "a", json!({"role": "viewer"}))).await;
    assert_eq!(last.problem(), "last-administrator");
    assert_eq!(
        bench.send(change("nobody-here", "b", json!({"disabled": true}))).await.problem(),
        "unknown-user"
    );
    assert_eq!(bench.send(change("otto", "c", json!({"role": "king"}))).await.problem(), "bad-argument");
    // A lesser role counts at once, in sessions that are open.
    bench.send(change("otto", "d", json!({"role": "viewer"}))).await.ok();
    let ping = otto.write(Method::POST, "/api/v1/commands", "e", &json!({"command": "Ping"}));
    let refused = bench.send(ping).await;
    assert_eq!(refused.problem(), "forbidden");
    let detail = refused.json()["detail"].as_str().unwrap().to_owned();
    assert!(
        detail.contains("otto") && detail.contains("'command'") && detail.contains("operator"),
        "{detail}"
    );
    bench.send(change("otto", "f", json!({"disabled": true}))).await.ok();
    assert_eq!(bench.send(otto.read("/api/v1/station")).await.problem(), "login-required");
    let again = root.write(Method::POST, "/api/v1/users", "g", &json!({"name": "otto", "role": "viewer"}));
    assert_eq!(bench.send(again).await.problem(), "user-exists");
    let audit = bench.send(root.read("/api/v1/audit?limit=1")).await.ok();
    assert_eq!(audit["items"][0]["detail"], "user otto, disabled");
}

#[tokio::test]
async fn a_machine_may_do_what_its_token_and_its_owner_may() {
    let bench = Bench::new().await;
    let root = bench.somebody("root-admin", Role::Administrator).await;
    bench.somebody("otto", Role::Operator).await;
    let new = |name: &str, key: &str, scopes: Value, owner: Value| {
        let body = json!({"name": name, "scopes": scopes, "days": 30, "owner": owner});
        root.write(Method::POST, "/api/v1/tokens", key, &body)
    };
    let too_much = bench.send(new("big", "a", json!(["manage-people"]), json!("otto"))).await;
    assert_eq!(too_much.problem(), "forbidden");
    assert_eq!(bench.send(new("bad", "b", json!(["fly"]), json!(null))).await.problem(), "bad-argument");
    let made = bench.send(new("script", "c", json!(["look", "command"]), json!("otto"))).await.ok();
    let secret = made["secret"].as_str().unwrap().to_owned();
    assert!(secret.starts_with("gst_") && secret.len() == 68);
    let tokens = bench.send(root.read("/api/v1/tokens")).await;
    assert!(!String::from_utf8_lossy(&tokens.bytes).contains(&secret[4..]));
    let ask = |method: Method, path: &str, body: Value| {
        request(method, path)
            .header(header::AUTHORIZATION, format!("Bearer {secret}"))
            .header("idempotency-key", body.to_string().len().to_string())
            .header(header::CONTENT_TYPE, "application/json")
            .body(Body::from(body.to_string()))
            .unwrap()
    };
    let ping = json!({"command": "Ping"});
    let id = bench.send(ask(Method::POST, "/api/v1/commands", ping)).await.ok()["command"].clone();
    let command = bench.send(root.read(&format!("/api/v1/commands/{id}"))).await.ok();
    assert_eq!(command["principal"], "token:script");
    let critical = json!({"command": "Reset", "confirm": "Reset"});
    assert_eq!(bench.send(ask(Method::POST, "/api/v1/commands", critical)).await.problem(), "forbidden");
    assert_eq!(bench.send(ask(Method::POST, "/api/v1/clock/vouch", json!({}))).await.status().as_u16(), 200);
    assert_eq!(bench.send(ask(Method::GET, "/api/v1/users", json!({}))).await.problem(), "forbidden");
    // It ends with its owner, comes back with him, and ends for good when it is revoked (or its days are over: doors.rs).
    let change = |key: &str, body: Value| root.write(Method::POST, "/api/v1/users/otto", key, &body);
    bench.send(change("d", json!({"disabled": true}))).await.ok();
    assert_eq!(bench.send(ask(Method::GET, "/api/v1/station", json!({}))).await.problem(), "token-refused");
    bench.send(change("e", json!({"disabled": false}))).await.ok();
    bench.send(ask(Method::GET, "/api/v1/station", json!({}))).await.ok();
    bench.send(root.write(Method::DELETE, "/api/v1/tokens/script", "f", &json!({}))).await.ok();
    assert_eq!(bench.send(ask(Method::GET, "/api/v1/station", json!({}))).await.problem(), "token-refused");
    let again = bench.send(root.write(Method::DELETE, "/api/v1/tokens/script", "g", &json!({}))).await;
    assert_eq!(again.problem(), "not-found");
}

#[tokio::test]
async fn a_stream_ends_with_its_session() {
    let (bench, address) = Bench::on_a_socket().await;
    let verma = bench.somebody("verma", Role::Viewer).await;
    let connect = |cookie: Option<&str>, origin: &str| {
        let mut request = format!("ws://{address}/api/v1/stream").into_client_request().unwrap();
        if let Some(cookie) = cookie {
            request.headers_mut().insert("cookie", cookie.parse().unwrap());
        }
        request.headers_mut().insert("origin", origin.parse().unwrap());
        tokio_tungstenite::connect_async(request)
    };
    let own = format!("http://{address}");
    assert!(connect(None, &own).await.is_err(), "nobody may look any more");
    assert!(connect(Some(&verma.cookie), "http://evil.example").await.is_err());
    let (mut socket, _) = connect(Some(&verma.cookie), &own).await.unwrap();
    assert!(matches!(socket.next().await, Some(Ok(Message::Text(_)))));
    bench.send(verma.write(Method::DELETE, "/api/v1/session", "o", &json!({}))).await.ok();
    let ended = within(std::time::Duration::from_secs(10), async {
        while let Some(Ok(message)) = socket.next().await {
            if let Message::Close(Some(frame)) = message {
                return Some((u16::from(frame.code), frame.reason.to_string()));
            }
        }
        None
    });
    let (code, reason) = ended.await.expect("in time").expect("a word at the end");
    assert_eq!(code, 1008);
    assert!(reason.contains("logged out"), "{reason}");
}

#[tokio::test]
async fn behind_tls_the_cookie_and_the_origin_are_stricter() {
    let bench = Bench::with_people(|settings| settings.https = true).await;
    let token = bench.people.session_of("verma", Role::Operator).await;
    let plain = Browser { cookie: format!("session={}", token.reveal()), csrf: String::new() };
    assert_eq!(bench.send(plain.read("/api/v1/station")).await.problem(), "login-required");
    let hosted = Browser { cookie: format!("__Host-session={}", token.reveal()), csrf: String::new() };
    bench.send(hosted.read("/api/v1/station")).await.ok();
    let csrf = bench.send(hosted.read("/api/v1/session")).await.ok()["csrf"].as_str().unwrap().to_owned();
    let hosted = Browser { csrf, ..hosted };
    let mut write = hosted.write(Method::POST, "/api/v1/links/e22/disarm", "a", &json!({}));
    write.headers_mut().insert("origin", format!("https://{HOST}").parse().unwrap());
    bench.send(write).await.ok();
    let write = hosted.write(Method::POST, "/api/v1/links/e22/disarm", "b", &json!({}));
    assert_eq!(bench.send(write).await.problem(), "origin-refused");
    bench.hands.pass_h(1.5);
    let renewed = bench.send(hosted.read("/api/v1/session")).await;
    let cookie = renewed.header("set-cookie");
    assert!(cookie.starts_with("__Host-session=") && cookie.ends_with("; Secure"), "{cookie}");
    // Two cookies of the name: one of them was slipped in.
    let two = Browser { cookie: format!("{0}; {0}", hosted.cookie), csrf: String::new() };
    assert_eq!(bench.send(two.read("/api/v1/station")).await.problem(), "login-required");
}

/// What the record of the first transmission says, when somebody has had a Ping sent.
async fn first_transmission(ask: impl AsyncFn(&Bench) -> Request<Body>) -> Value {
    let bench = Bench::with_people(|settings| {
        settings.open_reading = Some(true);
        settings.call_sign = "DL0STA".to_owned();
        settings.licence = "club".to_owned();
    })
    .await;
    let root = bench.somebody("root-admin", Role::Administrator).await;
    bench.somebody("otto", Role::Operator).await;
    let body = json!({"call_sign": "DL1OTT", "licence": "class A"});
    bench.send(root.write(Method::POST, "/api/v1/users/otto", "a", &body)).await.ok();
    let link = mission::LinkId::new("e22").unwrap();
    bench.inbox.send(EngineMessage::Link { link, state: mission::LinkState::Ok }).await;
    let ask = ask(&bench).await;
    bench.send(ask).await.ok();
    for _ in 0..1000 {
        let found = bench.get("/api/v1/transmissions").await.ok();
        if let Some(first) = found["items"].get(0) {
            let mut first = first.clone();
            assert!(first["at"].is_string() && first["link"] == "e22", "{first}");
            first.as_object_mut().unwrap().retain(|key, _| {
                ["command", "attempt", "principal", "person", "call_sign", "licence"].contains(&key.as_str())
            });
            return first;
        }
        crate::clock::wall_sleep(std::time::Duration::from_millis(10)).await;
    }
    panic!("nothing was radiated");
}

#[tokio::test]
async fn each_transmission_says_who_answered_for_it() {
    let ping = || json!({"command": "Ping", "gate": "blind"});
    let by_person = first_transmission(async |bench: &Bench| {
        let otto = bench.somebody("otto", Role::Operator).await;
        otto.write(Method::POST, "/api/v1/commands", "k", &ping())
    });
    assert_eq!(
        by_person.await,
        json!({"command": 1, "attempt": 1, "principal": "otto", "person": "otto", "call_sign": "DL1OTT", "licence": "class A"})
    );
    let by_machine = first_transmission(async |bench: &Bench| {
        let root = bench.somebody("root-admin", Role::Administrator).await;
        let body = json!({"name": "script", "scopes": ["command"], "days": 1, "owner": "otto"});
        let made = bench.send(root.write(Method::POST, "/api/v1/tokens", "t", &body)).await.ok();
        let bearer = format!("Bearer {}", made["secret"].as_str().unwrap());
        let mut request = super::write("/api/v1/commands", "k").body(Body::from(ping().to_string())).unwrap();
        request.headers_mut().insert("authorization", bearer.parse().unwrap());
        request
    });
    assert_eq!(
        by_machine.await,
        json!({"command": 1, "attempt": 1, "principal": "token:script", "person": "otto", "call_sign": "DL1OTT", "licence": "class A"})
    );
    let by_machine_of_nobody = first_transmission(async |_: &Bench| {
        super::write("/api/v1/commands", "k").body(Body::from(ping().to_string())).unwrap()
    });
    assert_eq!(
        by_machine_of_nobody.await,
        json!({"command": 1, "attempt": 1, "principal": "local", "person": null, "call_sign": "DL0STA", "licence": "club"})
    );
}
