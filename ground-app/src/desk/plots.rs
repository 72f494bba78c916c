//! Which plots there are and what they show.

use serde::{Deserialize, Serialize};

/// Plots that there may be.
pub const PLOTS_MAX: usize = 24;
/// Parameters that one plot may have.
pub const CURVES_MAX: usize = 8;

/// The plots.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(default)]
pub struct PlotsDesk {
    /// Each with its parameters, e.g. `heartbeat.temp`.
    pub plots: Vec<Vec<String>>,
    /// How much time they show, in seconds.
    pub length_s: f64,
    /// Their end, microseconds since 1970; `None`: now, whenever that is.
    pub to_us: Option<i64>,
    /// Passes are laid over each other, at AOS.
    pub compare: bool,
    /// Where exported files are put; `None`: the folder in which the program was begun.
    pub folder: Option<String>,
}

impl Default for PlotsDesk {
    fn default() -> Self {
        let plots = vec![
            vec!["heartbeat.temp".to_owned()],
            ["x", "y", "z"].iter().map(|axis| format!("heartbeat.omega.{axis}")).collect(),
        ];
        Self { plots, length_s: 6.0 * 3600.0, to_us: None, compare: false, folder: None }
    }
}

impl PlotsDesk {
    /// Shows it in a plot of its own, unless it is shown already.
    pub fn show(&mut self, parameter: &str) {
        let shown = self.plots.iter().flatten().any(|shown| shown == parameter);
        if !shown && self.plots.len() < PLOTS_MAX {
            self.plots.insert(0, vec![parameter.to_owned()]);
        }
    }

    /// Shows it in this plot, too; `false` when there is no room.
    pub fn add(&mut self, plot: usize, parameter: &str) -> bool {
        let Some(plot) = self.plots.get_mut(plot) else { return false };
        if plot.iter().any(|shown| shown == parameter) {
            return true;
        }
        let room = plot.len() < CURVES_MAX;
        if room {
            plot.push(parameter.to_owned());
        }
        room
    }

    /// Does not show it any more; a plot that shows nothing goes.
    pub fn remove(&mut self, plot: usize, parameter: &str) {
        if let Some(shown) = self.plots.get_mut(plot) {
            shown.retain(|shown| shown != parameter);
        }
        self.plots.retain(|plot| !plot.is_empty());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_shown_once_and_an_empty_plot_goes() {
        let mut desk = PlotsDesk::default();
        desk.show("heartbeat.rad");
        desk.show("heartbeat.rad");
        desk.show("heartbeat.omega.y");
        assert_eq!(desk.plots.len(), 3);
        assert!(desk.add(0, "heartbeat.temp") && desk.add(0, "heartbeat.temp"));
        assert_eq!(desk.plots[0], ["heartbeat.rad", "heartbeat.temp"]);
        desk.remove(0, "heartbeat.rad");
        desk.remove(0, "heartbeat.temp");
        assert_eq!(desk.plots.len(), 2);
        for number in 0..20 {
            desk.add(0, &format!("p{number}"));
        }
        assert_eq!(desk.plots[0].len(), CURVES_MAX);
    }
}
