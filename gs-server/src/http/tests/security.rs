//! Every path is tried in every wrong way; the route table says what there is.

use axum::body::Body;
use axum::http::{Method, Request, header};
use serde_json::json;

use super::super::admit::Policy;
use super::super::routes::{Access, Route, table};
use super::people::Browser;
use super::{Bench, HOST, TOKEN, request, write};
use crate::people::{Right, Role};

/// A path of the table with something in the place of its parameters.
fn concrete(path: &str) -> String {
    path.replace("/links/{id}", "/links/e22")
        .replace("/keys/{id}", "/keys/00000000")
        .replace("/satellites/{name}", "/satellites/pixelsat-1")
        .replace("{name}", "status")
        .replace("{file}", "main.js")
        .replace("{month}", "2026-11")
        .replace("{id}", "1")
}

fn writes() -> Vec<(Method, String)> {
    let method = |access| match access {
        Access::Write => Some(Method::POST),
        Access::Remove => Some(Method::DELETE),
        Access::Read | Access::Stream | Access::Door => None,
    };
    let paths: Vec<_> = table()
        .iter()
        .filter(|route| route.policy != Policy::LoggedIn)
        .filter_map(|route| Some((method(route.access)?, concrete(route.path))))
        .collect();
    assert!(paths.len() >= 8 && paths.iter().any(|(method, _)| method == Method::DELETE));
    paths
}

fn body(builder: axum::http::request::Builder, body: impl Into<Body>) -> Request<Body> {
    builder.body(body.into()).unwrap()
}

fn without(path: &str, name: &str) -> Request<Body> {
    let mut request = body(write(path, "k"), "{}");
    request.headers_mut().remove(name);
    request
}

fn with(path: &str, name: &'static str, value: &str) -> Request<Body> {
    let mut request = body(write(path, "k"), "{}");
    request.headers_mut().insert(name, value.parse().unwrap());
    request
}

