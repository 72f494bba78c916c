//! The server that runs, over its API: for the command line when the data folder is in use.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::time::Duration;

use api::{
    ElementsAdded, ElementsRequest, ElementsSource, FetchReport, HeldElements, Outcome, Page, Problem,
};
use reqwest::header::{AUTHORIZATION, CONTENT_TYPE, HeaderValue};
use reqwest::{Client, Method, RequestBuilder, Url};
use serde::de::DeserializeOwned;
use tle::Elements;
use tle::formats::{Form, write};

use super::client::{PATIENCE, chain, http_client};
use crate::config::Config;
use crate::http::{Token, TokenError};

/// Bytes of elements in one request: the API takes 64 KiB with all quotes escaped.
const TEXT_MAX: usize = 24 * 1024;
/// A fetch asks several sources one after the other.
const FETCH_PATIENCE: Duration = Duration::from_secs(900);
/// What an answer may have.
const ANSWER_MAX: usize = 16 << 20;

/// Why the server did not do it.
#[derive(Debug, thiserror::Error)]
pub enum RemoteError {
    /// The configuration does not say where it listens.
    #[error(
        "the server listens on a port that it chose itself (http.listen with port 0): give the port in the configuration"
    )]
    NoPort,
    /// No client.
    #[error("no request can be made: {0}")]
    Client(String),
    /// The token file.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// No answer.
    #[error("the data folder is in use, and no server answers at {url}: {why}")]
    NoAnswer {
        /// Where.
        url: String,
        /// Why.
        why: String,
    },
    /// It says no.
    #[error("the server refuses: {0}")]
    Refused(String),
    /// Not now.
    #[error("the server is busy: {0}")]
    Busy(String),
    /// Its answer is of another version, or of somebody else.
    #[error("the answer of {url} is not understood ({why}): is it this program, of the same version?")]
    Strange {
        /// Where.
        url: String,
        /// Why.
        why: String,
    },
}

/// A client of our own server.
pub struct Remote {
    base: Url,
    client: Client,
    token: Token,
}

impl Remote {
    /// The server of this configuration, on this machine.
    ///
    /// # Errors
    /// [`RemoteError`] when it cannot be known where it listens, or its token cannot be read.
    pub fn new(config: &Config) -> Result<Self, RemoteError> {
        let listen = config.http.listen;
        if listen.port() == 0 {
            return Err(RemoteError::NoPort);
        }
        let ip = match listen.ip() {
            ip if !ip.is_unspecified() => ip,
            IpAddr::V4(_) => IpAddr::V4(Ipv4Addr::LOCALHOST),
            IpAddr::V6(_) => IpAddr::V6(Ipv6Addr::LOCALHOST),
        };
        let base = format!("http://{}/api/v1/", SocketAddr::new(ip, listen.port()));
        let base = Url::parse(&base).map_err(|error| RemoteError::Client(error.to_string()))?;
        Ok(Self {
            client: http_client(&base, PATIENCE).map_err(RemoteError::Client)?,
            token: Token::load_or_create(&config.token_file())?,
            base,
        })
    }

    /// The same, as somebody else.
    #[must_use]
    pub fn with_token(self, token: Token) -> Self {
        Self { token, ..self }
    }

