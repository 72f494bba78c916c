//! The cheapest way to ask for missing chunks.

/// placeholder
pub struct Cost;
/// placeholder
pub struct Cover;
/// placeholder
pub struct Range;
/// placeholder
pub fn cheapest_cover() {}
