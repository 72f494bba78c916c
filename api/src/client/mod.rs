//! A typed client of the API: one method for each operation but those that need a browser's cookie, and the [stream](EventStream) that comes back by itself.
//!
//! ```no_run
//! # async fn example() -> Result<(), api::client::ClientError> {
//! use api::client::{Client, Filter, IdempotencyKey};
//!
//! let client = Client::new("http://127.0.0.1:8700", Some("the token of the server's token file"))?;
//! println!("{}", client.station().await?.station);
//! let ping = serde_json::from_value(serde_json::json!({"command": "Ping"})).expect("a command");
//! let done = client.send_command(&ping, &IdempotencyKey::fresh()).await?;
//! println!("command {:?}", done.command);
//! for event in client.events(&Filter::new().limit(10)).await?.items {
//!     println!("{}", event.message);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! It does **not** repeat a write by itself: where [`ClientError::NoAnswer`] comes back, ask again with the same
//! [`IdempotencyKey`]. It needs a tokio runtime.

mod error;
mod filter;
mod operation;
mod operations;
mod others;
mod stream;
mod timers;

use std::fmt;
use std::time::Duration;

use reqwest::header::{ACCEPT, AUTHORIZATION, CONTENT_TYPE, HeaderMap, HeaderValue, IF_NONE_MATCH};
use reqwest::{Method, RequestBuilder, Response, StatusCode, Url, redirect};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::Problem;
pub use error::ClientError;
use error::chain;
pub use filter::Filter;
pub use operation::Operation;
pub use operations::ImageFile;
pub use stream::{EventStream, StreamItem, StreamOptions};

/// No answer takes longer, but that of [`Client::fetch_elements`].
const PATIENCE: Duration = Duration::from_secs(30);
/// What an answer may have.
const ANSWER_MAX: usize = 64 << 20;

/// Says that two requests are the same intent: new for each intent, the same when it is asked again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IdempotencyKey(String);

impl IdempotencyKey {
    /// A new one, by chance.
    #[must_use]
    pub fn fresh() -> Self {
        Self(uuid::Uuid::new_v4().to_string())
    }

    /// One that was kept; `None` when it is not 1 to 128 visible characters.
    #[must_use]
    pub fn new(key: &str) -> Option<Self> {
        let legal = (1..=128).contains(&key.len()) && key.bytes().all(|byte| byte.is_ascii_graphic());
        legal.then(|| Self(key.to_owned()))
    }

    /// As it is sent.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// A client of one server. Cheap to clone.
#[derive(Clone)]
pub struct Client {
    base: Url,
    http: reqwest::Client,
    token: Option<HeaderValue>,
}

impl fmt::Debug for Client {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Client").field("base", &self.base.as_str()).finish_non_exhaustive()
    }
}

impl Client {
    /// A client of the server at this address (`http://127.0.0.1:8700`); without a token it can only read.
    ///
    /// # Errors
    /// [`ClientError::Address`] for an address or a token that is none, [`ClientError::Setup`] when this machine lacks
    /// what secure connections need.
    pub fn new(address: &str, token: Option<&str>) -> Result<Self, ClientError> {
        // The whole process shares one provider; whoever installed another first has chosen.
        if rustls::crypto::CryptoProvider::get_default().is_none() {
            let _ = rustls::crypto::ring::default_provider().install_default();
        }
        let base = base(address)?;
        let builder = reqwest::Client::builder()
            .user_agent(concat!("pixelsat-ground/", env!("CARGO_PKG_VERSION")))
            .redirect(redirect::Policy::none())
            // Whoever asks decides whether to ask again.
            .retry(reqwest::retry::never())
            .connect_timeout(PATIENCE / 3);
        // Without TLS no certificates are needed, and a server on this machine is reached without a proxy.
        let builder = match base.scheme() {
            "http" => builder.tls_certs_only(std::iter::empty()).no_proxy(),
            _ => builder,
        };
        let http = builder.build().map_err(|error| ClientError::Setup(chain(error)))?;
        Self::with_http(http, address, token)
    }

