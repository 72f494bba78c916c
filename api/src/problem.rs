//! What went wrong, as RFC 9457 has it.

use serde::{Deserialize, Serialize};

/// The body of every answer that is an error; media type `application/problem+json`.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// What kind, a stable URN: [`ProblemKind::urn`].
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind in words.
    pub title: String,
    /// HTTP status, once more.
    pub status: u16,
    /// What went wrong here, with the remedy where there is one.
    pub detail: String,
    /// The path that was asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub instance: Option<String>,
    /// The fields that are wrong.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub errors: Vec<FieldError>,
    /// Try again after so many seconds.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub retry_after_s: Option<u64>,
}

/// One field that is wrong.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FieldError {
    /// Which, e.g. `arguments.count`.
    pub field: String,
    /// What is wrong and what would be right.
    pub message: String,
}

impl Problem {
    /// A problem of this kind.
    #[must_use]
    pub fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        Self {
            kind: kind.urn(),
            title: kind.title().to_owned(),
            status: kind.status(),
            detail: detail.into(),
            instance: None,
            errors: Vec::new(),
            retry_after_s: None,
        }
    }

    /// The same, naming a field.
    #[must_use]
    pub fn with_field(mut self, field: impl Into<String>, message: impl Into<String>) -> Self {
        self.errors.push(FieldError { field: field.into(), message: message.into() });
        self
    }

    /// The kind, when this version knows it.
    #[must_use]
    pub fn known_kind(&self) -> Option<ProblemKind> {
        ProblemKind::ALL.iter().copied().find(|kind| kind.urn() == self.kind)
    }
}

