//! What storage would read back.

use std::sync::Arc;

use mission::record::{CommandRecord, DownloadRecord, DownloadState, PassRecord};
use mission::snapshot::{
    CommandSnapshot, ImageSnapshot, KeySnapshot, LastIds, SatelliteSnapshot, SealedSnapshot,
};
use mission::{ElementSet, Record, Snapshot, Stage};
use protocol::Counter;

use crate::world::World;

impl World {
    /// As storage would read it back.
    pub(crate) fn snapshot(&self) -> Snapshot {
        let mut ids = LastIds::default();
        let mut commands: Vec<(CommandRecord, CommandSnapshot)> = Vec::new();
        let mut last_tag = None;
        let mut counter: Option<Counter> = None;
        let mut image: Option<ImageSnapshot> = None;
        let mut downloads: Vec<DownloadRecord> = Vec::new();
        let mut elements = Vec::new();
        let mut of_others: std::collections::BTreeMap<mission::SatelliteId, Vec<ElementSet>> =
            std::collections::BTreeMap::new();
        let mut pass: Option<PassRecord> = None;
        let mut plans: Vec<mission::run::PlanRecord> = Vec::new();
        let mut runs: Vec<mission::run::RunRecord> = Vec::new();
        for record in &self.stored {
            match record {
                Record::Elements(row) => {
                    ids.elements = row.id.0;
                    let set = ElementSet { id: row.id, elements: Arc::clone(&row.elements) };
                    match row.satellite == self.satellite {
                        true => elements.push(set),
                        false => of_others.entry(row.satellite.clone()).or_default().push(set),
                    }
                }
                Record::Plan(row) => {
                    ids.plan = ids.plan.max(row.id.0);
                    plans.retain(|found| found.id != row.id);
                    plans.push(row.clone());
                }
                Record::Run(row) => {
                    ids.run = ids.run.max(row.id.0);
                    runs.retain(|found| found.id != row.id);
                    runs.push((**row).clone());
                }
                Record::Pass(row) => {
                    ids.pass = row.id.0;
                    pass = Some(row.clone());
                }
                Record::Frame(row) => ids.frame = ids.frame.max(row.id.0),
                Record::Command(row) => {
                    ids.command = row.id.0;
                    commands.push((row.clone(), fresh(row)));
                }
                Record::Stage(row) => {
                    let (_, command) = commands.iter_mut().find(|(c, _)| c.id == row.command).unwrap();
                    (command.stage, command.stage_at, command.attempt) = (row.stage, row.at, row.attempt);
                    if matches!(row.stage, Stage::Radiating | Stage::Radiated) {
                        command.on_air_at = Some(row.at);
                    }
                }
                Record::Sealed(row) => {
                    let (_, command) = commands.iter_mut().find(|(c, _)| c.id == row.command).unwrap();
                    let bytes = Arc::new(*row.bytes);
                    command.sealed =
                        Some(SealedSnapshot { key: row.key, counter: row.counter, tag: row.tag, bytes });
                    (last_tag, counter) = (Some(row.tag), counter.max(Some(row.counter)));
                }
                Record::CounterFloor(row) => counter = counter.max(Some(row.counter)),
                Record::Image(row) => {
                    ids.image = ids.image.max(row.id.0);
                    match &mut image {
                        Some(held) if held.record.id == row.id => held.record = row.clone(),
                        _ => {
                            let record = row.clone();
                            image = Some(ImageSnapshot { record, chunks: Vec::new(), conflicts: Vec::new() });
                        }
                    }
                }
                Record::Chunk(row) => {
                    let image = image.as_mut().filter(|held| held.record.id == row.image).unwrap();
                    if row.conflict {
                        image.conflicts.push(row.index);
                    } else {
                        image.chunks.push((row.index, row.data.clone()));
                    }
                }
                Record::Download(row) => {
                    ids.download = ids.download.max(row.id.0);
                    downloads.retain(|found| found.id != row.id);
                    downloads.push(row.clone());
                }
                _ => {}
            }
        }
        downloads.retain(|found| found.state == DownloadState::Active);
        let open = |c: &CommandSnapshot| !c.stage.is_final() || c.stage == Stage::Unknown;
        Snapshot {
            recent: Vec::new(),
            last_ids: ids,
            satellites: vec![SatelliteSnapshot {
                satellite: self.satellite.clone(),
                last_tag,
                commands: commands.into_iter().map(|(_, c)| c).filter(open).collect(),
                image,
                downloads,
                limits: Vec::new(),
                heartbeat: None,
                elements,
                pass: pass.filter(|pass| pass.ended_at.is_none()),
            }]
            .into_iter()
            .chain(of_others.into_iter().map(|(satellite, elements)| SatelliteSnapshot {
                satellite,
                last_tag: None,
                commands: Vec::new(),
                image: None,
                downloads: Vec::new(),
                limits: Vec::new(),
                heartbeat: None,
                elements,
                pass: None,
            }))
            .collect(),
            plans: plans.into_iter().filter(|plan| plan.withdrawn_at.is_none()).collect(),
            runs: {
                let ended = runs.iter().filter(|run| run.state == mission::run::RunState::Ended);
                let newest = ended.map(|run| run.id).max();
                let wanted = |run: &mission::run::RunRecord| {
                    !run.state.is_final() || is_later(run) || Some(run.id) == newest
                };
                runs.sort_by_key(|run| run.id);
                runs.into_iter().filter(wanted).collect()
            },
            keys: vec![KeySnapshot { key: self.key(), counter, witness: self.witness.clone() }],
        }
    }
}

fn fresh(row: &CommandRecord) -> CommandSnapshot {
    CommandSnapshot {
        record: row.clone(),
        stage: Stage::Queued,
        stage_at: row.created_at,
        attempt: 0,
        on_air_at: None,
        sealed: None,
    }
}

fn is_later(run: &mission::run::RunRecord) -> bool {
    run.progress.end == Some(mission::plan::RunEnd::Later)
}
