//! What somebody may do, and which role brings it.

use std::fmt;
use std::str::FromStr;

/// One thing that somebody may do. Handlers ask for rights, never for roles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Right {
    /// See everything that was heard, sent and planned.
    Look,
    /// Ask for telecommands and downloads, take them back, arm links, vouch for the clock, take note of alerts.
    Command,
    /// Fire telecommands that are critical.
    Critical,
    /// Hand over elements and plans, attach and arm them.
    Plan,
    /// Say yes or no to what somebody else asked for under the two-person rule.
    Approve,
    /// What outlasts a pass: confirm counters, test alerts, settings.
    ManageStation,
    /// Users, their roles, and the tokens of machines.
    ManagePeople,
}

impl Right {
    /// All rights.
    pub const ALL: [Self; 7] = [
        Self::Look,
        Self::Command,
        Self::Critical,
        Self::Plan,
        Self::Approve,
        Self::ManageStation,
        Self::ManagePeople,
    ];

    /// The word in scopes, problems and the API.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Look => "look",
            Self::Command => "command",
            Self::Critical => "critical",
            Self::Plan => "plan",
            Self::Approve => "approve",
            Self::ManageStation => "manage-station",
            Self::ManagePeople => "manage-people",
        }
    }

    /// The least role that has it.
    #[must_use]
    pub fn least_role(self) -> Role {
        Role::ALL.into_iter().find(|role| role.rights().has(self)).unwrap_or(Role::Administrator)
    }
}

impl fmt::Display for Right {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that names no right.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no right: use look, command, critical, plan, approve, manage-station or manage-people")]
pub struct NoSuchRight(String);

impl FromStr for Right {
    type Err = NoSuchRight;

    fn from_str(word: &str) -> Result<Self, NoSuchRight> {
        let shown = || NoSuchRight(word.chars().take(40).collect());
        Self::ALL.into_iter().find(|right| right.name() == word).ok_or_else(shown)
    }
}

/// A set of rights.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
pub struct Rights(u8);

impl Rights {
    /// None.
    pub const NONE: Self = Self(0);

    /// Every right.
    #[must_use]
    pub fn all() -> Self {
        Right::ALL.into_iter().collect()
    }

    /// Whether this right is among them.
    #[must_use]
    pub const fn has(self, right: Right) -> bool {
        self.0 & (1 << right as u8) != 0
    }

    /// Those of both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether all of these are among those of `other`.
    #[must_use]
    pub const fn are_within(self, other: Self) -> bool {
        self.0 & !other.0 == 0
    }

    /// Each of them.
    pub fn iter(self) -> impl Iterator<Item = Right> {
        Right::ALL.into_iter().filter(move |right| self.has(*right))
    }

    /// Their words with a blank between.
    #[must_use]
    pub fn words(self) -> String {
        self.iter().map(Right::name).collect::<Vec<_>>().join(" ")
    }

    /// Rights from words with blanks or commas between.
    ///
    /// # Errors
    /// [`NoSuchRight`] for the first word that is none.
    pub fn from_words(words: &str) -> Result<Self, NoSuchRight> {
        words.split([' ', ',']).filter(|word| !word.is_empty()).map(str::parse).collect()
    }
}

impl FromIterator<Right> for Rights {
    fn from_iter<I: IntoIterator<Item = Right>>(rights: I) -> Self {
        Self(rights.into_iter().fold(0, |set, right| set | 1 << right as u8))
    }
}

impl fmt::Debug for Rights {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Rights({})", self.words())
    }
}

/// What a user is in the team. Each role has the rights of those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// Follows.
    Viewer,
    /// Runs passes.
    Operator,
    /// Answers for the mission: approves, settles keys and counters.
    MissionLead,
    /// Lets people in.
    Administrator,
}

impl Role {
    /// All roles, rising.
    pub const ALL: [Self; 4] = [Self::Viewer, Self::Operator, Self::MissionLead, Self::Administrator];

    /// The word in the archive and the API.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Operator => "operator",
            Self::MissionLead => "mission-lead",
            Self::Administrator => "administrator",
        }
    }

    /// What it may do.
    #[must_use]
    pub fn rights(self) -> Rights {
        let rights: &[Right] = match self {
            Self::Viewer => &[Right::Look],
            Self::Operator => &[Right::Look, Right::Command, Right::Critical, Right::Plan],
            Self::MissionLead => &[
                Right::Look,
                Right::Command,
                Right::Critical,
                Right::Plan,
                Right::Approve,
                Right::ManageStation,
            ],
            Self::Administrator => &Right::ALL,
        };
        rights.iter().copied().collect()
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that names no role.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no role: use viewer, operator, mission-lead or administrator")]
pub struct NoSuchRole(String);

impl FromStr for Role {
    type Err = NoSuchRole;

    fn from_str(word: &str) -> Result<Self, NoSuchRole> {
        let shown = || NoSuchRole(word.chars().take(40).collect());
        Self::ALL.into_iter().find(|role| role.name() == word).ok_or_else(shown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_role_has_the_rights_of_those_before_it_and_more() {
        for pair in Role::ALL.windows(2) {
            assert!(pair[0].rights().are_within(pair[1].rights()), "{pair:?}");
            assert_ne!(pair[0].rights(), pair[1].rights(), "{pair:?}");
        }
        assert_eq!(Role::Administrator.rights(), Rights::all());
        assert_eq!(Right::Approve.least_role(), Role::MissionLead);
        assert_eq!(Right::Look.least_role(), Role::Viewer);
    }

    #[test]
    fn words_come_back_as_what_they_were() {
        for right in Right::ALL {
            assert_eq!(right.name().parse(), Ok(right));
        }
        for role in Role::ALL {
            assert_eq!(role.name().parse(), Ok(role));
        }
        let some = Rights::from_words("look, plan").unwrap();
        assert_eq!(some.words(), "look plan");
        assert!(some.has(Right::Plan) && !some.has(Right::Command));
        assert!(Rights::from_words("look everything").is_err());
        assert!("root".parse::<Role>().is_err());
    }
}
