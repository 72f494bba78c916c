//! Terminals as a reader of a guide has them: a shell that runs commands, and windows that stay open.

use std::collections::BTreeMap;
use std::fs::File;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use rustix::process::{Pid, Signal, kill_process_group};

use crate::wait::{PATIENCE, until};

/// A reader's home, and the windows that are open in it.
#[derive(Debug)]
pub struct Terminals {
    home: PathBuf,
    /// What each shell is given to know.
    pub environment: Vec<(&'static str, String)>,
    /// What each shell begins with.
    pub prelude: String,
    windows: BTreeMap<String, Window>,
    opened: usize,
}

#[derive(Debug)]
struct Window {
    child: Child,
    output: PathBuf,
}

impl Terminals {
    /// None is open yet.
    #[must_use]
    pub fn new(home: &Path) -> Self {
        Self {
            home: home.to_path_buf(),
            environment: Vec::new(),
            prelude: String::new(),
            windows: BTreeMap::new(),
            opened: 0,
        }
    }

    fn shell(&self, script: &str) -> Command {
        let mut command = Command::new("bash");
        command.args(["-eu", "-o", "pipefail", "-c"]).arg(script).current_dir(&self.home);
        for name in ["GS_LISTEN", "GS_DATA", "GS_LOG"] {
            command.env_remove(name);
        }
        command.env("HOME", &self.home).stdin(Stdio::null());
        for (name, value) in &self.environment {
            command.env(name, value);
        }
        command
    }

    /// Runs commands to their end: whether they succeeded, and all that they said, on whichever of the two.
    ///
    /// # Panics
    /// When there is no shell.
    #[must_use]
    pub fn run(&self, commands: &str) -> (bool, String) {
        let script = format!("exec 2>&1\n{}\n{commands}", self.prelude);
        let output = self.shell(&script).output().expect("a shell");
        (output.status.success(), String::from_utf8_lossy(&output.stdout).into_owned())
    }

    /// Opens a window in which a command stays.
    ///
    /// # Panics
    /// When there is no shell, or the window is open already.
    pub fn open(&mut self, name: &str, command: &str) {
        self.opened += 1;
        let output = self.home.join(format!("window-{}-{name}.log", self.opened));
        let file = File::create(&output).expect("a file for what the window shows");
        let mut shell = self.shell(&format!("exec 2>&1\n{}\n{command}", self.prelude));
        let child = shell.stdout(file).stderr(Stdio::null()).process_group(0).spawn().expect("a shell");
        let before = self.windows.insert(name.to_owned(), Window { child, output });
        assert!(before.is_none(), "window {name} is open already");
    }

    /// What a window has shown so far.
    ///
    /// # Panics
    /// When there is no such window.
    #[must_use]
    pub fn shown(&self, name: &str) -> String {
        let window = self.windows.get(name).unwrap_or_else(|| panic!("no window {name} is open"));
        String::from_utf8_lossy(&std::fs::read(&window.output).unwrap_or_default()).into_owned()
    }

    /// Whether its command still runs.
    ///
    /// # Panics
    /// When there is no such window.
    #[must_use]
    pub fn stays(&mut self, name: &str) -> bool {
        let window = self.windows.get_mut(name).unwrap_or_else(|| panic!("no window {name} is open"));
        window.child.try_wait().expect("the state of a child").is_none()
    }

    /// Ctrl-C: its command ends, and well.
    ///
    /// # Panics
    /// When it does not.
    pub fn close(&mut self, name: &str) {
        let shown = self.shown(name);
        let mut window = self.windows.remove(name).expect("it is open");
        signal(&window.child, Signal::INT);
        let what = format!("window {name} ends");
        let (status, _) = until(&what, PATIENCE, || window.child.try_wait().expect("the state of a child"));
        assert!(status.success(), "window {name}: {status}\n{shown}");
    }
}

fn signal(child: &Child, signal: Signal) {
    if let Some(group) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        // One that has ended needs none.
        let _ = kill_process_group(group, signal);
    }
}

impl Drop for Terminals {
    fn drop(&mut self) {
        for (name, window) in &mut self.windows {
            signal(&window.child, Signal::KILL);
            let _ = window.child.wait();
            if std::thread::panicking() {
                let shown = std::fs::read(&window.output).unwrap_or_default();
                let shown = String::from_utf8_lossy(&shown).into_owned();
                let tail: Vec<&str> = shown.lines().rev().take(40).collect();
                eprintln!("--- end of window {name}");
                tail.iter().rev().for_each(|line| eprintln!("{line}"));
            }
        }
    }
}