    /// Anything that can be written, with an answer of its own shape.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub async fn make<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &impl serde::Serialize,
    ) -> Result<T, RemoteError> {
        self.ask(Method::POST, path, body, PATIENCE).await
    }

    /// Takes something back, with an answer of its own shape.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub async fn take_back<T: DeserializeOwned>(&self, path: &str) -> Result<T, RemoteError> {
        self.ask(Method::DELETE, path, &api::Nothing {}, PATIENCE).await
    }

    /// What is held: one page.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub async fn held(&self, satellite: Option<&str>, limit: u32) -> Result<Vec<HeldElements>, RemoteError> {
        let mut url = self.url("elements")?;
        url.query_pairs_mut().append_pair("limit", &limit.to_string());
        if let Some(satellite) = satellite {
            url.query_pairs_mut().append_pair("satellite", satellite);
        }
        let page: Page<HeldElements> = self.send(self.client.get(url.clone()), &url).await?;
        Ok(page.items)
    }

    /// How it stands with each source.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub async fn sources(&self) -> Result<Vec<ElementsSource>, RemoteError> {
        let url = self.url("elements/sources")?;
        let page: Page<ElementsSource> = self.send(self.client.get(url.clone()), &url).await?;
        Ok(page.items)
    }

    /// Adds sets of one satellite, in as many requests as it takes.
    ///
    /// # Errors
    /// [`RemoteError`]; what came before it was added.
    pub async fn add(
        &self,
        satellite: &str,
        sets: &[&Elements],
        source: &str,
    ) -> Result<ElementsAdded, RemoteError> {
        let mut sum: Option<ElementsAdded> = None;
        for text in texts(sets)? {
            let request = ElementsRequest {
                satellite: Some(satellite.to_owned()),
                text,
                source: Some(source.to_owned()),
                lenient: true,
            };
            let added: ElementsAdded = self.post("elements", &request, PATIENCE).await?;
            sum = Some(match sum {
                None => added,
                Some(sum) => ElementsAdded {
                    added: sum.added + added.added,
                    held: sum.held + added.held,
                    newest_epoch: sum.newest_epoch.max(added.newest_epoch),
                    ..sum
                },
            });
        }
        sum.ok_or_else(|| RemoteError::Refused("there is nothing to add".into()))
    }

    /// Has every source asked that may be asked.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub async fn fetch(&self) -> Result<FetchReport, RemoteError> {
        self.post("elements/fetch", &api::Nothing {}, FETCH_PATIENCE).await
    }

    /// Anything that can be read.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub async fn get<T: DeserializeOwned>(
        &self,
        path: &str,
        query: &[(&str, String)],
    ) -> Result<T, RemoteError> {
        let mut url = self.url(path)?;
        for (name, value) in query {
            url.query_pairs_mut().append_pair(name, value);
        }
        self.send(self.client.get(url.clone()), &url).await
    }

    /// Anything that can be written, under a key of its own.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub async fn write(&self, path: &str, body: &impl serde::Serialize) -> Result<Outcome, RemoteError> {
        self.ask(Method::POST, path, body, PATIENCE).await
    }

    /// As [`Self::write`], with an answer of its own shape.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub async fn ask_to<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &impl serde::Serialize,
    ) -> Result<T, RemoteError> {
        self.ask(Method::POST, path, body, PATIENCE).await
    }

    /// Takes something back.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub async fn remove(&self, path: &str) -> Result<Outcome, RemoteError> {
        self.ask(Method::DELETE, path, &api::Nothing {}, PATIENCE).await
    }

    fn url(&self, path: &str) -> Result<Url, RemoteError> {
        self.base.join(path).map_err(|error| RemoteError::Client(error.to_string()))
    }

    async fn post<T: DeserializeOwned>(
        &self,
        path: &str,
        body: &impl serde::Serialize,
        patience: Duration,
    ) -> Result<T, RemoteError> {
        self.ask(Method::POST, path, body, patience).await
    }

    async fn ask<T: DeserializeOwned>(
        &self,
        method: Method,
        path: &str,
        body: &impl serde::Serialize,
        patience: Duration,
    ) -> Result<T, RemoteError> {
        let url = self.url(path)?;
        let body = serde_json::to_vec(body).map_err(|error| RemoteError::Client(error.to_string()))?;
        let request = self
            .client
            .request(method, url.clone())
            .timeout(patience)
            .header(CONTENT_TYPE, "application/json")
            .header("idempotency-key", uuid::Uuid::new_v4().to_string())
            .body(body);
        self.send(request, &url).await
    }

    async fn send<T: DeserializeOwned>(&self, request: RequestBuilder, url: &Url) -> Result<T, RemoteError> {
        let no_answer =
            |error: reqwest::Error| RemoteError::NoAnswer { url: url.to_string(), why: chain(&error) };
        let strange = |why: String| RemoteError::Strange { url: url.to_string(), why };
        let mut bearer = HeaderValue::try_from(format!("Bearer {}", self.token.reveal()))
            .map_err(|error| RemoteError::Client(error.to_string()))?;
        bearer.set_sensitive(true);
        let mut response = request.header(AUTHORIZATION, bearer).send().await.map_err(no_answer)?;
        let status = response.status();
        let mut body = Vec::new();
        while let Some(chunk) = response.chunk().await.map_err(no_answer)? {
            if body.len() + chunk.len() > ANSWER_MAX {
                return Err(strange("it is too long".into()));
            }
            body.extend_from_slice(&chunk);
        }
        if !status.is_success() {
            return Err(match serde_json::from_slice::<Problem>(&body) {
                Ok(problem) if problem.known_kind() == Some(api::ProblemKind::Overloaded) => {
                    RemoteError::Busy(problem.detail)
                }
                Ok(problem) => RemoteError::Refused(problem.detail),
                Err(_) => strange(format!("status {status}")),
            });
        }
        serde_json::from_slice(&body).map_err(|error| strange(error.to_string()))
    }
}

/// Sets as texts of bounded length.
fn texts(sets: &[&Elements]) -> Result<Vec<String>, RemoteError> {
    let mut texts = Vec::new();
    let mut chunk: Vec<Elements> = Vec::new();
    let mut length = 0;
    let json = |sets: &[Elements]| {
        write(Form::OmmJson, sets).map_err(|error| RemoteError::Refused(error.to_string()))
    };
    for set in sets {
        let one = json(std::slice::from_ref(set))?.len();
        if length + one > TEXT_MAX && !chunk.is_empty() {
            texts.push(json(&chunk)?);
            chunk.clear();
            length = 0;
        }
        length += one;
        chunk.push((*set).clone());
    }
    if !chunk.is_empty() {
        texts.push(json(&chunk)?);
    }
    Ok(texts)
}
