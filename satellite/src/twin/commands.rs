//! What each request does (ICD section 3).

use std::collections::VecDeque;

use protocol::{ChunkRange, ErrorCode, RequestTag, Telecommand};

use super::{Twin, queue::Answer, timers::Torque};
use crate::{
    elements::are_elements,
    state::{ClockSetting, StateChange, StoredImage},
    vector::{add, scale},
};

/// A capture that is going on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exposure {
    pub(super) done_us: u64,
    pub(super) tag: RequestTag,
    pub(super) recipe: StoredImage,
}

impl Twin {
    /// Whether this satellite has the request at all, and its content makes sense to it.
    pub(super) fn is_known(&self, command: &Telecommand) -> bool {
        match command {
            Telecommand::GetImageRanges(_) => self.config.ranges,
            Telecommand::SetTle(lines) => are_elements(lines),
            // the autonomy extension: satellites of another kind
            Telecommand::SetMode { .. }
            | Telecommand::UploadSchedule(_)
            | Telecommand::GetModeReport
            | Telecommand::SetParameter { .. }
            | Telecommand::UploadScript(_)
            | Telecommand::GetEvents { .. }
            | Telecommand::UploadGuidance(_) => false,
            _ => true,
        }
    }

    pub(super) fn execute(&mut self, now_us: u64, tag: RequestTag, command: Telecommand) {
        let utc_ms = self.utc_ms(now_us);
        let answer = match command {
            Telecommand::Ping => Answer::Pong,
            Telecommand::GetImageInfo => Answer::ImageInfo,
            Telecommand::GetImageChunk { first, count } => {
                return self.send_chunks(now_us, tag, &[ChunkRange { first, count }]);
            }
            Telecommand::GetImageRanges(list) => return self.send_chunks(now_us, tag, &list.ranges),
            Telecommand::Reset => return self.reset(now_us),
            Telecommand::ExecuteTorqueProfile(profile) => {
                let impulse_n_m_s = profile.steps.iter().fold([0.0; 3], |sum, step| {
                    let seconds = f64::from(step.duration_ms) / 1000.0;
                    add(sum, scale(step.torque_n_m.map(f64::from), seconds))
                });
                let done_us = now_us.saturating_add(profile.duration_ms().saturating_mul(1000));
                // a new profile ends the one before it, whose answer is never sent
                self.torque = Some(Torque { done_us, tag, impulse_n_m_s });
                return;
            }
            Telecommand::GetAdcsInfo => Answer::AdcsInfo,
            Telecommand::CaptureImage { resolution, grey, strong_compression } => {
                if self.exposure.is_some() {
                    Answer::Error(ErrorCode::CAMERA_FAILURE)
                } else {
                    let number = self.state.next_image;
                    let recipe = StoredImage { number, resolution, grey, strong_compression };
                    return self.start_capture(now_us, tag, recipe);
                }
            }
            Telecommand::SetDownlinkSchedule(list) => {
                self.schedule = list.slots.iter().copied().collect();
                Answer::ScheduleInfo
            }
            Telecommand::SetAdcsOmegaKill => {
                self.body.kill_rotation(now_us);
                Answer::AdcsInfo
            }
            Telecommand::SetAdcsAttitude { attitude_mrp } => {
                self.body.point_attitude(now_us, attitude_mrp);
                Answer::AdcsInfo
            }
            Telecommand::SetAdcsTarget { latitude_deg, longitude_deg } => {
                self.body.point_ground(now_us, utc_ms, latitude_deg, longitude_deg);
                Answer::AdcsInfo
            }
            Telecommand::SetAdcsAuto => {
                self.body.point_nadir(now_us, utc_ms);
                Answer::AdcsInfo
            }
            Telecommand::SetTimestamp { utc_ms: set_ms } => {
                self.store(now_us, StateChange::Clock(Some(ClockSetting { set_ms, at_utc_ms: utc_ms })));
                Answer::Heartbeat
            }
            Telecommand::SetTle(_) => {
                self.store(now_us, StateChange::Elements);
                Answer::Heartbeat
            }
            Telecommand::SetTransmitter { on } => {
                self.store(now_us, StateChange::Transmitter(on));
                if !on {
                    self.queue.clear();
                    self.repeat = None;
                    return;
                }
                Answer::Heartbeat
            }
            // refused before: see `is_known`
            Telecommand::SetMode { .. }
            | Telecommand::UploadSchedule(_)
            | Telecommand::GetModeReport
            | Telecommand::SetParameter { .. }
            | Telecommand::UploadScript(_)
            | Telecommand::GetEvents { .. }
            | Telecommand::UploadGuidance(_) => Answer::Error(ErrorCode::MALFORMED_PACKET),
        };
        self.answer(now_us, Some(tag), answer);
    }

    fn send_chunks(&mut self, now_us: u64, tag: RequestTag, asked: &[ChunkRange]) {
        let Some(image) = &self.image else {
            return self.answer(now_us, Some(tag), Answer::Error(ErrorCode::CAMERA_FAILURE));
        };
        let ranges: VecDeque<_> = asked
            .iter()
            .map(|range| image.range(range.first, range.count))
            .filter(|range| !range.is_empty())
            .collect();
        if ranges.is_empty() {
            return self.answer(now_us, Some(tag), Answer::Error(ErrorCode::MALFORMED_PACKET));
        }
        self.queue.push_chunks(now_us.saturating_add(self.config.answer_delay_us), Some(tag), ranges);
    }

    /// The old image is gone the moment the camera begins.
    fn start_capture(&mut self, now_us: u64, tag: RequestTag, recipe: StoredImage) {
        self.store(now_us, StateChange::ImageErased { next_number: recipe.number });
        self.image = None;
        if self.queue.drop_chunks() {
            self.complain(ErrorCode::SCHEDULED_TRANSMISSION_READ_FAILURE);
        }
        let done_us = now_us.saturating_add(self.config.capture_us);
        self.exposure = Some(Exposure { done_us, tag, recipe });
    }
}
