//! The document says what the routes do: no route without its operation, no parameter that is not taken.

use std::collections::BTreeSet;

use axum::http::Method;
use serde_json::Value;

use super::super::openapi::{document, table as operations, text};
use super::super::routes::{Access, table};
use super::{Bench, TOKEN, heartbeat, request};

fn method(access: Access) -> &'static str {
    match access {
        Access::Write | Access::Door => "POST",
        Access::Remove => "DELETE",
        Access::Read | Access::Stream => "GET",
    }
}

#[test]
fn every_route_has_its_operation_and_every_operation_its_route() {
    let routes: BTreeSet<_> = table()
        .iter()
        .filter(|route| route.path.starts_with("/api/v1/"))
        .map(|route| (route.path, method(route.access)))
        .collect();
    let rows = operations();
    let told: BTreeSet<_> = rows.iter().map(|row| (row.path, row.method)).collect();
    assert_eq!(told.len(), rows.len(), "an operation is told twice");
    let untold: Vec<_> = routes.difference(&told).collect();
    assert!(untold.is_empty(), "add these routes to http/openapi/table.rs: {untold:?}");
    let gone: Vec<_> = told.difference(&routes).collect();
    assert!(gone.is_empty(), "http/openapi/table.rs tells of routes that there are not: {gone:?}");
}

/// A query that nobody knows is refused with the names of those that are known: they must be those of the document.
#[tokio::test]
async fn the_parameters_of_the_document_are_those_that_are_taken() {
    let bench = Bench::new().await;
    for row in operations().iter().filter(|row| row.method == "GET" && !row.params.is_empty()) {
        let path = format!("{}?nonsense=1", row.path.replace("{id}", "1"));
        let with_token = request(Method::GET, &path).header("authorization", format!("Bearer {TOKEN}"));
        let answer = bench.send(with_token.body(axum::body::Body::empty()).unwrap()).await;
        assert_eq!(answer.problem(), "bad-parameter", "{}", row.path);
        let detail = answer.json()["detail"].as_str().unwrap().to_owned();
        let (_, known) = detail.split_once("expected ").unwrap_or_else(|| panic!("{}: {detail}", row.path));
        let known: BTreeSet<&str> = known.split('`').skip(1).step_by(2).collect();
        let told: BTreeSet<&str> = row.params.iter().map(|param| param.name).collect();
        assert_eq!(told, known, "{}", row.path);
    }
}

fn docs(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(name)
}

#[test]
fn the_document_is_the_one_in_the_folder_of_documents() {
    let path = docs("openapi.json");
    if std::env::var("INSTA_UPDATE").is_ok_and(|how| how == "always") {
        std::fs::write(&path, text()).unwrap();
    }
    let stored = std::fs::read_to_string(&path).unwrap();
    assert!(stored == text(), "run `gs-server openapi > docs/openapi.json` and look at what changed");
}

#[test]
fn every_reference_of_the_document_leads_somewhere() {
    let document = serde_json::to_value(document()).unwrap();
    assert_eq!(document["openapi"], "3.1.0");
    let mut open = vec![&document];
    let mut references = 0;
    while let Some(value) = open.pop() {
        match value {
            Value::Object(fields) => {
                if let Some(Value::String(reference)) = fields.get("$ref") {
                    let pointer = reference.strip_prefix('#').unwrap();
                    assert!(document.pointer(pointer).is_some(), "{reference} leads nowhere");
                    references += 1;
                }
                open.extend(fields.values());
            }
            Value::Array(items) => open.extend(items),
            _ => {}
        }
    }
    assert!(references > 100, "{references}");
    let ids: Vec<&str> = document["paths"]
        .as_object()
        .unwrap()
        .values()
        .flat_map(|path| path.as_object().unwrap().values())
        .filter_map(|operation| operation["operationId"].as_str())
        .collect();
    assert_eq!(ids.len(), ids.iter().collect::<BTreeSet<_>>().len());
}

