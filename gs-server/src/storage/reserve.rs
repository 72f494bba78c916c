//! A file of fixed slots for raw frames while the database takes nothing.
//!
//! The room is allocated when the station starts, so a frame can be kept when the disk is full: a slot is written in
//! place and synced. Each slot carries a checksum; one that was torn by a power cut is skipped. A generation number in
//! the head says which slots count, so that emptying the reserve is one small write. When that write is torn, the
//! frames come back at the next start: twice is better than never.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::{FileExt as _, OpenOptionsExt as _};
use std::path::Path;

use mission::port::ReservedFrame;
use mission::record::{Route, Source};
use mission::{LinkId, SatelliteId, StationId, UtcUs};

/// Bytes of a slot: one sector, so that it is written whole by any disk of today.
const SLOT: usize = 512;
/// Two heads in turn: the newer one that is whole counts.
const HEADS: u64 = 2;
/// The least that makes sense: the heads and one frame.
const LEAST_BYTES: u64 = (HEADS + 1) * SLOT as u64;

const HEAD_MARK: &[u8; 8] = b"RESERVE1";

// Places in a slot. The checksum covers all that follows it.
const GENERATION: usize = 4;
const SEQUENCE: usize = 12;
const SOURCE: usize = 20;
const RSSI_KNOWN: usize = 21;
const RSSI: usize = 22;
const RECEIVED_AT: usize = 24;
const NAMES: [usize; 3] = [32, 65, 98];
const NAME_MOST: usize = 32;
const FRAME: usize = 131;
const FRAME_MOST: usize = 240;

/// Why the reserve did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum ReserveError {
    /// All slots are taken.
    #[error("the reserve for raw frames is full: frames are being lost until the database recovers")]
    Full,
    /// The configuration has none.
    #[error("there is no reserve for raw frames: its size is 0 in the configuration")]
    Absent,
    /// The disk failed.
    #[error("the reserve for raw frames could not be read or written")]
    Io(#[source] io::Error),
}

/// The reserve, open.
#[derive(Debug)]
pub struct Reserve {
    file: File,
    slots: u64,
    generation: u64,
    next: u64,
}

impl Reserve {
    /// Opens the reserve and allocates its room, at least `bytes` (and never less than it had).
    ///
    /// # Errors
    /// [`ReserveError::Io`] when there is no room or the disk fails.
    pub fn open(path: &Path, bytes: u64) -> Result<Self, ReserveError> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(path)
            .map_err(ReserveError::Io)?;
        let present = file.metadata().map_err(ReserveError::Io)?.len();
        let wanted = bytes.max(LEAST_BYTES).next_multiple_of(SLOT as u64).max(present);
        if present < wanted {
            allocate(&file, present, wanted).map_err(ReserveError::Io)?;
            if let Some(folder) = path.parent() {
                File::open(folder).and_then(|folder| folder.sync_all()).map_err(ReserveError::Io)?;
            }
        }
        let mut reserve = Self { file, slots: wanted / SLOT as u64 - HEADS, generation: 0, next: 0 };
        reserve.generation = reserve.newest_generation()?;
        for index in 0..reserve.slots {
            if reserve.slot(index)?.is_some() {
                reserve.next = index + 1;
            }
        }
        Ok(reserve)
    }

    /// How many frames it can hold.
    pub fn capacity(&self) -> u64 {
        self.slots
    }

    /// Keeps a frame; it is on the disk when this returns.
    ///
    /// # Errors
    /// [`ReserveError::Full`] when all slots are taken, [`ReserveError::Io`] when the disk fails: the slot is free
    /// again then.
    pub fn push(&mut self, frame: &ReservedFrame) -> Result<(), ReserveError> {
        if self.next >= self.slots {
            return Err(ReserveError::Full);
        }
        let Some(slot) = encode(frame, self.generation, self.next) else {
            return Err(ReserveError::Io(io::Error::new(
                io::ErrorKind::InvalidInput,
                "a frame has 1 to 240 bytes",
            )));
        };
        self.file.write_all_at(&slot, place(self.next)).map_err(ReserveError::Io)?;
        self.file.sync_data().map_err(ReserveError::Io)?;
        self.next += 1;
        Ok(())
    }

    /// All frames that it holds, oldest first; torn slots are skipped.
    ///
    /// # Errors
    /// [`ReserveError::Io`] when the disk fails.
    pub fn read_all(&mut self) -> Result<Vec<ReservedFrame>, ReserveError> {
        (0..self.next).filter_map(|index| self.slot(index).transpose()).collect()
    }

    /// Empties it.
    ///
    /// # Errors
    /// [`ReserveError::Io`] when the disk fails.
    pub fn clear(&mut self) -> Result<(), ReserveError> {
        let generation = self.generation + 1;
        let mut head = [0; SLOT];
        put(&mut head, GENERATION, &generation.to_le_bytes());
        put(&mut head, SEQUENCE, HEAD_MARK);
        stamp(&mut head);
        self.file.write_all_at(&head, (generation % HEADS) * SLOT as u64).map_err(ReserveError::Io)?;
        self.file.sync_data().map_err(ReserveError::Io)?;
        self.generation = generation;
        self.next = 0;
        Ok(())
    }

    fn newest_generation(&self) -> Result<u64, ReserveError> {
        let mut newest = 0;
        for index in 0..HEADS {
            let mut head = [0; SLOT];
            self.file.read_exact_at(&mut head, index * SLOT as u64).map_err(ReserveError::Io)?;
            if is_whole(&head) && head.get(SEQUENCE..SEQUENCE + 8) == Some(HEAD_MARK) {
                newest = newest.max(u64::from_le_bytes(array(&head, GENERATION)));
            }
        }
        Ok(newest)
    }

    fn slot(&self, index: u64) -> Result<Option<ReservedFrame>, ReserveError> {
        let mut slot = [0; SLOT];
        self.file.read_exact_at(&mut slot, place(index)).map_err(ReserveError::Io)?;
        let counts = is_whole(&slot)
            && u64::from_le_bytes(array(&slot, GENERATION)) == self.generation
            && u64::from_le_bytes(array(&slot, SEQUENCE)) == index;
        Ok(if counts { decode(&slot) } else { None })
    }
}