    /// The same over an HTTP client of yours, with its own certificates or proxy. It must not follow redirects, nor repeat
    /// requests.
    ///
    /// # Errors
    /// [`ClientError::Address`] for an address or a token that is none.
    pub fn with_http(http: reqwest::Client, address: &str, token: Option<&str>) -> Result<Self, ClientError> {
        let token = token.map(|token| {
            let bearer = HeaderValue::try_from(format!("Bearer {token}"));
            let mut bearer = bearer
                .map_err(|_| ClientError::Address("the token has characters that no token has".to_owned()))?;
            bearer.set_sensitive(true);
            Ok(bearer)
        });
        Ok(Self { base: base(address)?, http, token: token.transpose()? })
    }

    /// Every operation that this client has a method for.
    pub fn operations() -> impl Iterator<Item = Operation> {
        let stream = [stream::STREAM];
        operations::ALL.into_iter().chain(others::ALL).flatten().copied().chain(stream)
    }

    /// Anything that is a text, by its path below `/api/v1/`.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn text(&self, path: &str, filter: &Filter) -> Result<String, ClientError> {
        let url = self.url(path, filter)?;
        let response = self.send(self.http.get(url.clone()), &url, PATIENCE).await?;
        let status = response.status().as_u16();
        String::from_utf8(bytes(response, &url).await?).map_err(|error| ClientError::Strange {
            url: url.to_string(),
            status,
            why: error.to_string(),
        })
    }

    /// Anything that can be read, by its path below `/api/v1/`.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn get<T: DeserializeOwned>(&self, path: &str, filter: &Filter) -> Result<T, ClientError> {
        let url = self.url(path, filter)?;
        read(self.send(self.http.get(url.clone()), &url, PATIENCE).await?, &url).await
    }

    /// Anything that is written by POST.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn post<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &(impl Serialize + ?Sized),
        key: &IdempotencyKey,
    ) -> Result<T, ClientError> {
        self.write(Method::POST, path, body, key, PATIENCE).await
    }

    /// Anything that is taken away by DELETE.
    ///
    /// # Errors
    /// [`ClientError`].
    pub async fn delete<T: DeserializeOwned>(
        &self,
        path: &str,
        key: &IdempotencyKey,
    ) -> Result<T, ClientError> {
        self.write(Method::DELETE, path, &crate::Nothing {}, key, PATIENCE).await
    }

    async fn write<T: DeserializeOwned>(
        &self,
        method: Method,
        path: &str,
        body: &(impl Serialize + ?Sized),
        key: &IdempotencyKey,
        patience: Duration,
    ) -> Result<T, ClientError> {
        let url = self.url(path, &Filter::new())?;
        let body = serde_json::to_vec(body).map_err(|error| ClientError::Address(error.to_string()))?;
        let request = self
            .http
            .request(method, url.clone())
            .header(CONTENT_TYPE, "application/json")
            .header("idempotency-key", key.as_str())
            .body(body);
        read(self.send(request, &url, patience).await?, &url).await
    }

    /// Sends what needs an answer; a problem is an error.
    async fn send(
        &self,
        request: RequestBuilder,
        url: &Url,
        patience: Duration,
    ) -> Result<Response, ClientError> {
        let request = match &self.token {
            Some(token) => request.header(AUTHORIZATION, token.clone()),
            None => request,
        };
        let answer = timers::within(patience, request.send()).await;
        let no_answer = |why| ClientError::NoAnswer { url: url.to_string(), why };
        let response = answer
            .ok_or_else(|| no_answer(format!("nothing came within {} s", patience.as_secs())))?
            .map_err(|error| no_answer(chain(error)))?;
        let status = response.status();
        if status.is_success() || matches!(status, StatusCode::NOT_MODIFIED | StatusCode::SWITCHING_PROTOCOLS)
        {
            return Ok(response);
        }
        Err(problem(response, url).await)
    }

    fn url(&self, path: &str, filter: &Filter) -> Result<Url, ClientError> {
        let joined = self.base.join(path).map_err(|error| ClientError::Address(error.to_string()));
        let mut url = joined.and_then(|url| match url.as_str().starts_with(self.base.as_str()) {
            true => Ok(url),
            false => Err(ClientError::Address(format!("'{path}' is no path of the API"))),
        })?;
        if !filter.pairs().is_empty() {
            url.query_pairs_mut().extend_pairs(filter.pairs());
        }
        Ok(url)
    }
}

