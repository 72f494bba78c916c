//! Asking for commands, and what came of it. What is asked for is on the disk, with its key, before it leaves; without an
//! answer it is asked again under the same key, so that a click makes one command however often it is asked.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use api::client::{Client, ClientError, IdempotencyKey};
use api::{CommandRequest, GateWord, Outcome, OutcomeWord, ProblemKind};

use super::super::Scene;
use crate::desk::Asked;
use crate::link::Pending;

/// Words that are kept on what came of clicks.
const TOLD_MAX: usize = 20;
/// A click on silence without an answer is asked again under its key for so long; then it is a new one, for the same key
/// would be answered with what was done then, and nothing would be radiated. Off twice does no harm.
const CEASE_AGAIN: Duration = Duration::from_secs(5);
/// Requests that are remembered by the number of their command.
const SENT_MAX: usize = 200;

/// What came of a click.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Told {
    pub(super) is_good: bool,
    pub(super) words: String,
    /// Wrong fields, as the server names them.
    pub(super) fields: BTreeMap<String, String>,
}

/// What is on its way to the server.
#[derive(Default)]
pub(super) struct Sender {
    /// Asked for in the last frame; leaves in this one, since it is on the disk now.
    next: Vec<Asked>,
    waiting: Vec<(Asked, Pending<Outcome>)>,
    cancelling: Vec<(u64, Pending<Outcome>, Option<CommandRequest>)>,
    /// To be made anew with another priority, once the old one is withdrawn.
    pub(super) told: VecDeque<Told>,
    /// What this window asked for, by the number of the command.
    pub(super) sent: BTreeMap<u64, CommandRequest>,
    /// The last silence that was asked for and has no answer, and when.
    cease: Option<(Asked, Instant)>,
}

impl Sender {
    /// Asks for this in the next frame.
    pub(super) fn ask(&mut self, scene_desk: &mut crate::desk::Desk, asked: Asked) {
        scene_desk.is_urgent = true;
        self.next.push(asked);
    }

    /// Whether this is on its way right now.
    pub(super) fn is_asking(&self, key: &str) -> bool {
        self.next.iter().any(|asked| asked.key == key)
            || self.waiting.iter().any(|(asked, _)| asked.key == key)
    }

    /// Withdraws a command, and asks for `again` when that is done.
    pub(super) fn cancel(&mut self, scene: &Scene<'_>, id: u64, again: Option<CommandRequest>) {
        let key = IdempotencyKey::fresh();
        let question = move |client: Client| async move { client.cancel_command(id, &key).await };
        self.cancelling.push((id, scene.courier.ask(question), again));
    }

    /// Silence: the satellite's transmitter off, at once, heard or not. A click without an answer is the same again.
    pub(super) fn cease(&mut self, scene: &mut Scene<'_>) {
        let satellite = scene.satellite().map(|satellite| satellite.satellite.clone());
        let now = scene.now;
        let same = self.cease.take().filter(|(asked, at)| {
            asked.request.satellite == satellite && now.saturating_duration_since(*at) < CEASE_AGAIN
        });
        let fresh = || Asked {
            key: IdempotencyKey::fresh().as_str().to_owned(),
            server: scene.model.address.clone(),
            request: CommandRequest {
                satellite,
                link: None,
                command: "SetTransmitter".to_owned(),
                arguments: [("on".to_owned(), false.into())].into_iter().collect(),
                priority: i16::MAX,
                gate: GateWord::Blind,
                when: None,
                expires_at: None,
                attempts: None,
                confirm: None,
            },
        };
        let (asked, at) = same.unwrap_or_else(|| (fresh(), now));
        if !self.is_asking(&asked.key) {
            self.next.push(asked.clone());
        }
        self.cease = Some((asked, at));
    }

