//! Who is let in by what they show, and how long: tokens of machines by the clock, and addresses that proxies tell.

use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use axum::body::Body;
use axum::extract::ConnectInfo;
use axum::http::{Method, Request};
use serde_json::json;

use super::people::{Browser, knock};
use super::{Bench, HOST, request};
use crate::people::Role;

fn with_token(path: &str, secret: &str) -> Request<Body> {
    request(Method::GET, path)
        .header("authorization", format!("Bearer {secret}"))
        .body(Body::empty())
        .unwrap()
}

async fn token(bench: &Bench, root: &Browser, name: &str, days: u32) -> String {
    let body = json!({"name": name, "scopes": ["look"], "days": days});
    let made = bench.send(root.write(Method::POST, "/api/v1/tokens", name, &body)).await.ok();
    made["secret"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn a_machine_s_token_ends_to_the_minute_when_its_days_are_over() {
    let bench = Bench::new().await;
    let root = bench.somebody("root-admin", Role::Administrator).await;
    let (day, week) = (token(&bench, &root, "day", 1).await, token(&bench, &root, "week", 7).await);
    bench.hands.pass_h(24.0 - 1.0 / 60.0);
    bench.send(with_token("/api/v1/station", &day)).await.ok();
    bench.hands.pass_h(1.0 / 60.0);
    let refused = bench.send(with_token("/api/v1/station", &day)).await;
    assert_eq!(refused.problem(), "token-refused");
    assert!(refused.json()["detail"].as_str().unwrap().contains("expired"));
    // Nor does it open what anybody may read: whoever shows it should hear that it is over.
    assert_eq!(bench.send(with_token("/healthz", &day)).await.problem(), "token-refused");
    bench.send(with_token("/api/v1/station", &week)).await.ok();
    // Using it does not make it younger, and a clock that is set back is no use either: nothing is kept of the refusal.
    for _ in 0..6 {
        bench.hands.pass_h(23.9);
        bench.send(with_token("/api/v1/station", &week)).await.ok();
    }
    bench.hands.pass_h(0.7);
    assert_eq!(bench.send(with_token("/api/v1/station", &week)).await.problem(), "token-refused");
    for days in [0, 100_000] {
        let body = json!({"name": "other", "scopes": ["look"], "days": days});
        let root = bench.somebody("root-admin", Role::Administrator).await;
        let refused = bench.send(root.write(Method::POST, "/api/v1/tokens", &days.to_string(), &body)).await;
        assert_eq!(refused.problem(), "bad-argument", "{days} days");
    }
}

/// What the server logs, kept.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl io::Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Log {
    fn take(&self) -> String {
        String::from_utf8(std::mem::take(&mut *self.0.lock().unwrap())).unwrap()
    }

    fn follow(&self) -> tracing::subscriber::DefaultGuard {
        let log = self.clone();
        let subscriber = tracing_subscriber::fmt().with_ansi(false).with_writer(move || log.clone());
        tracing::subscriber::set_default(subscriber.finish())
    }
}

/// A wrong password from this peer, with these lines of `X-Forwarded-For`.
fn guess(peer: &str, forwarded: &[&str], n: u32) -> Request<Body> {
    let body = json!({"name": format!("user-{n}"), "password": "a wrong password"});
    let mut request = knock("/api/v1/session", &body);
    request.headers_mut().insert("origin", format!("https://{HOST}").parse().unwrap());
    for line in forwarded {
        request.headers_mut().append("x-forwarded-for", line.parse().unwrap());
    }
    let peer = SocketAddr::new(peer.parse().unwrap(), 5000);
    request.extensions_mut().insert(ConnectInfo(peer));
    request
}

/// Guesses 21 times with what the attacker forges anew each time: whether the address was sent away at the end.
async fn is_stopped(bench: &Bench, peer: &str, forge: impl Fn(u32) -> Vec<String>) -> bool {
    let mut last = String::new();
    for n in 0..21 {
        let lines = forge(n);
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        last = bench.send(guess(peer, &lines, n)).await.problem();
    }
    assert!(["rate-limited", "wrong-password"].contains(&last.as_str()), "{last}");
    last == "rate-limited"
}

async fn bench(https: bool) -> Bench {
    Bench::with_people(|settings| settings.https = https).await
}

#[tokio::test]
async fn a_stranger_s_word_about_its_address_is_ignored() {
    let bench = bench(true).await;
    let log = Log::default();
    let forged = |n: u32| vec![format!("198.51.100.{n}"), format!("203.0.113.{n}, 127.0.0.1")];
    {
        let _following = log.follow();
        assert!(is_stopped(&bench, "192.0.2.7", forged).await, "each forged address had its own bucket");
    }
    let said = log.take();
    assert!(said.contains("address=192.0.2.7"), "{said}");
    assert!(!said.contains("198.51.100.") && !said.contains("203.0.113."), "{said}");
    // Whoever was named has lost nothing.
    assert_eq!(bench.send(guess("198.51.100.3", &[], 100)).await.problem(), "wrong-password");
    assert_eq!(bench.send(guess("127.0.0.1", &["203.0.113.3"], 101)).await.problem(), "wrong-password");
    let root = bench.people.session_of("root-admin", Role::Administrator).await;
    let cookie = format!("__Host-session={}", root.reveal());
    let audit = request(Method::GET, "/api/v1/audit?limit=1000").header("cookie", cookie);
    let audit = bench.send(audit.body(Body::empty()).unwrap()).await.ok().to_string();
    assert!(!audit.contains("198.51.100.") && !audit.contains("203.0.113."), "{audit}");
}

#[tokio::test]
async fn without_a_proxy_nobody_is_believed() {
    let bench = bench(false).await;
    let guess = |n: u32| {
        let mut request = guess("127.0.0.1", &[&format!("198.51.100.{n}")], n);
        request.headers_mut().insert("origin", format!("http://{HOST}").parse().unwrap());
        request
    };
    for n in 0..20 {
        assert_eq!(bench.send(guess(n)).await.problem(), "wrong-password");
    }
    assert_eq!(bench.send(guess(20)).await.problem(), "rate-limited");
}

#[tokio::test]
async fn of_what_a_proxy_tells_the_last_address_that_is_not_its_own_counts() {
    type Forge = fn(u32) -> Vec<String>;
    let cases: [(&str, Forge, &str); 6] = [
        ("127.0.0.1", |n| vec![format!("198.51.100.{n}, 203.0.113.5")], "203.0.113.5"),
        ("::1", |n| vec![format!("198.51.100.{n}"), "203.0.113.6".to_owned()], "203.0.113.6"),
        (
            "127.0.0.1",
            |n| vec![format!("10.0.0.{n}, 203.0.113.7, 127.0.0.1"), "::1".to_owned()],
            "203.0.113.7",
        ),
        ("127.0.0.1", |n| vec![format!("198.51.100.{n}, [2001:db8::7]:44{n:02}")], "2001:db8::7"),
        ("127.0.0.1", |n| vec![format!("203.0.113.8:{}", 1000 + n)], "203.0.113.8"),
        // A proxy that tells nonsense is held to account itself.
        ("127.0.0.9", |n| vec![format!("198.51.100.{n}, unknown")], "127.0.0.9"),
    ];
    for (peer, forge, counted) in cases {
        let bench = bench(true).await;
        let log = Log::default();
        {
            let _following = log.follow();
            assert!(is_stopped(&bench, peer, forge).await, "{counted}");
        }
        assert!(log.take().contains(&format!("address={counted}")), "{counted}");
        // Somebody else behind the same proxy comes in.
        let other = bench.send(guess(peer, &["198.51.100.1, 203.0.113.99"], 50)).await;
        assert_eq!(other.problem(), "wrong-password", "{counted}");
    }
}
