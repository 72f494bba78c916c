//! Followers of the stream, hundreds in one thread: the little of a WebSocket that this takes, read by hand, so that the
//! crowd costs less than what it looks at.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::time::Duration;

use rustix::buffer::spare_capacity;
use rustix::event::{Timespec, epoll};

use crate::wait::utc_us;

/// Latencies are counted in steps of so many microseconds.
const STEP_US: i64 = 100;
/// Longer ones count as this long: 60 s.
const STEPS: usize = 600_000;

/// What followers saw.
pub(super) struct Tally {
    pub(super) messages: u64,
    pub(super) told: u64,
    pub(super) holes: u64,
    pub(super) doubles: u64,
    pub(super) lost: u64,
    latencies: Vec<u64>,
}

impl Default for Tally {
    fn default() -> Self {
        Self { messages: 0, told: 0, holes: 0, doubles: 0, lost: 0, latencies: vec![0; STEPS + 1] }
    }
}

impl Tally {
    pub(super) fn add(&mut self, other: Self) {
        self.messages += other.messages;
        self.told += other.told;
        self.holes += other.holes;
        self.doubles += other.doubles;
        self.lost += other.lost;
        for (sum, more) in self.latencies.iter_mut().zip(other.latencies) {
            *sum += more;
        }
    }

    pub(super) fn quantile_ms(&self, share: f64) -> f64 {
        let wanted = (share * self.told as f64).ceil() as u64;
        let mut seen = 0;
        let step = self.latencies.iter().position(|count| {
            seen += count;
            seen >= wanted.max(1)
        });
        step.map_or(f64::NAN, |step| (step as i64 * STEP_US) as f64 / 1000.0)
    }

    fn message(&mut self, text: &[u8], last: &mut i64, sent: &[AtomicI64]) {
        self.messages += 1;
        let Some(sequence) = text.strip_prefix(b"{\"type\":\"event\",\"sequence\":").and_then(number) else {
            return;
        };
        match sequence - *last {
            1 => {}
            _ if *last == 0 => {}
            step if step <= 0 => self.doubles += 1,
            _ => self.holes += 1,
        }
        *last = sequence.max(*last);
        let frame = find(text, b"\"kind\":\"frame-heard\"").and_then(|_| {
            let at = find(text, b"\"frame\":")?;
            number(text.get(at + 8..)?)
        });
        let sent = frame.and_then(|frame| sent.get(usize::try_from(frame).ok()?));
        if let Some(sent) = sent.map(|sent| sent.load(Ordering::Acquire)).filter(|sent| *sent > 0) {
            let step = ((utc_us() - sent) / STEP_US).clamp(0, STEPS as i64);
            self.latencies[step as usize] += 1;
            self.told += 1;
        }
    }
}

fn number(text: &[u8]) -> Option<i64> {
    let digits = text.iter().take_while(|byte| byte.is_ascii_digit()).count();
    std::str::from_utf8(text.get(..digits)?).ok()?.parse().ok()
}

fn find(text: &[u8], wanted: &[u8]) -> Option<usize> {
    text.windows(wanted.len()).position(|window| window == wanted)
}

/// Opens a stream by hand.
pub(super) fn open(address: SocketAddr, topics: &str) -> io::Result<TcpStream> {
    let mut socket = TcpStream::connect(address)?;
    socket.set_read_timeout(Some(Duration::from_secs(30)))?;
    write!(
        socket,
        "GET /api/v1/stream?topics={topics} HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    )?;
    let (mut head, mut byte) = (Vec::new(), [0]);
    while !head.ends_with(b"\r\n\r\n") {
        socket.read_exact(&mut byte)?;
        head.push(byte[0]);
    }
    if head.starts_with(b"HTTP/1.1 101") {
        return Ok(socket);
    }
    Err(io::Error::other(String::from_utf8_lossy(&head).into_owned()))
}

struct Follower {
    socket: TcpStream,
    bytes: Vec<u8>,
    last: i64,
    open: bool,
}

/// Follows with all of them until `stop`, and then until nothing more comes.
pub(super) fn follow(sockets: Vec<TcpStream>, sent: &[AtomicI64], stop: &AtomicBool) -> Tally {
    let epoll = epoll::create(epoll::CreateFlags::CLOEXEC).expect("epoll");
    let mut followers = Vec::with_capacity(sockets.len());
    for (index, socket) in sockets.into_iter().enumerate() {
        socket.set_nonblocking(true).expect("a socket that does not wait");
        epoll::add(&epoll, &socket, epoll::EventData::new_u64(index as u64), epoll::EventFlags::IN)
            .expect("epoll takes it");
        followers.push(Follower { socket, bytes: Vec::new(), last: 0, open: true });
    }
    let mut tally = Tally::default();
    let mut events = Vec::with_capacity(256);
    let mut piece = vec![0; 64 * 1024];
    let wait = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };
    while !stop.load(Ordering::Acquire) {
        match epoll::wait(&epoll, spare_capacity(&mut events), Some(&wait)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => panic!("epoll: {error}"),
        }
        for event in events.drain(..) {
            let data = event.data;
            let Some(follower) = usize::try_from(data.u64()).ok().and_then(|at| followers.get_mut(at)) else {
                continue;
            };
            if !follower.take(&mut piece, &mut tally, sent) && follower.open {
                follower.open = false;
                tally.lost += 1;
                let _ = epoll::delete(&epoll, &follower.socket);
            }
        }
    }
    tally
}

impl Follower {
    /// Reads once; false when the stream is over.
    fn take(&mut self, piece: &mut [u8], tally: &mut Tally, sent: &[AtomicI64]) -> bool {
        match self.socket.read(piece) {
            Ok(0) => return false,
            Ok(count) => self.bytes.extend_from_slice(&piece[..count]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => return true,
            Err(_) => return false,
        }
        let mut done = 0;
        let mut open = true;
        while let Some((kind, from, to)) = frame(&self.bytes, done) {
            let content = &self.bytes[from..to];
            match kind {
                1 => tally.message(content, &mut self.last, sent),
                8 => open = false,
                9 => {
                    // A mask of zeros is a mask.
                    let mut pong = vec![0x8A, 0x80 | content.len() as u8, 0, 0, 0, 0];
                    pong.extend_from_slice(content);
                    let _ = self.socket.write_all(&pong);
                }
                _ => {}
            }
            done = to;
        }
        self.bytes.drain(..done);
        open
    }
}

/// Kind, begin and end of the content of the frame that begins at `at`, when all of it is there.
fn frame(bytes: &[u8], at: usize) -> Option<(u8, usize, usize)> {
    let head = bytes.get(at..at + 2)?;
    let (kind, short) = (head[0] & 15, usize::from(head[1] & 127));
    let (from, length) = match short {
        126 => (at + 4, usize::from(u16::from_be_bytes(bytes.get(at + 2..at + 4)?.try_into().ok()?))),
        127 => {
            let length = u64::from_be_bytes(bytes.get(at + 2..at + 10)?.try_into().ok()?);
            (at + 10, usize::try_from(length).ok()?)
        }
        short => (at + 2, short),
    };
    let to = from.checked_add(length)?;
    (to <= bytes.len()).then_some((kind, from, to))
}

/// Whether the other end has closed: what still lies in between is taken first.
pub(super) fn is_over(mut socket: &TcpStream) -> bool {
    let _ = socket.set_read_timeout(Some(Duration::from_millis(20)));
    let mut piece = [0; 64 * 1024];
    loop {
        match socket.read(&mut piece) {
            Ok(0) => return true,
            Ok(_) => {}
            Err(error) => return !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut),
        }
    }
}