#[tokio::test]
async fn every_write_is_refused_in_every_wrong_way() {
    let bench = Bench::new().await;
    let large = format!("{{\"x\":\"{}\"}}", "x".repeat(600_000));
    for (method, path) in writes() {
        let wrong_method = body(write(&path, "k"), "{}");
        let mut two_keys = body(write(&path, "k"), "{}");
        two_keys.headers_mut().append("idempotency-key", "l".parse().unwrap());
        let mut plain = body(write(&path, "k"), "{}");
        plain.headers_mut().insert("content-type", "text/plain".parse().unwrap());
        let mut form = body(write(&path, "k"), "command=Ping");
        form.headers_mut().insert("content-type", "application/x-www-form-urlencoded".parse().unwrap());
        let cases = [
            ("no token", without(&path, "authorization"), 401, "login-required"),
            ("other scheme", with(&path, "authorization", &format!("Basic {TOKEN}")), 401, "login-required"),
            (
                "wrong token",
                with(&path, "authorization", "Bearer 0123456789abcdef0123456789abcdee"),
                401,
                "token-refused",
            ),
            ("empty token", with(&path, "authorization", "Bearer "), 401, "token-refused"),
            (
                "cut token",
                with(&path, "authorization", &format!("Bearer {}", &TOKEN[1..])),
                401,
                "token-refused",
            ),
            ("foreign host", with(&path, "host", "evil.example:8700"), 421, "host-refused"),
            ("host without port", with(&path, "host", "127.0.0.1"), 421, "host-refused"),
            ("no host", without(&path, "host"), 421, "host-refused"),
            ("foreign origin", with(&path, "origin", "http://evil.example"), 403, "origin-refused"),
            ("null origin", with(&path, "origin", "null"), 403, "origin-refused"),
            ("other port's origin", with(&path, "origin", "http://127.0.0.1:8701"), 403, "origin-refused"),
            ("no idempotency key", without(&path, "idempotency-key"), 400, "idempotency-key-required"),
            ("empty idempotency key", with(&path, "idempotency-key", ""), 400, "idempotency-key-required"),
            (
                "long idempotency key",
                with(&path, "idempotency-key", &"x".repeat(129)),
                400,
                "idempotency-key-required",
            ),
            ("two idempotency keys", two_keys, 400, "idempotency-key-required"),
            ("wrong method", wrong_method, 405, "method-not-allowed"),
            ("oversized", body(write(&path, "k"), large.clone()), 413, "body-too-large"),
            ("text", plain, 415, "wrong-media-type"),
            ("form", form, 415, "wrong-media-type"),
            ("undeclared", without(&path, "content-type"), 415, "wrong-media-type"),
            ("no JSON", body(write(&path, "k"), "{\"a\":"), 400, "bad-json"),
            ("a list", body(write(&path, "k"), "[1]"), 422, "wrong-shape"),
            ("an empty list", body(write(&path, "k"), "[]"), 422, "wrong-shape"),
            ("unknown field", body(write(&path, "k"), r#"{"nonsense":1}"#), 422, "wrong-shape"),
        ];
        for (name, mut request, status, problem) in cases {
            *request.method_mut() = if name == "wrong method" { Method::PUT } else { method.clone() };
            let answer = bench.send(request).await;
            assert_eq!(answer.status().as_u16(), status, "{path}, {name}");
            assert_eq!(answer.problem(), problem, "{path}, {name}");
            if status == 401 {
                assert_eq!(answer.header("www-authenticate"), "Bearer");
            }
        }
    }
    assert_eq!(bench.store.counts().await.unwrap().commands, 0);
    assert_eq!(bench.store.last_event_seq().await.unwrap(), 1);
}

fn method(route: &Route) -> Method {
    match route.access {
        Access::Read | Access::Stream => Method::GET,
        Access::Write | Access::Door => Method::POST,
        Access::Remove => Method::DELETE,
    }
}

/// Origins that are not this server's.
const STRANGE: [&str; 4] = ["http://evil.example", "null", "http://127.0.0.1:8701", "https://127.0.0.1:8700"];

fn is_changing(route: &Route) -> bool {
    matches!(route.access, Access::Write | Access::Remove)
}

/// What a browser sends on this route, with everything that belongs to it.
fn asked(browser: &Browser, route: &Route) -> Request<Body> {
    browser.write(method(route), &concrete(route.path), "k", &json!({}))
}

/// Tokens of machines that had every right: one whose day is over in 24 h, and one that was revoked.
pub(super) async fn dead_tokens(bench: &Bench, root: &Browser) -> [(&'static str, String); 2] {
    let scopes: Vec<&str> = Right::ALL.iter().map(|right| right.name()).collect();
    let make = async |name: &str| {
        let body = json!({"name": name, "scopes": scopes, "days": 1});
        let made = bench.send(root.write(Method::POST, "/api/v1/tokens", name, &body)).await.ok();
        format!("Bearer {}", made["secret"].as_str().unwrap())
    };
    let dead = [("expired token", make("short-lived").await), ("revoked token", make("revoked").await)];
    for (_, bearer) in &dead {
        let mut look = root.read("/api/v1/version");
        look.headers_mut().remove("cookie");
        look.headers_mut().insert("authorization", bearer.parse().unwrap());
        bench.send(look).await.ok();
    }
    bench.send(root.write(Method::DELETE, "/api/v1/tokens/revoked", "r", &json!({}))).await.ok();
    dead
}

/// The whole matrix: each path × nobody, an expired session, one that was ended, one whose user was shut out, a machine's
/// token that is expired, one that was revoked, one of any other scope, a strange origin, no origin, no CSRF word, the word of another session, an exchanged cookie, a wrong
/// method, a body too large. All are refused, each for its own reason, and nothing is stored.
#[tokio::test]
async fn every_path_is_refused_to_everybody_who_may_not() {
    let bench = Bench::with_people(|settings| settings.open_reading = Some(false)).await;
    let root = bench.somebody("root-admin", Role::Administrator).await;
    // A machine that may do anything but the right in question is the sharpest stranger.
    let mut lacking = std::collections::BTreeMap::new();
    for right in Right::ALL {
        let scopes: Vec<&str> =
            Right::ALL.iter().filter(|other| **other != right).map(|other| other.name()).collect();
        let body = json!({"name": format!("no-{right}"), "scopes": scopes, "days": 30});
        let made = bench.send(root.write(Method::POST, "/api/v1/tokens", right.name(), &body)).await.ok();
        lacking.insert(right, made["secret"].as_str().unwrap().to_owned());
    }
    let dead = dead_tokens(&bench, &root).await;
    let expired = bench.somebody("eve", Role::Administrator).await;
    bench.hands.pass_h(25.0);
    let ended = bench.somebody("ed", Role::Administrator).await;
    bench.send(ended.write(Method::DELETE, "/api/v1/session", "o", &json!({}))).await.ok();
    let shut_out = bench.somebody("otto", Role::Administrator).await;
    let root = bench.somebody("root-admin", Role::Administrator).await;
    let disable = root.write(Method::POST, "/api/v1/users/otto", "d", &json!({"disabled": true}));
    bench.send(disable).await.ok();
    let other = bench.somebody("olga", Role::Administrator).await;
    let before = bench.store.last_event_seq().await.unwrap();

    let large = json!({"x": "x".repeat(600_000)});
    let mut tried = 0;
    for route in table().iter().filter(|route| route.policy != Policy::Anyone) {
        let path = concrete(route.path);
        let mut refused = Vec::new();
        let nobody = Browser { cookie: "x=y".to_owned(), csrf: "x".to_owned() };
        for (name, browser) in
            [("nobody", &nobody), ("expired", &expired), ("ended", &ended), ("shut out", &shut_out)]
        {
            refused.push((name, asked(browser, route), 401, "login-required"));
        }
        if let Policy::Needs(right) = route.policy {
            let mut request = asked(&nobody, route);
            let bearer = format!("Bearer {}", lacking[&right]);
            request.headers_mut().insert("authorization", bearer.parse().unwrap());
            refused.push(("without the right", request, 403, "forbidden"));
        }
        for (name, bearer) in &dead {
            let mut request = asked(&nobody, route);
            request.headers_mut().insert("authorization", bearer.parse().unwrap());
            refused.push((*name, request, 401, "token-refused"));
        }
        if route.policy == Policy::LoggedIn {
            let mut request = asked(&nobody, route);
            let bearer = format!("Bearer {}", lacking[&Right::Look]);
            request.headers_mut().insert("authorization", bearer.parse().unwrap());
            refused.push(("a machine", request, 401, "login-required"));
        }
        let strange = |origin: &str| {
            let mut request = asked(&root, route);
            request.headers_mut().insert("origin", origin.parse().unwrap());
            request
        };
        for origin in STRANGE {
            refused.push(("strange origin", strange(origin), 403, "origin-refused"));
        }
        if is_changing(route) {
            let mut none = asked(&root, route);
            none.headers_mut().remove("origin");
            refused.push(("no origin", none, 403, "csrf"));
            let mut no_word = asked(&root, route);
            no_word.headers_mut().remove("x-csrf-token");
            refused.push(("no CSRF word", no_word, 403, "csrf"));
            let mut wrong_word = asked(&root, route);
            wrong_word.headers_mut().insert("x-csrf-token", other.csrf.parse().unwrap());
            refused.push(("word of another session", wrong_word, 403, "csrf"));
            let too_large = root.write(method(route), &path, "k", &large);
            refused.push(("too large", too_large, 413, "body-too-large"));
        }
        let mut wrong_method = asked(&root, route);
        *wrong_method.method_mut() = Method::PATCH;
        refused.push(("wrong method", wrong_method, 405, "method-not-allowed"));
        for (name, request, status, problem) in refused {
            let answer = bench.send(request).await;
            assert_eq!(
                (answer.status().as_u16(), answer.problem().as_str()),
                (status, problem),
                "{path}: {name}"
            );
            tried += 1;
        }
        // An exchanged cookie that somebody kept: it ends the session, so each path gets one of its own.
        let old = bench.somebody("rosa", Role::Administrator).await;
        bench.hands.pass_h(1.1);
        let new = Browser::of(&bench.send(old.read("/api/v1/session")).await);
        bench.send(new.read("/api/v1/version")).await.ok();
        bench.hands.pass_h(0.02);
        bench.send(root.read("/api/v1/version")).await.ok();
        let replayed = bench.send(asked(&old, route)).await;
        assert_eq!(replayed.problem(), "session-replayed", "{path}");
        assert_eq!(bench.send(asked(&new, route)).await.problem(), "login-required", "{path}");
        tried += 2;
    }
    assert!(tried > 900, "{tried}");
    assert_eq!(bench.store.counts().await.unwrap().commands, 0);
    assert_eq!(bench.store.last_event_seq().await.unwrap(), before);
}

#[test]
fn what_anybody_may_take_is_known_by_name() {
    let open: Vec<_> =
        table().into_iter().filter(|route| route.policy == Policy::Anyone).map(|r| r.path).collect();
    let known = [
        "/",
        "/plan",
        "/favicon.ico",
        "/page/{file}",
        "/healthz",
        "/readyz",
        "/login",
        "/welcome",
        "/api/v1/session",
        "/api/v1/session",
        "/api/v1/welcome",
        "/api/docs",
        "/api/v1/openapi.json",
        "/api/v1/health",
    ];
    assert_eq!(open, known, "a path without any condition: is there really nothing in it that needs one?");
}

#[tokio::test]
async fn the_doors_take_no_strangers_page_and_no_endless_body() {
    let bench = Bench::new().await;
    let doors: Vec<_> =
        table().iter().filter(|route| route.access == Access::Door).map(|route| route.path).collect();
    assert!(!doors.is_empty());
    for path in doors {
        let knock = || {
            request(Method::POST, path)
                .header(header::CONTENT_TYPE, "application/json")
                .body(Body::from("{}"))
                .unwrap()
        };
        let mut strange = knock();
        strange.headers_mut().insert("origin", "http://evil.example".parse().unwrap());
        assert_eq!(bench.send(strange).await.problem(), "origin-refused");
        let mut form = knock();
        form.headers_mut().insert("content-type", "application/x-www-form-urlencoded".parse().unwrap());
        assert_eq!(bench.send(form).await.problem(), "wrong-media-type");
        let mut large = knock();
        *large.body_mut() = Body::from(format!("{{\"x\":\"{}\"}}", "x".repeat(70_000)));
        assert_eq!(bench.send(large).await.problem(), "body-too-large");
        assert_eq!(bench.send(knock()).await.problem(), "wrong-shape");
    }
}

/// What anybody may take is still no strangers' page's, takes its own methods only, and no credential that is none.
#[tokio::test]
async fn what_anybody_may_take_refuses_strange_origins_wrong_methods_and_dead_tokens() {
    let bench = Bench::new().await;
    let root = bench.somebody("root-admin", Role::Administrator).await;
    let dead = dead_tokens(&bench, &root).await;
    bench.hands.pass_h(25.0);
    let open: Vec<_> = table().into_iter().filter(|route| route.policy == Policy::Anyone).collect();
    assert!(open.len() > 10);
    for route in open {
        let path = concrete(route.path);
        let asked = || request(method(&route), &path).header(header::CONTENT_TYPE, "application/json");
        for origin in STRANGE {
            let answer = bench.send(asked().header("origin", origin).body(Body::from("{}")).unwrap()).await;
            assert_eq!(answer.problem(), "origin-refused", "{path}: {origin}");
            assert!(answer.header("set-cookie").is_empty());
        }
        for wrong in [Method::PATCH, Method::PUT, Method::OPTIONS, Method::TRACE] {
            let mut request = asked().body(Body::from("{}")).unwrap();
            *request.method_mut() = wrong.clone();
            let answer = bench.send(request).await;
            assert_eq!(answer.problem(), "method-not-allowed", "{path}: {wrong}");
            assert!(!answer.header("allow").is_empty(), "{path}: {wrong}");
        }
        for (name, bearer) in &dead {
            let answer = bench.send(asked().header("authorization", bearer).body(Body::from("{}")).unwrap());
            assert_eq!(answer.await.problem(), "token-refused", "{path}: {name}");
        }
    }
}

#[tokio::test]
async fn the_page_s_own_origin_and_lower_case_bearer_may_write() {
    let bench = Bench::new().await;
    let mut request = body(write("/api/v1/links/e22/disarm", "k"), "");
    request.headers_mut().insert("origin", format!("http://{HOST}").parse().unwrap());
    request.headers_mut().insert("authorization", format!("bearer {TOKEN}").parse().unwrap());
    request.headers_mut().remove("content-type");
    bench.send(request).await.ok();
}

#[tokio::test]
async fn every_path_checks_the_host_and_carries_the_security_headers() {
    let bench = Bench::new().await;
    let mut paths: Vec<String> = table().iter().map(|route| concrete(route.path)).collect();
    paths.push("/nowhere".to_owned());
    for path in paths {
        let strange = Request::builder().uri(&path).header(header::HOST, "attacker.example:8700");
        let strange = bench.send(strange.body(Body::empty()).unwrap()).await;
        assert_eq!(strange.problem(), "host-refused", "{path}");
        let own = bench.get(&path).await;
        for answer in [strange, own] {
            let policy = answer.header("content-security-policy");
            assert!(
                policy.contains("default-src 'self'") && policy.contains("frame-ancestors 'none'"),
                "{path}"
            );
            assert!(!policy.contains("unsafe"), "{path}");
            assert_eq!(answer.header("x-content-type-options"), "nosniff", "{path}");
            assert_eq!(answer.header("referrer-policy"), "no-referrer", "{path}");
            assert!(["no-store", "no-cache"].contains(&answer.header("cache-control")), "{path}");
            assert!(answer.parts.headers.get("access-control-allow-origin").is_none(), "{path}");
        }
    }
}

#[tokio::test]
async fn two_host_headers_or_another_name_in_the_request_line_are_refused() {
    let bench = Bench::new().await;
    let two = request(Method::GET, "/api/v1/version").header(header::HOST, HOST).body(Body::empty()).unwrap();
    assert_eq!(bench.send(two).await.problem(), "host-refused");
    let line = request(Method::GET, "http://evil.example/api/v1/version").body(Body::empty()).unwrap();
    assert_eq!(bench.send(line).await.problem(), "host-refused");
}

#[tokio::test]
async fn every_error_is_a_problem_and_405_names_the_methods() {
    let bench = Bench::new().await;
    for (method, path, status, problem) in [
        (Method::GET, "/nowhere", 404, "not-found"),
        (Method::GET, "/api/v1/nowhere", 404, "not-found"),
        (Method::GET, "/page/../mod.rs", 404, "not-found"),
        (Method::GET, "/page/%2e%2e%2fmod.rs", 404, "not-found"),
        (Method::PUT, "/api/v1/commands", 405, "method-not-allowed"),
        (Method::OPTIONS, "/api/v1/commands", 405, "method-not-allowed"),
        (Method::GET, "/api/v1/commands/1/cancel", 405, "method-not-allowed"),
        (Method::GET, "/api/v1/frames/1", 404, "not-found"),
        (Method::GET, "/api/v1/frames/18446744073709551615", 404, "not-found"),
        (Method::GET, "/api/v1/frames/-1", 400, "bad-parameter"),
        (Method::GET, "/api/v1/frames/one", 400, "bad-parameter"),
        (Method::GET, "/api/v1/frames/%ff", 400, "bad-parameter"),
        (Method::GET, "/api/v1/frames?limit=0", 400, "bad-parameter"),
        (Method::GET, "/api/v1/frames?limit=1001", 400, "bad-parameter"),
        (Method::GET, "/api/v1/frames?lmit=1", 400, "bad-parameter"),
        (Method::GET, "/api/v1/events?level=loud", 400, "bad-parameter"),
        (Method::GET, "/api/v1/events?kind=frame-heard,nonsense", 400, "bad-parameter"),
        (Method::GET, "/api/v1/telemetry", 400, "bad-parameter"),
        (Method::GET, "/api/v1/telemetry?parameter=x&start=yesterday", 400, "bad-parameter"),
        (Method::GET, "/api/v1/telemetry?parameter=heartbeat.none", 404, "not-found"),
        (Method::GET, "/api/v1/telemetry?parameter=x&satellite=other", 422, "unknown-satellite"),
        (Method::GET, "/api/v1/stream", 426, "upgrade-required"),
        (Method::GET, "/api/v1/stream?after=x", 400, "bad-parameter"),
    ] {
        let answer = bench.send(request(method.clone(), path).body(Body::empty()).unwrap()).await;
        assert_eq!(answer.status().as_u16(), status, "{method} {path}");
        assert_eq!(answer.problem(), problem, "{method} {path}");
        if status == 405 {
            assert!(!answer.header("allow").is_empty(), "{method} {path}");
        }
    }
}

#[test]
fn the_kinds_of_problems_are_part_of_the_api() {
    let lines: Vec<String> = api::ProblemKind::ALL
        .iter()
        .map(|kind| format!("{} {} {}", kind.status(), kind.urn(), kind.title()))
        .collect();
    insta::assert_snapshot!(lines.join("\n"));
}
