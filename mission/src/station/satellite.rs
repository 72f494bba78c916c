//! One satellite as the engine sees it: its commands, its exchange, its image.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use protocol::{Answer, Counter, RequestTag, Telecommand};

use super::contact::Contact;
use super::image::Assembly;
use super::journal::Ticket;
use super::sealing::Sealer;
use super::sky::Sky;
use crate::clock::{MonoUs, Now, UtcUs};
use crate::config::Profile;
use crate::id::{CommandId, SatelliteId, TxId};
use crate::limits::LimitState;
use crate::record::{CommandRecord, DownloadRecord};
use crate::snapshot::SealedSnapshot;
use crate::stage::Stage;

/// A command that is not over, or whose outcome telemetry may still settle.
#[derive(Debug)]
pub(super) struct Command {
    pub(super) record: CommandRecord,
    pub(super) stage: Stage,
    pub(super) stage_at: UtcUs,
    pub(super) attempt: u16,
    /// The tag of the newest attempt.
    pub(super) tag: Option<RequestTag>,
    /// When the newest attempt left the antenna, or may have.
    pub(super) on_air_at: Option<UtcUs>,
    /// The same on the scale that never steps; `None` when that was in another life.
    pub(super) on_air_mono: Option<MonoUs>,
    /// What tag and time on the air were before the newest attempt, should nothing of it be radiated.
    pub(super) before: Before,
    /// Sealed in the last life and never handed over: it goes on with the same bytes.
    pub(super) sealed: Option<SealedSnapshot>,
    /// Not tried again before this.
    pub(super) not_before: MonoUs,
}

/// What was known of the attempts before the newest one.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Before {
    pub(super) tag: Option<RequestTag>,
    pub(super) on_air_at: Option<UtcUs>,
    pub(super) on_air_mono: Option<MonoUs>,
}

impl Command {
    /// What is repeated is a request whose answer was lost: one without an answer has none to lose, and its silence may
    /// be its success.
    pub(super) fn may_repeat(&self) -> bool {
        self.record.telecommand.is_idempotent()
            && self.record.telecommand.answer() != Answer::None
            && self.attempt < self.record.attempts_allowed
    }

    /// The newest attempt is on the air, or may be.
    pub(super) fn goes_on_air(&mut self, now: Now) {
        (self.on_air_at, self.on_air_mono) = (Some(now.utc), Some(now.mono));
    }

    /// Microseconds from the radiation of the newest attempt to `now`, negative when that lies before it. Measured on
    /// the scale that never steps, if it was in this life.
    pub(super) fn since_on_air_us(&self, now: Now) -> Option<i64> {
        let signed = |us: u64| i64::try_from(us).unwrap_or(i64::MAX);
        match (self.on_air_mono, self.on_air_at) {
            (Some(at), _) => Some(signed(now.mono.since(at)) - signed(at.since(now.mono))),
            (None, Some(at)) => Some(now.utc.0.saturating_sub(at.0)),
            (None, None) => None,
        }
    }
}

/// What a command sets, as a number for each thing that holds one value: of two commands with the same number, the one
/// that was radiated last is meant to hold.
pub(super) fn setting(telecommand: &Telecommand) -> Option<u32> {
    let part = |kind: u32, what: u8, part: u8| kind << 16 | u32::from(what) << 8 | u32::from(part);
    Some(match telecommand {
        Telecommand::SetDownlinkSchedule(_) => 1,
        Telecommand::SetAdcsOmegaKill
        | Telecommand::SetAdcsAttitude { .. }
        | Telecommand::SetAdcsTarget { .. }
        | Telecommand::SetAdcsAuto => 2,
        Telecommand::SetTimestamp { .. } => 3,
        Telecommand::SetTle(_) => 4,
        Telecommand::SetTransmitter { .. } => 5,
        Telecommand::SetMode { .. } => 6,
        Telecommand::SetParameter { parameter, .. } => part(7, *parameter, 0),
        Telecommand::UploadSchedule(upload) => part(8, upload.schedule, upload.part),
        Telecommand::UploadScript(upload) => part(9, upload.script, upload.part),
        Telecommand::UploadGuidance(guidance) => part(10, guidance.id, 0),
        _ => return None,
    })
}

/// A sealed frame on its way to the radio.
#[derive(Debug, Clone)]
pub(super) struct Prepared {
    pub(super) command: CommandId,
    pub(super) attempt: u16,
    pub(super) link: usize,
    pub(super) tag: RequestTag,
    pub(super) counter: Counter,
    pub(super) bytes: Arc<[u8; 240]>,
}

/// What is still needed before the bytes may be handed over. The order is the ICD's: commit, witness, transmit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    /// Counter, nonce and bytes wait for their commit.
    Sealing(Ticket),
    /// The witness is being raised; asked again at this time if that failed.
    Witnessing(Option<MonoUs>),
    /// The stage `radiating` waits for its commit.
    Marking(Ticket),
}

/// What the uplink of one satellite is doing. There is one at a time, so never two things on the air.
#[derive(Debug)]
pub(super) enum Exchange {
    /// Nothing.
    Idle,
    /// A frame is made durable, step by step.
    Preparing(Prepared, Step),
    /// The radio has the bytes.
    OnAir { frame: Prepared, tx: TxId, give_up_at: MonoUs },
    /// The satellite's answer is awaited; nothing is sent meanwhile.
    Awaiting(Awaited),
}

