//! A crowd at the stream: followers, clients that take nothing, clients that mean harm, and a radio that hears a frame
//! every few milliseconds. What comes of it is told in figures.

mod follower;
mod hostile;

use std::fmt;
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::thread;
use std::time::Duration;

use api::{FrameView, Page};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

use crate::pty::heartbeat;
use crate::wait::{now, pause, utc_us};
use crate::{Folder, Pty, Server};
use follower::Tally;

/// Who comes, and what is heard meanwhile.
#[derive(Debug, Clone, Copy)]
pub struct Load {
    /// Clients that follow and take everything.
    pub followers: usize,
    /// Clients that open the stream and take nothing.
    pub stalled: usize,
    /// Clients that mean harm.
    pub hostile: usize,
    /// Frames a second that the radio hears.
    pub frames_per_s: u32,
    /// For how long.
    pub seconds: u32,
}

/// What came of it.
#[derive(Debug, Clone, Default)]
pub struct Figures {
    /// Frames that the radio sent.
    pub frames: usize,
    /// Frames in the archive.
    pub archived: usize,
    /// Messages that the followers took.
    pub messages: u64,
    /// Frames that the followers were told of, all together.
    pub told: u64,
    /// Followers that missed an event.
    pub holes: u64,
    /// Events that came twice.
    pub doubles: u64,
    /// Followers whose stream ended early.
    pub lost: u64,
    /// From the last byte at the radio to the client: median, ms.
    pub p50_ms: f64,
    /// The same, 99 of 100.
    pub p99_ms: f64,
    /// The same, the worst.
    pub max_ms: f64,
    /// From the last byte at the radio to the server's stamp of receipt: median, ms.
    pub receipt_p50_ms: f64,
    /// The same, 99 of 100.
    pub receipt_p99_ms: f64,
    /// The most memory that the server had, MiB.
    pub memory_mib: f64,
    /// Processor time of the server, cores.
    pub cores: f64,
    /// Stalled clients that were let go.
    pub stalled_let_go: usize,
    /// What hostile clients did, all together.
    pub attacks: u64,
}

impl Figures {
    /// How much later than usual a frame is received, ms: 99 of 100 over the median.
    #[must_use]
    pub fn jitter_ms(&self) -> f64 {
        self.receipt_p99_ms - self.receipt_p50_ms
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frames, archived, messages, told, holes, doubles, lost, attacks, .. } = self;
        writeln!(
            f,
            "frames sent {frames}, archived {archived}; messages taken {messages}, frames told {told}"
        )?;
        writeln!(f, "holes {holes}, doubles {doubles}, followers lost {lost}")?;
        let Self { p50_ms, p99_ms, max_ms, .. } = self;
        writeln!(f, "frame to client: p50 {p50_ms:.1} ms, p99 {p99_ms:.1} ms, max {max_ms:.1} ms")?;
        let (p50, p99) = (self.receipt_p50_ms, self.receipt_p99_ms);
        writeln!(f, "receipt: p50 {p50:.1} ms, p99 {p99:.1} ms, jitter {:.1} ms", self.jitter_ms())?;
        let Self { memory_mib, cores, stalled_let_go, .. } = self;
        write!(
            f,
            "server: {memory_mib:.0} MiB at most, {cores:.2} cores; stalled clients let go {stalled_let_go}, attacks {attacks}"
        )
    }
}

