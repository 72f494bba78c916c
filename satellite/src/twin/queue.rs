//! Answers that wait for the transmitter.

use std::collections::VecDeque;

use protocol::{ErrorCode, ImageChunk, RequestTag};

use crate::store::Image;

/// Answers that may wait. A request that finds as many is refused; results of work that was accepted before (capture,
/// torque, schedule) and unsolicited Errors still find room, for there are few of them.
const REQUESTS_MAX: usize = 4;
const ALL_MAX: usize = REQUESTS_MAX + 12;

/// One packet to send; its contents are made when it is sent.
#[derive(Clone, Debug)]
pub(super) enum Answer {
    Pong,
    Error(ErrorCode),
    ImageInfo,
    AdcsInfo,
    ScheduleInfo,
    Heartbeat,
    Chunk(Box<ImageChunk>),
}

/// What waits: one packet, or the chunks of ranges that are known not to be empty.
#[derive(Clone, Debug)]
enum Work {
    One(Answer),
    Chunks { ranges: VecDeque<std::ops::Range<u32>> },
}

#[derive(Clone, Debug)]
struct Waiting {
    ready_us: u64,
    tag: Option<RequestTag>,
    work: Work,
}

/// First come, first served.
#[derive(Clone, Debug, Default)]
pub(super) struct Queue {
    waiting: VecDeque<Waiting>,
}

impl Queue {
    pub(super) fn is_full(&self) -> bool {
        self.waiting.len() >= REQUESTS_MAX
    }

    pub(super) fn clear(&mut self) {
        self.waiting.clear();
    }

    /// The image is gone: so are chunks that were to be sent of it. True if there were any.
    pub(super) fn drop_chunks(&mut self) -> bool {
        let before = self.waiting.len();
        self.waiting.retain(|waiting| !matches!(waiting.work, Work::Chunks { .. }));
        self.waiting.len() < before
    }

    pub(super) fn push(&mut self, ready_us: u64, tag: Option<RequestTag>, answer: Answer) {
        self.add(Waiting { ready_us, tag, work: Work::One(answer) });
    }

    /// An unsolicited packet, before everything that waits.
    pub(super) fn push_first(&mut self, ready_us: u64, answer: Answer) {
        if self.waiting.len() < ALL_MAX {
            self.waiting.push_front(Waiting { ready_us, tag: None, work: Work::One(answer) });
        }
    }

    pub(super) fn push_chunks(
        &mut self,
        ready_us: u64,
        tag: Option<RequestTag>,
        ranges: VecDeque<std::ops::Range<u32>>,
    ) {
        self.add(Waiting { ready_us, tag, work: Work::Chunks { ranges } });
    }

    pub(super) fn ready_us(&self) -> Option<u64> {
        self.waiting.front().map(|waiting| waiting.ready_us)
    }

    /// The next packet that is ready, with its tag.
    pub(super) fn next(
        &mut self,
        now_us: u64,
        image: Option<&Image>,
    ) -> Option<(Option<RequestTag>, Answer)> {
        loop {
            let waiting = self.waiting.front_mut().filter(|waiting| waiting.ready_us <= now_us)?;
            let tag = waiting.tag;
            let found = match &mut waiting.work {
                Work::One(answer) => Some(answer.clone()),
                Work::Chunks { ranges } => {
                    let chunk = next_number(ranges).and_then(|number| image?.chunk(number)).map(Box::new);
                    if ranges.iter().any(|range| !range.is_empty())
                        && let Some(chunk) = chunk
                    {
                        return Some((tag, Answer::Chunk(chunk)));
                    }
                    chunk.map(Answer::Chunk)
                }
            };
            self.waiting.pop_front();
            if let Some(answer) = found {
                return Some((tag, answer));
            }
        }
    }

    fn add(&mut self, waiting: Waiting) {
        if self.waiting.len() < ALL_MAX {
            self.waiting.push_back(waiting);
        }
    }
}

fn next_number(ranges: &mut VecDeque<std::ops::Range<u32>>) -> Option<u32> {
    while let Some(range) = ranges.front_mut() {
        if let Some(number) = range.next() {
            return Some(number);
        }
        ranges.pop_front();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_waits_until_it_is_ready_and_errors_overtake() {
        let mut queue = Queue::default();
        queue.push(10, RequestTag::new(1), Answer::Pong);
        assert!(queue.next(9, None).is_none());
        queue.push_first(10, Answer::Error(ErrorCode(32)));
        assert!(matches!(queue.next(10, None), Some((None, Answer::Error(ErrorCode(32))))));
        assert!(matches!(queue.next(10, None), Some((Some(_), Answer::Pong))));
        assert!(queue.next(10, None).is_none());
    }

    #[test]
    fn the_queue_is_bounded() {
        let mut queue = Queue::default();
        for _ in 0..100 {
            queue.push(0, None, Answer::Pong);
            queue.push_first(0, Answer::Pong);
        }
        assert_eq!(queue.waiting.len(), ALL_MAX);
        assert!(queue.is_full());
    }
}
