//! Real processes: started, watched, killed.

use std::ffi::OsStr;
use std::fs::OpenOptions;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::wait::{PATIENCE, now, pause, until};
use crate::{Client, Folder, binary};

/// A process that ends with its owner.
#[derive(Debug)]
pub struct Process {
    child: Child,
    log: PathBuf,
}

impl Process {
    /// Starts a command; what it says goes to `log`.
    ///
    /// # Panics
    /// When it cannot be started.
    #[must_use]
    pub fn start(mut command: Command, log: &Path) -> Self {
        let open = || OpenOptions::new().create(true).append(true).open(log).expect("a log file");
        command.stdin(Stdio::null()).stderr(open());
        let child = command.spawn().unwrap_or_else(|error| panic!("{command:?}: {error}"));
        Self { child, log: log.to_path_buf() }
    }

    /// Its number.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Everything that it and those before it said.
    #[must_use]
    pub fn log(&self) -> String {
        let bytes = std::fs::read(&self.log).unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Its end, if it has ended.
    ///
    /// # Panics
    /// When the system does not say.
    pub fn ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().expect("the state of a child")
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// When it does not end.
    pub fn wait(&mut self) -> ExitStatus {
        let what = format!("process {} ends", self.pid());
        until(&what, PATIENCE, || self.ended()).0
    }

    /// `kill -9`.
    ///
    /// # Panics
    /// When the system refuses.
    pub fn kill9(&mut self) {
        self.child.kill().expect("kill");
        let _status = self.child.wait().expect("the end of a killed child");
    }

    /// Sends a signal.
    ///
    /// # Panics
    /// When the system refuses.
    pub fn signal(&self, signal: Signal) {
        let pid = i32::try_from(self.pid()).ok().and_then(Pid::from_raw).expect("a process number");
        kill_process(pid, signal).expect("a signal");
    }

    /// Asks it to end, and waits.
    ///
    /// # Panics
    /// When it does not end.
    pub fn terminate(&mut self) -> ExitStatus {
        self.signal(Signal::TERM);
        self.wait()
    }

    /// Processor time that it took so far, user and system.
    ///
    /// # Panics
    /// When it has ended.
    #[must_use]
    pub fn cpu(&self) -> Duration {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.pid())).expect("procfs");
        let after_name = stat.rsplit_once(')').expect("a name in brackets").1;
        // Fields 14 and 15 of proc(5), in ticks of 10 ms.
        let ticks: u64 =
            after_name.split_whitespace().skip(11).take(2).map(|f| f.parse::<u64>().unwrap_or(0)).sum();
        Duration::from_millis(10 * ticks)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if std::thread::panicking() {
            let log = self.log();
            let tail: Vec<&str> = log.lines().rev().take(40).collect();
            eprintln!("--- end of {}", self.log.display());
            tail.iter().rev().for_each(|line| eprintln!("{line}"));
        }
    }
}

/// `gs-server` with these arguments; the environment's settings for it are taken away.
#[must_use]
pub fn gs_server<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(binary::gs_server());
    command.args(arguments).stdin(Stdio::null());
    for name in ["GS_LISTEN", "GS_DATA", "GS_LOG"] {
        command.env_remove(name);
    }
    command
}

/// Runs it to its end: exit code, standard output, standard error.
///
/// # Panics
/// When it cannot be started, or a signal ended it.
#[must_use]
pub fn run(mut command: Command) -> (i32, String, String) {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let code = output.status.code().unwrap_or_else(|| panic!("{command:?}: {}", output.status));
    (code, text(&output.stdout), text(&output.stderr))
}

/// A server that is ready.
#[derive(Debug)]
pub struct Server {
    /// The process.
    pub process: Process,
    /// Its API.
    pub client: Client,
    /// From its start to its first good answer.
    pub ready_after: Duration,
}

impl Server {
    /// Starts one in this folder and waits until it is ready.
    ///
    /// # Panics
    /// When it is not ready in time, or ends.
    #[must_use]
    pub fn start(folder: &Folder) -> Self {
        let config = folder.write_config();
        let mut command = gs_server(["serve", "--config"]);
        command.arg(config);
        Self::start_by(folder, command)
    }

    /// Starts one by a command of the caller's, such as `strace … gs-server serve …`.
    ///
    /// # Panics
    /// As [`Server::start`].
    #[must_use]
    pub fn start_by(folder: &Folder, mut command: Command) -> Self {
        command.stdout(Stdio::null());
        let began = now();
        let mut process = Process::start(command, &folder.file("serve.log"));
        let mut client = Client { address: folder.address, token: String::new() };
        loop {
            if is_ready(&client) {
                break;
            }
            if let Some(status) = process.ended() {
                panic!("the server ended instead of being ready: {status}");
            }
            assert!(began.elapsed() < PATIENCE, "not ready in {PATIENCE:?}");
            pause(Duration::from_millis(5));
        }
        let ready_after = began.elapsed();
        client.token =
            std::fs::read_to_string(folder.data().join("token")).expect("a token").trim().to_owned();
        Self { process, client, ready_after }
    }

    /// The station's view.
    ///
    /// # Panics
    /// When it does not answer.
    #[must_use]
    pub fn station(&self) -> api::StationView {
        self.client.read("/api/v1/station")
    }

    /// Waits until the only link is in this state.
    ///
    /// # Panics
    /// When it does not come in time.
    pub fn until_link(&self, state: &str, limit: Duration) -> Duration {
        until(&format!("the link is {state}"), limit, || {
            (self.station().links[0].state == state).then_some(())
        })
        .1
    }

    /// Ends it in order.
    ///
    /// # Panics
    /// When it does not end well.
    pub fn stop(mut self) {
        let status = self.process.terminate();
        assert!(status.success(), "{status}");
    }
}

/// Whether a server there answers that it is ready.
fn is_ready(client: &Client) -> bool {
    client.get("/api/v1/health").is_ok_and(|answer| answer.status == 200)
}

/// A twin behind a pseudo-terminal.
#[derive(Debug)]
pub struct Twin {
    /// The process.
    pub process: Process,
    _stdout: BufReader<ChildStdout>,
    /// When it was ready.
    pub began: Instant,
}

impl Twin {
    /// Starts one for the station of this folder and waits until its port is there.
    ///
    /// # Panics
    /// When it is not ready.
    #[must_use]
    pub fn start(folder: &Folder, arguments: &[&str]) -> Self {
        let mut command = gs_server(["twin", "serve", "--json", "--pty"]);
        command
            .arg(folder.port())
            .arg("--journal")
            .arg(folder.journal())
            .arg("--key")
            .arg(folder.file("twin.key"));
        command.arg("--heartbeat-s").arg(folder.heartbeat_s.to_string());
        if let Some(speed) = folder.speed {
            command.arg("--speed").arg(speed.to_string());
        }
        if !folder.ranges {
            command.arg("--no-ranges");
        }
        command.args(arguments).stdout(Stdio::piped());
        let mut process = Process::start(command, &folder.file("twin.log"));
        let mut stdout = BufReader::new(process.child.stdout.take().expect("a pipe"));
        let mut line = String::new();
        stdout.read_line(&mut line).expect("what the twin says");
        assert!(line.contains("\"ready\":true"), "{line}");
        Self { process, _stdout: stdout, began: now() }
    }
}
