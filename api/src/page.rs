//! Lists, and requests that say nothing.

use serde::{Deserialize, Serialize};

/// A page of a list.
///
/// Without `after` a list runs from the newest down, and the next page is asked for with `before=NEXT`; with `after`
/// it runs upwards, and the next page is asked for with `after=NEXT`.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Page<T> {
    /// The entries.
    pub items: Vec<T>,
    /// Cursor of the next page; `null` when this was the last one for now.
    pub next: Option<u64>,
}

/// The body of a request that needs none: empty, or `{}`.
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Nothing {}
