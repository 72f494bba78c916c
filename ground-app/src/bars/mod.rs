//! The frame that is the same on every layout: above, what must never be out of sight; below, what happened last.

mod bottom;
mod old;
mod top;

pub(crate) use bottom::bottom;
pub(crate) use old::over as old;
pub(crate) use top::top;
