//! Durations in fixed buckets.

use std::sync::atomic::{AtomicU64, Ordering};

/// Upper ends of the buckets, microseconds; the last bucket has none.
const BOUNDS_US: [u64; 13] = [
    100, 250, 1_000, 2_500, 5_000, 10_000, 25_000, 50_000, 100_000, 250_000, 1_000_000, 2_500_000, 10_000_000,
];

/// How often durations fell where. Never waits.
#[derive(Debug, Default)]
pub struct Histogram {
    buckets: [AtomicU64; BOUNDS_US.len() + 1],
    sum_us: AtomicU64,
}

/// A histogram at one moment, as Prometheus wants it.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Upper end in seconds, and how many durations were not longer.
    pub up_to_s: Vec<(f64, u64)>,
    /// All durations together, seconds.
    pub sum_s: f64,
    /// How many there were.
    pub count: u64,
}

impl Histogram {
    /// Counts one duration.
    pub fn observe(&self, us: u64) {
        let bucket = BOUNDS_US.partition_point(|bound| *bound < us);
        if let Some(bucket) = self.buckets.get(bucket) {
            bucket.fetch_add(1, Ordering::Relaxed);
        }
        self.sum_us.fetch_add(us, Ordering::Relaxed);
    }

    /// How it stands.
    pub fn read(&self) -> Reading {
        let mut count = 0;
        let mut up_to_s = Vec::with_capacity(BOUNDS_US.len());
        for (at, bucket) in self.buckets.iter().enumerate() {
            count += bucket.load(Ordering::Relaxed);
            if let Some(bound) = BOUNDS_US.get(at) {
                up_to_s.push((*bound as f64 / 1e6, count));
            }
        }
        Reading { up_to_s, sum_s: self.sum_us.load(Ordering::Relaxed) as f64 / 1e6, count }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_counts_in_its_bucket_and_in_all_above() {
        let histogram = Histogram::default();
        for us in [100, 101, 9_000_000, 60_000_000] {
            histogram.observe(us);
        }
        let reading = histogram.read();
        assert_eq!(reading.up_to_s[0], (0.0001, 1));
        assert_eq!(reading.up_to_s[1], (0.00025, 2));
        assert_eq!(reading.up_to_s.last(), Some(&(10.0, 3)));
        assert_eq!((reading.count, reading.sum_s), (4, 69.000_201));
    }
}
