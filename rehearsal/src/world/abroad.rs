//! Others who hear the satellite: what they report to ground, and what the satellite is told to send for them.

use mission::reception::Delivered;
use mission::{CommandIntent, Gate, Input, Intent, UtcUs};
use protocol::{DownlinkSchedule, DownlinkSlot, Telecommand};

use super::World;

/// From the command to the first scheduled transmission, and from one to the next, microseconds.
const ABROAD_US: (i64, i64) = (3_600_000_000, 1_800_000_000);
/// A pass over somebody holds no more chunks.
const SLOT_CHUNKS: u16 = 120;
/// A command that is not on the air by then is for another pass, microseconds.
const EXPIRES_US: i64 = 300_000_000;
/// Numbers of the intents, far from those of the desk.
const NUMBERS: u64 = u64::MAX / 4;

impl World {
    /// What others report by now, and what is scheduled for them.
    pub(super) fn strangers_step(&mut self) {
        if self.reports.is_time_to_schedule(self.now_us) {
            self.schedule_abroad();
        }
        let due = self.reports.due(self.now_us);
        if due.is_empty() {
            return;
        }
        let at_us = |us: u64| UtcUs(self.utc_at_zero_us + i64::try_from(us).unwrap_or(i64::MAX));
        let now = self.now().utc;
        let delivered: Vec<Delivered> = due
            .iter()
            .filter_map(|heard| heard.delivered(&self.satellite, at_us(heard.end_us), now))
            .collect();
        self.report.reported += delivered.len() as u64;
        let chunks = due.iter().filter(|heard| heard.is_chunk()).count() as u64;
        self.report.chunks_reported += chunks;
        self.report.chunks_reported_in_view += if self.in_view { chunks } else { 0 };
        self.tell(Input::Outside { delivery: self.now_us, receptions: &delivered });
    }

    /// The satellite shall send the longest gaps of the image while it is over others.
    fn schedule_abroad(&mut self) {
        let mut pieces = Vec::new();
        for (mut first, mut count) in self.store.gaps() {
            while count > 0 {
                let piece = count.min(SLOT_CHUNKS);
                pieces.push((first, piece));
                (first, count) = (first + piece, count - piece);
            }
        }
        pieces.sort_by_key(|&(first, count)| (std::cmp::Reverse(count), first));
        let now = self.now().utc;
        let mut schedule = DownlinkSchedule::default();
        for (number, &(first, count)) in (0..).zip(&pieces) {
            let time = now.plus(ABROAD_US.0 + number * ABROAD_US.1);
            let time_ms = u64::try_from(time.0 / 1_000).unwrap_or(0);
            if schedule.slots.push(DownlinkSlot { time_ms, first, count, attitude_mrp: None }).is_err() {
                break;
            }
        }
        if schedule.slots.is_empty() {
            return;
        }
        let intent = Intent::Command(CommandIntent {
            satellite: self.satellite.clone(),
            link: Some(self.link.clone()),
            telecommand: Telecommand::SetDownlinkSchedule(schedule),
            priority: 1,
            gate: Gate::Heard,
            expires_at: Some(now.plus(EXPIRES_US)),
            when: None,
            attempts_allowed: None,
            confirmation: None,
        });
        self.want(NUMBERS + self.report.passes, intent);
    }
}