/// An answer that is awaited.
#[derive(Debug, Clone)]
pub(super) struct Awaited {
    pub(super) command: CommandId,
    pub(super) link: usize,
    pub(super) tag: RequestTag,
    pub(super) answer: Answer,
    /// The chunks asked for, in the order in which they will come: (first, count).
    pub(super) chunks: Vec<(u16, u16)>,
    /// Chunks that came.
    pub(super) got: u32,
    pub(super) deadline: MonoUs,
}

impl Awaited {
    /// How many chunks are still to come after this one; `None` when it was not asked for.
    pub(super) fn chunks_after(&self, index: u16) -> Option<u64> {
        let at = self.chunks.iter().position(|&(first, count)| {
            u32::from(index) >= u32::from(first) && u32::from(index) < u32::from(first) + u32::from(count)
        })?;
        let (first, count) = self.chunks[at];
        let here = u64::from(count) - 1 - u64::from(index - first);
        Some(here + self.chunks[at + 1..].iter().map(|&(_, count)| u64::from(count)).sum::<u64>())
    }
}

/// An outcome that does not hold up the uplink: told by telemetry, or by an answer long after.
#[derive(Debug, Clone)]
pub(super) struct Settling {
    pub(super) command: CommandId,
    pub(super) tag: RequestTag,
    pub(super) answer: Answer,
    /// The satellite may send its answer within this stretch.
    pub(super) busy_until: Option<(MonoUs, MonoUs)>,
    pub(super) deadline: MonoUs,
}

/// The order to bring an image home.
#[derive(Debug)]
pub(super) struct Download {
    pub(super) record: DownloadRecord,
    /// What the image is must be asked (again) before chunks are.
    pub(super) ask_info: bool,
    /// Nothing is asked before this.
    pub(super) not_before: MonoUs,
    /// ImageInfo said so many times in a row that there is no image.
    pub(super) no_image: u32,
}

/// A satellite and what the engine knows of it.
pub(super) struct Satellite {
    pub(super) id: SatelliteId,
    pub(super) profile: Profile,
    pub(super) sealer: Option<Sealer>,
    pub(super) witness_retry_at: Option<MonoUs>,
    pub(super) limits: Vec<LimitState>,
    pub(super) contact: Contact,
    pub(super) commands: BTreeMap<CommandId, Command>,
    pub(super) exchange: Exchange,
    pub(super) settling: Vec<Settling>,
    pub(super) image: Option<Assembly>,
    /// These CaptureImages of ours may have been obeyed: the next ImageInfo declares a new image.
    pub(super) captures: BTreeSet<CommandId>,
    pub(super) download: Option<Download>,
    pub(super) last_tag: Option<RequestTag>,
    /// Of the newest heartbeat: when it was heard, uptime in ms.
    pub(super) uptime: Option<(UtcUs, u32)>,
    /// The newest value of each parameter that was received live, and when.
    pub(super) readings: BTreeMap<String, (Option<f64>, MonoUs)>,
    /// Its elements and passes.
    pub(super) sky: Sky,
    /// What the uplink is doing, for people.
    pub(super) note: String,
    /// Everything but the lease of its key lets something be sent now.
    pub(super) wants_lease: bool,
    /// When the uplink wants to be looked at again.
    pub(super) wake: Option<MonoUs>,
}

impl Satellite {
    /// Commands that wait for their turn, in the order of their turn.
    pub(super) fn queue(&self) -> Vec<CommandId> {
        let mut queue: Vec<_> = self
            .commands
            .values()
            .filter(|c| matches!(c.stage, Stage::Queued | Stage::Sealed))
            // What was sealed in the last life goes first: no older counter is radiated after a newer one.
            .map(|c| (c.stage != Stage::Sealed, -i32::from(c.record.priority), c.record.id))
            .collect();
        queue.sort_unstable();
        queue.into_iter().map(|(_, _, id)| id).collect()
    }

    /// The command that is on its way or awaits its answer.
    pub(super) fn outstanding(&self) -> Option<CommandId> {
        match &self.exchange {
            Exchange::Idle => None,
            Exchange::Preparing(frame, _) | Exchange::OnAir { frame, .. } => Some(frame.command),
            Exchange::Awaiting(awaited) => Some(awaited.command),
        }
    }

    /// Something of ours is on its way to it, or its answer is.
    pub(super) fn is_on_air_or_awaits(&self) -> bool {
        matches!(self.exchange, Exchange::OnAir { .. } | Exchange::Awaiting(_))
    }

    pub(super) fn wake_at(&mut self, at: MonoUs) {
        self.wake = Some(self.wake.map_or(at, |wake| wake.min(at)));
    }
}

/// The chunks that a request names, in the order in which they come.
pub(super) fn chunks_asked(telecommand: &Telecommand, chunks_in_image: Option<u32>) -> Vec<(u16, u16)> {
    let end = chunks_in_image.unwrap_or(1 << 16).min(1 << 16);
    let cut = |first: u16, count: u16| {
        let stop = (u32::from(first) + u32::from(count)).min(end);
        let count = stop.saturating_sub(u32::from(first));
        (first, u16::try_from(count).unwrap_or(u16::MAX))
    };
    match telecommand {
        Telecommand::GetImageChunk { first, count } => vec![cut(*first, *count)],
        Telecommand::GetImageRanges(ranges) => ranges.ranges.iter().map(|r| cut(r.first, r.count)).collect(),
        _ => Vec::new(),
    }
    .into_iter()
    .filter(|&(_, count)| count > 0)
    .collect()
}
