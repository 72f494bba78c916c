//! Rehearsals: a plan goes through its coming pass in many worlds, before anything is radiated.
//!
//! | module | idea |
//! | --- | --- |
//! | `setup` | one world of a rehearsal: what is known stays, what is uncertain follows the seed |
//! | `outcome` | what came of one world |
//! | `summary` | what may be expected, from all of them |
//! | `warnings` | what no operator wants, found without flying |
//!
//! Each world has the station's own engine, the elements and the place that it believes in, and the twin under the real
//! geometry. A seed decides what nobody knows beforehand: [`Uncertainty`].

mod outcome;
mod setup;
mod summary;
mod warnings;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use mission::config::Times;
use mission::plan::Plan;
use mission::sky::{ElementSet, PassAhead, SkyFault, passes_of};
use mission::{ElementsId, Profile, Site, UtcUs};
use radio::airtime::LinkTiming;
use rayon::prelude::*;
use tle::Elements;

pub use outcome::{Commands, Outcome, StepFate};
pub use setup::Uncertainty;
pub use summary::{Ends, Spread, StepSummary, Summary};
pub use warnings::{refusals, warnings};

use crate::Violation;

/// No pass that is rehearsed is longer, microseconds: two hours.
pub const PASS_MAX_US: i64 = 7_200_000_000;
/// The coming pass is sought this far ahead, microseconds: ten days.
pub const AHEAD_US: i64 = 10 * 86_400_000_000;

/// What is rehearsed.
#[derive(Debug, Clone)]
pub struct Rehearsal {
    /// The plan.
    pub plan: Arc<Plan>,
    /// Its text.
    pub text: Arc<str>,
    /// The satellite's elements, as the station holds them.
    pub elements: Elements,
    /// Where the station stands.
    pub site: Site,
    /// The pass: one of [`coming_pass`].
    pub pass: PassAhead,
    /// What the satellite knows.
    pub profile: Profile,
    /// Airtime of the link.
    pub timing: LinkTiming,
    /// When the station may transmit, and when it is closed.
    pub times: Times,
    /// What nobody knows beforehand.
    pub uncertainty: Uncertainty,
}

/// Why nothing was rehearsed.
#[derive(Debug, Clone, thiserror::Error)]
pub enum RehearsalError {
    /// The elements tell no passes.
    #[error("elements of {satellite}: {fault}")]
    Sky {
        /// Whose.
        satellite: String,
        /// Why.
        #[source]
        fault: SkyFault,
    },
    /// No pass.
    #[error(
        "no pass over the station that the plan takes in the ten days after {0}; begin later with --pass, or ask for less in min_pass"
    )]
    NoPass(tle::UtcInstant),
    /// The satellite does not set, or not for hours.
    #[error("the pass lasts longer than two hours: such a one is not rehearsed")]
    TooLong,
    /// The twin cannot fly these elements.
    #[error("the twin cannot fly these elements: {0}")]
    Elements(#[from] tle::propagator::ElementsError),
    /// The station refuses the plan or the pass.
    #[error("the station refuses it: {0}")]
    Refused(String),
    /// Something that must always hold did not: a fault of this program.
    #[error("a fault of this program, please report it: {0}")]
    Violation(Box<Violation>),
    /// The caller stopped it.
    #[error("stopped after {0} runs")]
    Stopped(usize),
}

/// The first pass after `from` (the one that lasts then included) that the plan takes.
///
/// # Errors
/// [`RehearsalError::Sky`] when the elements tell nothing, [`RehearsalError::NoPass`] when none comes within ten days,
/// [`RehearsalError::TooLong`] when the satellite does not set.
pub fn coming_pass(
    plan: &Plan,
    elements: &Elements,
    site: &Site,
    from: UtcUs,
) -> Result<PassAhead, RehearsalError> {
    // From before the pass that may last already: within the window alone its culmination would be another.
    let passes = passes(elements, site, from.plus(-PASS_MAX_US), from.plus(AHEAD_US))?;
    let mut ahead = passes.into_iter().filter(|pass| !pass.is_over_at(from));
    let found = ahead.find(|pass| warnings::takes(plan, pass, elements).is_ok());
    let pass = found.ok_or(RehearsalError::NoPass(mission::sky::instant(from)))?;
    match pass.los_at {
        Some(los) if los.0 - pass.aos_at.0 <= PASS_MAX_US => Ok(pass),
        _ => Err(RehearsalError::TooLong),
    }
}

fn passes(
    elements: &Elements,
    site: &Site,
    from: UtcUs,
    until: UtcUs,
) -> Result<Vec<PassAhead>, RehearsalError> {
    let set = ElementSet { id: ElementsId(1), elements: Arc::new(elements.clone()) };
    passes_of(&set, site, from, until)
        .map_err(|fault| RehearsalError::Sky { satellite: elements.label(), fault })
}

/// Goes through the pass once for each seed, on all cores; what came of it, in the order of the seeds. `progress` is told
/// how many are done, and may stop it.
///
/// # Errors
/// [`RehearsalError`]; a plan that the station does not take is [`RehearsalError::Refused`].
pub fn rehearse(
    what: &Rehearsal,
    seeds: &[u64],
    progress: impl Fn(usize) -> ControlFlow<()> + Sync,
) -> Result<Vec<Outcome>, RehearsalError> {
    let (done, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
    let one = |seed: &u64| {
        if stopped.load(Ordering::Relaxed) {
            return Err(RehearsalError::Stopped(done.load(Ordering::Relaxed)));
        }
        let outcome = setup::fly(what, *seed)?;
        let so_far = done.fetch_add(1, Ordering::Relaxed) + 1;
        if progress(so_far).is_break() {
            stopped.store(true, Ordering::Relaxed);
        }
        Ok(outcome)
    };
    seeds.par_iter().map(one).collect()
}