/// Takes the room for good: allocated, and written once so that no later write has to find any.
fn allocate(file: &File, present: u64, wanted: u64) -> io::Result<()> {
    match rustix::fs::fallocate(file, rustix::fs::FallocateFlags::empty(), 0, wanted) {
        // Some file systems cannot; writing does it as well.
        Ok(()) | Err(rustix::io::Errno::OPNOTSUPP) => {}
        Err(error) => return Err(error.into()),
    }
    let zeros = vec![0; 64 * SLOT];
    let mut at = present;
    while at < wanted {
        let length = (wanted - at).min(zeros.len() as u64);
        file.write_all_at(zeros.get(..length as usize).unwrap_or_default(), at)?;
        at += length;
    }
    file.sync_all()
}

fn place(index: u64) -> u64 {
    (HEADS + index) * SLOT as u64
}

fn put(slot: &mut [u8; SLOT], at: usize, bytes: &[u8]) {
    if let Some(place) = slot.get_mut(at..at + bytes.len()) {
        place.copy_from_slice(bytes);
    }
}

fn array<const N: usize>(slot: &[u8; SLOT], at: usize) -> [u8; N] {
    slot.get(at..at + N).and_then(|bytes| bytes.try_into().ok()).unwrap_or([0; N])
}

fn checksum(slot: &[u8; SLOT]) -> [u8; 4] {
    protocol::crc32(slot.get(GENERATION..).unwrap_or_default()).to_le_bytes()
}

fn stamp(slot: &mut [u8; SLOT]) {
    let sum = checksum(slot);
    put(slot, 0, &sum);
}

fn is_whole(slot: &[u8; SLOT]) -> bool {
    array::<4>(slot, 0) == checksum(slot)
}

/// Length, then bytes; `None` when they are too many.
fn put_sized(slot: &mut [u8; SLOT], at: usize, most: usize, bytes: &[u8]) -> Option<()> {
    let length = u8::try_from(bytes.len()).ok().filter(|_| bytes.len() <= most)?;
    put(slot, at, &[length]);
    put(slot, at + 1, bytes);
    Some(())
}

fn get_sized(slot: &[u8; SLOT], at: usize, most: usize) -> Option<&[u8]> {
    let length = usize::from(*slot.get(at)?);
    slot.get(at + 1..at + 1 + length).filter(|_| length <= most)
}

fn encode(frame: &ReservedFrame, generation: u64, sequence: u64) -> Option<[u8; SLOT]> {
    let mut slot = [0; SLOT];
    put(&mut slot, GENERATION, &generation.to_le_bytes());
    put(&mut slot, SEQUENCE, &sequence.to_le_bytes());
    put(&mut slot, SOURCE, &[u8::from(frame.source == Source::File)]);
    put(&mut slot, RSSI_KNOWN, &[u8::from(frame.rssi_dbm.is_some())]);
    put(&mut slot, RSSI, &frame.rssi_dbm.unwrap_or(0).to_le_bytes());
    put(&mut slot, RECEIVED_AT, &frame.received_at.0.to_le_bytes());
    let route = &frame.route;
    for (at, name) in
        NAMES.iter().zip([route.satellite.as_str(), route.station.as_str(), route.link.as_str()])
    {
        put_sized(&mut slot, *at, NAME_MOST, name.as_bytes())?;
    }
    put_sized(&mut slot, FRAME, FRAME_MOST, &frame.bytes)?;
    stamp(&mut slot);
    Some(slot)
}

