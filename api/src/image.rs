//! Pictures.

use serde::{Deserialize, Serialize};

use crate::Time;

/// An image that the satellite declared.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImageView {
    /// Image.
    pub id: u64,
    /// Satellite.
    pub satellite: String,
    /// Station.
    pub station: String,
    /// Link.
    pub link: String,
    /// The frame that declared it.
    pub declared_by: u64,
    /// When.
    pub declared_at: Time,
    /// Bytes of the file.
    pub size_bytes: u32,
    /// Number of chunks.
    pub chunks: u32,
    /// Width in pixels.
    pub width_px: u16,
    /// Height in pixels.
    pub height_px: u16,
    /// Chunks held.
    pub held: u32,
    /// Chunks with versions that differ.
    pub conflicts: u32,
    /// All chunks are held.
    pub complete: bool,
    /// When the last chunk arrived.
    pub completed_at: Option<Time>,
    /// SHA-256 of the whole file in hex, once complete.
    pub sha256: Option<String>,
}

/// Which chunks of an image are held, and who brought them.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChunkMap {
    /// Image.
    pub image: u64,
    /// Number of chunks.
    pub chunks: u32,
    /// Chunks held, those in conflict included.
    pub held: u32,
    /// Chunks with versions that differ.
    pub conflicts: u32,
    /// One letter per chunk: `#` held, `.` missing, `!` held in versions that differ.
    pub map: String,
    /// For each chunk the frame that brought the version in use; `null` where it is missing.
    pub frames: Vec<Option<u64>>,
}