/// The list of all operations in docs/api.md, as the table has them.
#[test]
fn the_page_of_the_api_names_every_operation() {
    const MARKS: [&str; 2] = ["<!-- operations -->\n", "<!-- end -->\n"];
    let rows = operations().into_iter().map(|row| {
        let path = row.path.strip_prefix("/api/v1").unwrap();
        format!("| `{} {path}` | {} |\n", row.method, row.summary)
    });
    let rows: String = rows.collect();
    let wanted = format!("{}| operation | what |\n| --- | --- |\n{rows}{}", MARKS[0], MARKS[1]);
    let page = std::fs::read_to_string(docs("api.md")).unwrap();
    let (before, rest) = page.split_once(MARKS[0]).unwrap();
    let (_, after) = rest.split_once(MARKS[1]).unwrap();
    let expected = format!("{before}{wanted}{after}");
    if std::env::var("INSTA_UPDATE").is_ok_and(|how| how == "always") {
        std::fs::write(docs("api.md"), &expected).unwrap();
        return;
    }
    assert!(
        page == expected,
        "run the tests with INSTA_UPDATE=always and look at what changed in docs/api.md"
    );
}

/// What a client with a token has no use for: it brings or ends a browser's cookie.
const OF_BROWSERS: [(&str, &str); 5] = [
    ("POST", "/api/v1/session"),
    ("DELETE", "/api/v1/session"),
    ("POST", "/api/v1/session/end-all"),
    ("POST", "/api/v1/session/password"),
    ("POST", "/api/v1/welcome"),
];

#[test]
fn every_operation_has_its_method_in_the_typed_client() {
    let methods: Vec<_> = api::client::Client::operations()
        .map(|operation| (operation.method, format!("/api/v1/{}", operation.path)))
        .collect();
    let known: BTreeSet<_> = methods.iter().map(|(method, path)| (*method, path.as_str())).collect();
    assert_eq!(known.len(), methods.len(), "two methods for one operation");
    let rows = operations();
    let told: BTreeSet<_> = rows.iter().map(|row| (row.method, row.path)).collect();
    let wanted: BTreeSet<_> = told.iter().filter(|row| !OF_BROWSERS.contains(row)).copied().collect();
    assert!(OF_BROWSERS.iter().all(|row| told.contains(row)));
    let without: Vec<_> = wanted.difference(&known).collect();
    assert!(without.is_empty(), "add methods to api::client for {without:?}");
    let gone: Vec<_> = known.difference(&wanted).collect();
    assert!(gone.is_empty(), "api::client asks for what there is not: {gone:?}");
}

#[test]
fn every_kind_of_problem_is_told_in_the_documents() {
    let page = std::fs::read_to_string(docs("api.md")).unwrap();
    for kind in api::ProblemKind::ALL {
        assert!(page.contains(&format!("`{}`", kind.word())), "docs/api.md does not tell of {}", kind.word());
    }
}

#[tokio::test]
async fn what_is_held_already_is_not_sent_again() {
    let bench = Bench::new().await;
    bench.hear(&heartbeat(20.0)).await;
    bench.frames(1).await;
    for path in ["/api/v1/openapi.json", "/api/v1/telemetry/latest", "/api/v1/elements", "/api/docs", "/"] {
        let first = bench.get(path).await;
        let tag = first.header("etag").to_owned();
        assert!(first.status() == 200 && tag.starts_with("W/\""), "{path}: {tag}");
        let again = request(Method::GET, path).header("if-none-match", &tag);
        let again = bench.send(again.body(axum::body::Body::empty()).unwrap()).await;
        assert_eq!((again.status().as_u16(), again.bytes.len()), (304, 0), "{path}");
        assert_eq!(again.header("etag"), tag);
    }
    let tag = bench.get("/api/v1/telemetry/latest").await.header("etag").to_owned();
    bench.hear(&heartbeat(21.0)).await;
    bench.frames(2).await;
    assert_ne!(bench.get("/api/v1/telemetry/latest").await.header("etag"), tag);
}

#[tokio::test]
async fn every_read_takes_head_and_refuses_a_form_that_it_has_not() {
    let bench = Bench::new().await;
    for row in operations().iter().filter(|row| row.method == "GET") {
        let path = row.path.replace("{id}", "1");
        let got = bench.get(&path).await;
        let head = bench.send(request(Method::HEAD, &path).body(axum::body::Body::empty()).unwrap()).await;
        assert_eq!(head.status(), got.status(), "HEAD {path}");
        if got.status().is_success() {
            assert!(head.bytes.is_empty(), "HEAD {path}");
        }
        if path.ends_with("/stream") {
            continue;
        }
        let strange = request(Method::GET, &path).header("accept", "application/x-nonsense");
        let strange = bench.send(strange.body(axum::body::Body::empty()).unwrap()).await;
        assert_eq!(
            (strange.status().as_u16(), strange.problem().as_str()),
            (406, "not-acceptable"),
            "{path}"
        );
    }
}
