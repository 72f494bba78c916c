//! Small reports: the list of scheduled transmissions (ICD section 4) and mode machines (section 7).

use crate::wire::packet;

packet! {
    /// ScheduleInfo, 9 bytes: state of the list that SetDownlinkSchedule replaces.
    pub struct ScheduleInfo (9 bytes) {
        /// Entries stored.
        entries: u8 = ["entries"], "";
        /// Time of the next entry, ms since 1970 UTC; 0 if there is none.
        next_ms: u64 = ["next"], "ms";
    }
}

packet! {
    /// ModeReport, 25 bytes: state of an autonomous satellite's mode machine.
    pub struct ModeReport (25 bytes) {
        /// Which machine: 0 unused, 1 CHESS, 2 HERMES.
        model: u8 = ["model"], "";
        /// Its mode.
        mode: u8 = ["mode"], "";
        /// Its sub-state; 255 = none.
        substate: u8 = ["substate"], "";
        /// Triggers that hold, one per bit.
        triggers: u32 = ["triggers"], "";
        /// Time in this mode, s.
        in_mode_s: u32 = ["in_mode"], "s";
        /// Time since ground was last heard, s.
        no_comm_s: u32 = ["no_comm"], "s";
        /// Boots so far.
        boots: u32 = ["boots"], "";
        /// Schedule entries not yet run.
        schedule_left: u16 = ["schedule_left"], "";
        /// Battery, V.
        battery_v: f32 = ["battery"], "V";
    }
}
