//! Every write is tried in every wrong way; the route table says what there is.

use axum::body::Body;
use axum::http::{Method, Request, header};

use super::super::routes::{Access, table};
use super::{Bench, HOST, TOKEN, request, write};

/// A path of the table with something in the place of its parameters.
fn concrete(path: &str) -> String {
    path.replace("/links/{id}", "/links/e22")
        .replace("/keys/{id}", "/keys/00000000")
        .replace("/satellites/{name}", "/satellites/pixelsat-1")
        .replace("{name}", "status")
        .replace("{file}", "main.js")
        .replace("{id}", "1")
}

fn writes() -> Vec<(Method, String)> {
    let method = |access| match access {
        Access::Write => Some(Method::POST),
        Access::Remove => Some(Method::DELETE),
        Access::Read | Access::Stream => None,
    };
    let paths: Vec<_> =
        table().iter().filter_map(|route| Some((method(route.access)?, concrete(route.path)))).collect();
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
    let large = format!("{{\"x\":\"{}\"}}", "x".repeat(70_000));
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
