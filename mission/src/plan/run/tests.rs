//! A world that is simple enough to be sure of, and every promise of the machine held against it.

mod cases;
mod chaos;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use protocol::Telecommand;

use super::PlanRun;
use crate::clock::{MonoUs, Now, UtcUs};
use crate::plan::*;
use crate::record::Gate;
use crate::stage::Stage;
use crate::{CommandId, DownloadId, PlanName, SatelliteId};

const S: u64 = 1_000_000;
const AOS: UtcUs = UtcUs(1_800_000_000_000_000);

fn at(s: u64) -> UtcUs {
    AOS.plus(i64::try_from(s * S).unwrap())
}

fn window(length_s: u64) -> ContactWindow {
    ContactWindow { aos: AOS, los: at(length_s) }
}

fn step(action: Action) -> Step {
    Step { action, when: Condition::default(), limit_us: None, on_failure: OnFailure::Abort }
}

fn send(telecommands: impl IntoIterator<Item = Telecommand>) -> Action {
    Action::Send(Send {
        telecommands: telecommands.into_iter().collect(),
        priority: None,
        attempts: None,
        gate: Gate::Heard,
        approval: None,
    })
}

fn plan(steps: Vec<Step>) -> Plan {
    Plan {
        name: PlanName::new("test").unwrap(),
        satellite: SatelliteId::new("pixelsat-1").unwrap(),
        priority: 3,
        worth: 1.0,
        min_pass: MinPass::default(),
        limit_us: None,
        at_los: AtLos::Stop,
        transmit: true,
        attach: None,
        steps,
    }
}

/// The engine and the sky, by hand.
struct World {
    plan: Arc<Plan>,
    run: PlanRun,
    window: ContactWindow,
    now: Now,
    elevation_deg: Option<f64>,
    heard_ago_us: Option<u64>,
    telemetry: BTreeMap<String, Reading>,
    held: bool,
    /// What is durable: what was accepted under which number, and the progress.
    asked: BTreeMap<Ordinal, AskState>,
    progress: Progress,
    stored: u64,
    /// What was wished in this life.
    wished: BTreeSet<Ordinal>,
    steps: BTreeMap<Ordinal, String>,
    notes: Vec<String>,
    next_id: u64,
}

impl World {
    fn new(plan: Plan, length_s: u64) -> Self {
        let plan = Arc::new(plan);
        Self {
            run: PlanRun::new(Arc::clone(&plan), window(length_s)),
            plan,
            window: window(length_s),
            now: Now { mono: MonoUs(5 * S), utc: AOS.plus(-10_000_000) },
            elevation_deg: Some(45.0),
            heard_ago_us: Some(0),
            telemetry: BTreeMap::new(),
            held: false,
            asked: BTreeMap::new(),
            progress: Progress::default(),
            stored: 0,
            wished: BTreeSet::new(),
            steps: BTreeMap::new(),
            notes: Vec::new(),
            next_id: 0,
        }
    }

    fn go_to(&mut self, s: u64) {
        let ahead = u64::try_from(at(s).0 - self.now.utc.0).unwrap();
        self.pass(ahead);
    }

    fn pass(&mut self, us: u64) {
        self.now = Now { mono: self.now.mono.plus(us), utc: self.now.utc.plus(i64::try_from(us).unwrap()) };
    }