fn base(address: &str) -> Result<Url, ClientError> {
    let wrong = |why: String| {
        ClientError::Address(format!("'{address}' is no address of a server ({why}): give http://HOST:PORT"))
    };
    let url = Url::parse(address).map_err(|error| wrong(error.to_string()))?;
    if !matches!(url.scheme(), "http" | "https") || url.host_str().is_none() {
        return Err(wrong("it must begin with http:// or https://".to_owned()));
    }
    if !url.username().is_empty() || url.password().is_some() || url.query().is_some() {
        return Err(wrong("secrets and questions do not belong into it".to_owned()));
    }
    let path = url.path().trim_end_matches('/').to_owned();
    url.join(&format!("{path}/api/v1/")).map_err(|error| wrong(error.to_string()))
}

/// What stands in a path for this name.
fn segment(name: &str) -> String {
    let safe = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_');
    name.bytes()
        .map(|byte| if safe(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") })
        .collect()
}

async fn bytes(mut response: Response, url: &Url) -> Result<Vec<u8>, ClientError> {
    let mut body = Vec::new();
    loop {
        let no_answer = |why| ClientError::NoAnswer { url: url.to_string(), why };
        let chunk = timers::within(PATIENCE, response.chunk()).await;
        let chunk = chunk.ok_or_else(|| no_answer("it stopped in the middle".to_owned()))?;
        let Some(chunk) = chunk.map_err(|error| no_answer(chain(error)))? else { return Ok(body) };
        if body.len() + chunk.len() > ANSWER_MAX {
            let (status, why) = (response.status().as_u16(), "it is too long".to_owned());
            return Err(ClientError::Strange { url: url.to_string(), status, why });
        }
        body.extend_from_slice(&chunk);
    }
}

async fn read<T: DeserializeOwned>(response: Response, url: &Url) -> Result<T, ClientError> {
    let status = response.status().as_u16();
    let body = bytes(response, url).await?;
    serde_json::from_slice(&body).map_err(|error| ClientError::Strange {
        url: url.to_string(),
        status,
        why: error.to_string(),
    })
}

async fn problem(response: Response, url: &Url) -> ClientError {
    let status = response.status();
    match bytes(response, url).await {
        Ok(body) => match serde_json::from_slice::<Problem>(&body) {
            Ok(problem) => ClientError::Refused(Box::new(problem)),
            Err(_) => ClientError::Strange {
                url: url.to_string(),
                status: status.as_u16(),
                why: format!("status {status}"),
            },
        },
        Err(error) => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn client(address: &str) -> Result<Client, ClientError> {
        Client::new(address, Some("0123456789abcdef0123456789abcdef"))
    }

    #[test]
    fn an_address_may_have_a_path_and_no_secrets() {
        let client_of = client("https://ground.example.org/sat/").unwrap();
        let url = client_of.url("frames/1", &Filter::new().link("e 22").limit(5)).unwrap();
        assert_eq!(url.as_str(), "https://ground.example.org/sat/api/v1/frames/1?link=e+22&limit=5");
        for wrong in ["127.0.0.1:8700", "ftp://a", "http://me:secret@a", "http://a?x=1", ""] {
            assert!(matches!(client(wrong), Err(ClientError::Address(_))), "{wrong}");
        }
        assert!(client_of.url("http://evil.example/", &Filter::new()).is_err());
        assert!(client_of.url("../../admin", &Filter::new()).is_err());
    }

    #[test]
    fn a_name_cannot_leave_its_place_in_the_path_and_a_token_is_never_shown() {
        assert_eq!(segment("../a b%"), "%2E%2E%2Fa%20b%25");
        let client = client("http://127.0.0.1:8700").unwrap();
        assert!(!format!("{client:?} {:?}", client.token).contains("0123456789abcdef"));
    }
}
