//! The air between satellite and ground: what arrives, how strong, and how damaged. Seeded, without a clock.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use tle::UtcInstant;

use crate::{
    orbit::Orbit,
    passes::PassProfile,
    sky::{Sky, SkyLook},
};

/// Distance that [`RSSI_ZENITH_DBM`] refers to, km.
const REFERENCE_KM: f64 = 500.0;
/// Received power at 500 km, dBm: a small directional antenna on the ground, see docs/twin.md.
const RSSI_ZENITH_DBM: f64 = -106.0;
/// Extra loss at the very horizon (ground reflection, buildings), dB; gone at [`HORIZON_DEG`].
const HORIZON_LOSS_DB: f64 = 4.0;
const HORIZON_DEG: f64 = 6.0;
/// Power at which half of the frames are lost, dBm, and how sharp the edge is, dB.
const SENSITIVITY_DBM: f64 = -122.5;
const SENSITIVITY_EDGE_DB: f64 = 0.7;
/// Largest deviation of a frame's power from the mean, dB: the satellite tumbles.
const FADING_DB: f64 = 1.5;
/// Longest run of junk a receiver makes of noise, bytes.
const NOISE_MAX_LEN: usize = 24;

/// Losses that come in runs, after Gilbert and Elliott: the channel is good or bad and may change with each frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Burst {
    /// Chance for each frame that a good channel turns bad, 0..=1.
    pub enter: f64,
    /// Chance for each frame that a bad channel turns good, 0..=1. The mean burst is `1 / leave` frames.
    pub leave: f64,
    /// Chance that a frame is lost while the channel is bad, 0..=1.
    pub loss: f64,
}

/// What the channel does to frames, in both directions.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelConfig {
    /// Everything random follows from this.
    pub seed: u64,
    /// Chance that a frame is lost, independent of all others, 0..=1.
    pub loss: f64,
    /// Chance **per byte** that one of its bits is flipped; the frame is delivered nevertheless, for LoRa's own
    /// CRC may be off.
    pub flips: f64,
    /// Losses in runs, on top of `loss`.
    pub burst: Option<Burst>,
    /// Chance per downlink frame that the receiver met it in the middle: its head is missing.
    pub cut: f64,
    /// Chance per downlink frame that the receiver makes a few bytes of junk before it.
    pub noise: f64,
    /// When the satellite is in view, and how high. Fixed from [`Channel::new`] on.
    pub passes: PassProfile,
    /// Added to every frame's strength, dB: pointing, cables, polarisation, a noisy neighbourhood.
    pub level_db: f64,
    /// Whether weak signals near the horizon are lost more often. Below the horizon nothing is heard in any case.
    pub elevation_loss: bool,
}

impl Default for ChannelConfig {
    /// A clean channel in which only the horizon costs frames.
    fn default() -> Self {
        Self {
            seed: 0,
            loss: 0.0,
            flips: 0.0,
            burst: None,
            cut: 0.0,
            noise: 0.0,
            passes: PassProfile::default(),
            level_db: 0.0,
            elevation_loss: true,
        }
    }
}

impl ChannelConfig {
    /// A channel that loses nothing and always sees the satellite.
    #[must_use]
    pub fn perfect() -> Self {
        Self { passes: PassProfile::Always { elevation_deg: 60.0 }, elevation_loss: false, ..Self::default() }
    }
}

/// A frame as it arrives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reception {
    /// The bytes: possibly flipped, possibly without their head. Never empty unless the frame was.
    pub bytes: Vec<u8>,
    /// Strength at the ground, dBm.
    pub rssi_dbm: i16,
    /// Junk the receiver made of noise just before the frame.
    pub noise_before: Option<Vec<u8>>,
}

/// Why a frame did not arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LossCause {
    /// The satellite was below the horizon.
    OutOfView,
    /// Too weak at this elevation.
    Weak,
    /// In a burst.
    Burst,
    /// By the independent loss.
    Random,
}

/// What became of one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Transit {
    /// It arrived, perhaps damaged.
    Received(Reception),
    /// It did not.
    Lost(LossCause),
}