macro_rules! kinds {
    ($($(#[$meta:meta])* $name:ident $status:literal $word:literal $title:literal;)*) => {
        /// The kinds of problems: words and numbers are stable.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum ProblemKind {
            $($(#[$meta])* $name,)*
        }

        impl ProblemKind {
            /// All kinds.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// The last part of the URN.
            #[must_use]
            pub const fn word(self) -> &'static str {
                match self { $(Self::$name => $word),* }
            }

            /// HTTP status.
            #[must_use]
            pub const fn status(self) -> u16 {
                match self { $(Self::$name => $status),* }
            }

            /// The kind in words.
            #[must_use]
            pub const fn title(self) -> &'static str {
                match self { $(Self::$name => $title),* }
            }
        }
    };
}

kinds! {
    /// Nothing is there.
    NotFound 404 "not-found" "There is nothing here";
    /// The path does not take this method.
    MethodNotAllowed 405 "method-not-allowed" "This path does not take this method";
    /// What the path has to say comes in none of the forms that are accepted.
    NotAcceptable 406 "not-acceptable" "This path answers in another form";
    /// A parameter of the query or of the path is wrong.
    BadParameter 400 "bad-parameter" "A parameter is wrong";
    /// The body is no JSON.
    BadJson 400 "bad-json" "The body is not JSON";
    /// The body is JSON of another shape.
    WrongShape 422 "wrong-shape" "The body has the wrong shape";
    /// The body is not declared as JSON.
    WrongMediaType 415 "wrong-media-type" "The body must be application/json";
    /// The body is too large.
    BodyTooLarge 413 "body-too-large" "The body is too large";
    /// The Host header is not one of ours.
    HostRefused 421 "host-refused" "This server does not answer under that name";
    /// A page of somebody else asks.
    OriginRefused 403 "origin-refused" "Pages of another origin may not do this";
    /// Nobody is logged in, and no token came.
    LoginRequired 401 "login-required" "Log in, or send a token";
    /// Who asks lacks the right.
    Forbidden 403 "forbidden" "This needs a right that is missing";
    /// A write by a page without the session's own word.
    Csrf 403 "csrf" "The request does not come from this session's page";
    /// The session's cookie was exchanged for a newer one: somebody holds a copy.
    SessionReplayed 401 "session-replayed" "This session's cookie was used before it was exchanged";
    /// Name and password do not go together.
    WrongPassword 401 "wrong-password" "Name and password do not go together";
    /// A password that is too short or too long.
    BadPassword 422 "bad-password" "The password cannot be used";
    /// A one-time link that was used, is too old, or never was.
    LinkRefused 410 "link-refused" "This link does not open anything any more";
    /// Too many attempts.
    RateLimited 429 "rate-limited" "Too many attempts";
    /// No such user.
    UnknownUser 404 "unknown-user" "There is no such user";
    /// The user is there already.
    UserExists 409 "user-exists" "The name is taken";
    /// Without an administrator nobody could let anybody in.
    LastAdministrator 409 "last-administrator" "Somebody must stay administrator";
    /// This approval cannot be given.
    ApprovalRefused 409 "approval-refused" "This cannot be approved like that";
    /// The token is another.
    TokenRefused 401 "token-refused" "The token is not the right one";
    /// A write without idempotency key.
    IdempotencyKeyRequired 400 "idempotency-key-required" "A write needs the header Idempotency-Key";
    /// The key is used for another request.
    IdempotencyKeyReused 409 "idempotency-key-reused" "This Idempotency-Key was used for another request";
    /// The path speaks WebSocket only.
    UpgradeRequired 426 "upgrade-required" "This path speaks WebSocket";
    /// Too many streams are open.
    TooManyStreams 503 "too-many-streams" "Too many streams are open";
    /// No such satellite.
    UnknownSatellite 422 "unknown-satellite" "There is no such satellite";
    /// No such link.
    UnknownLink 422 "unknown-link" "There is no such link";
    /// No such command.
    UnknownCommand 404 "unknown-command" "There is no such command";
    /// No such download.
    UnknownDownload 404 "unknown-download" "There is no such download";
    /// No such key.
    UnknownKey 404 "unknown-key" "There is no such key";
    /// The satellite can be heard, not commanded.
    NoKey 409 "no-key" "The satellite has no key";
    /// The configuration does not say where the station stands.
    NoPlace 409 "no-place" "The station does not know where it stands";
    /// Nothing says where the satellite is.
    NoElements 409 "no-elements" "There are no elements";
    /// An argument of a telecommand is wrong.
    BadArgument 422 "bad-argument" "An argument is wrong";
    /// The satellite does not know this telecommand.
    NotInProfile 422 "not-in-profile" "The satellite does not know this telecommand";
    /// The command is critical.
    NeedsConfirmation 409 "needs-confirmation" "The command is critical and needs confirmation";
    /// It was or may have been radiated.
    TooLate 409 "too-late" "It is too late for that";
    /// Its time is over already.
    AlreadyExpired 422 "already-expired" "Its time is over already";
    /// Too many commands wait.
    QueueFull 429 "queue-full" "Too many commands wait";
    /// Nothing is locked.
    NotLocked 409 "not-locked" "Nothing is locked";
    /// The clock leads above forgotten counters, and nobody vouches for it.
    ClockNotVouched 409 "clock-not-vouched" "Nobody says that the clock is right";
    /// Counters of a sequence were forgotten, and nobody says above which to go on.
    FloorNeeded 409 "floor-needed" "Nobody says above which counter to go on";
    /// No plan has this name.
    UnknownPlan 404 "unknown-plan" "There is no such plan";
    /// The plan is wrong; the message says where and what to do.
    PlanRefused 422 "plan-refused" "The plan is refused";
    /// Too many plans are in use.
    PlansFull 409 "plans-full" "Too many plans are in use";
    /// There is no such pass, or the plan does not take it.
    PassRefused 409 "pass-refused" "The plan does not get this pass";
    /// No plan runs at present.
    NothingRuns 409 "nothing-runs" "No plan runs at present";
    /// The alert is over and known.
    AlertNotOpen 409 "alert-not-open" "The alert is not open";
    /// No target of messages has this name.
    UnknownTarget 404 "unknown-target" "There is no such target";
    /// A test message did not go through.
    DeliveryFailed 502 "delivery-failed" "The message did not go through";
    /// Storage takes nothing at present.
    StorageFailing 503 "storage-failing" "Storage is failing";
    /// The station cannot take more at present.
    Overloaded 503 "overloaded" "The station is busy";
    /// The station is stopping.
    Stopping 503 "stopping" "The station is stopping";
    /// A fault of the server.
    Internal 500 "internal" "The server failed";
}

impl ProblemKind {
    /// The stable URN.
    #[must_use]
    pub fn urn(self) -> String {
        format!("urn:pixelsat-ground:problem:{}", self.word())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_its_own_word_and_an_error_status() {
        let mut words: Vec<_> = ProblemKind::ALL.iter().map(|kind| kind.word()).collect();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), ProblemKind::ALL.len());
        for kind in ProblemKind::ALL {
            assert!((400..600).contains(&kind.status()));
            assert_eq!(Problem::new(*kind, "x").known_kind(), Some(*kind));
        }
    }

    #[test]
    fn a_problem_reads_like_rfc_9457() {
        let problem = Problem::new(ProblemKind::BadArgument, "arguments.count: 1 to 64")
            .with_field("arguments.count", "1 to 64");
        assert_eq!(
            serde_json::to_value(&problem).unwrap(),
            serde_json::json!({
                "type": "urn:pixelsat-ground:problem:bad-argument",
                "title": "An argument is wrong",
                "status": 422,
                "detail": "arguments.count: 1 to 64",
                "errors": [{"field": "arguments.count", "message": "1 to 64"}],
            })
        );
    }
}
