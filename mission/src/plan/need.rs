//! The least time that a plan takes: what a pass must last for it at the very least.

use protocol::{Answer, FRAME_LEN, SHORT_OVERHEAD, Telecommand};
use radio::airtime::LinkTiming;

use super::condition::Condition;
use super::step::{Action, Step};

/// The least time from AOS to the end of the last step, microseconds.
///
/// Everything goes well here: nothing is lost, no heartbeat is in the way, what is waited for is there at once, an
/// image is whole after one question.
pub fn least_us(steps: &[Step], timing: &LinkTiming) -> u64 {
    list_us(steps, timing, 0)
}

/// When these steps end at the earliest, begun at `from_us` after AOS.
pub(super) fn list_us(steps: &[Step], timing: &LinkTiming, from_us: u64) -> u64 {
    steps.iter().fold(from_us, |at_us, step| step_us(step, timing, at_us))
}

/// When this step ends at the earliest, come to at `from_us` after AOS.
pub(super) fn step_us(step: &Step, timing: &LinkTiming, from_us: u64) -> u64 {
    let begin_us = begin_us(&step.when, from_us);
    match &step.action {
        Action::Listen { for_us } => begin_us.saturating_add(*for_us),
        Action::Send(send) => send
            .telecommands
            .iter()
            .fold(begin_us, |at, command| at.saturating_add(exchange_us(command, timing))),
        Action::WaitFor { until, .. } => self::begin_us(until, begin_us),
        // Whether there is something to bring home is known after one question.
        Action::DownloadImage => begin_us.saturating_add(exchange_us(&Telecommand::GetImageInfo, timing)),
        Action::Repeat { steps, until: Some(_), .. } => list_us(steps, timing, begin_us),
        Action::Repeat { steps, until: None, at_most } => {
            let mut at_us = begin_us;
            // Only the first round can wait for a time after AOS.
            for _ in 0..(*at_most).min(2) {
                at_us = list_us(steps, timing, at_us);
            }
            let further = u64::from(at_most.saturating_sub(2));
            let round_us = list_us(steps, timing, at_us).saturating_sub(at_us);
            at_us.saturating_add(round_us.saturating_mul(further))
        }
    }
}

/// When a condition holds at the earliest.
pub(super) fn begin_us(when: &Condition, from_us: u64) -> u64 {
    from_us.max(when.after_aos_us.unwrap_or(0))
}

/// One request and the end of its shortest answer, microseconds.
pub fn exchange_us(telecommand: &Telecommand, timing: &LinkTiming) -> u64 {
    let answer = |frames: u64, len: usize| {
        timing.turn_round_us + frames.saturating_mul(timing.frame_us(len)) + timing.delivery_us(len)
    };
    let answered = match telecommand.answer() {
        Answer::None => 0,
        Answer::One(_) => answer(1, SHORT_OVERHEAD),
        Answer::Chunks => answer(chunks(telecommand), FRAME_LEN),
    };
    let extra_us = match telecommand {
        Telecommand::ExecuteTorqueProfile(profile) => profile.duration_ms().saturating_mul(1000),
        _ => 0,
    };
    timing.uplink_us().saturating_add(answered).saturating_add(extra_us)
}

/// Chunks that are asked for; the image may have fewer.
fn chunks(telecommand: &Telecommand) -> u64 {
    match telecommand {
        Telecommand::GetImageChunk { count, .. } => u64::from(*count),
        Telecommand::GetImageRanges(ranges) => ranges.ranges.iter().map(|r| u64::from(r.count)).sum(),
        _ => 0,
    }
}