/// What the channel did so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChannelStats {
    /// Frames that arrived (both ways), damaged ones included.
    pub received: u64,
    /// Frames lost below the horizon.
    pub out_of_view: u64,
    /// Frames lost for weakness, in bursts or at random while in view, satellite to ground.
    pub lost_down: u64,
    /// The same, ground to satellite.
    pub lost_up: u64,
    /// Frames that arrived with flipped bits.
    pub flipped: u64,
    /// Frames that arrived without their head.
    pub cut: u64,
    /// Runs of junk made of noise.
    pub noise: u64,
    /// Frames while the satellite was in view, both ways, by the elevation: one count for each ten degrees, what
    /// stands below 0 (a mask may allow it) in the first.
    pub by_elevation: [CarriedAt; 9],
}

/// Frames at some elevation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CarriedAt {
    /// Sent.
    pub sent: u64,
    /// Of these lost for weakness, in bursts or at random.
    pub lost: u64,
}

/// The seeded channel.
#[derive(Clone, Debug)]
pub struct Channel {
    config: ChannelConfig,
    sky: Sky,
    rng: ChaCha8Rng,
    in_burst: bool,
    stats: ChannelStats,
}

impl Channel {
    /// A channel at its beginning, to a satellite on this orbit. `utc_at_zero` is the UTC at microsecond 0.
    #[must_use]
    pub fn new(config: ChannelConfig, orbit: &Orbit, utc_at_zero: UtcInstant) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(config.seed ^ 0x00c4_a22e_1000_0000);
        let sky = Sky::new(&config.passes, orbit, utc_at_zero);
        Self { config, sky, rng, in_burst: false, stats: ChannelStats::default() }
    }

    /// A frame on its way from the satellite to the ground.
    pub fn down(&mut self, now_us: u64, packet: &[u8]) -> Transit {
        let (mut bytes, rssi_dbm) = match self.carry(now_us, packet) {
            Ok(carried) => carried,
            Err(cause) => {
                self.stats.lost_down += u64::from(cause != LossCause::OutOfView);
                return Transit::Lost(cause);
            }
        };
        if self.chance(self.config.cut) && bytes.len() > 1 {
            let head = self.rng.random_range(1..bytes.len());
            bytes.drain(..head);
            self.stats.cut += 1;
        }
        let noise_before = self.chance(self.config.noise).then(|| {
            let mut junk = vec![0; self.rng.random_range(1..=NOISE_MAX_LEN)];
            self.rng.fill_bytes(&mut junk);
            self.stats.noise += 1;
            junk
        });
        Transit::Received(Reception { bytes, rssi_dbm, noise_before })
    }

    /// A frame on its way from the ground to the satellite. The satellite always listens, so heads are not cut.
    pub fn up(&mut self, now_us: u64, packet: &[u8]) -> Transit {
        match self.carry(now_us, packet) {
            Ok((bytes, rssi_dbm)) => Transit::Received(Reception { bytes, rssi_dbm, noise_before: None }),
            Err(cause) => {
                self.stats.lost_up += u64::from(cause != LossCause::OutOfView);
                Transit::Lost(cause)
            }
        }
    }

    /// The configuration it was made with.
    #[must_use]
    pub fn config(&self) -> &ChannelConfig {
        &self.config
    }

    /// Changes the losses while running: a rehearsal lets the weather turn. The random sequence goes on.
    pub fn config_mut(&mut self) -> &mut ChannelConfig {
        &mut self.config
    }

    /// The sky over the station.
    pub fn sky_mut(&mut self) -> &mut Sky {
        &mut self.sky
    }

    /// What it did so far.
    #[must_use]
    pub fn stats(&self) -> &ChannelStats {
        &self.stats
    }

    fn carry(&mut self, now_us: u64, packet: &[u8]) -> Result<(Vec<u8>, i16), LossCause> {
        if !self.sky.in_view(now_us) {
            self.stats.out_of_view += 1;
            return Err(LossCause::OutOfView);
        }
        let look = self.sky.look(now_us);
        let band = ((look.elevation_deg.max(0.0) / 10.0) as usize).min(8);
        self.stats.by_elevation[band].sent += 1;
        let carried = self.fade(mean_rssi_dbm(&look), packet);
        self.stats.by_elevation[band].lost += u64::from(carried.is_err());
        carried
    }

    /// What becomes of a frame of this mean strength.
    fn fade(&mut self, mean_dbm: f64, packet: &[u8]) -> Result<(Vec<u8>, i16), LossCause> {
        let power_dbm = mean_dbm + self.config.level_db + self.rng.random_range(-FADING_DB..=FADING_DB);
        if self.config.elevation_loss && self.chance(weak_loss(power_dbm)) {
            return Err(LossCause::Weak);
        }
        if let Some(burst) = self.config.burst {
            let change = if self.in_burst { burst.leave } else { burst.enter };
            self.in_burst ^= self.chance(change);
            if self.in_burst && self.chance(burst.loss) {
                return Err(LossCause::Burst);
            }
        }
        if self.chance(self.config.loss) {
            return Err(LossCause::Random);
        }
        let mut bytes = packet.to_vec();
        if self.flip(&mut bytes) {
            self.stats.flipped += 1;
        }
        self.stats.received += 1;
        Ok((bytes, power_dbm.round().clamp(-125.0, -104.0) as i16))
    }

    /// Flips single bits of bytes chosen at random; one draw decides about a frame without any.
    fn flip(&mut self, bytes: &mut [u8]) -> bool {
        let rate = self.config.flips;
        if rate.is_nan() || rate <= 0.0 {
            return false;
        }
        let none_per_byte = (1.0 - rate).max(f64::MIN_POSITIVE).ln();
        let mut at = 0_usize;
        let mut flipped = false;
        loop {
            // the gap to the next damaged byte follows the geometric distribution
            let draw: f64 = 1.0 - self.rng.random::<f64>();
            let gap = (draw.ln() / none_per_byte).min(1e6) as usize;
            at = at.saturating_add(gap);
            let Some(byte) = bytes.get_mut(at) else { return flipped };
            *byte ^= 1 << self.rng.random_range(0..8_u32);
            flipped = true;
            at += 1;
        }
    }

    /// Draws only when the outcome is open, so that a clean channel is a cheap one.
    fn chance(&mut self, probability: f64) -> bool {
        if probability > 0.0 { self.rng.random::<f64>() < probability } else { false }
    }
}

