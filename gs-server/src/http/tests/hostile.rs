//! What attackers type: paths that climb out, scripts that are stored or thrown back, SQL, templates, prototypes, frames. Each
//! is tried on every path of the table where it could do harm, so that a new path is tried by itself.

use axum::body::Body;
use axum::http::{Method, Request};
use mission::Level;
use mission::alert::{AlertKind, Condition};
use mission::record::{EventKind, EventRecord, PassRecord, Record, Subject};
use mission::{Batch, BatchId, PassId, SatelliteId, UtcUs};
use serde_json::{Value, json};

use super::super::openapi::table as operations;
use super::super::page::FILES;
use super::super::routes::{Access, Route, table};
use super::{Answer, Bench, TOKEN, request, station, write};
use crate::clock::wall_sleep;

const SCRIPT: &str = "\"'><script>alert(1)</script><img src=x onerror=alert(2)>";
/// What it would be in an answer that runs it.
const ALIVE: [&str; 3] = ["<script>alert", "<img src=x", "onerror=alert(2)>"];

fn method(route: &Route) -> Method {
    match route.access {
        Access::Read | Access::Stream => Method::GET,
        Access::Write | Access::Door => Method::POST,
        Access::Remove => Method::DELETE,
    }
}

/// With every right, and everything else that a request needs.
fn asked(method: Method, path: &str, key: &str, body: &Value) -> Request<Body> {
    let body = if method == Method::GET { Body::empty() } else { Body::from(body.to_string()) };
    let mut request = write(path, key).body(body).unwrap();
    *request.method_mut() = method;
    request
}

fn text(answer: &Answer) -> String {
    String::from_utf8_lossy(&answer.bytes).into_owned()
}

/// A path of the table with this in the place of its parameter.
fn with(path: &str, parameter: &str) -> String {
    let (before, rest) = path.split_once('{').unwrap();
    let (_, after) = rest.split_once('}').unwrap();
    format!("{before}{parameter}{after}")
}

/// Reading paths as they can be asked, with what [`attacked`] has put into the archive.
fn readable() -> Vec<String> {
    let reads = table().into_iter().filter(|route| route.access == Access::Read).map(|route| route.path);
    let mut paths: Vec<String> = reads
        .map(|path| path.replace("{file}", "main.js").replace("{month}", "2026-11").replace("{id}", "1"))
        .collect();
    for form in ["passes/1.html", "passes/1.md", "months/2026-11.html", "months/2026-11.md"] {
        paths.push(format!("/api/v1/reports/{form}"));
    }
    paths
}

#[tokio::test]
async fn no_path_climbs_out_of_where_it_belongs() {
    let bench = Bench::new().await;
    std::fs::write(bench.folder.path().join("secret.toml"), "the-secret-beside-the-archive").unwrap();
    let climbs = [
        "..",
        "../../../etc/passwd",
        "..%2f..%2f..%2fetc%2fpasswd",
        "%2e%2e%2f%2e%2e%2fdata%2ftoken",
        "%252e%252e%252fsecret.toml",
        "..%5c..%5csecret.toml",
        "....%2f%2fsecret.toml",
        "%2fetc%2fpasswd",
        "%2e%2e",
        "1%00.html",
        "main.js%00",
        "main.js%2f..%2f..%2fmod.rs",
        "file:%2f%2f%2fetc%2fpasswd",
        "%c0%ae%c0%ae%2fsecret.toml",
        "1%2f..%2f2",
    ];
    let mut tried = 0;
    for route in table().iter().filter(|route| route.path.contains('{')) {
        for climb in climbs {
            let path = with(route.path, climb);
            let answer = bench.send(asked(method(route), &path, "k", &json!({}))).await;
            assert!(answer.status().is_client_error(), "{path}: {}", answer.status());
            let _ = answer.problem();
            let told = text(&answer);
            for leak in ["root:", "the-secret", TOKEN, "pub mod", "[package]", "SQLite format"] {
                assert!(!told.contains(leak), "{path}: {told}");
            }
            tried += 1;
        }
    }
    assert!(tried > 300, "{tried}");
    assert_eq!(bench.store.last_event_seq().await.unwrap(), 1, "something was changed");
}

/// A station where everything that anybody may write freely is a script, and so is what names could be.
async fn attacked() -> Bench {
    attacked_on(Bench::watching("").await).await
}

