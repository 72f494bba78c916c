//! A store in memory with the engine's own contract: a batch is taken whole or not at all.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use mission::plan::RunEnd;
use mission::record::{
    CommandRecord, DownloadRecord, DownloadState, ImageRecord, LimitRecord, PassRecord, Record, SealedRecord,
};
use mission::run::{PlanRecord, RunRecord, RunState};
use mission::snapshot::{
    CommandSnapshot, ImageSnapshot, KeySnapshot, LastIds, SatelliteSnapshot, SealedSnapshot, Snapshot,
    Witness,
};
use mission::{
    Batch, CommandId, DownloadId, ElementSet, FrameId, ImageId, PassId, PlanId, RunId, SatelliteId, Stage,
    UtcUs,
};
use protocol::{Counter, Downlink, KeyId, RequestTag};

/// A command with its last stage.
#[derive(Debug, Clone)]
pub(crate) struct StoredCommand {
    pub(crate) record: CommandRecord,
    pub(crate) stage: Stage,
    pub(crate) stage_at: UtcUs,
    pub(crate) attempt: u16,
    pub(crate) on_air_at: Option<UtcUs>,
}

/// Everything that a restart needs, and what the checks look at.
#[derive(Debug, Default)]
pub(crate) struct Store {
    pub(crate) commands: BTreeMap<CommandId, StoredCommand>,
    pub(crate) sealed: HashMap<[u8; 12], SealedRecord>,
    counters: HashSet<(KeyId, u64)>,
    pub(crate) witness: Option<Counter>,
    counter: Option<Counter>,
    last_tag: Option<RequestTag>,
    last_ids: LastIds,
    images: BTreeMap<ImageId, ImageRecord>,
    chunks: BTreeMap<u16, Box<[u8; 222]>>,
    conflicts: Vec<u16>,
    current_image: Option<ImageId>,
    downloads: BTreeMap<DownloadId, DownloadRecord>,
    limits: BTreeMap<String, LimitRecord>,
    heartbeat: Option<(FrameId, UtcUs, u32)>,
    elements: Vec<ElementSet>,
    pub(crate) passes: BTreeMap<PassId, PassRecord>,
    pub(crate) plans: BTreeMap<PlanId, PlanRecord>,
    pub(crate) runs: BTreeMap<RunId, RunRecord>,
    /// Final stages reached, by word.
    pub(crate) finals: BTreeMap<&'static str, u64>,
    pub(crate) frames: u64,
    pub(crate) events: u64,
    pub(crate) bridges: u64,
    pub(crate) images_complete: u64,
}

/// A stage that was reached in a batch.
pub(crate) struct Reached {
    pub(crate) command: CommandId,
    pub(crate) stage: Stage,
}

impl Store {
    /// Takes a batch; what stages it brought. Wrong rows are told as a sentence.
    pub(crate) fn apply(&mut self, batch: &Batch) -> Result<Vec<Reached>, String> {
        let mut reached = Vec::new();
        for record in &batch.records {
            self.take(record, &mut reached)?;
        }
        Ok(reached)
    }