fn decode(slot: &[u8; SLOT]) -> Option<ReservedFrame> {
    let name = |at| std::str::from_utf8(get_sized(slot, at, NAME_MOST)?).ok();
    let [satellite, station, link] = NAMES;
    Some(ReservedFrame {
        route: Route {
            satellite: SatelliteId::new(name(satellite)?).ok()?,
            station: StationId::new(name(station)?).ok()?,
            link: LinkId::new(name(link)?).ok()?,
        },
        source: if array::<1>(slot, SOURCE) == [0] { Source::Radio } else { Source::File },
        received_at: UtcUs(i64::from_le_bytes(array(slot, RECEIVED_AT))),
        rssi_dbm: (array::<1>(slot, RSSI_KNOWN) != [0]).then(|| i16::from_le_bytes(array(slot, RSSI))),
        bytes: get_sized(slot, FRAME, FRAME_MOST)?.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(number: u16) -> ReservedFrame {
        ReservedFrame {
            route: Route {
                satellite: SatelliteId::new("pixelsat-1").unwrap(),
                station: StationId::new(&"s".repeat(32)).unwrap(),
                link: LinkId::new("uhf").unwrap(),
            },
            source: if number.is_multiple_of(2) { Source::Radio } else { Source::File },
            received_at: UtcUs(i64::from(number) - 5),
            rssi_dbm: (!number.is_multiple_of(3)).then_some(-100 - number.cast_signed()),
            bytes: vec![number as u8; 16 + usize::from(number) % 225].into(),
        }
    }

    #[test]
    fn frames_come_back_in_order_after_opening_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("reserve.bin");
        let mut reserve = Reserve::open(&path, 100 * 512).unwrap();
        assert_eq!(reserve.capacity(), 98);
        let frames: Vec<_> = (0..98).map(frame).collect();
        for frame in &frames {
            reserve.push(frame).unwrap();
        }
        assert!(matches!(reserve.push(&frame(0)), Err(ReserveError::Full)));
        drop(reserve);
        let mut reserve = Reserve::open(&path, 512).unwrap();
        assert_eq!(reserve.read_all().unwrap(), frames);
        reserve.clear().unwrap();
        assert_eq!(reserve.read_all().unwrap(), []);
        reserve.push(&frames[7]).unwrap();
        drop(reserve);
        let mut reserve = Reserve::open(&path, 512).unwrap();
        assert_eq!(reserve.read_all().unwrap(), [frames[7].clone()]);
        reserve.clear().unwrap();
        reserve.clear().unwrap();
        assert_eq!(Reserve::open(&path, 512).unwrap().read_all().unwrap(), []);
    }

    #[test]
    fn room_is_taken_at_once_and_nobody_else_may_read_it() {
        use std::os::unix::fs::MetadataExt as _;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("reserve.bin");
        let _reserve = Reserve::open(&path, 1 << 20).unwrap();
        let metadata = path.metadata().unwrap();
        assert_eq!(metadata.len(), 1 << 20);
        assert!(metadata.blocks() * 512 >= 1 << 20, "sparse: {} blocks", metadata.blocks());
        assert_eq!(metadata.mode() & 0o777, 0o600);
    }

    #[test]
    fn a_frame_that_is_too_long_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut reserve = Reserve::open(&folder.path().join("reserve.bin"), 0).unwrap();
        let long = ReservedFrame { bytes: vec![0; 241].into(), ..frame(1) };
        assert!(matches!(reserve.push(&long), Err(ReserveError::Io(_))));
        reserve.push(&frame(1)).unwrap();
        assert_eq!(reserve.read_all().unwrap(), [frame(1)]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// A power cut in the middle of a write leaves any mixture of old and new bytes in the last slot.
        #[test]
        fn a_torn_slot_is_skipped_and_the_others_stand(count in 1u16..8, cut in 0usize..512, junk in any::<u8>()) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("reserve.bin");
            let mut reserve = Reserve::open(&path, 10 * 512).unwrap();
            for number in 0..count {
                reserve.push(&frame(number)).unwrap();
            }
            drop(reserve);
            let mut bytes = std::fs::read(&path).unwrap();
            let last = (usize::from(count) + 1) * 512;
            let before = bytes.clone();
            bytes[last + cut..last + 512].fill(junk);
            std::fs::write(&path, &bytes).unwrap();
            let mut reserve = Reserve::open(&path, 0).unwrap();
            let read = reserve.read_all().unwrap();
            let whole = if bytes == before { count } else { count - 1 };
            prop_assert_eq!(&read, &(0..whole).map(frame).collect::<Vec<_>>());
            reserve.push(&frame(99)).unwrap();
            let read = reserve.read_all().unwrap();
            prop_assert_eq!(read.last(), Some(&frame(99)));
        }
    }
}