async fn attacked_on(bench: Bench) -> Bench {
    let at = bench.timer.now().utc.0 - 3_600_000_000;
    let satellite = SatelliteId::new("pixelsat-1").unwrap();
    let pass = PassRecord {
        id: PassId(1),
        satellite: satellite.clone(),
        station: station().station,
        aos_at: UtcUs(at),
        tca_at: UtcUs(at + 300_000_000),
        los_at: Some(UtcUs(at + 600_000_000)),
        max_elevation_deg: 45.0,
        elements: Vec::new(),
        ended_at: Some(UtcUs(at + 600_000_000)),
    };
    let event = EventRecord {
        at: UtcUs(at + 10_000_000),
        kind: EventKind::SatelliteError,
        level: Level::Critical,
        satellite: Some(satellite),
        station: station().station,
        link: None,
        key: None,
        subject: Subject::default(),
        message: SCRIPT.into(),
    };
    let records = vec![Record::Pass(pass), Record::Event(event)];
    bench.store.apply(&Batch { id: BatchId(900), records }).await.unwrap();
    let condition = Condition::new(AlertKind::Backup, "nightly", Level::Critical, SCRIPT);
    bench.alerts.report("backup", Some(condition));
    for _ in 0..600 {
        if bench.get("/api/v1/alerts/1").await.status().is_success() {
            break;
        }
        wall_sleep(std::time::Duration::from_millis(20)).await;
    }
    bench.post("/api/v1/alerts/1/acknowledge", "note", &json!({"note": SCRIPT})).await.ok();
    bench
}

#[tokio::test]
async fn what_was_stored_by_an_attacker_lies_still_on_every_page() {
    let bench = attacked().await;
    // Names are letters, digits, - and _, whatever is named.
    let plan = |name: &str| json!({"name": name, "satellite": "pixelsat-1", "steps": [{"do": "listen", "for_s": 5.0}]});
    for (path, body) in [
        ("/api/v1/plans", plan(SCRIPT)),
        ("/api/v1/users", json!({"name": SCRIPT, "role": "viewer"})),
        ("/api/v1/users", json!({"name": "eve", "role": SCRIPT})),
        ("/api/v1/tokens", json!({"name": SCRIPT, "scopes": ["look"], "days": 1})),
        ("/api/v1/commands", json!({"command": SCRIPT})),
        ("/api/v1/elements", json!({"text": SCRIPT})),
        ("/api/v1/alerts/1/assign", json!({"to": "nobody", "note": 1})),
    ] {
        let answer = bench.post(path, "k", &body).await;
        assert!(answer.status().is_client_error(), "{path}: {}", text(&answer));
        assert_eq!(answer.header("content-type"), "application/problem+json", "{path}");
    }
    let (mut seen, mut pages) = (0, 0);
    for path in readable() {
        let answer = bench.send(asked(Method::GET, &path, "k", &json!({}))).await;
        let (kind, told) = (answer.header("content-type").to_owned(), text(&answer));
        assert_eq!(answer.header("x-content-type-options"), "nosniff", "{path}");
        seen += usize::from(told.contains("alert(1)"));
        // A browser runs nothing of JSON or plain text that is declared as such.
        if kind.starts_with("application/") && kind.contains("json") || kind.starts_with("text/plain") {
            continue;
        }
        pages += usize::from(kind.starts_with("text/html"));
        for alive in ALIVE {
            assert!(!told.contains(alive), "{path}, {kind}: {told}");
        }
    }
    assert!(seen >= 5, "the script was seen in {seen} answers only: what does this test show?");
    assert!(pages >= 7, "{pages}");
    // The pages that show JSON put it in as text: no way in for markup is called in any of their modules (see `page`).
    for (name, text) in FILES.iter().filter(|(name, _)| name.ends_with(".js")) {
        for way in [
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            "document.write",
            "srcdoc",
            "createContextualFragment",
        ] {
            assert!(!text.contains(way), "{name}: {way}");
        }
    }
}

#[tokio::test]
async fn what_is_asked_is_not_thrown_back_alive_and_no_login_leads_away() {
    let bench = Bench::new().await;
    let coded = "%22%3E%3Cscript%3Ealert(1)%3C%2Fscript%3E%3Cimg%20src%3Dx%20onerror%3Dalert(2)%3E";
    let mut paths = vec![format!("/{coded}"), format!("/api/v1/{coded}"), format!("/page/{coded}")];
    for route in table() {
        let path = if route.path.contains('{') { with(route.path, coded) } else { route.path.to_owned() };
        paths.push(path.clone());
        paths.push(format!("{path}?{coded}={coded}"));
    }
    for row in operations().iter().filter(|row| row.method == "GET") {
        for param in row.params.iter().filter(|_| !row.path.replace("{id}", "1").contains('{')) {
            paths.push(format!("{}?{}={coded}", row.path.replace("{id}", "1"), param.name));
        }
    }
    for path in paths {
        let answer = bench.get(&path).await;
        let (kind, told) = (answer.header("content-type"), text(&answer));
        assert!(!answer.status().is_server_error(), "{path}: {told}");
        assert_eq!(answer.header("x-content-type-options"), "nosniff", "{path}");
        if !kind.contains("json") {
            ALIVE.iter().for_each(|alive| assert!(!told.contains(alive), "{path}, {kind}: {told}"));
        }
        assert_eq!(answer.header("location"), "", "{path}: a GET leads nowhere else");
    }
    // The page of the login has nothing of its address in it, and its module goes to one place.
    let plain = bench.get("/login").await.bytes;
    for away in ["next=//evil.example", "next=https:%2f%2fevil.example", "return_to=javascript:alert(1)"] {
        assert_eq!(bench.get(&format!("/login?{away}")).await.bytes, plain, "{away}");
    }
    for (name, text) in FILES.iter().filter(|(name, _)| name.ends_with(".js")) {
        assert!(!text.contains("URLSearchParams(location"), "{name} reads what is asked of the page");
        for to in text.split("location.replace(").skip(1) {
            assert!(to.starts_with("\"/\")") || to.starts_with("\"/login\")"), "{name}: {}", &to[..20]);
        }
        assert!(!text.contains("location.href =") && !text.contains("location ="), "{name}");
    }
}

