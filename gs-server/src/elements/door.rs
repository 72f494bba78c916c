//! Sets into the engine, and the archive's answer to what is held.

use std::collections::HashSet;

use api::{ElementsAdded, ElementsView, FineTime, HeldElements, RefusedElements, Time};
use mission::sky::{ElementsAge, SETS_AT_ONCE};
use mission::{Intent, Principal, SatelliteId, UtcUs};
use sha2::{Digest as _, Sha256};
use tle::Elements;

use super::sets::{SetsOfText, Wanted};
use crate::engine::{EngineHandle, IntentError};
use crate::storage::{ElementsRow, Page, Scope, Store, StoreError};

/// Rows of the archive that are read at once.
const ROWS: u32 = 1000;

/// The way in for elements. Cheap to clone.
#[derive(Clone)]
pub struct Door {
    /// Takes them in.
    pub engine: EngineHandle,
    /// Tells what is held.
    pub store: Store,
}

/// Why elements were not added.
#[derive(Debug, thiserror::Error)]
pub enum AddError {
    /// The engine says no.
    #[error(transparent)]
    Intent(#[from] IntentError),
    /// It could not be looked up what is held.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Who adds elements, and under which key it counts only once.
#[derive(Debug, Clone)]
pub struct Adder {
    /// Who.
    pub principal: Principal,
    /// The idempotency key.
    pub key: String,
    /// SHA-256 of the request.
    pub digest: [u8; 32],
}

impl Adder {
    /// A key made of what is added: the same elements count once, however often they come.
    pub fn of(principal: &str, satellite: &SatelliteId, sets: &[&Elements]) -> Self {
        let mut hash = Sha256::new();
        hash.update(satellite.as_str());
        for set in sets {
            hash.update(format!("{set:?}"));
        }
        let digest: [u8; 32] = hash.finalize().into();
        Self {
            principal: Principal::new(principal),
            key: format!("elements-{}", hex::encode(digest)),
            digest,
        }
    }
}

impl Door {
    /// Adds the sets of one satellite; those that are held already are passed over. Durable when it returns. The second
    /// value: the same request had been accepted before.
    ///
    /// # Errors
    /// [`AddError`]; some may have been added all the same, and asking again is harmless.
    pub async fn add(
        &self,
        satellite: &SatelliteId,
        sets: &[&Elements],
        source: &str,
        adder: &Adder,
    ) -> Result<(ElementsAdded, bool), AddError> {
        // What was added then is held now, so the engine would not be asked and could not tell.
        let mut replayed = match self.store.find_intent(&adder.principal, &adder.key).await? {
            Some(stored) if stored.digest != adder.digest => return Err(IntentError::KeyReused.into()),
            earlier => earlier.is_some(),
        };
        let fresh = self.fresh(satellite, sets).await?;
        let added = fresh.len() as u64;
        for chunk in fresh.chunks(SETS_AT_ONCE) {
            // Of more than one chunk some may have been added before we were killed: each has the key of what it holds, or
            // the rest would count as added too.
            let key = if sets.len() > SETS_AT_ONCE {
                let held: Vec<&Elements> = chunk.iter().collect();
                Adder::of("", satellite, &held).key
            } else {
                adder.key.clone()
            };
            let intent = Intent::AddElements {
                satellite: satellite.clone(),
                elements: chunk.to_vec(),
                source: source.to_owned(),
            };
            replayed |=
                self.engine.intent(adder.principal.clone(), key, adder.digest, intent).await?.replayed;
        }
        let report = ElementsAdded {
            satellite: satellite.to_string(),
            added,
            held: sets.len() as u64 - added,
            newest_epoch: sets
                .iter()
                .map(|set| set.epoch)
                .max()
                .map(|at| FineTime::from_unix_us(at.unix_us())),
            of_others: 0,
            refused: Vec::new(),
            warnings: Vec::new(),
        };
        Ok((report, replayed))
    }

    /// Those that are not in the archive, each once.
    async fn fresh(&self, satellite: &SatelliteId, sets: &[&Elements]) -> Result<Vec<Elements>, StoreError> {
        let epochs: HashSet<i64> = sets.iter().map(|set| set.epoch.unix_us()).collect();
        let mut held: Vec<Elements> = Vec::new();
        let scope = Scope { satellite: Some(satellite.to_string()), ..Scope::default() };
        let mut page = Page { before: Some(i64::MAX), limit: ROWS, ..Page::default() };
        loop {
            let rows = self.store.elements(&scope, &page).await?;
            for row in rows.iter().filter(|row| epochs.contains(&row.epoch_us)) {
                held.push(row.elements()?);
            }
            match rows.last() {
                Some(last) if rows.len() >= ROWS as usize => page.before = Some(last.id),
                _ => break,
            }
        }
        let mut fresh = Vec::new();
        for set in sets {
            if !held.contains(set) {
                held.push((*set).clone());
                fresh.push((*set).clone());
            }
        }
        Ok(fresh)
    }
}

/// The report of what was added, with what the text held besides.
pub fn report(mut added: ElementsAdded, text: &SetsOfText, taken: usize, source: &str) -> ElementsAdded {
    added.of_others = text.sets.len().saturating_sub(taken) as u64;
    added.refused = refused(text, source);
    added.warnings = warnings(text);
    added
}

/// Sets of a text that could not be used; the first hundred.
pub fn refused(text: &SetsOfText, source: &str) -> Vec<RefusedElements> {
    let refused = text.refused.iter().take(100).map(|refused| RefusedElements {
        source: source.to_owned(),
        line: refused.line as u64,
        object: refused.object.clone(),
        error: refused.error.clone(),
    });
    refused.collect()
}

/// What was odd in a text; the first hundred.
pub fn warnings(text: &SetsOfText) -> Vec<String> {
    let all = text.sets.iter().flat_map(|found| {
        found
            .warnings
            .iter()
            .map(move |warning| format!("line {} ({}): {warning}", found.line, found.elements.label()))
    });
    all.take(100).collect()
}

/// A page of what the archive holds, as it looks at this time.
///
/// # Errors
/// [`StoreError`] when the archive cannot be read.
pub async fn held(
    store: &Store,
    satellites: &[Wanted],
    scope: &Scope,
    page: &Page,
    now: UtcUs,
) -> Result<Vec<HeldElements>, StoreError> {
    let mut in_use = Vec::new();
    for wanted in satellites {
        let named = scope.satellite.as_deref();
        if named.is_none_or(|name| name == wanted.satellite.as_str()) {
            in_use.extend(used_at(store, &wanted.satellite, now).await?);
        }
    }
    let rows = store.elements(scope, page).await?;
    rows.iter().map(|row| view(row, &in_use, now)).collect()
}

/// The set for this time: the newest at or before it, else the nearest; of two with one epoch the later one.
async fn used_at(store: &Store, satellite: &SatelliteId, now: UtcUs) -> Result<Option<i64>, StoreError> {
    let scope = Scope { satellite: Some(satellite.to_string()), ..Scope::default() };
    let page = Page { before: Some(i64::MAX), limit: ROWS, ..Page::default() };
    let rows = store.elements(&scope, &page).await?;
    let before = rows.iter().filter(|row| row.epoch_us <= now.0).max_by_key(|row| (row.epoch_us, row.id));
    let nearest = || rows.iter().min_by_key(|row| (row.epoch_us, -row.id));
    Ok(before.or_else(nearest).map(|row| row.id))
}

fn view(row: &ElementsRow, in_use: &[i64], now: UtcUs) -> Result<HeldElements, StoreError> {
    let elements = row.elements()?;
    let age = ElementsAge::at(&elements, now);
    Ok(HeldElements {
        id: u64::try_from(row.id).unwrap_or(0),
        satellite: row.satellite.clone(),
        station: row.station.clone(),
        source: row.source.clone(),
        added_at: Time::from_unix_us(row.added_at_us),
        added_by: row.who.clone(),
        in_use: in_use.contains(&row.id),
        age_days: age.age_days,
        timing_error_s: age.timing_error_s,
        level: age.level.to_string(),
        elements: elements_view(&elements),
    })
}

/// A set as the wire has it.
pub fn elements_view(elements: &Elements) -> ElementsView {
    ElementsView {
        satellite: elements.label(),
        norad_cat_id: elements.norad_cat_id,
        object_id: elements.object_id.clone(),
        epoch: FineTime::from_unix_us(elements.epoch.unix_us()),
        mean_motion_rev_day: elements.mean_motion_rev_day,
        eccentricity: elements.eccentricity,
        inclination_deg: elements.inclination_deg,
        raan_deg: elements.raan_deg,
        arg_of_perigee_deg: elements.arg_of_perigee_deg,
        mean_anomaly_deg: elements.mean_anomaly_deg,
        bstar: elements.bstar,
        element_set_no: elements.element_set_no,
        rev_at_epoch: elements.rev_at_epoch,
    }
}
