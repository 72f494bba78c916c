//! What is asked for, and which events say that it has changed.

/// What the stream cannot tell whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resource {
    /// Who the server is.
    Version,
    /// Who we are.
    Session,
    /// Open alerts.
    Alerts,
    /// Newest values.
    Latest,
    /// Passes.
    Passes,
    /// Images.
    Images,
    /// Commands.
    Commands,
    /// Schedule.
    Schedule,
    /// Plans.
    Plans,
    /// Runs.
    Runs,
    /// Events.
    Events,
    /// Frames.
    Frames,
    /// Approvals.
    Approvals,
    /// Limits.
    Limits,
    /// Parameters.
    Parameters,
    /// Downloads.
    Downloads,
    /// Rehearsals.
    Rehearsals,
    /// Elements.
    Elements,
    /// Receivers.
    Receivers,
}

impl Resource {
    /// All, those first that a window shows first.
    pub const ALL: [Self; 19] = [
        Self::Version,
        Self::Session,
        Self::Alerts,
        Self::Latest,
        Self::Passes,
        Self::Images,
        Self::Commands,
        Self::Schedule,
        Self::Plans,
        Self::Runs,
        Self::Events,
        Self::Frames,
        Self::Approvals,
        Self::Limits,
        Self::Parameters,
        Self::Downloads,
        Self::Rehearsals,
        Self::Elements,
        Self::Receivers,
    ];

    /// What an event of this kind may have changed.
    #[must_use]
    pub fn touched_by(kind: &str) -> &'static [Self] {
        match kind {
            "alert" => &[Self::Alerts],
            "image-declared" | "chunk-received" | "chunk-conflict" | "image-complete" => &[Self::Images],
            "download" => &[Self::Downloads],
            "limit" => &[Self::Limits],
            "pass" => &[Self::Passes, Self::Schedule],
            "plan" => &[Self::Plans, Self::Schedule, Self::Runs, Self::Rehearsals],
            "elements" => &[Self::Elements, Self::Passes, Self::Schedule],
            "station" => &[Self::Approvals, Self::Session],
            _ => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_stands_at_its_own_number() {
        for (index, resource) in Resource::ALL.into_iter().enumerate() {
            assert_eq!(resource as usize, index);
        }
    }
}