#[tokio::test]
async fn sql_in_a_parameter_is_a_word_like_any_other_to_a_file() {
    sql_is_a_word(attacked().await).await;
}

#[tokio::test]
async fn sql_in_a_parameter_is_a_word_like_any_other_to_a_postgresql() {
    let bench = attacked_on(Bench::watching_a_postgres().await).await;
    sql_is_a_word(bench).await;
}

async fn sql_is_a_word(bench: Bench) {
    let before = bench.store.counts().await.unwrap();
    let mut tried = 0;
    for word in [
        "'",
        "' OR '1'='1",
        "x'; drop table frames; --",
        "\" or 1=1 --",
        "%' or '%'='",
        "1) union select 1--",
        "x'); select pg_sleep(20); --",
        "$$; drop table frames; $$ || $1 || E'\\\\' ::int",
        "a\\' or 1=1 --",
    ] {
        let coded: String = word.bytes().map(|byte| format!("%{byte:02x}")).collect();
        for row in operations().iter().filter(|row| row.method == "GET") {
            let path = row.path.replace("{id}", "1").replace("{month}", "2026-11");
            if path.contains('{') {
                continue;
            }
            for param in &row.params {
                let answer = bench.get(&format!("{path}?{}={coded}", param.name)).await;
                let told = text(&answer);
                assert!(!answer.status().is_server_error(), "{path} {}: {told}", param.name);
                assert!(
                    !told.contains("syntax error") && !told.contains("sqlite") && !told.contains("postgres"),
                    "{path} {}: {told}",
                    param.name
                );
                if answer.status().is_success() {
                    // Taken as a word that fits nothing.
                    let items = answer.json()["items"].as_array().map_or(0, Vec::len);
                    assert_eq!(items, 0, "{path} {}={word}: {told}", param.name);
                }
                tried += 1;
            }
        }
        for route in table().iter().filter(|route| route.path.contains('{')) {
            let answer = bench.send(asked(method(route), &with(route.path, &coded), "k", &json!({}))).await;
            assert!(answer.status().is_client_error(), "{}: {}", route.path, text(&answer));
            tried += 1;
        }
    }
    assert!(tried > 300, "{tried}");
    // What may be any text comes back as it was given, and was no statement on its way.
    let evil = "'); drop table users; -- ${7*7} $1 $$ E'\\' \"";
    let user = json!({"name": "eve", "role": "viewer", "licence": evil});
    bench.post("/api/v1/users", "u", &user).await.ok();
    let users = bench.send(asked(Method::GET, "/api/v1/users", "k", &json!({}))).await.ok();
    assert_eq!(users["items"][0]["licence"], evil, "{users}");
    // Which alert came first is nobody's business; that of the backup stays.
    let alerts = bench.send(asked(Method::GET, "/api/v1/alerts", "k", &json!({}))).await.ok();
    let stays = alerts["items"].as_array().unwrap().iter().find(|alert| alert["kind"] == "backup");
    let path = format!("/api/v1/alerts/{}", stays.unwrap()["id"]);
    bench.post(&format!("{path}/acknowledge"), "evil", &json!({"note": evil})).await.ok();
    assert_eq!(bench.send(asked(Method::GET, &path, "k", &json!({}))).await.ok()["note"], evil);
    let after = bench.store.counts().await.unwrap();
    assert_eq!((before.frames, before.commands), (after.frames, after.commands));
}

