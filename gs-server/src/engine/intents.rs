//! Intents under way: each counts once, however often it is sent.

use std::collections::HashMap;

use mission::{Accepted, Intent, IntentEnvelope, IntentId, Principal, Refusal};
use tokio::sync::oneshot;

use super::handle::{Done, INTENTS, IntentError, Request};
use crate::clock::BusyToken;
use crate::storage::StoredIntent;

type Answer = oneshot::Sender<(Result<Done, IntentError>, BusyToken)>;

/// One intent and everybody who waits for it.
struct UnderWay {
    key: (Principal, String),
    digest: [u8; 32],
    /// Until it was looked up whether it was accepted before.
    intent: Option<Intent>,
    answers: Vec<Answer>,
    busy: BusyToken,
}

impl UnderWay {
    fn answer(self, result: &Result<Done, IntentError>) {
        for answer in self.answers {
            // Whoever asked may have hung up; the answer is durable all the same.
            let _ = answer.send((result.clone(), self.busy.clone()));
        }
    }
}

/// The intents under way.
#[derive(Default)]
pub(super) struct Intents {
    under_way: HashMap<IntentId, UnderWay>,
    by_key: HashMap<(Principal, String), IntentId>,
    last: u64,
}

impl Intents {
    /// Takes a request in. `Some` when it has to be looked up in storage first; otherwise it was answered, or joined
    /// the same intent that is under way already.
    pub(super) fn take(&mut self, request: Request) -> Option<(IntentId, Principal, String)> {
        let Request { principal, idempotency_key, digest, intent, answer, busy } = request;
        let key = (principal, idempotency_key);
        if let Some(same) = self.by_key.get(&key).and_then(|id| self.under_way.get_mut(id)) {
            if same.digest == digest {
                same.answers.push(answer);
            } else {
                let _ = answer.send((Err(IntentError::KeyReused), busy));
            }
            return None;
        }
        if self.under_way.len() >= INTENTS {
            let _ = answer.send((Err(IntentError::Overloaded), busy));
            return None;
        }
        self.last += 1;
        let id = IntentId(self.last);
        self.by_key.insert(key.clone(), id);
        let (principal, idempotency_key) = key.clone();
        self.under_way
            .insert(id, UnderWay { key, digest, intent: Some(intent), answers: vec![answer], busy });
        Some((id, principal, idempotency_key))
    }

    /// Storage has told whether the intent was accepted before. `Some` when it was not: then the engine is asked.
    pub(super) fn looked_up(
        &mut self,
        id: IntentId,
        found: Result<Option<StoredIntent>, ()>,
    ) -> Option<IntentEnvelope> {
        let result = match found {
            Ok(None) => {
                let this = self.under_way.get_mut(&id)?;
                let intent = this.intent.take()?;
                return Some(IntentEnvelope {
                    id,
                    principal: this.key.0.clone(),
                    idempotency_key: this.key.1.clone(),
                    digest: this.digest,
                    intent,
                });
            }
            Ok(Some(stored)) => {
                let same = self.under_way.get(&id).is_some_and(|this| this.digest == stored.digest);
                if same {
                    Ok(Done { accepted: stored.accepted, replayed: true })
                } else {
                    Err(IntentError::KeyReused)
                }
            }
            Err(()) => Err(IntentError::Storage),
        };
        self.finish(id, &result);
        None
    }

    /// The engine has answered.
    pub(super) fn reply(&mut self, id: IntentId, result: Result<Accepted, Refusal>) {
        let result =
            result.map(|accepted| Done { accepted, replayed: false }).map_err(|refusal| match refusal {
                Refusal::Stopping => IntentError::Stopping,
                other => IntentError::Refused(other),
            });
        self.finish(id, &result);
    }

    fn finish(&mut self, id: IntentId, result: &Result<Done, IntentError>) {
        if let Some(this) = self.under_way.remove(&id) {
            self.by_key.remove(&this.key);
            this.answer(result);
        }
    }
}
