//! Names and numbers: a type for each thing that could be swapped by mistake.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// A name that is not one: empty, too long, or with a letter that is not allowed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{found}' is not a name: use 1 to 32 of a-z, 0-9, '-' and '_', beginning with a letter or digit")]
pub struct NameError {
    /// What was given.
    pub found: String,
}

fn check(name: &str) -> Result<(), NameError> {
    let legal = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-' || b == b'_';
    let first_legal = name.bytes().next().is_some_and(|b| b.is_ascii_lowercase() || b.is_ascii_digit());
    if first_legal && name.len() <= 32 && name.bytes().all(legal) {
        Ok(())
    } else {
        Err(NameError { found: name.chars().take(64).collect() })
    }
}

macro_rules! name {
    ($(#[$meta:meta])* $type:ident) => {
        $(#[$meta])*
        ///
        /// 1 to 32 characters of `a-z`, `0-9`, `-`, `_`. Cheap to clone.
        #[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $type(Arc<str>);

        impl $type {
            /// The name, checked.
            ///
            /// # Errors
            /// [`NameError`] when it is empty, too long or holds a character that is not allowed.
            pub fn new(name: &str) -> Result<Self, NameError> {
                check(name)?;
                Ok(Self(name.into()))
            }

            /// The name as text.
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl FromStr for $type {
            type Err = NameError;
            fn from_str(name: &str) -> Result<Self, NameError> {
                Self::new(name)
            }
        }

        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }

        impl fmt::Debug for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{}({})", stringify!($type), self.0)
            }
        }
    };
}

name!(
    /// A satellite, as the configuration calls it.
    SatelliteId
);
name!(
    /// A ground station.
    StationId
);
name!(
    /// One way to the radio: a serial port, a TCP connection, a replayed file.
    LinkId
);
name!(
    /// A plan for passes.
    PlanName
);
name!(
    /// An antenna of a ground station, with its rotator if it has one.
    AntennaId
);

macro_rules! number {
    ($(#[$meta:meta])* $type:ident) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $type(pub u64);

        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

number!(
    /// A raw frame in the archive, from 1, rising in the order of arrival.
    FrameId
);
number!(
    /// A telecommand on its way, from 1, rising.
    CommandId
);
number!(
    /// An image that the satellite declared, from 1, rising.
    ImageId
);
number!(
    /// A standing order to bring an image home, from 1, rising.
    DownloadId
);
number!(
    /// A set of mean elements of one satellite, from 1, rising in the order in which they were added.
    ElementsId
);
number!(
    /// A pass of a satellite over our station, from 1, rising.
    PassId
);
number!(
    /// A plan that was handed over, from 1, rising.
    PlanId
);
number!(
    /// An armed plan in one pass, from 1, rising.
    RunId
);
number!(
    /// An alert, from 1, rising.
    AlertId
);
number!(
    /// A batch of records that is stored whole or not at all; numbered within one life of the process.
    BatchId
);
number!(
    /// One hand-over of bytes to a radio; numbered within one life of the process.
    TxId
);
number!(
    /// One operator's intent on its way through the engine; chosen by the shell.
    IntentId
);

/// Who wants something: an operator's name, or `engine` for the machine itself.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Principal(Arc<str>);

impl Principal {
    /// The machine itself.
    pub fn engine() -> Self {
        Self("engine".into())
    }

    /// A person or a program, by name; cut at 64 characters.
    pub fn new(name: &str) -> Self {
        Self(name.chars().take(64).collect::<String>().into())
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Principal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Debug for Principal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Principal({})", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_short_and_plain() {
        assert!(SatelliteId::new("pixelsat-1").is_ok());
        for bad in ["", "PixelSat", "-x", "a b", "a/b", &"x".repeat(33)] {
            assert!(LinkId::new(bad).is_err(), "{bad}");
        }
    }
}