    /// Takes one record of a batch.
    pub(crate) fn take(&mut self, record: &Record, reached: &mut Vec<Reached>) -> Result<(), String> {
        match record {
            Record::Frame(frame) => {
                if frame.id.0 > self.last_ids.frame {
                    self.last_ids.frame = frame.id.0;
                    self.frames += 1;
                }
                let parsed = protocol::DownFrame::parse(&frame.bytes).map_err(|e| e.to_string())?;
                if let (false, None, Ok(Downlink::Heartbeat(h))) = (frame.nested, frame.tag, parsed.packet())
                {
                    self.heartbeat = Some((frame.id, frame.heard_at, h.uptime_ms));
                }
            }
            Record::Command(command) => {
                self.last_ids.command = self.last_ids.command.max(command.id.0);
                let stored = StoredCommand {
                    record: command.clone(),
                    stage: Stage::Queued,
                    stage_at: command.created_at,
                    attempt: 0,
                    on_air_at: None,
                };
                if self.commands.insert(command.id, stored).is_some() {
                    return Err(format!("command {} twice", command.id));
                }
            }
            Record::Stage(stage) => {
                let command = self.commands.get_mut(&stage.command).ok_or("stage of no command")?;
                let idempotent = command.record.telecommand.is_idempotent();
                let first = stage.stage == Stage::Queued && stage.attempt == 0;
                if !first && !command.stage.may_be_followed_by(stage.stage, idempotent) {
                    return Err(format!(
                        "command {}: {} after {}",
                        stage.command, stage.stage, command.stage
                    ));
                }
                command.stage = stage.stage;
                command.stage_at = stage.at;
                command.attempt = stage.attempt;
                if matches!(stage.stage, Stage::Radiating | Stage::Radiated) {
                    command.on_air_at = Some(stage.at);
                }
                reached.push(Reached { command: stage.command, stage: stage.stage });
            }
            Record::Sealed(sealed) => {
                if !self.counters.insert((sealed.key, sealed.counter.0)) {
                    return Err(format!("counter {} twice", sealed.counter));
                }
                self.counter = self.counter.max(Some(sealed.counter));
                self.last_tag = Some(sealed.tag);
                if self.sealed.insert(*sealed.nonce.as_bytes(), sealed.clone()).is_some() {
                    return Err("nonce twice".to_owned());
                }
            }
            Record::CounterFloor(floor) => self.counter = self.counter.max(Some(floor.counter)),
            Record::Image(image) => {
                self.last_ids.image = self.last_ids.image.max(image.id.0);
                if self.current_image != Some(image.id) {
                    self.current_image = Some(image.id);
                    self.chunks.clear();
                    self.conflicts.clear();
                }
                let before = self.images.insert(image.id, image.clone());
                let was_complete = before.is_some_and(|image| image.completed_at.is_some());
                self.images_complete += u64::from(image.completed_at.is_some() && !was_complete);
            }
            Record::Chunk(chunk) if chunk.conflict => self.conflicts.push(chunk.index),
            Record::Chunk(chunk) => {
                if self.chunks.insert(chunk.index, chunk.data.clone()).is_some() {
                    return Err(format!("chunk {} of image {} replaced", chunk.index, chunk.image));
                }
            }
            Record::Download(download) => {
                self.last_ids.download = self.last_ids.download.max(download.id.0);
                self.downloads.insert(download.id, download.clone());
            }
            Record::Limit(limit) => {
                self.limits.insert(limit.parameter.clone(), limit.clone());
            }
            Record::Elements(set) => {
                self.last_ids.elements = self.last_ids.elements.max(set.id.0);
                self.elements.push(ElementSet { id: set.id, elements: Arc::clone(&set.elements) });
            }
            Record::Pass(pass) => {
                self.last_ids.pass = self.last_ids.pass.max(pass.id.0);
                self.passes.insert(pass.id, pass.clone());
            }
            Record::Plan(plan) => {
                self.last_ids.plan = self.last_ids.plan.max(plan.id.0);
                self.plans.insert(plan.id, plan.clone());
            }
            Record::Run(run) => {
                self.last_ids.run = self.last_ids.run.max(run.id.0);
                self.runs.insert(run.id, (**run).clone());
            }
            Record::Event(event) => {
                self.events += 1;
                self.bridges += u64::from(event.kind == mission::record::EventKind::Bridge);
            }
            Record::Reception(_)
            | Record::Outside(_)
            | Record::ReceptionRssi(_)
            | Record::Telemetry(_)
            | Record::Audit(_)
            | Record::Intent(_) => {}
        }
        Ok(())
    }

    /// What a restart begins from; without a key the satellite is only heard.
    pub(crate) fn snapshot(&self, satellite: &SatelliteId, key: Option<KeyId>) -> Snapshot {
        let open = |c: &&StoredCommand| !c.stage.is_final() || c.stage == Stage::Unknown;
        let commands = self.commands.values().filter(open).map(|c| CommandSnapshot {
            record: c.record.clone(),
            stage: c.stage,
            stage_at: c.stage_at,
            attempt: c.attempt,
            on_air_at: c.on_air_at,
            sealed: self.newest_sealed(c.record.id),
        });
        let image = self.current_image.and_then(|id| self.images.get(&id)).map(|record| ImageSnapshot {
            record: record.clone(),
            chunks: self.chunks.iter().map(|(index, data)| (*index, data.clone())).collect(),
            conflicts: self.conflicts.clone(),
        });
        let active = |d: &&DownloadRecord| d.state == DownloadState::Active;
        Snapshot {
            last_ids: self.last_ids,
            satellites: vec![SatelliteSnapshot {
                satellite: satellite.clone(),
                last_tag: self.last_tag,
                commands: commands.collect(),
                image,
                downloads: self.downloads.values().filter(active).cloned().collect(),
                limits: self.limits.values().cloned().collect(),
                heartbeat: self.heartbeat,
                elements: self.elements.clone(),
                pass: self.passes.values().rev().find(|pass| pass.ended_at.is_none()).cloned(),
            }],
            recent: Vec::new(),
            plans: self.plans.values().filter(|plan| plan.withdrawn_at.is_none()).cloned().collect(),
            runs: {
                let ended = |run: &&RunRecord| run.state == RunState::Ended;
                let newest = self.runs.values().rev().find(ended).map(|run| run.id);
                let of_plan: BTreeMap<PlanId, RunId> =
                    self.runs.values().filter(ended).map(|run| (run.plan, run.id)).collect();
                let later = |run: &RunRecord| {
                    run.progress.end == Some(RunEnd::Later) && of_plan.get(&run.plan) == Some(&run.id)
                };
                let wanted = |run: &&RunRecord| !run.state.is_final() || later(run) || Some(run.id) == newest;
                self.runs.values().filter(wanted).cloned().collect()
            },
            keys: Vec::from_iter(key.map(|key| KeySnapshot {
                key,
                counter: self.counter,
                witness: self.witness.map_or(Witness::Missing, Witness::At),
            })),
        }
    }

