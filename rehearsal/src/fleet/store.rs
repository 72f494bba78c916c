//! The store of a station with several satellites: one for each, and what is common.

use std::collections::BTreeMap;

use mission::record::Record;
use mission::snapshot::{LastIds, Snapshot};
use mission::{Batch, CommandId, ImageId, ReservedFrame, SatelliteId, UtcUs};
use protocol::{Counter, KeyId};

use crate::store::{Reached, Store};

/// What is durable at one station.
#[derive(Debug, Default)]
pub(super) struct Stores {
    /// One for each satellite, with its key where it has one.
    of: BTreeMap<SatelliteId, (Store, Option<KeyId>)>,
    owner: BTreeMap<CommandId, SatelliteId>,
    images: BTreeMap<ImageId, SatelliteId>,
    /// Raw frames that the database did not take.
    pub(super) reserve: Vec<ReservedFrame>,
}

impl Stores {
    pub(super) fn new(satellites: impl IntoIterator<Item = (SatelliteId, Option<KeyId>)>) -> Self {
        let of = satellites.into_iter().map(|(id, key)| (id, (Store::default(), key))).collect();
        Self { of, ..Self::default() }
    }

    pub(super) fn get(&self, satellite: &SatelliteId) -> Option<&Store> {
        self.of.get(satellite).map(|(store, _)| store)
    }

    pub(super) fn all(&self) -> impl Iterator<Item = (&SatelliteId, &Store)> {
        self.of.iter().map(|(id, (store, _))| (id, store))
    }

    /// Takes a batch; what stages it brought, with their satellites.
    pub(super) fn apply(&mut self, batch: &Batch) -> Result<Vec<(SatelliteId, Reached)>, String> {
        let mut all = Vec::new();
        for record in &batch.records {
            let Some(satellite) = self.satellite(record) else { continue };
            let Some((store, _)) = self.of.get_mut(&satellite) else {
                return Err(format!("a record of {satellite}, which is not in the configuration"));
            };
            let mut reached = Vec::new();
            store.take(record, &mut reached)?;
            all.extend(reached.into_iter().map(|reached| (satellite.clone(), reached)));
            match record {
                Record::Command(command) => drop(self.owner.insert(command.id, satellite)),
                Record::Image(image) => drop(self.images.insert(image.id, satellite)),
                _ => {}
            }
        }
        Ok(all)
    }

    /// Whose record it is; `None` for what concerns none.
    fn satellite(&self, record: &Record) -> Option<SatelliteId> {
        Some(match record {
            Record::Frame(frame) => frame.route.satellite.clone(),
            Record::Command(command) => command.route.satellite.clone(),
            Record::Stage(stage) => self.owner.get(&stage.command)?.clone(),
            Record::Sealed(sealed) => sealed.route.satellite.clone(),
            Record::CounterFloor(floor) => {
                self.of.iter().find(|(_, (_, key))| *key == Some(floor.key)).map(|(id, _)| id.clone())?
            }
            Record::Image(image) => image.route.satellite.clone(),
            Record::Chunk(chunk) => self.images.get(&chunk.image)?.clone(),
            Record::Download(download) => download.route.satellite.clone(),
            Record::Limit(limit) => limit.satellite.clone(),
            Record::Elements(set) => set.satellite.clone(),
            Record::Pass(pass) => pass.satellite.clone(),
            Record::Plan(plan) => plan.plan.satellite.clone(),
            Record::Run(run) => run.satellite.clone(),
            Record::Event(event) => event.satellite.clone()?,
            Record::Reception(_)
            | Record::Outside(_)
            | Record::ReceptionRssi(_)
            | Record::Telemetry(_)
            | Record::Audit(_)
            | Record::Intent(_) => return None,
        })
    }

    pub(super) fn raise_witness(&mut self, key: KeyId, counter: Counter) {
        let found = self.of.values_mut().find(|(_, of)| *of == Some(key));
        if let Some((store, _)) = found {
            store.witness = store.witness.max(Some(counter));
        }
    }

    /// What a restart begins from.
    pub(super) fn snapshot(&self) -> Snapshot {
        let mut whole = Snapshot::default();
        for (satellite, (store, key)) in &self.of {
            let mut part = store.snapshot(satellite, *key);
            whole.last_ids = greatest(whole.last_ids, part.last_ids);
            whole.satellites.append(&mut part.satellites);
            whole.keys.append(&mut part.keys);
            whole.plans.append(&mut part.plans);
            whole.runs.append(&mut part.runs);
        }
        whole.plans.sort_by_key(|plan| plan.id);
        whole.runs.sort_by_key(|run| run.id);
        whole
    }

    /// Forgets what is over, so that memory stays flat.
    pub(super) fn forget(&mut self, now: UtcUs) {
        for (store, _) in self.of.values_mut() {
            store.forget(now);
        }
        let of = &self.of;
        self.owner.retain(|command, satellite| {
            of.get(satellite).is_some_and(|(store, _)| store.commands.contains_key(command))
        });
    }
}

fn greatest(a: LastIds, b: LastIds) -> LastIds {
    LastIds {
        frame: a.frame.max(b.frame),
        command: a.command.max(b.command),
        image: a.image.max(b.image),
        download: a.download.max(b.download),
        elements: a.elements.max(b.elements),
        pass: a.pass.max(b.pass),
        plan: a.plan.max(b.plan),
        run: a.run.max(b.run),
    }
}
