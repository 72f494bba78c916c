//! What a run came to.

use std::collections::BTreeMap;

use satellite::CarriedAt;

/// Counts of one run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// The seed.
    pub seed: u64,
    /// Simulated time in seconds.
    pub simulated_s: f64,
    /// Frames that the satellite sent, all kinds.
    pub frames_sent: u64,
    /// Frames that ground stored.
    pub frames_heard: u64,
    /// Frames while the satellite was in view, both ways, and how many of them the air lost, for each ten degrees of
    /// elevation.
    pub by_elevation: [CarriedAt; 9],
    /// Requests for chunks, chunks asked for, chunks bridged.
    pub requests: u64,
    /// Chunks asked for in all requests.
    pub chunks_requested: u64,
    /// Chunks asked for although held.
    pub chunks_bridged: u64,
    /// Chunks that the satellite sent.
    pub chunks_sent: u64,
    /// Uplink frames radiated.
    pub uplinks: u64,
    /// Time on the air upwards, in seconds.
    pub airtime_up_s: f64,
    /// Time on the air downwards, in seconds.
    pub airtime_down_s: f64,
    /// The image on the ground equals the satellite's.
    pub images_equal: bool,
    /// Images that became whole.
    pub images_complete: u64,
    /// Chunks of the newest image.
    pub image_chunks: u64,
    /// Commands by their last stage.
    pub commands: BTreeMap<&'static str, u64>,
    /// Times that ground and satellite were on the air together, so that neither heard the other.
    pub collisions: u64,
    /// Times the engine was killed.
    pub kills: u64,
    /// Frames that others reported.
    pub reported: u64,
    /// Chunks that others reported.
    pub chunks_reported: u64,
    /// Those of them that were reported while the satellite was in view.
    pub chunks_reported_in_view: u64,
    /// Scheduled transmissions that the satellite began.
    pub scheduled: u64,
    /// Passes that were seen to their end.
    pub passes: u64,
    /// SHA-256 of everything that happened, as hex: equal for equal seeds.
    pub log_hash: String,
}
