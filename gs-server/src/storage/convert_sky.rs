//! Between the engine's records of elements and passes and the rows of their tables.

use std::sync::Arc;

use mission::record::{ElementsRecord, PassRecord};
use mission::{ElementSet, ElementsId, PassId, UtcUs};
use tle::Elements;
use tle::formats::{Checksums, Form, sets, write};

use super::StoreError;
use super::convert::{int, narrow, parse};
use super::rows::{ElementsRow, PassElementsRow, PassRow};

impl ElementsRow {
    pub(super) fn of(record: &ElementsRecord) -> Result<Self, StoreError> {
        let set = &record.elements;
        let omm = write(Form::OmmJson, std::slice::from_ref(set.as_ref()))
            .map_err(|error| StoreError::Conflict(format!("elements {}: {error}", record.id)))?;
        Ok(Self {
            id: int("elements", record.id.0)?,
            satellite: record.satellite.to_string(),
            station: record.station.to_string(),
            norad_cat_id: set.norad_cat_id.map(i64::from),
            object_name: set.name.clone(),
            epoch_us: set.epoch.unix_us(),
            source: record.source.clone(),
            added_at_us: record.added_at.0,
            who: record.who.to_string(),
            omm,
        })
    }

    /// The elements as the engine and `tle` take them.
    ///
    /// # Errors
    /// [`StoreError`] when the text is none that was written here.
    pub fn elements(&self) -> Result<Elements, StoreError> {
        let wrong = |why: String| StoreError::damaged(format!("elements.omm of {}: {why}", self.id));
        let mut found = sets(&self.omm, Checksums::Strict).map_err(|error| wrong(error.to_string()))?;
        match found.next() {
            Some(Ok(found)) => Ok(found.elements),
            Some(Err(error)) => Err(wrong(error.to_string())),
            None => Err(wrong("there is no set".to_owned())),
        }
    }

    /// The set with its number.
    ///
    /// # Errors
    /// As [`Self::elements`].
    pub fn set(&self) -> Result<ElementSet, StoreError> {
        Ok(ElementSet {
            id: ElementsId(narrow("elements.id", self.id)?),
            elements: Arc::new(self.elements()?),
        })
    }
}

impl PassRow {
    pub(super) fn of(record: &PassRecord) -> Result<Self, StoreError> {
        Ok(Self {
            id: int("pass", record.id.0)?,
            satellite: record.satellite.to_string(),
            station: record.station.to_string(),
            aos_at_us: record.aos_at.0,
            tca_at_us: record.tca_at.0,
            los_at_us: record.los_at.map(|los| los.0),
            max_elevation_deg: record.max_elevation_deg,
            ended_at_us: record.ended_at.map(|at| at.0),
        })
    }

    pub(super) fn record(&self, used: &[PassElementsRow]) -> Result<PassRecord, StoreError> {
        Ok(PassRecord {
            id: PassId(narrow("passes.id", self.id)?),
            satellite: parse("passes.satellite", &self.satellite)?,
            station: parse("passes.station", &self.station)?,
            aos_at: UtcUs(self.aos_at_us),
            tca_at: UtcUs(self.tca_at_us),
            los_at: self.los_at_us.map(UtcUs),
            max_elevation_deg: self.max_elevation_deg,
            elements: used
                .iter()
                .map(|row| {
                    Ok((ElementsId(narrow("pass_elements.elements", row.elements)?), UtcUs(row.from_us)))
                })
                .collect::<Result<_, StoreError>>()?,
            ended_at: self.ended_at_us.map(UtcUs),
        })
    }
}

impl PassElementsRow {
    pub(super) fn of(record: &PassRecord) -> Result<Vec<Self>, StoreError> {
        let pass = int("pass", record.id.0)?;
        record
            .elements
            .iter()
            .map(|(elements, from)| {
                Ok(Self { pass, elements: int("elements", elements.0)?, from_us: from.0 })
            })
            .collect()
    }
}
