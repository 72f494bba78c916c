//! The scheduler's inner question: options on antennas in whole seconds, at most one a job.

/// One way to serve a job: on this antenna, within `[from_s, until_s)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Choice {
    /// The passage; at most one choice of a job is taken, in one piece.
    pub(super) job: usize,
    /// The candidate it came from, for the way back.
    pub(super) candidate: usize,
    /// The antenna.
    pub(super) antenna: usize,
    pub(super) from_s: i64,
    pub(super) until_s: i64,
    /// The shortest piece that counts; at least 1, at most the length of the window.
    pub(super) min_s: i64,
    /// Millionths of a point per second kept.
    pub(super) rate: i64,
    /// Millionths of a point for being taken at all: what a promise weighs.
    pub(super) promise: i64,
}

impl Choice {
    /// The latest begin that still leaves the shortest piece.
    pub(super) const fn latest_s(&self) -> i64 {
        self.until_s - self.min_s
    }

    /// Whether it cannot be cut.
    pub(super) const fn is_rigid(&self) -> bool {
        self.min_s == self.until_s - self.from_s
    }

    /// What a piece of it is worth, promise included.
    pub(super) const fn weight(&self, start_s: i64, stop_s: i64) -> i64 {
        self.rate * (stop_s - start_s) + self.promise
    }
}

/// A piece that was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Piece {
    /// The index of the choice.
    pub(super) choice: usize,
    pub(super) start_s: i64,
    pub(super) stop_s: i64,
}

/// Choices that may stand in each other's way. Jobs and antennas are numbered from 0 without holes.
#[derive(Debug, Clone, Default)]
pub(super) struct Task {
    /// By begin.
    pub(super) choices: Vec<Choice>,
    /// From the end of one piece to the begin of the next, by antenna.
    pub(super) gap_s: Vec<i64>,
    pub(super) jobs: usize,
}

impl Task {
    /// What the pieces weigh, promises included.
    pub(super) fn weight(&self, pieces: &[Piece]) -> i64 {
        pieces.iter().map(|p| self.choices[p.choice].weight(p.start_s, p.stop_s)).sum()
    }

    /// What the pieces are worth, promises aside.
    pub(super) fn worth(&self, pieces: &[Piece]) -> i64 {
        pieces.iter().map(|p| self.choices[p.choice].rate * (p.stop_s - p.start_s)).sum()
    }

    /// From the first begin to the last end.
    pub(super) fn span_s(&self) -> (i64, i64) {
        let from = self.choices.iter().map(|c| c.from_s).min().unwrap_or(0);
        let until = self.choices.iter().map(|c| c.until_s).max().unwrap_or(from);
        (from, until)
    }

    /// The same with only these choices.
    pub(super) fn restricted(&self, kept: &[usize]) -> Self {
        let choices = kept.iter().map(|&i| self.choices[i].clone()).collect();
        Self { choices, gap_s: self.gap_s.clone(), jobs: self.jobs }
    }
}

/// An answer to a task.
#[derive(Debug, Clone, Default)]
pub(super) struct Solution {
    pub(super) pieces: Vec<Piece>,
    /// Nothing weighs more.
    pub(super) bound: i64,
}
