//! When the satellite should send its picture to strangers: a schedule of blind downlinks over the stations of the public
//! network, by what each frame may be expected to bring.
//!
//! | file | what it holds |
//! |---|---|
//! | `task` | what is asked: orbit, listeners, missing chunks, and the satellite's rules |
//! | `coverage` | who has the satellite in view when, and how likely a frame is heard |
//! | `value` | the expected number of missing chunks that come home |
//! | `search` | entries one by one, the best first, then each again among the others |
//! | `bound` | what no schedule can exceed |
//! | `history` | what the archive knows of those who heard it before |
//! | `battery` | what the transmitter may take |
//! | `pointing` | where the antenna should look |
//! | `answer` | the schedule, explained |
//!
//! The model of hearing: a station listens in a pass or it does not, with the probability of its history and of when it was
//! last seen; while it listens, each frame is heard by the margin of the link at that elevation and distance, independently.
//! So a chunk that is sent twice in one pass gains less than one that is sent in two. The expectation counts a chunk as home
//! when anybody heard it, and is exact under this model.
//!
//! What it does **not** do: send anything. The schedule goes up as a step of a plan, when somebody has looked at it.

mod answer;
mod battery;
mod bound;
mod coverage;
mod history;
mod pointing;
mod search;
mod task;
mod value;

pub use answer::{DownlinkPlan, Ear, Entry, expected_of, plan, round_robin};
pub use coverage::Coverage;
pub use history::{HeardBy, joined, listeners};
pub use task::{Battery, LISTENERS_MAX, Link, Listener, Pointing, Rules, Task, TaskError, WINDOW_DAYS_MAX};
