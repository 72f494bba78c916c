//! Randomness for the engine: the operating system's, or a seed's.

use mission::Entropy;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha12Rng;

/// The operating system's randomness.
#[derive(Debug, Clone, Copy, Default)]
pub struct OsEntropy;

impl OsEntropy {
    /// Makes sure that the operating system gives randomness.
    ///
    /// # Errors
    /// When it gives none; nothing can be sealed on such a machine.
    pub fn new() -> std::io::Result<Self> {
        getrandom::fill(&mut [0; 4]).map_err(|error| std::io::Error::other(error.to_string()))?;
        Ok(Self)
    }
}

impl Entropy for OsEntropy {
    #[expect(clippy::expect_used, reason = "it was there at start; without it nothing may be sealed")]
    fn fill(&mut self, bytes: &mut [u8]) {
        getrandom::fill(bytes).expect("the operating system gives randomness");
    }
}

/// Randomness from a seed, for demos and tests. Never with a real key.
#[derive(Debug, Clone)]
pub struct SeededEntropy(ChaCha12Rng);

impl SeededEntropy {
    /// The same seed, the same bytes.
    pub fn new(seed: u64) -> Self {
        Self(ChaCha12Rng::seed_from_u64(seed))
    }
}

impl Entropy for SeededEntropy {
    fn fill(&mut self, bytes: &mut [u8]) {
        self.0.fill_bytes(bytes);
    }
}