    fn newest_sealed(&self, command: CommandId) -> Option<SealedSnapshot> {
        let of_command = self.sealed.values().filter(|sealed| sealed.command == command);
        of_command.max_by_key(|sealed| sealed.counter).map(|sealed| SealedSnapshot {
            key: sealed.key,
            counter: sealed.counter,
            tag: sealed.tag,
            bytes: Arc::new(*sealed.bytes),
        })
    }

    /// Chunk `index` of the current image is held.
    pub(crate) fn holds(&self, index: u16) -> bool {
        self.chunks.contains_key(&index)
    }

    /// Some download is active.
    pub(crate) fn has_active_download(&self) -> bool {
        self.downloads.values().any(|d| d.state == DownloadState::Active)
    }

    /// The current image: its record, and the file when it is whole.
    pub(crate) fn image(&self) -> Option<(&ImageRecord, Option<Vec<u8>>)> {
        let record = self.images.get(&self.current_image?)?;
        let whole = record.completed_at.is_some().then(|| {
            let mut bytes: Vec<u8> = self.chunks.values().flat_map(|data| data.iter().copied()).collect();
            bytes.truncate(usize::try_from(record.size_bytes).unwrap_or(usize::MAX));
            bytes
        });
        Some((record, whole))
    }

    /// Chunks held of the current image.
    pub(crate) fn chunks_held(&self) -> u64 {
        u64::try_from(self.chunks.len()).unwrap_or(u64::MAX)
    }

    /// Gaps of the current image, first chunk and count, in their order.
    pub(crate) fn gaps(&self) -> Vec<(u16, u16)> {
        let chunks = self.image().map_or(0, |(record, _)| record.chunks);
        let mut gaps: Vec<(u16, u16)> = Vec::new();
        for index in
            (0..u16::try_from(chunks).unwrap_or(u16::MAX)).filter(|index| !self.chunks.contains_key(index))
        {
            match gaps.last_mut() {
                Some((first, count)) if *first + *count == index => *count += 1,
                _ => gaps.push((index, 1)),
            }
        }
        gaps
    }

    /// Chunks asked for, and bridged ones among them, over all downloads.
    pub(crate) fn chunks_requested(&self) -> (u64, u64, u64) {
        self.downloads.values().fold((0, 0, 0), |(requests, asked, bridged), d| {
            (
                requests + u64::from(d.requests),
                asked + u64::from(d.chunks_requested),
                bridged + u64::from(d.chunks_bridged),
            )
        })
    }

    /// Forgets commands that are over, so that memory stays flat over thousands of passes.
    pub(crate) fn forget(&mut self, now: UtcUs) {
        let day_us = 24 * 3_600 * 1_000_000;
        let old = |c: &StoredCommand| {
            (c.stage.is_final() && c.stage != Stage::Unknown) || now.0 - c.stage_at.0 > day_us
        };
        let finals = &mut self.finals;
        self.commands.retain(|_, c| {
            let keep = !(old(c) && c.stage.is_final() && now.0 - c.stage_at.0 > day_us / 24);
            if !keep {
                *finals.entry(c.stage.name()).or_default() += 1;
            }
            keep
        });
        let commands = &self.commands;
        self.sealed.retain(|_, sealed| commands.contains_key(&sealed.command));
        self.images.retain(|id, _| Some(*id) == self.current_image);
    }
}
