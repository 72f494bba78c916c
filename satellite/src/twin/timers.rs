//! What happens by itself: boot, heartbeats, the end of captures and torque profiles, the schedule, faults.

use std::collections::VecDeque;

use protocol::{ErrorCode, RequestTag, ScheduleInfo, UpDecoder};

use super::{Twin, queue::Answer};
use crate::{
    Fault,
    state::{ClockSetting, StateChange},
    store::Image,
    vector::Vec3,
};

/// A scheduled transmission that is this late is not begun any more, ms.
const SCHEDULE_LATE_MAX_MS: u64 = 60_000;

/// A torque profile that is running.
#[derive(Clone, Copy, Debug)]
pub(super) struct Torque {
    pub(super) done_us: u64,
    pub(super) tag: RequestTag,
    pub(super) impulse_n_m_s: Vec3,
}

impl Twin {
    /// Switched on: the first boot, or one after a reset.
    pub(super) fn boot(&mut self, now_us: u64) {
        let change =
            StateChange::Boot { boots: self.state.boots.saturating_add(1), utc_ms: self.utc_ms(now_us) };
        self.store(now_us, change);
        self.up_again_us = now_us.saturating_add(self.config.boot_us);
        self.heartbeat_due_us = self.up_again_us.saturating_add(self.config.first_heartbeat_us);
    }

    /// Found in flight: the rhythm goes on from the boot that the state remembers, to the millisecond.
    pub(super) fn resume(&mut self, now_us: u64) {
        self.up_again_us = now_us;
        let since_boot_ms = self.utc_ms(now_us).saturating_sub(self.state.booted_utc_ms);
        let since_boot_us = since_boot_ms.saturating_mul(1000).saturating_add(now_us % 1000);
        let first_us = self.config.boot_us.saturating_add(self.config.first_heartbeat_us);
        let period_us = self.config.heartbeat_period_us.max(1);
        let until_next_us = match since_boot_us.checked_sub(first_us) {
            None => first_us - since_boot_us,
            Some(since_first_us) => period_us - since_first_us % period_us,
        };
        self.heartbeat_due_us = now_us.saturating_add(until_next_us);
    }

    /// The computer restarts: everything volatile is lost.
    pub(super) fn reset(&mut self, now_us: u64) {
        self.queue.clear();
        self.errors.clear();
        self.repeat = None;
        self.exposure = None;
        self.torque = None;
        self.schedule.clear();
        self.decoder = UpDecoder::new();
        self.boot(now_us);
        self.complain(ErrorCode::POST_SYSTEM_RESET);
    }

    /// The heartbeat that is due is taken; those that were missed are not made up for.
    pub(super) fn keep_rhythm(&mut self, now_us: u64) {
        let period_us = if self.is_battery_low {
            self.config.heartbeat_period_low_us
        } else {
            self.config.heartbeat_period_us
        }
        .max(1);
        let missed = now_us.saturating_sub(self.heartbeat_due_us) / period_us;
        self.heartbeat_due_us = self.heartbeat_due_us.saturating_add(period_us.saturating_mul(missed + 1));
    }

    /// When something happens by itself that is no transmission.
    pub(super) fn own_event_us(&self) -> Option<u64> {
        [
            self.exposure.map(|exposure| exposure.done_us),
            self.torque.map(|torque| torque.done_us),
            self.schedule_due_us(),
            self.faults.front().map(|(at_us, _)| *at_us),
        ]
        .into_iter()
        .flatten()
        .min()
    }

    /// Lets everything happen that was due until now, in order of time.
    pub(super) fn advance(&mut self, now_us: u64) {
        while let Some(at_us) = self.own_event_us().filter(|at_us| *at_us <= now_us) {
            if let Some((_, fault)) = self.faults.pop_front_if(|(due_us, _)| *due_us <= at_us) {
                self.apply_fault(at_us, fault);
            } else if let Some(exposure) = self.exposure.take_if(|exposure| exposure.done_us <= at_us) {
                self.finish_capture(at_us, exposure);
            } else if let Some(torque) = self.torque.take_if(|torque| torque.done_us <= at_us) {
                self.body.push(at_us, torque.impulse_n_m_s);
                self.answer(at_us, Some(torque.tag), Answer::AdcsInfo);
            } else {
                self.begin_scheduled(at_us, now_us);
            }
        }
    }

    pub(super) fn apply_fault(&mut self, now_us: u64, fault: Fault) {
        match fault {
            Fault::Reset => self.reset(now_us),
            Fault::Mute(on) => self.is_mute = on,
            Fault::SensorNan(on) => {
                self.is_sensor_nan = on;
                if on {
                    self.complain(ErrorCode::IMU_FAILURE);
                }
            }
            Fault::ClockUnset => {
                self.store(now_us, StateChange::Clock(None));
                self.complain(ErrorCode::RTC_FAILURE);
            }
            Fault::ClockStale { behind_ms } => {
                if let Some(clock) = self.state.clock {
                    let set_ms = clock.set_ms.saturating_sub(behind_ms);
                    self.store(now_us, StateChange::Clock(Some(ClockSetting { set_ms, ..clock })));
                }
            }
            Fault::DuplicateAnswers(on) => self.repeats_answers = on,
            Fault::LowBattery(on) => {
                self.is_battery_low = on;
                if on {
                    self.complain(ErrorCode::LOW_BATTERY);
                }
            }
        }
    }

    pub(super) fn schedule_info(&self) -> ScheduleInfo {
        ScheduleInfo {
            entries: u8::try_from(self.schedule.len()).unwrap_or(u8::MAX),
            next_ms: self.schedule.front().map_or(0, |slot| slot.time_ms),
        }
    }

    fn finish_capture(&mut self, now_us: u64, exposure: super::Exposure) {
        let taken = Image::recall(self.config.seed, &exposure.recipe, &self.config.image, self.config.camera);
        let answer = match taken {
            Some(image) => {
                self.store(now_us, StateChange::Image(exposure.recipe));
                self.image = Some(image);
                Answer::ImageInfo
            }
            None => Answer::Error(ErrorCode::CAMERA_FAILURE),
        };
        self.answer(now_us, Some(exposure.tag), answer);
    }

    /// When the next slot begins, by the satellite's own clock; never without one.
    fn schedule_due_us(&self) -> Option<u64> {
        let (slot, clock) = (self.schedule.front()?, self.state.clock?);
        let from_setting_ms = i128::from(slot.time_ms) - i128::from(clock.set_ms);
        let due_utc_ms = i128::from(clock.at_utc_ms) + from_setting_ms;
        let due_ms = due_utc_ms - i128::from(self.config.utc_at_zero_ms);
        Some(u64::try_from(due_ms.max(0)).unwrap_or(u64::MAX).saturating_mul(1000))
    }

    fn begin_scheduled(&mut self, at_us: u64, now_us: u64) {
        let (Some(slot), Some(clock)) = (self.schedule.pop_front(), self.state.clock) else { return };
        let late_ms = clock.read_ms(self.utc_ms(now_us)).saturating_sub(slot.time_ms);
        let range = self.image.as_ref().map(|image| image.range(slot.first, slot.count));
        match range.filter(|range| !range.is_empty() && late_ms <= SCHEDULE_LATE_MAX_MS) {
            Some(range) => {
                if let Some(mrp) = slot.attitude_mrp {
                    self.body.point_attitude(at_us, mrp);
                }
                self.stats.scheduled += 1;
                self.queue.push_chunks(at_us, None, VecDeque::from([range]));
            }
            None => self.complain(ErrorCode::SCHEDULED_TRANSMISSION_READ_FAILURE),
        }
    }
}
