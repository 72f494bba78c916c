//! Tests of the storage as a whole; each has a folder of its own.

mod audit;
mod conformance;
mod damage;
mod folder;
mod full;
mod kill;
mod plans;
mod records;
mod redecode;
mod refusals;
mod sky;
mod snapshot;
mod telemetry;

use super::{Store, StoreError, StoreOptions};

/// A store in a folder that goes away with it.
async fn fresh() -> (tempfile::TempDir, Store) {
    let parent = tempfile::tempdir().unwrap();
    let store = Store::open(options(&parent)).await.unwrap();
    (parent, store)
}

fn options(parent: &tempfile::TempDir) -> StoreOptions {
    StoreOptions {
        folder: parent.path().join("data"),
        station: Some(records::route().station),
        simulated: false,
        max_page_count: None,
        reserve_bytes: 64 * 1024,
    }
}

async fn reopen(parent: &tempfile::TempDir) -> Result<Store, StoreError> {
    Store::open(options(parent)).await
}

/// The same numbers in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: u64) -> u64 {
        // splitmix64
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % bound
    }
}
