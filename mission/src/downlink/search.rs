//! Entries one by one, the best first; then each is taken out and put where it is best among the others, until nothing gets
//! better.

use super::battery;
use super::coverage::Coverage;
use super::task::Task;
use super::value::{Block, Value};

/// From one tried beginning to the next, beats; the best is then looked at beat by beat.
const STRIDE: usize = 8;
/// Tried ranges of chunks for each beginning.
const RANGES_TRIED: usize = 12;
/// Ranges whose gain is computed exactly, of those tried.
const RANGES_WEIGHED: usize = 3;
/// So often everything is gone through again.
const ROUNDS: usize = 3;
/// Frames at an entry's end that bring less than this many chunks are not sent.
const WORTHLESS: f64 = 0.01;

/// The search's view of the task.
struct Search<'a> {
    task: &'a Task,
    coverage: &'a Coverage,
    losses_db: &'a [f64],
    /// Sums of the coverage up to each beat.
    sums: Vec<f64>,
    pause: usize,
}

/// The best entries that were found, in order of time.
pub(super) fn best(task: &Task, coverage: &Coverage, losses_db: &[f64]) -> Vec<Block> {
    let mut sums = vec![0.0];
    for heard in &coverage.anybody {
        sums.push(sums[sums.len() - 1] + heard);
    }
    let pause = usize::try_from(task.rules.pause_us.div_euclid(coverage.beat_us) + 1).unwrap_or(1);
    let search = Search { task, coverage, losses_db, sums, pause };
    let mut blocks = Vec::new();
    while blocks.len() < task.rules.entries_max {
        let Some((_, block)) = search.next(&blocks) else { break };
        blocks.push(block);
    }
    for _ in 0..ROUNDS {
        let mut is_better = false;
        for index in 0..blocks.len() {
            let old = blocks.remove(index);
            let others = Value::of(task, coverage, losses_db, &blocks);
            let had = others.gain(task, coverage, losses_db, old);
            let next = search.next(&blocks).filter(|(gain, _)| *gain > had + 1e-3);
            is_better |= next.is_some();
            blocks.insert(index, next.map_or(old, |(_, block)| block));
        }
        if !is_better {
            break;
        }
    }
    blocks.sort_by_key(|block| block.start);
    blocks
}

