//! The expected number of missing chunks that come home.

use super::coverage::Coverage;
use super::task::Task;

/// An entry on the raster: chunks `first..first + count`, from beat `start`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Block {
    pub(super) start: usize,
    pub(super) first: u16,
    pub(super) count: u16,
}

impl Block {
    /// The first beat after it.
    pub(super) const fn end(&self) -> usize {
        self.start + self.count as usize
    }
}

/// What is lost in the k-th frame of an entry, dB: the satellite turns to nadir while it sends.
pub(super) fn losses_db(task: &Task) -> Vec<f64> {
    let beat_s = task.rules.beat_us() as f64 / 1e6;
    (0..usize::from(task.rules.chunks_max))
        .map(|k| {
            task.pointing.map_or(0.0, |pointing| {
                let turning = (-(k as f64) * beat_s / pointing.settle_s.max(1e-3)).exp();
                pointing.held_loss_db + (pointing.loose_loss_db - pointing.held_loss_db) * turning
            })
        })
        .collect()
}

/// How likely each missing chunk is still missing, after the entries so far.
#[derive(Debug, Clone)]
pub(super) struct Value {
    /// By chunk number: its place among the missing ones.
    place: Vec<Option<u32>>,
    /// By missing chunk: for each visit in which it was sent, the probability that a listener who listens missed it.
    missed: Vec<Vec<(u32, f64)>>,
    /// By missing chunk: the probability that nobody has heard it.
    pub(super) fails: Vec<f64>,
}

impl Value {
    pub(super) fn new(task: &Task) -> Self {
        let chunks = task.missing.last().map_or(0, |&last| usize::from(last) + 1);
        let mut place = vec![None; chunks];
        for (k, &chunk) in task.missing.iter().enumerate() {
            place[usize::from(chunk)] = Some(k as u32);
        }
        let count = task.missing.len();
        Self { place, missed: vec![Vec::new(); count], fails: vec![1.0; count] }
    }

    /// The place of a chunk among the missing ones.
    pub(super) fn place_of(&self, chunk: usize) -> Option<usize> {
        self.place.get(chunk).copied().flatten().map(|place| place as usize)
    }

    /// Chunks that are expected to come home.
    pub(super) fn expected(&self) -> f64 {
        self.fails.iter().map(|fail| 1.0 - fail).sum()
    }

    /// What an entry adds.
    pub(super) fn gain(&self, task: &Task, coverage: &Coverage, losses_db: &[f64], block: Block) -> f64 {
        self.frames(block)
            .map(|(k, beat, place)| {
                let factor: f64 = coverage
                    .in_view
                    .get(beat)
                    .into_iter()
                    .flatten()
                    .map(|&number| {
                        let visit = &coverage.visits[number as usize];
                        let before = self.missed[place]
                            .iter()
                            .find(|(known, _)| *known == number)
                            .map_or(1.0, |m| m.1);
                        let after = before * (1.0 - visit.heard(task, beat, losses_db[k]));
                        (1.0 - visit.listening * (1.0 - after)) / (1.0 - visit.listening * (1.0 - before))
                    })
                    .product();
                self.fails[place] * (1.0 - factor)
            })
            .sum()
    }

    /// Adds an entry.
    pub(super) fn add(&mut self, task: &Task, coverage: &Coverage, losses_db: &[f64], block: Block) {
        let frames: Vec<_> = self.frames(block).collect();
        for (k, beat, place) in frames {
            for &number in coverage.in_view.get(beat).into_iter().flatten() {
                let visit = &coverage.visits[number as usize];
                let missed = &mut self.missed[place];
                let index = missed.iter().position(|(known, _)| *known == number).unwrap_or_else(|| {
                    missed.push((number, 1.0));
                    missed.len() - 1
                });
                let before = missed[index].1;
                let after = before * (1.0 - visit.heard(task, beat, losses_db[k]));
                missed[index].1 = after;
                self.fails[place] *=
                    (1.0 - visit.listening * (1.0 - after)) / (1.0 - visit.listening * (1.0 - before));
            }
        }
    }

    /// Of all entries together.
    pub(super) fn of(task: &Task, coverage: &Coverage, losses_db: &[f64], blocks: &[Block]) -> Self {
        let mut value = Self::new(task);
        for &block in blocks {
            value.add(task, coverage, losses_db, block);
        }
        value
    }

    /// Frames of an entry that carry a missing chunk: number in the entry, beat, place among the missing.
    fn frames(&self, block: Block) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
        (0..usize::from(block.count)).filter_map(move |k| {
            self.place_of(usize::from(block.first) + k).map(|place| (k, block.start + k, place))
        })
    }
}
