//! People: who is logged in, users, the tokens of machines, what a second person has to approve, and who answered for a
//! transmission.

use serde::{Deserialize, Serialize};

use crate::Time;

/// Logs somebody in.
#[derive(Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct LoginRequest {
    /// The user's name.
    pub name: String,
    /// The password.
    pub password: String,
}

/// Sets a password by a one-time link.
#[derive(Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct WelcomeRequest {
    /// The code of the link: what stands behind `#code=`.
    pub code: String,
    /// The first administrator's name: 1 to 32 of `a-z`, `0-9`, `-`, `_`. Others have theirs already.
    #[serde(default)]
    pub name: Option<String>,
    /// The new password: 12 characters to 256 bytes.
    pub password: String,
    /// Amateur radio call sign; what is known stays when it is missing.
    #[serde(default)]
    pub call_sign: Option<String>,
    /// The licence in words, e.g. its class; what is known stays when it is missing.
    #[serde(default)]
    pub licence: Option<String>,
}

/// Exchanges one's own password.
#[derive(Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct PasswordRequest {
    /// The present one.
    pub old: String,
    /// The new one: 12 characters to 256 bytes.
    pub new: String,
}

macro_rules! hidden {
    ($($name:ident),*) => {
        $(
            impl std::fmt::Debug for $name {
                fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                    f.write_str(concat!(stringify!($name), "(redacted)"))
                }
            }
        )*
    };
}

hidden!(LoginRequest, WelcomeRequest, PasswordRequest, TokenMade, LinkMade);

/// Who asks, as the server sees it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct SessionView {
    /// As records name them: a user, `token:NAME`, or `local` for the server's own token; `null`: nobody is logged in.
    pub name: Option<String>,
    /// `viewer`, `operator`, `mission-lead` or `administrator`; `null` for machines.
    pub role: Option<String>,
    /// What they may do.
    pub rights: Vec<String>,
    /// To be sent as `X-CSRF-Token` with each write of this session; `null` for machines.
    pub csrf: Option<String>,
    /// When they have to log in again at the latest.
    pub expires_at: Option<Time>,
    /// `off` or `critical`: whether a second person has to approve what is critical.
    pub two_person: String,
}

/// A user.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct UserView {
    /// The name; never given to somebody else.
    pub name: String,
    /// `viewer`, `operator`, `mission-lead` or `administrator`.
    pub role: String,
    /// Amateur radio call sign.
    pub call_sign: Option<String>,
    /// The licence in words.
    pub licence: Option<String>,
    /// May not come in any more.
    pub disabled: bool,
    /// Whether a password was set: the one-time link was used.
    pub has_password: bool,
    /// When the user was made.
    pub created_at: Time,
    /// By whom.
    pub created_by: String,
    /// Sessions that are open.
    pub sessions: u64,
}

/// Makes a user.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct UserRequest {
    /// 1 to 32 of `a-z`, `0-9`, `-`, `_`.
    pub name: String,
    /// `viewer`, `operator`, `mission-lead` or `administrator`.
    pub role: String,
    /// Amateur radio call sign.
    #[serde(default)]
    pub call_sign: Option<String>,
    /// The licence in words.
    #[serde(default)]
    pub licence: Option<String>,
}

/// Changes a user; what is missing stays.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct UserChange {
    /// Another role.
    #[serde(default)]
    pub role: Option<String>,
    /// Another call sign; empty for none.
    #[serde(default)]
    pub call_sign: Option<String>,
    /// Another licence; empty for none.
    #[serde(default)]
    pub licence: Option<String>,
    /// Shut out, with all sessions and tokens, or let in again.
    #[serde(default)]
    pub disabled: Option<bool>,
}

/// A one-time link, told once.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct LinkMade {
    /// Whose; `null`: it makes the first administrator.
    pub user: Option<String>,
    /// Path and fragment of the address, `/welcome#code=…`. What stands behind `#` never leaves the browser.
    pub link: String,
    /// Not after this.
    pub expires_at: Time,
}

/// A machine's token; the token itself was told once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct TokenView {
    /// Its name; never used again.
    pub name: String,
    /// The user who answers for it.
    pub owner: Option<String>,
    /// What it may do, as far as its owner may.
    pub scopes: Vec<String>,
    /// When it was made.
    pub created_at: Time,
    /// By whom.
    pub created_by: String,
    /// Not after this.
    pub expires_at: Time,
    /// When it was revoked.
    pub revoked_at: Option<Time>,
}

/// Makes a token.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct TokenRequest {
    /// 1 to 32 of `a-z`, `0-9`, `-`, `_`.
    pub name: String,
    /// Rights: `look`, `command`, `critical`, `plan`, `approve`, `manage-station`, `manage-people`.
    pub scopes: Vec<String>,
    /// How long it is good, 1 to 3650.
    pub days: u32,
    /// The user who answers for it; whoever makes it, when it is missing.
    #[serde(default)]
    pub owner: Option<String>,
}

/// A token, told once.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct TokenMade {
    /// The token itself. It is not kept: nobody can tell it again.
    pub secret: String,
    /// All about it.
    pub token: TokenView,
}

/// Something that needs, or needed, a second person.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct ApprovalView {
    /// Its number.
    pub id: u64,
    /// `command` or `arm-plan`.
    pub kind: String,
    /// What would happen, in words.
    pub summary: String,
    /// What was asked for, as it was sent.
    pub request: serde_json::Value,
    /// SHA-256 of what it means: satellite, link, packet type, payload, conditions; or the plan's text. To be sent
    /// with the approval: what was seen is what is approved.
    pub digest: String,
    /// Who asked, as records name them.
    pub principal: String,
    /// The person behind that.
    pub person: String,
    /// When.
    pub asked_at: Time,
    /// Not to be approved after this.
    pub expires_at: Time,
    /// `awaiting`, `approved`, `refused` or `expired`.
    pub state: String,
    /// Who decided.
    pub decided_by: Option<String>,
    /// When.
    pub decided_at: Option<Time>,
    /// Why it was refused.
    pub why: Option<String>,
    /// The command that came of it.
    pub command: Option<u64>,
}

/// Says yes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct ApproveRequest {
    /// The digest that was shown.
    pub digest: String,
}

/// Says no, or takes back what one asked for.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct RefuseRequest {
    /// Why.
    #[serde(default)]
    pub why: Option<String>,
}

/// Who answered for one radiation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct TransmissionView {
    /// The command.
    pub command: u64,
    /// Which attempt of it.
    pub attempt: u16,
    /// To whom.
    pub satellite: String,
    /// From where.
    pub station: String,
    /// Over what.
    pub link: String,
    /// When it was permitted, which is just before it was radiated.
    pub at: Time,
    /// Who asked for it: a user, `token:NAME`, `plan:NAME`, `local`, `engine`.
    pub principal: String,
    /// The person behind that: the token's owner, whoever armed the plan.
    pub person: Option<String>,
    /// Their call sign, else the station's.
    pub call_sign: Option<String>,
    /// Their licence, else the station's.
    pub licence: Option<String>,
}
