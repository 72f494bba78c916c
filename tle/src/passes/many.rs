//! Large jobs: many satellites, on all the cores that rayon has.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::station::Station;

use super::pass::SatellitePasses;
use super::request::{PassSearch, SearchError};
use super::search::PassFinder;

/// All passes of many satellites over the stations, in the order in which the satellites were given.
///
/// `progress` hears after each satellite how many of them are done; it is called from several threads, and not in order. It
/// ends the job early by [`ControlFlow::Break`]. The work runs in rayon's pool: call from
/// `ThreadPool::install` to bound the threads.
///
/// # Errors
/// A window or threshold that cannot be searched, and [`SearchError::Stopped`].
pub fn find_many(
    finders: &[PassFinder],
    stations: &[Station],
    search: &PassSearch,
    progress: impl Fn(usize) -> ControlFlow<()> + Sync,
) -> Result<Vec<SatellitePasses>, SearchError> {
    search.check()?;
    let done = AtomicUsize::new(0);
    let stopped = AtomicBool::new(false);
    let total = finders.len();
    finders
        .par_iter()
        .map(|finder| {
            if stopped.load(Ordering::Relaxed) {
                return Err(SearchError::Stopped { done: done.load(Ordering::Relaxed), total });
            }
            let found = finder.find(stations, search)?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if progress(done).is_break() {
                stopped.store(true, Ordering::Relaxed);
                if done < total {
                    return Err(SearchError::Stopped { done, total });
                }
            }
            Ok(found)
        })
        .collect()
}