    /// Looks for answers, and sends what waits. Once a frame.
    pub(super) fn step(&mut self, scene: &mut Scene<'_>) {
        for asked in std::mem::take(&mut self.next) {
            if let Some(key) = IdempotencyKey::new(&asked.key) {
                let request = asked.request.clone();
                let question = move |client: Client| async move { client.send_command(&request, &key).await };
                self.waiting.push((asked, scene.courier.ask(question)));
            }
        }
        let mut index = 0;
        while let Some((_, pending)) = self.waiting.get(index) {
            let Some(answer) = pending.take() else {
                index += 1;
                continue;
            };
            let (asked, _) = self.waiting.remove(index);
            self.settle(scene, &asked, answer);
        }
        let mut index = 0;
        while let Some((_, pending, _)) = self.cancelling.get(index) {
            let Some(answer) = pending.take() else {
                index += 1;
                continue;
            };
            let (id, _, again) = self.cancelling.remove(index);
            match (answer, again) {
                (Ok(_), Some(request)) => {
                    // The old one cannot leave any more: a new one takes its place
                    let key = IdempotencyKey::fresh().as_str().to_owned();
                    let server = scene.model.address.clone();
                    self.next.push(Asked { key, request, server });
                    scene.courier.wake();
                }
                (Ok(_), None) => self.tell(true, format!("Command {id} is withdrawn"), BTreeMap::new()),
                (Err(error), _) => self.refused(&format!("Command {id} stays as it is"), &error),
            }
        }
    }

    fn settle(&mut self, scene: &mut Scene<'_>, asked: &Asked, answer: Result<Outcome, ClientError>) {
        let name = &asked.request.command;
        let is_known = !matches!(&answer, Err(error) if is_open(error));
        match answer {
            Ok(outcome) => {
                if let Some(id) = outcome.command {
                    self.sent.insert(id, asked.request.clone());
                    while self.sent.len() > SENT_MAX {
                        self.sent.pop_first();
                    }
                }
                let words = match (outcome.outcome, outcome.command, outcome.approval) {
                    (OutcomeWord::AwaitingApproval, _, Some(approval)) => {
                        format!("{name} waits for a second person: approval {approval}. Nothing was sent")
                    }
                    (_, Some(id), _) => format!("{name} is queued: command {id}"),
                    _ => format!("{name}: done"),
                };
                self.tell(true, words, BTreeMap::new());
            }
            Err(error) if is_known => self.refused(&format!("{name} was not sent"), &error),
            Err(error) => {
                let words = format!(
                    "{name}: no answer ({error}). It may have been taken: ask again, it stays one command"
                );
                self.tell(false, words, BTreeMap::new());
            }
        }
        if is_known {
            let drafts = &mut scene.desk.commands.drafts;
            for draft in drafts.iter_mut().filter(|draft| draft.asked.as_ref() == Some(asked)) {
                draft.asked = None;
            }
            self.cease.take_if(|(cease, _)| cease == asked);
            scene.desk.is_urgent = true;
        }
    }

    fn refused(&mut self, what: &str, error: &ClientError) {
        let fields = error.problem().map(|problem| &problem.errors[..]).unwrap_or_default();
        let short = |field: &str| field.strip_prefix("arguments.").unwrap_or(field).to_owned();
        let fields = fields.iter().map(|one| (short(&one.field), one.message.clone())).collect();
        self.tell(false, format!("{what}: {error}"), fields);
    }

    fn tell(&mut self, is_good: bool, words: String, fields: BTreeMap<String, String>) {
        if self.told.len() >= TOLD_MAX {
            self.told.pop_front();
        }
        self.told.push_back(Told { is_good, words, fields });
    }
}

/// Nobody knows whether it was done.
fn is_open(error: &ClientError) -> bool {
    match error {
        ClientError::NoAnswer { .. } | ClientError::Strange { .. } => true,
        // A server that stops may have taken it a moment before.
        ClientError::Refused(_) => matches!(
            error.kind(),
            Some(ProblemKind::Internal | ProblemKind::StorageFailing | ProblemKind::Stopping)
        ),
        ClientError::Address(_) | ClientError::Setup(_) => false,
    }
}
