//! What the transmitter may take from the battery.

use super::coverage::Coverage;
use super::task::Task;
use super::value::Block;

/// Whether the battery stays above its floor with these entries.
pub(super) fn lasts(task: &Task, coverage: &Coverage, blocks: &[Block]) -> bool {
    let Some(battery) = task.battery else { return true };
    let beat_h = coverage.beat_us as f64 / 3.6e9;
    let mut sends = vec![false; coverage.beats()];
    for block in blocks {
        let end = block.end().min(sends.len());
        sends[block.start.min(end)..end].fill(true);
    }
    let mut charge_wh = battery.charge_wh.min(battery.capacity_wh);
    for (sends, lit) in sends.iter().zip(&coverage.sunlit) {
        let mut power_w = -battery.load_w;
        if *lit {
            power_w += battery.sunlit_w;
        }
        if *sends {
            power_w -= battery.transmit_w;
        }
        charge_wh = (charge_wh + power_w * beat_h).min(battery.capacity_wh);
        if *sends && charge_wh < battery.floor_wh {
            return false;
        }
    }
    true
}
