//! Why something was not taken, in words that are counted.

/// Why a message did not become a reception.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, thiserror::Error)]
pub enum Refusal {
    /// One reception is longer than 16 KiB, or one message than 1 MiB.
    #[error("it is too long: 16 KiB are read of one reception, 1 MiB of one message")]
    TooLong,
    /// Lists in lists.
    #[error("it is nested too deeply: 32 levels are read")]
    TooDeep,
    /// It cannot be read as what it should be.
    #[error("it is malformed: it cannot be read in this format")]
    Malformed,
    /// It is something else than a report of a packet.
    #[error("it is no report of a packet")]
    NotAReport,
    /// There should be bytes, and are none.
    #[error("it has no bytes")]
    NoBytes,
    /// The bytes cannot be read: neither base64 nor hex as it should be.
    #[error("its bytes cannot be read: neither base64 nor hex")]
    BadBytes,
    /// More bytes than a packet can have.
    #[error("it has more than 256 bytes: no LoRa packet has")]
    PacketTooLong,
    /// A test packet of the network.
    #[error("it is a test packet of TinyGS")]
    TestPacket,
    /// Another satellite's, or noise.
    #[error("it is none of our satellite's: no magic where one may stand")]
    Foreign,
    /// More came at once than can be stored. Whoever sent it may send it again.
    #[error("there was no room for it: more came at once than can be stored")]
    NoRoom,
}

impl Refusal {
    /// All.
    pub const ALL: [Self; 10] = [
        Self::TooLong,
        Self::TooDeep,
        Self::Malformed,
        Self::NotAReport,
        Self::NoBytes,
        Self::BadBytes,
        Self::PacketTooLong,
        Self::TestPacket,
        Self::Foreign,
        Self::NoRoom,
    ];

    /// The word under which it is counted.
    pub const fn name(self) -> &'static str {
        match self {
            Self::TooLong => "too-long",
            Self::TooDeep => "too-deep",
            Self::Malformed => "malformed",
            Self::NotAReport => "not-a-report",
            Self::NoBytes => "no-bytes",
            Self::BadBytes => "bad-bytes",
            Self::PacketTooLong => "packet-too-long",
            Self::TestPacket => "test-packet",
            Self::Foreign => "foreign",
            Self::NoRoom => "no-room",
        }
    }
}

/// A value that was dropped, or not trusted, while the reception survives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Doubt {
    /// Latitude or longitude is no place on Earth.
    Position,
    /// The altitude is nowhere near the ground.
    Altitude,
    /// RSSI outside -200 to 50 dBm.
    Rssi,
    /// SNR outside -60 to 60 dB.
    Snr,
    /// A frequency, an offset or an error that no radio of ours has.
    Frequency,
    /// Spreading factor, bandwidth or coding rate that LoRa does not have.
    Modulation,
    /// A time before the launch, or of no calendar.
    TimeTooEarly,
    /// A time more than 60 s ahead.
    TimeInFuture,
    /// The clock of the board does not agree with the server's.
    ClockDisagrees,
    /// A value is of another type than it should be.
    WrongType,
    /// A name was too long, or held characters that are not for printing.
    Name,
}

impl Doubt {
    /// All.
    pub const ALL: [Self; 11] = [
        Self::Position,
        Self::Altitude,
        Self::Rssi,
        Self::Snr,
        Self::Frequency,
        Self::Modulation,
        Self::TimeTooEarly,
        Self::TimeInFuture,
        Self::ClockDisagrees,
        Self::WrongType,
        Self::Name,
    ];

    /// The word under which it is counted.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Altitude => "altitude",
            Self::Rssi => "rssi",
            Self::Snr => "snr",
            Self::Frequency => "frequency",
            Self::Modulation => "modulation",
            Self::TimeTooEarly => "time-too-early",
            Self::TimeInFuture => "time-in-future",
            Self::ClockDisagrees => "clock-disagrees",
            Self::WrongType => "wrong-type",
            Self::Name => "name",
        }
    }
}

/// A set of [`Doubt`]s.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Doubts(u16);

impl Doubts {
    /// Adds one.
    pub const fn add(&mut self, doubt: Doubt) {
        self.0 |= 1 << doubt as u16;
    }

    /// Whether it is in.
    pub const fn has(self, doubt: Doubt) -> bool {
        self.0 & 1 << doubt as u16 != 0
    }

    /// None is in.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Those that are in.
    pub fn iter(self) -> impl Iterator<Item = Doubt> {
        Doubt::ALL.into_iter().filter(move |doubt| self.has(*doubt))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_doubt_has_a_place_and_a_name_of_its_own() {
        let mut names: Vec<_> = Doubt::ALL.iter().map(|doubt| doubt.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Doubt::ALL.len());
        for (at, doubt) in Doubt::ALL.into_iter().enumerate() {
            assert_eq!(doubt as usize, at, "{} stands in its place", doubt.name());
            let mut doubts = Doubts::default();
            doubts.add(doubt);
            assert_eq!(doubts.iter().collect::<Vec<_>>(), [doubt]);
        }
    }
}