    /// One call, every promise checked; what it asked for is accepted unless the process dies first.
    fn advance(&mut self, dies: bool) -> Vec<Wish> {
        let asked = self.asked.clone();
        let view = RunView {
            now: self.now,
            window: self.window,
            elevation_deg: self.elevation_deg,
            heard_ago_us: self.heard_ago_us,
            telemetry: &self.telemetry,
            asked: &asked,
            held: self.held,
        };
        let had_ended = self.run.end().is_some();
        let wishes = self.run.advance(&view);
        assert!(!had_ended || wishes.is_empty(), "it wishes after its end: {wishes:?}");
        for wish in &wishes {
            if let Wish::Command { ordinal, step, .. } | Wish::Download { ordinal, step } = wish {
                assert!(self.wished.insert(*ordinal), "asked twice in one life: {wish:?}");
                assert!(!asked.contains_key(ordinal), "asked though accepted: {wish:?}");
                assert!(
                    self.window.aos <= self.now.utc && self.now.utc < self.window.los,
                    "outside: {wish:?}"
                );
                assert!(!self.held && self.plan.transmit, "{wish:?}");
                let when = &find(&self.plan.steps, step).when;
                assert_eq!(when.holds(&view), Holds::Yes, "before its conditions hold: {wish:?}");
                let known = self.steps.entry(*ordinal).or_insert_with(|| step.clone());
                assert_eq!(known, step, "one number, two steps");
            }
            if let Wish::Cancel { ordinal, .. } = wish {
                assert!(self.wished.contains(ordinal) || asked.contains_key(ordinal), "{wish:?}");
            }
            if let Wish::Note { text, .. } = wish {
                self.notes.push(text.clone());
            }
        }
        let done = wishes.iter().filter(|wish| matches!(wish, Wish::Done(_))).count();
        assert_eq!(done == 1, !had_ended && self.run.end().is_some());
        if self.run.end().is_none() {
            assert!(self.now.utc < self.window.los, "it lives beyond LOS");
            let wakeup = self.run.next_wakeup().unwrap();
            let los = u64::try_from(self.window.los.0 - self.now.utc.0).unwrap();
            assert!(self.now.mono <= wakeup && wakeup.0 <= self.now.mono.0 + los, "{wakeup:?}");
        }
        if !dies {
            self.carry_out(&wishes);
        }
        wishes
    }

    /// One batch: what was asked for, and the progress.
    fn carry_out(&mut self, wishes: &[Wish]) {
        for wish in wishes {
            self.next_id += 1;
            match wish {
                Wish::Command { ordinal, .. } => {
                    let state = AskState::Command(CommandId(self.next_id), Stage::Queued);
                    assert_eq!(self.asked.insert(*ordinal, state), None, "accepted twice: {ordinal}");
                }
                Wish::Download { ordinal, .. } => {
                    let state = AskState::Download(DownloadId(self.next_id), DownloadView::Active);
                    assert_eq!(self.asked.insert(*ordinal, state), None, "accepted twice: {ordinal}");
                }
                Wish::Cancel { ordinal, .. } => match self.asked.get_mut(ordinal) {
                    Some(AskState::Command(_, stage @ (Stage::Queued | Stage::Sealed))) => {
                        *stage = Stage::Cancelled;
                    }
                    Some(AskState::Download(_, state @ DownloadView::Active)) => *state = DownloadView::Ended,
                    _ => {}
                },
                Wish::Note { .. } | Wish::Done(_) => {}
            }
        }
        if self.run.revision() != self.stored {
            self.stored = self.run.revision();
            self.progress = self.run.progress().clone();
        }
    }

    fn kill(&mut self) {
        self.run = PlanRun::resume(Arc::clone(&self.plan), self.window, self.progress.clone());
        self.now.mono = MonoUs(S);
        self.stored = 0;
        self.wished.clear();
    }

    fn set(&mut self, ordinal: u64, stage: Stage) {
        match self.asked.get_mut(&Ordinal(ordinal)) {
            Some(AskState::Command(_, now)) => *now = stage,
            other => panic!("{other:?}"),
        }
    }

    fn end(&self) -> Option<&RunEnd> {
        self.run.end()
    }
}

fn find<'a>(steps: &'a [Step], place: &str) -> &'a Step {
    let (first, rest) = place.split_once('.').map_or((place, None), |(first, rest)| (first, Some(rest)));
    let index: usize = first.trim_start_matches("steps[").trim_end_matches(']').parse().unwrap();
    match (rest, &steps[index].action) {
        (None, _) => &steps[index],
        (Some(rest), Action::Repeat { steps, .. }) => find(steps, rest),
        _ => panic!("{place}"),
    }
}

fn commands(wishes: &[Wish]) -> Vec<&'static str> {
    wishes
        .iter()
        .filter_map(|wish| match wish {
            Wish::Command { telecommand, .. } => Some(telecommand.name()),
            Wish::Download { .. } => Some("download"),
            Wish::Cancel { .. } => Some("cancel"),
            _ => None,
        })
        .collect()
}