impl Search<'_> {
    /// The entry that adds most to these, with what it adds.
    fn next(&self, blocks: &[Block]) -> Option<(f64, Block)> {
        let value = Value::of(self.task, self.coverage, self.losses_db, blocks);
        let longest = self.longest(&value);
        let mut fails = value.fails.clone();
        fails.sort_by(|a, b| b.total_cmp(a));
        let worst = fails.first().copied().unwrap_or(0.0);
        let most: f64 = fails.iter().take(longest).sum();
        // Optimistic: every frame counts in full. What cannot beat the best is not looked at.
        let mut starts: Vec<(f64, usize)> = (0..self.coverage.beats())
            .step_by(STRIDE)
            .map(|start| {
                let end = (start + longest + STRIDE).min(self.coverage.beats());
                (((self.sums[end] - self.sums[start]) * worst).min(most), start)
            })
            .filter(|(hope, _)| *hope > WORTHLESS)
            .collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        // A gain within half a percent of all that can be hoped for is good enough.
        let mut best: Option<(f64, Block)> = None;
        for (hope, start) in starts {
            if best.is_some_and(|(gain, _)| gain >= 0.995 * hope) {
                break;
            }
            self.try_at(&value, blocks, start, &mut best);
        }
        let (_, rough) = best?;
        for start in rough.start.saturating_sub(STRIDE)..rough.start + STRIDE {
            self.try_at(&value, blocks, start, &mut best);
        }
        best.map(|(gain, block)| (gain, self.trimmed(&value, block))).filter(|(gain, _)| *gain > WORTHLESS)
    }

    /// The longest entry that may be of use: as far as the missing chunks reach.
    fn longest(&self, value: &Value) -> usize {
        let span = self.task.missing.first().zip(self.task.missing.last());
        let span = span.map_or(0, |(first, last)| usize::from(last - first) + 1);
        span.min(usize::from(self.task.rules.chunks_max)).min(value.fails.len().max(1) * 64)
    }

    fn try_at(&self, value: &Value, blocks: &[Block], start: usize, best: &mut Option<(f64, Block)>) {
        let room = self.room(blocks, start).min(self.longest(value));
        if room == 0 {
            return;
        }
        let missing = &self.task.missing;
        let step = missing.len().div_ceil(RANGES_TRIED).max(1);
        let last = missing.len().saturating_sub(1);
        let mut ranges: Vec<(f64, Block)> = (0..missing.len())
            .step_by(step)
            .chain([last])
            // An entry that ends with the last missing chunk as well as one that begins with a missing one.
            .flat_map(|k| {
                let before = usize::from(missing[k]).saturating_sub(room - 1);
                [usize::from(missing[k]), before.max(usize::from(missing[0]))]
            })
            .map(|first| {
                let count = room.min(usize::from(missing[last]) + 1 - first);
                let rough: f64 = (0..count)
                    .filter_map(|k| Some((k, value.place_of(first + k)?)))
                    .map(|(k, place)| self.coverage.anybody[start + k] * value.fails[place])
                    .sum();
                (rough, Block { start, first: first as u16, count: count as u16 })
            })
            .collect();
        ranges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.first.cmp(&b.1.first)));
        ranges.dedup_by_key(|(_, block)| block.first);
        for &(rough, block) in ranges.iter().take(RANGES_WEIGHED) {
            if best.is_some_and(|(gain, _)| gain >= rough * 1.25 + WORTHLESS) {
                continue;
            }
            let Some(block) = self.affordable(blocks, block) else { continue };
            let gain = value.gain(self.task, self.coverage, self.losses_db, block);
            if best.is_none_or(|(most, _)| gain > most + 1e-9) {
                *best = Some((gain, block));
            }
        }
    }

    /// How many beats are free from here on.
    fn room(&self, blocks: &[Block], start: usize) -> usize {
        let longest =
            usize::from(self.task.rules.chunks_max).min(self.coverage.beats().saturating_sub(start));
        let taken = blocks.iter().map(|block| {
            if start + self.pause > block.start && start < block.end() + self.pause {
                0
            } else if block.start >= start {
                block.start - self.pause - start
            } else {
                usize::MAX
            }
        });
        let free = taken.min().unwrap_or(usize::MAX).min(longest);
        let silent = self.coverage.is_silent[start.min(self.coverage.beats())..].iter().take(free);
        silent.take_while(|is_silent| !**is_silent).count()
    }

    /// As much of an entry as the battery can feed beside these.
    fn affordable(&self, blocks: &[Block], mut block: Block) -> Option<Block> {
        if self.task.battery.is_none() {
            return Some(block);
        }
        let mut all = blocks.to_vec();
        all.push(block);
        while !battery::lasts(self.task, self.coverage, &all) {
            block.count = block.count.saturating_sub((block.count / 8).max(1));
            if block.count == 0 {
                return None;
            }
            all.pop();
            all.push(block);
        }
        Some(block)
    }

    /// Without the frames at its ends that bring next to nothing.
    fn trimmed(&self, value: &Value, mut block: Block) -> Block {
        let brings = |block: Block, k: u16| {
            let one = Block { start: block.start + usize::from(k), first: block.first + k, count: 1 };
            value.gain(self.task, self.coverage, self.losses_db, one)
        };
        while block.count > 1 && brings(block, block.count - 1) < WORTHLESS {
            block.count -= 1;
        }
        // Frames before the first useful one only let the satellite turn to its attitude.
        while self.task.pointing.is_none() && block.count > 1 && brings(block, 0) < WORTHLESS {
            (block.start, block.first, block.count) = (block.start + 1, block.first + 1, block.count - 1);
        }
        block
    }
}
