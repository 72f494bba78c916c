//! Why a request came to nothing.

use std::error::Error as _;
use std::fmt;

use crate::{Problem, ProblemKind};

/// Why the server did not do it, or did not say that it did.
#[derive(Debug)]
pub enum ClientError {
    /// The address or the token is none.
    Address(String),
    /// No client can be made on this machine.
    Setup(String),
    /// No answer: it may have been done all the same. Ask again with the same idempotency key.
    NoAnswer {
        /// Where.
        url: String,
        /// Why.
        why: String,
    },
    /// It says no.
    Refused(Box<Problem>),
    /// The answer is of another version, or of somebody else.
    Strange {
        /// Where.
        url: String,
        /// HTTP status.
        status: u16,
        /// Why.
        why: String,
    },
}

impl ClientError {
    /// The problem that the server told, when it told one.
    #[must_use]
    pub fn problem(&self) -> Option<&Problem> {
        match self {
            Self::Refused(problem) => Some(problem),
            _ => None,
        }
    }

    /// The kind of that problem, when this version knows it.
    #[must_use]
    pub fn kind(&self) -> Option<ProblemKind> {
        self.problem().and_then(Problem::known_kind)
    }

    /// Whether the same request may succeed a little later: no answer came, or the server is busy, stopping or failing.
    #[must_use]
    pub fn is_temporary(&self) -> bool {
        match self {
            Self::NoAnswer { .. } => true,
            Self::Refused(problem) => matches!(problem.status, 429 | 503),
            Self::Strange { status, .. } => matches!(status, 502..=504),
            Self::Address(_) | Self::Setup(_) => false,
        }
    }
}

impl fmt::Display for ClientError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Address(why) => f.write_str(why),
            Self::Setup(why) => write!(f, "no request can be made: {why}"),
            Self::NoAnswer { url, why } => write!(f, "no server answers at {url}: {why}"),
            Self::Refused(problem) => write!(f, "the server refuses: {}", problem.detail),
            Self::Strange { url, why, .. } => {
                write!(
                    f,
                    "the answer of {url} is not understood ({why}): is it this program, of the same version?"
                )
            }
        }
    }
}

impl std::error::Error for ClientError {}

/// The error and its reasons; the address is left out, it is said elsewhere.
pub(super) fn chain(error: reqwest::Error) -> String {
    let error = error.without_url();
    let mut text = error.to_string();
    let mut reason = error.source();
    while let Some(error) = reason {
        text.push_str(": ");
        text.push_str(&error.to_string());
        reason = error.source();
    }
    text
}
