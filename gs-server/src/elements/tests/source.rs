//! A source on a real socket that counts who asks, and answers what it is told to.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;

/// One request as it came.
#[derive(Debug, Clone)]
pub(crate) struct Asked {
    pub(crate) line: String,
    pub(crate) headers: HeaderMap,
    pub(crate) body: String,
}

/// What is answered; `None`: nothing, ever.
pub(crate) type Script = dyn Fn(&Asked) -> Option<Response> + Send + Sync;

#[derive(Clone)]
pub(crate) struct Source {
    pub(crate) address: SocketAddr,
    asked: Arc<Mutex<Vec<Asked>>>,
    script: Arc<Mutex<Arc<Script>>>,
    stop: CancellationToken,
}

impl Drop for Source {
    fn drop(&mut self) {
        // Two for the router's copy and this one.
        if Arc::strong_count(&self.asked) <= 2 {
            self.stop.cancel();
        }
    }
}

impl Source {
    pub(crate) async fn new(script: impl Fn(&Asked) -> Option<Response> + Send + Sync + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let source = Self {
            address: listener.local_addr().unwrap(),
            asked: Arc::default(),
            script: Arc::new(Mutex::new(Arc::new(script))),
            stop: CancellationToken::new(),
        };
        let router = Router::new().fallback(answer).with_state(source.clone());
        let stop = source.stop.clone();
        tokio::spawn(async move {
            tokio::select! {
                served = axum::serve(listener, router) => served.unwrap(),
                () = stop.cancelled() => {}
            }
        });
        source
    }

    pub(crate) async fn saying(status: u16, body: &str) -> Self {
        let body = body.to_owned();
        Self::new(move |_| Some(say(status, &body))).await
    }

    pub(crate) fn now_says(&self, script: impl Fn(&Asked) -> Option<Response> + Send + Sync + 'static) {
        *self.script.lock().unwrap() = Arc::new(script);
    }

    pub(crate) fn asked(&self) -> Vec<Asked> {
        self.asked.lock().unwrap().clone()
    }

    pub(crate) fn count(&self) -> usize {
        self.asked.lock().unwrap().len()
    }

    pub(crate) fn url(&self) -> String {
        format!("http://{}/gp.php?GROUP=cubesat&FORMAT=json", self.address)
    }
}

async fn answer(State(source): State<Source>, request: Request) -> Response {
    let (parts, body) = request.into_parts();
    let body: Bytes = axum::body::to_bytes(body, 1 << 20).await.unwrap();
    let asked = Asked {
        line: format!("{} {}", parts.method, parts.uri),
        headers: parts.headers,
        body: String::from_utf8_lossy(&body).into_owned(),
    };
    source.asked.lock().unwrap().push(asked.clone());
    let script = source.script.lock().unwrap().clone();
    match script(&asked) {
        Some(response) => response,
        None => std::future::pending().await,
    }
}

pub(crate) fn say(status: u16, body: &str) -> Response {
    say_with(status, &[], body)
}

pub(crate) fn say_with(status: u16, headers: &[(&str, &str)], body: &str) -> Response {
    let mut response = Response::builder().status(StatusCode::from_u16(status).unwrap());
    for (name, value) in headers {
        response = response.header(*name, *value);
    }
    response.body(Body::from(body.to_owned())).unwrap()
}
