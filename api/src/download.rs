//! Standing orders to bring an image home.

use serde::{Deserialize, Serialize};

use crate::Time;

/// Bring the satellite's image home.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DownloadRequest {
    /// From whom; may be left out where there is one satellite.
    #[serde(default)]
    pub satellite: Option<String>,
    /// Over what; may be left out where the satellite has one link.
    #[serde(default)]
    pub link: Option<String>,
}

/// A standing order.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DownloadView {
    /// Download.
    pub id: u64,
    /// Satellite.
    pub satellite: String,
    /// Station.
    pub station: String,
    /// Link.
    pub link: String,
    /// The image, once it is known.
    pub image: Option<u64>,
    /// Who wants it.
    pub principal: String,
    /// `active`, `complete`, `cancelled` or `failed`.
    pub state: String,
    /// When it was ordered.
    pub created_at: Time,
    /// Requests for chunks radiated so far.
    pub requests: u32,
    /// Chunks asked for in all requests together.
    pub chunks_requested: u32,
    /// Chunks asked for although held, because that cost less airtime than another request.
    pub chunks_bridged: u32,
}
