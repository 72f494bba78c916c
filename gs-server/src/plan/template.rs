//! Plans to begin with, each a commented text that passes the check.

use clap::ValueEnum;
use mission::plan::approval::digest;
use protocol::Telecommand;

/// A plan to begin with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Template {
    /// Hear what the satellite says, and transmit nothing
    #[default]
    Listen,
    /// Ask whether it is well
    Status,
    /// Take a picture and bring it home
    Picture,
    /// Bring home the image that it holds
    Download,
    /// Set its clock (critical: needs an approval)
    SetClock,
}

impl Template {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Listen, Self::Status, Self::Picture, Self::Download, Self::SetClock];

    /// Whether something in it must be approved.
    pub const fn needs_approval(self) -> bool {
        matches!(self, Self::SetClock)
    }

    const fn text(self) -> &'static str {
        match self {
            Self::Listen => include_str!("templates/listen.toml"),
            Self::Status => include_str!("templates/status.toml"),
            Self::Picture => include_str!("templates/picture.toml"),
            Self::Download => include_str!("templates/download.toml"),
            Self::SetClock => include_str!("templates/set-clock.toml"),
        }
    }

    /// The text, for this satellite; approved by whom it says, where something must be approved.
    pub fn write(self, satellite: &str, approved_by: Option<&str>) -> String {
        let digest = digest(&[Telecommand::SetTimestamp { utc_ms: 0 }]);
        let text = self.text().replace("@SATELLITE@", satellite).replace("@DIGEST@", &digest);
        match approved_by {
            Some(name) => {
                let name = toml::Value::String(name.to_owned());
                text.replace(
                    "# approved_by = { name = \"@NAME@\"",
                    &format!("approved_by = {{ name = {name}"),
                )
            }
            None => text.replace("@NAME@", "who looked at it"),
        }
    }
}
