//! A row of a timeline: its items in order of time, so that a frame looks at those in view and no others, however many
//! there are.

use jiff::Timestamp;

use crate::level::Level;

/// What an item is, and so how it looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// The satellite above the horizon; quality 0 to 1 is drawn as height and strength.
    Pass {
        /// 0 hardly worth it, 1 overhead.
        quality: f32,
    },
    /// A plan that waits.
    Plan,
    /// A plan that runs or ran.
    Run,
    /// Frames were heard.
    Contact,
    /// Something was sent.
    Command,
    /// An alarm held.
    Alarm(Level),
}

/// Something that lasts from a start to an end.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// By which its owner knows it; unique in its lane.
    pub id: String,
    /// From.
    pub start: Timestamp,
    /// To; the start itself for a moment.
    pub end: Timestamp,
    /// What it is.
    pub kind: Kind,
    /// A few words, shown where there is room.
    pub label: String,
    /// What is told when the pointer rests on it.
    pub hover: String,
    /// Why it cannot be as it is; drawn hatched, told on hovering.
    pub conflict: Option<String>,
    /// Whether it can be taken and dropped on another one.
    pub can_be_dragged: bool,
}

/// A row with its items.
#[derive(Debug, Clone, Default)]
pub struct Lane {
    name: String,
    takes_drops: bool,
    items: Vec<Item>,
    /// The latest end of all items up to this one, seconds.
    latest_end_s: Vec<f64>,
    /// How many items before this one are alarms of each level, and how many have a conflict; one longer than `items`.
    counts: Vec<[u32; 6]>,
}

/// Items that begin within one place too small to tell them apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cluster {
    /// The first.
    pub first: usize,
    /// How many.
    pub count: usize,
    /// The worst alarm among them.
    pub worst: Option<Level>,
    /// Whether one has a conflict.
    pub has_conflict: bool,
    /// The latest end, seconds since 1970 (of the first 256).
    pub end_s: f64,
}

/// Seconds since 1970.
#[must_use]
pub fn seconds(at: Timestamp) -> f64 {
    at.as_microsecond() as f64 / 1e6
}

impl Lane {
    /// A row; the items are put in order once, here.
    #[must_use]
    pub fn new(name: impl Into<String>, mut items: Vec<Item>) -> Self {
        items.sort_by(|a, b| a.start.cmp(&b.start).then_with(|| a.id.cmp(&b.id)));
        let mut latest = f64::NEG_INFINITY;
        let latest_end_s = items.iter().map(|item| {
            latest = latest.max(seconds(item.end.max(item.start)));
            latest
        });
        let latest_end_s = latest_end_s.collect();
        let mut counts = vec![[0; 6]];
        let mut sum = [0_u32; 6];
        for item in &items {
            if let Kind::Alarm(level) = item.kind
                && let Some(count) = sum.get_mut(level.index())
            {
                *count += 1;
            }
            sum[5] += u32::from(item.conflict.is_some());
            counts.push(sum);
        }
        Self { name: name.into(), takes_drops: false, items, latest_end_s, counts }
    }

    /// Its items take what is dragged onto them.
    #[must_use]
    pub fn taking_drops(mut self) -> Self {
        self.takes_drops = true;
        self
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether its items take what is dragged onto them.
    #[must_use]
    pub fn takes_drops(&self) -> bool {
        self.takes_drops
    }

    /// Its items by their start.
    #[must_use]
    pub fn items(&self) -> &[Item] {
        &self.items
    }

    /// Looks at what is in view: single items, or clusters of those that begin within `grain_s` seconds of each other
    /// when there are more than eight of them.
    pub fn in_view(&self, start_s: f64, end_s: f64, grain_s: f64, mut see: impl FnMut(Cluster)) {
        let mut at = self.latest_end_s.partition_point(|latest| *latest < start_s);
        while let Some(item) = self.items.get(at) {
            let begin_s = seconds(item.start);
            if begin_s > end_s {
                return;
            }
            let rest = self.items.get(at..).unwrap_or_default();
            let near = rest.partition_point(|item| seconds(item.start) < begin_s + grain_s).max(1);
            let count = if near > 8 { near } else { 1 };
            see(self.cluster(at, count));
            at += count;
        }
    }

    fn cluster(&self, first: usize, count: usize) -> Cluster {
        let (before, after) = (self.counts.get(first), self.counts.get(first + count));
        let among = |index: usize| match (
            before.and_then(|all| all.get(index)),
            after.and_then(|all| all.get(index)),
        ) {
            (Some(before), Some(after)) => after > before,
            _ => false,
        };
        let end_s = self.items.iter().skip(first).take(count.min(256)).map(|item| seconds(item.end));
        Cluster {
            first,
            count,
            worst: Level::ALL.into_iter().rev().find(|level| among(level.index())),
            has_conflict: among(5),
            end_s: end_s.fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn lane(spans: &[(i64, i64, usize)]) -> Lane {
        let items = spans.iter().enumerate().map(|(index, (start, length, level))| Item {
            id: index.to_string(),
            start: Timestamp::from_second(*start).unwrap(),
            end: Timestamp::from_second(start + length).unwrap(),
            kind: Level::ALL.get(*level).map_or(Kind::Contact, |level| Kind::Alarm(*level)),
            label: String::new(),
            hover: String::new(),
            conflict: None,
            can_be_dragged: false,
        });
        Lane::new("test", items.collect())
    }

    proptest! {
        #[test]
        fn what_is_in_view_is_seen_once_and_its_worst_level_is_kept(
            spans in prop::collection::vec((0_i64..2_000, 0_i64..300, 0_usize..7), 0..200),
            start in 0_i64..2_000, length in 1_i64..1_000, grain in 0.0..50.0_f64,
        ) {
            let lane = lane(&spans);
            let (start_s, end_s) = (start as f64, (start + length) as f64);
            let mut seen = vec![0; spans.len()];
            lane.in_view(start_s, end_s, grain, |cluster| {
                let items = &lane.items()[cluster.first..cluster.first + cluster.count];
                let worst = items.iter().filter_map(|item| match item.kind { Kind::Alarm(level) => Some(level), _ => None }).max();
                assert_eq!(cluster.worst, worst);
                for times in &mut seen[cluster.first..cluster.first + cluster.count] {
                    *times += 1;
                }
            });
            for (item, times) in lane.items().iter().zip(seen) {
                prop_assert!(times <= 1);
                if seconds(item.end) >= start_s && seconds(item.start) <= end_s {
                    prop_assert_eq!(times, 1, "{:?}", item);
                }
            }
        }
    }

    #[test]
    fn two_hundred_thousand_items_are_seen_in_few_looks() {
        let spans: Vec<_> = (0..200_000).map(|index| (index, 1, 6)).collect();
        let lane = lane(&spans);
        let mut looks = 0;
        lane.in_view(0.0, 200_000.0, 400.0, |_| looks += 1);
        assert!(looks <= 501, "{looks}");
    }
}