#[tokio::test]
async fn a_template_is_shown_and_not_worked_out() {
    const TEMPLATES: &str =
        "{{31337*31337}} ${31337*31337} <%= 31337*31337 %> #{31337*31337} {{config}} {31337:?} %s %n";
    let bench = Bench::watching("").await;
    let condition = Condition::new(AlertKind::Backup, "nightly", Level::Critical, TEMPLATES);
    bench.alerts.report("backup", Some(condition));
    bench.until("/api/v1/alerts", "/items/0/message", &json!(TEMPLATES)).await;
    bench.post("/api/v1/alerts/1/acknowledge", "n", &json!({"note": TEMPLATES})).await.ok();
    let alert = bench.get("/api/v1/alerts/1").await.ok();
    assert_eq!(alert["note"], TEMPLATES);
    for path in readable() {
        let told = text(&bench.send(asked(Method::GET, &path, "k", &json!({}))).await);
        assert!(!told.contains("982007569"), "{path}: {told}");
    }
}

#[tokio::test]
async fn no_body_changes_what_an_object_is() {
    let bench = Bench::new().await;
    let mut tried = 0;
    for route in
        table().iter().filter(|route| matches!(route.access, Access::Write | Access::Remove | Access::Door))
    {
        let path = route.path.replace("{id}", "1").replace("{name}", "status");
        for body in [
            r#"{"__proto__":{"isAdmin":true}}"#,
            r#"{"constructor":{"prototype":{"isAdmin":true}}}"#,
            r#"{"prototype":{"role":"administrator"}}"#,
            r#"{"toString":"x","valueOf":"y"}"#,
        ] {
            let mut request = write(&path, "k").body(Body::from(body)).unwrap();
            *request.method_mut() = method(route);
            let answer = bench.send(request).await;
            // Without a session there is nothing to log out of.
            let refused = ["wrong-shape", "login-required", "forbidden", "csrf"];
            assert!(refused.contains(&answer.problem().as_str()), "{path} {body}: {}", text(&answer));
            tried += 1;
        }
    }
    assert!(tried > 100, "{tried}");
    // Deeper in, where a body has fields of any name: nothing there either.
    for body in [
        json!({"command": "Ping", "arguments": {"__proto__": {"critical": false}}}),
        json!({"name": "p", "satellite": "pixelsat-1", "steps": [{"do": "listen", "for_s": 1.0, "__proto__": {}}]}),
    ] {
        let path = if body.get("command").is_some() { "/api/v1/commands" } else { "/api/v1/plans" };
        let answer = bench.post(path, "deep", &body).await;
        assert!(answer.status().is_client_error(), "{path}: {}", text(&answer));
    }
    assert_eq!(bench.store.counts().await.unwrap().commands, 0);
}

#[tokio::test]
async fn no_page_and_no_answer_stands_in_somebodys_frame() {
    let bench = attacked().await;
    let mut paths = readable();
    paths.extend(["/nowhere".to_owned(), "/api/v1/frames?limit=x".to_owned(), "/page/none.js".to_owned()]);
    for path in paths {
        for request in [
            asked(Method::GET, &path, "k", &json!({})),
            request(Method::PATCH, &path).body(Body::empty()).unwrap(),
        ] {
            let answer = bench.send(request).await;
            assert!(answer.header("content-security-policy").contains("frame-ancestors 'none'"), "{path}");
            assert_eq!(answer.header("x-frame-options"), "DENY", "{path}");
            assert_eq!(answer.header("cross-origin-opener-policy"), "same-origin", "{path}");
        }
    }
}

#[tokio::test]
async fn no_page_has_a_script_or_a_style_in_it() {
    let bench = attacked().await;
    let mut pages = Vec::new();
    for path in readable() {
        let answer = bench.send(asked(Method::GET, &path, "k", &json!({}))).await;
        if !answer.header("content-type").starts_with("text/html") {
            continue;
        }
        let policy = answer.header("content-security-policy").to_owned();
        assert!(policy.starts_with("default-src 'self';") && !policy.contains("unsafe"), "{path}: {policy}");
        assert!(!policy.contains("script-src") && !policy.contains("*"), "{path}: {policy}");
        let page = text(&answer).to_ascii_lowercase();
        for script in page.split("<script").skip(1) {
            let (tag, rest) = script.split_once('>').unwrap();
            assert!(tag.contains("src=\"/page/") && rest.starts_with("</script>"), "{path}: <script{tag}>");
        }
        // What stands between < and > is markup; a text has neither.
        for tag in page.split('<').skip(1).filter_map(|rest| rest.split('>').next()) {
            let name = tag.split_whitespace().next().unwrap_or_default();
            assert!(!["style", "iframe", "base", "object", "embed"].contains(&name), "{path}: <{tag}>");
            for attribute in tag.split_whitespace().skip(1) {
                let inline = attribute.starts_with("on") || attribute.starts_with("style=");
                assert!(!inline && !attribute.contains("javascript:"), "{path}: <{tag}>");
            }
        }
        pages.push(path);
    }
    for known in ["/", "/plan", "/login", "/welcome", "/api/docs", "/api/v1/reports/passes/1.html"] {
        assert!(pages.iter().any(|page| page == known), "{known} is not among {pages:?}");
    }
}
