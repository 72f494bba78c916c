//! The invariants, held at every step against the store and against what the satellite really did.

use std::collections::{HashMap, HashSet};
use std::fmt;

use mission::{CommandId, Stage};
use protocol::{KeyId, Nonce, SealedUplink};

use crate::store::Store;

/// What must always hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Invariant {
    /// A nonce is used once with a key.
    NonceOnce,
    /// What is on the air was in the store before, sealed, with the stage `radiating` and the witness above it.
    StoredBeforeRadiated,
    /// Counters rise on the air.
    CounterOrder,
    /// What is not idempotent is radiated once.
    AtMostOnce,
    /// Two things of ours are never on the air together, and we never send while we receive.
    OneOnAir,
    /// A command that ended agrees with what the satellite obeyed.
    HonestOutcome,
    /// A held chunk is asked for only as a bridge that was justified.
    NoHeldChunk,
    /// What is acknowledged is stored.
    AcknowledgedIsStored,
    /// Stages follow each other as they may.
    StageOrder,
    /// Queues stay bounded.
    Bounded,
    /// The image on the ground equals the satellite's.
    ImageEqual,
    /// Nothing radiates outside a pass, the licence or the contact of its plan, in a blackout, or unarmed.
    InWindow,
    /// A run that is over has a reason, was told, and stays over.
    RunTold,
    /// No run is left behind, no contact of an armed plan is without one.
    NothingLeftBehind,
}

/// Something did not hold.
#[derive(Debug, Clone)]
pub struct Violation {
    /// What.
    pub invariant: Invariant,
    /// In which world.
    pub seed: u64,
    /// When, in microseconds of simulated time.
    pub at_us: u64,
    /// How, as a sentence.
    pub detail: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "seed {} at {} us: {:?}: {}", self.seed, self.at_us, self.invariant, self.detail)
    }
}

impl std::error::Error for Violation {}

/// What was seen on the air.
#[derive(Debug, Default)]
pub(crate) struct Air {
    nonces: HashSet<(KeyId, Nonce)>,
    last_counter: u64,
    /// Attempts on the air by command.
    radiated: HashMap<CommandId, u32>,
    /// Nonces that the satellite obeyed.
    obeyed: HashSet<[u8; 12]>,
    busy_until_us: u64,
    /// Nonces of each command, for the verdict.
    of_command: HashMap<CommandId, Vec<[u8; 12]>>,
}

type Check = Result<(), (Invariant, String)>;

impl Air {
    /// A frame of ours left the antenna.
    pub(crate) fn radiated(&mut self, store: &Store, packet: &[u8], start_us: u64, end_us: u64) -> Check {
        let Some(sealed) = packet.try_into().ok().and_then(|bytes| SealedUplink::from_bytes(bytes).ok())
        else {
            return Err((
                Invariant::StoredBeforeRadiated,
                "something that is no sealed frame was radiated".into(),
            ));
        };
        let nonce = sealed.nonce();
        let Some(row) = store.sealed.get(nonce.as_bytes()) else {
            return Err((Invariant::StoredBeforeRadiated, format!("nonce {nonce:?} is not in the store")));
        };
        if *row.bytes != *sealed.as_bytes() {
            return Err((Invariant::StoredBeforeRadiated, "other bytes were radiated than stored".into()));
        }
        let command = row.command;
        let stage = store.commands.get(&command).map(|c| c.stage);
        let may_be = [Stage::Radiating, Stage::Radiated, Stage::Answered, Stage::Unknown, Stage::Queued];
        if !stage.is_some_and(|stage| may_be.contains(&stage)) {
            return Err((
                Invariant::StoredBeforeRadiated,
                format!("command {command} is {stage:?} and on the air"),
            ));
        }
        if store.witness.is_none_or(|witness| witness < row.counter) {
            return Err((
                Invariant::StoredBeforeRadiated,
                "the witness is below the counter on the air".into(),
            ));
        }
        if !self.nonces.insert((row.key, nonce)) {
            return Err((Invariant::NonceOnce, format!("nonce {nonce:?} was radiated twice")));
        }
        if row.counter.0 <= self.last_counter {
            return Err((Invariant::CounterOrder, format!("{} after {}", row.counter.0, self.last_counter)));
        }
        self.last_counter = row.counter.0;
        if start_us < self.busy_until_us {
            return Err((
                Invariant::OneOnAir,
                format!("begins at {start_us}, other ends at {}", self.busy_until_us),
            ));
        }
        self.busy_until_us = end_us;
        let times = self.radiated.entry(command).or_default();
        *times += 1;
        let allowed = store.commands.get(&command).map_or(0, |c| {
            if c.record.telecommand.is_idempotent() { u32::from(c.record.attempts_allowed) } else { 1 }
        });
        if *times > allowed {
            return Err((
                Invariant::AtMostOnce,
                format!("command {command} was radiated {times} times of {allowed}"),
            ));
        }
        self.of_command.entry(command).or_default().push(*nonce.as_bytes());
        Ok(())
    }

    /// The satellite obeyed a frame.
    pub(crate) fn obeyed(&mut self, nonce: Nonce) {
        self.obeyed.insert(*nonce.as_bytes());
    }

    /// A command reached a final stage: does the satellite agree?
    pub(crate) fn verdict(&mut self, command: CommandId, stage: Stage, what: &str) -> Check {
        let nonces = self.of_command.get(&command);
        let obeyed = nonces.is_some_and(|nonces| nonces.iter().any(|nonce| self.obeyed.contains(nonce)));
        let lie = match stage {
            Stage::Answered => !obeyed,
            Stage::Failed | Stage::Cancelled | Stage::Expired => obeyed,
            _ => false,
        };
        if stage.is_final() && stage != Stage::Unknown {
            self.of_command.remove(&command);
            self.radiated.remove(&command);
        }
        if lie {
            let did = if obeyed { "obeyed it" } else { "did not obey it" };
            return Err((
                Invariant::HonestOutcome,
                format!("command {command} ({what}) is {stage}, the satellite {did}"),
            ));
        }
        Ok(())
    }

    /// Forgets what can be radiated no more, so that memory stays flat; nonces of the last few thousand frames stay.
    pub(crate) fn forget(&mut self) {
        if self.obeyed.len() > 20_000 {
            self.obeyed.clear();
        }
    }
}