/// Mean strength at the ground, dBm: spreading over the true distance, and what the horizon takes.
#[must_use]
pub fn mean_rssi_dbm(look: &SkyLook) -> f64 {
    let spreading_db = 20.0 * (look.range_km / REFERENCE_KM).log10();
    let horizon_db = HORIZON_LOSS_DB * (1.0 - look.elevation_deg / HORIZON_DEG).clamp(0.0, 1.0);
    RSSI_ZENITH_DBM - spreading_db - horizon_db
}

/// Chance that a frame of this strength is lost.
fn weak_loss(power_dbm: f64) -> f64 {
    1.0 / (1.0 + ((power_dbm - SENSITIVITY_DBM) / SENSITIVITY_EDGE_DB).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(config: ChannelConfig) -> Channel {
        let start = UtcInstant::from_unix_us(1_790_000_000_000_000);
        Channel::new(config, &Orbit::fictional(1, start), start)
    }

    fn received(transit: Transit) -> Option<Reception> {
        match transit {
            Transit::Received(reception) => Some(reception),
            Transit::Lost(_) => None,
        }
    }

    #[test]
    fn a_perfect_channel_changes_nothing() {
        let mut channel = channel(ChannelConfig::perfect());
        for _ in 0..1000 {
            let reception = received(channel.down(0, &[7; 240])).unwrap();
            assert_eq!(reception.bytes, [7; 240]);
            assert_eq!(reception.noise_before, None);
            assert!((-125..=-104).contains(&reception.rssi_dbm));
        }
    }

    #[test]
    fn the_loss_rate_is_what_was_asked_for_both_ways() {
        let mut channel = channel(ChannelConfig { loss: 0.2, ..ChannelConfig::perfect() });
        let lost = (0..10_000).filter(|_| received(channel.down(0, &[1])).is_none()).count();
        assert!((1_850..2_150).contains(&lost), "{lost}");
        let lost = (0..10_000).filter(|_| received(channel.up(0, &[1])).is_none()).count();
        assert!((1_850..2_150).contains(&lost), "{lost}");
    }

    #[test]
    fn bursts_come_in_runs_of_the_stated_mean_length() {
        let burst = Burst { enter: 0.02, leave: 0.2, loss: 1.0 };
        let mut channel = channel(ChannelConfig { burst: Some(burst), ..ChannelConfig::perfect() });
        let lost: Vec<bool> = (0..50_000).map(|_| received(channel.down(0, &[1])).is_none()).collect();
        let total = lost.iter().filter(|&&lost| lost).count();
        let runs = lost.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        let mean = total as f64 / runs as f64;
        assert!((4.5..5.5).contains(&mean), "{mean}");
    }

    #[test]
    fn flips_hit_the_stated_share_of_bytes_by_one_bit() {
        let mut channel = channel(ChannelConfig { flips: 1e-3, ..ChannelConfig::perfect() });
        let mut bits = 0;
        for _ in 0..10_000 {
            let reception = received(channel.down(0, &[0; 240])).unwrap();
            assert!(reception.bytes.iter().all(|byte| byte.count_ones() <= 1));
            bits += reception.bytes.iter().map(|byte| byte.count_ones()).sum::<u32>();
        }
        assert!((2_200..2_600).contains(&bits), "{bits}");
    }

    #[test]
    fn the_horizon_costs_frames_and_the_zenith_does_not() {
        let at = |elevation_deg| ChannelConfig {
            passes: PassProfile::Always { elevation_deg },
            ..ChannelConfig::default()
        };
        let lost = |elevation_deg| {
            let mut channel = channel(at(elevation_deg));
            (0..2_000).filter(|_| received(channel.down(0, &[1])).is_none()).count()
        };
        assert!(lost(0.5) > 1_000);
        assert!((20..600).contains(&lost(5.0)), "{}", lost(5.0));
        assert!(lost(20.0) < 10);
        assert_eq!(lost(-1.0), 2_000);
    }

    #[test]
    fn a_weaker_link_loses_more_near_the_horizon() {
        let lost = |level_db| {
            let passes = PassProfile::Always { elevation_deg: 5.0 };
            let mut channel = channel(ChannelConfig { passes, level_db, ..ChannelConfig::default() });
            (0..2_000).filter(|_| received(channel.down(0, &[1])).is_none()).count()
        };
        assert!(lost(-4.0) > lost(0.0) + 500, "{} {}", lost(-4.0), lost(0.0));
        assert!(lost(0.0) >= lost(4.0));
    }

    #[test]
    fn cut_frames_keep_their_tail_and_noise_stands_before() {
        let config = ChannelConfig { cut: 1.0, noise: 1.0, ..ChannelConfig::perfect() };
        let mut channel = channel(config);
        let packet: Vec<u8> = (0..=239).collect();
        for _ in 0..100 {
            let reception = received(channel.down(0, &packet)).unwrap();
            assert!(packet.ends_with(&reception.bytes) && reception.bytes.len() < packet.len());
            assert!(reception.noise_before.is_some_and(|junk| !junk.is_empty()));
        }
    }

    #[test]
    fn the_same_seed_does_the_same() {
        let config =
            ChannelConfig { loss: 0.3, flips: 1e-2, cut: 0.1, noise: 0.1, ..ChannelConfig::perfect() };
        let run = |seed| {
            let mut channel = channel(ChannelConfig { seed, ..config.clone() });
            (0..200).map(|_| channel.down(0, &[5; 100])).collect::<Vec<_>>()
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }
}
