//! A client of API v1. It believes only whole answers: what a killed server said half of was not said.

use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use serde::de::DeserializeOwned;

/// Longer than this no answer takes.
const PATIENCE: Duration = Duration::from_secs(30);

/// One server's API.
#[derive(Debug, Clone)]
pub struct Client {
    /// Where it listens.
    pub address: SocketAddr,
    /// What every write must show.
    pub token: String,
}

/// A whole answer.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Status code.
    pub status: u16,
    /// Names in lower case, and values.
    pub headers: Vec<(String, String)>,
    /// The body.
    pub body: Vec<u8>,
}

impl Answer {
    /// The value of a header.
    #[must_use]
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find_map(|(n, value)| (n == name).then_some(value.as_str()))
    }

    /// The body as text.
    #[must_use]
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    /// The body as a wire type.
    ///
    /// # Panics
    /// When it is none.
    #[must_use]
    pub fn json<T: DeserializeOwned>(&self) -> T {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|error| panic!("status {}, {error}: {}", self.status, self.text()))
    }

    /// The last part of a problem's type, e.g. `body-too-large`.
    #[must_use]
    pub fn problem(&self) -> String {
        let problem: api::Problem = self.json();
        problem
            .known_kind()
            .map(|kind| kind.urn())
            .unwrap_or_default()
            .rsplit(':')
            .next()
            .unwrap_or("")
            .to_owned()
    }
}

impl Client {
    /// Reads.
    ///
    /// # Errors
    /// No whole answer.
    pub fn get(&self, path: &str) -> io::Result<Answer> {
        self.ask("GET", path, &[], b"")
    }

    /// Reads a wire type.
    ///
    /// # Panics
    /// When there is no whole answer, or one that is no success.
    #[must_use]
    pub fn read<T: DeserializeOwned>(&self, path: &str) -> T {
        let answer = self.get(path).unwrap_or_else(|error| panic!("{path}: {error}"));
        assert_eq!(answer.status, 200, "{path}: {}", answer.text());
        answer.json()
    }

    /// Writes under an idempotency key.
    ///
    /// # Errors
    /// No whole answer: nobody knows whether it counts, ask again under the same key.
    pub fn post(&self, path: &str, key: &str, body: &str) -> io::Result<Answer> {
        let token = format!("Bearer {}", self.token);
        let headers = [
            ("authorization", token.as_str()),
            ("idempotency-key", key),
            ("content-type", "application/json"),
        ];
        self.ask("POST", path, &headers, body.as_bytes())
    }

    /// Asks anything.
    ///
    /// # Errors
    /// No whole answer.
    pub fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> io::Result<Answer> {
        let mut stream = TcpStream::connect_timeout(&self.address, PATIENCE)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        let mut request = format!(
            "{method} {path} HTTP/1.1\r\nhost: {}\r\nconnection: close\r\ncontent-length: {}\r\n",
            self.address,
            body.len()
        );
        for (name, value) in headers {
            request.push_str(&format!("{name}: {value}\r\n"));
        }
        request.push_str("\r\n");
        let mut bytes = request.into_bytes();
        bytes.extend_from_slice(body);
        // A server that refuses a long body need not read it to its end.
        let written = stream.write_all(&bytes);
        let mut raw = Vec::new();
        match stream.read_to_end(&mut raw) {
            Err(error) if raw.is_empty() => return Err(written.err().unwrap_or(error)),
            _ => {}
        }
        parse(&raw).ok_or_else(|| io::Error::new(io::ErrorKind::UnexpectedEof, "the answer is not whole"))
    }

    /// Every entry of a list, oldest first, page by page.
    ///
    /// # Panics
    /// When a page is no success.
    #[must_use]
    pub fn all<T: DeserializeOwned>(&self, path: &str) -> Vec<T> {
        let mut items = Vec::new();
        let mut after = 0;
        loop {
            let join = if path.contains('?') { '&' } else { '?' };
            let page: api::Page<T> = self.read(&format!("{path}{join}after={after}&limit=1000"));
            items.extend(page.items);
            match page.next {
                Some(next) => after = next,
                None => return items,
            }
        }
    }
}

/// An answer with the length that it claims.
fn parse(raw: &[u8]) -> Option<Answer> {
    let end = raw.windows(4).position(|window| window == b"\r\n\r\n")?;
    let head = std::str::from_utf8(&raw[..end]).ok()?;
    let mut lines = head.split("\r\n");
    let status = lines.next()?.split(' ').nth(1)?.parse().ok()?;
    let headers: Vec<(String, String)> = lines
        .filter_map(|line| line.split_once(':'))
        .map(|(name, value)| (name.trim().to_ascii_lowercase(), value.trim().to_owned()))
        .collect();
    let body = raw[end + 4..].to_vec();
    let header = |name: &str| headers.iter().find_map(|(n, v)| (n == name).then(|| v.clone()));
    let whole = match (header("content-length"), header("transfer-encoding")) {
        (Some(length), _) => length.parse() == Ok(body.len()),
        (None, None) => status == 304 || status == 204,
        (None, Some(_)) => return unchunk(&body).map(|body| Answer { status, headers, body }),
    };
    whole.then_some(Answer { status, headers, body })
}

/// Undoes the chunked encoding; `None` when its end is missing.
fn unchunk(mut raw: &[u8]) -> Option<Vec<u8>> {
    let mut body = Vec::new();
    loop {
        let end = raw.windows(2).position(|window| window == b"\r\n")?;
        let length = usize::from_str_radix(std::str::from_utf8(&raw[..end]).ok()?.trim(), 16).ok()?;
        raw = &raw[end + 2..];
        if length == 0 {
            return Some(body);
        }
        body.extend_from_slice(raw.get(..length)?);
        raw = raw.get(length + 2..)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_an_answer_is_none() {
        let whole = b"HTTP/1.1 201 Created\r\nContent-Length: 2\r\n\r\n{}";
        assert_eq!(parse(whole).unwrap().status, 201);
        assert!((0..whole.len()).all(|cut| parse(&whole[..cut]).is_none()));
        let chunked = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n";
        assert_eq!(parse(chunked).unwrap().body, b"{}");
        assert!(parse(&chunked[..chunked.len() - 6]).is_none());
    }
}