/// Brings the crowd to a server of its own.
///
/// # Panics
/// When the server or the machine does not bear it: the figures would be of something else.
#[must_use]
pub fn run(load: Load) -> Figures {
    let limits = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: limits.maximum, maximum: limits.maximum })
        .expect("as many open files as there may be");
    let mut folder = Folder::new();
    folder.link = "mode_pins = \"strapped\"\ntransmit_unverified = true\nrssi = false\n".to_owned();
    folder.log = "warn".to_owned();
    let mut pty = Pty::at(&folder.port());
    let mut server = Server::start(&folder);
    server.until_link("ok", crate::wait::PATIENCE);

    let frames = (load.frames_per_s * load.seconds) as usize;
    let sent: Arc<Vec<AtomicI64>> = Arc::new((0..=frames).map(|_| AtomicI64::new(0)).collect());
    let stop = Arc::new(AtomicBool::new(false));
    let open = || follower::open(folder.address, "events,status").expect("a stream");
    let stalled: Vec<TcpStream> = (0..load.stalled).map(|_| open()).collect();
    let halves: Vec<_> = (0..2)
        .map(|half| {
            let sockets: Vec<TcpStream> = (half..load.followers).step_by(2).map(|_| open()).collect();
            let (sent, stop) = (Arc::clone(&sent), Arc::clone(&stop));
            thread::spawn(move || follower::follow(sockets, &sent, &stop))
        })
        .collect();
    let hostile: Vec<_> = (0..load.hostile)
        .map(|which| {
            let (address, stop) = (folder.address, Arc::clone(&stop));
            thread::spawn(move || hostile::attack(which, address, &stop))
        })
        .collect();
    pause(Duration::from_millis(500));

    let (began, cpu) = (now(), server.process.cpu());
    for frame in 1..=frames {
        // Frame ids of a new archive count from 1, in the order in which they were heard.
        let due = Duration::from_secs(1) * u32::try_from(frame).expect("few frames") / load.frames_per_s;
        pause(due.saturating_sub(began.elapsed()));
        let bytes = heartbeat(u32::try_from(frame).expect("few frames") * 10);
        sent[frame].store(utc_us(), Ordering::Release);
        pty.write(&bytes);
    }
    let cores = (server.process.cpu() - cpu).as_secs_f64() / began.elapsed().as_secs_f64();
    // The last ones are still on their way.
    pause(Duration::from_secs(3));
    stop.store(true, Ordering::Release);
    let mut tally = Tally::default();
    for half in halves {
        tally.add(half.join().expect("a follower's thread"));
    }
    let attacks = hostile.into_iter().map(|one| one.join().expect("an attacker's thread")).sum();

    let (archived, receipts) = receipts(&server, &sent);
    let figures = Figures {
        frames,
        archived,
        messages: tally.messages,
        told: tally.told,
        holes: tally.holes,
        doubles: tally.doubles,
        lost: tally.lost,
        p50_ms: tally.quantile_ms(0.5),
        p99_ms: tally.quantile_ms(0.99),
        max_ms: tally.quantile_ms(1.0),
        receipt_p50_ms: quantile(&receipts, 0.5),
        receipt_p99_ms: quantile(&receipts, 0.99),
        memory_mib: peak_memory_mib(server.process.pid()),
        cores,
        stalled_let_go: stalled.iter().filter(|socket| follower::is_over(socket)).count(),
        attacks,
    };
    assert_eq!(server.process.ended(), None, "the server ended");
    server.stop();
    figures
}

/// How many frames the archive has, and for each the milliseconds from the radio to the stamp of receipt, rising.
fn receipts(server: &Server, sent: &[AtomicI64]) -> (usize, Vec<f64>) {
    let (mut after, mut all) = (0, Vec::new());
    loop {
        let page: Page<FrameView> = server.client.read(&format!("/api/v1/frames?limit=1000&after={after}"));
        for frame in &page.items {
            let id = usize::try_from(frame.id).expect("few frames");
            if let Some(sent) = sent.get(id) {
                let late_us = frame.heard_at.unix_us() - sent.load(Ordering::Acquire);
                all.push(late_us as f64 / 1000.0);
            }
        }
        match page.next {
            Some(next) => after = next,
            None => break,
        }
    }
    let count = all.len();
    all.sort_by(f64::total_cmp);
    (count, all)
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

/// The most memory that a process had at once (`VmHWM` of proc(5)).
fn peak_memory_mib(pid: u32) -> f64 {
    peak_kib(pid) as f64 / 1024.0
}

/// The same in KiB.
///
/// # Panics
/// When the process has ended.
#[must_use]
pub fn peak_kib(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).expect("procfs");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("the peak of memory");
    line.trim().trim_end_matches(" kB").trim().parse().expect("a number")
}
