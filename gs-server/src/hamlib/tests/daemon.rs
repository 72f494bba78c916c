//! A daemon of our own that can be told how to misbehave, with a rotator that turns in simulated time and a rig.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use mission::UtcUs;
use mission::pointing::{Mount, MountSettings, Position};
use tokio::io::{AsyncBufReadExt as _, AsyncWriteExt as _, BufReader};
use tokio::net::tcp::OwnedWriteHalf;
use tokio::net::{TcpListener, TcpStream};
use tokio_util::sync::CancellationToken;

use crate::clock::{Timer, wall_sleep};

/// How a daemon answers.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Manner {
    /// As hamlib does.
    Good,
    /// Reads, and says nothing.
    Silent,
    /// Refuses to set anything, with this number.
    Refusing(i32),
    /// Refuses everything but to say who it is.
    Broken(i32),
    /// Sends these bytes for every answer.
    Saying(String),
    /// Answers in pieces, with pauses.
    Dripping,
    /// Ends in the middle of an answer.
    Cutting,
    /// Answers, and then once more.
    Repeating,
    /// Says `RPRT 0` to everything and does not move.
    Frozen,
    /// Tells a position that is no number.
    Nan,
    /// Tells a position far away, every fifth time.
    Jumping,
    /// Knows neither limits nor name, and is silent about it.
    Old,
}

pub(super) struct State {
    pub(super) manner: Manner,
    pub(super) log: Vec<(UtcUs, String)>,
    pub(super) connections: usize,
    pub(super) limits: (f64, f64, f64, f64),
    pub(super) receive_hz: f64,
    pub(super) transmit_hz: f64,
    /// The rig shows this whatever it is set to.
    pub(super) stays_on_hz: Option<f64>,
    mount: Mount,
    position: Position,
    target: Position,
    moved_at: UtcUs,
    asked: usize,
}

pub(super) struct Daemon {
    pub(super) address: String,
    pub(super) state: Arc<Mutex<State>>,
    alive: CancellationToken,
    timer: Arc<dyn Timer>,
}

impl Daemon {
    pub(super) async fn start(timer: &Arc<dyn Timer>, manner: Manner) -> Self {
        let mount = Mount::new(MountSettings {
            azimuth_deg: (-180.0, 540.0),
            elevation_deg: (-10.0, 180.0),
            ..MountSettings::default()
        })
        .unwrap();
        let rest = Position { azimuth_deg: 0.0, elevation_deg: 0.0 };
        let state = State {
            manner,
            log: Vec::new(),
            connections: 0,
            limits: (-180.0, 450.0, 0.0, 90.0),
            receive_hz: 145e6,
            transmit_hz: 145e6,
            stays_on_hz: None,
            mount,
            position: rest,
            target: rest,
            moved_at: timer.now().utc,
            asked: 0,
        };
        let mut daemon = Self {
            address: "127.0.0.1:0".into(),
            state: Arc::new(Mutex::new(state)),
            alive: CancellationToken::new(),
            timer: Arc::clone(timer),
        };
        daemon.rise().await;
        daemon
    }

    /// Listens (again, on the same port).
    pub(super) async fn rise(&mut self) {
        let listener = loop {
            match TcpListener::bind(&self.address).await {
                Ok(listener) => break listener,
                Err(_) => wall_sleep(Duration::from_millis(5)).await,
            }
        };
        self.address = listener.local_addr().unwrap().to_string();
        self.alive = CancellationToken::new();
        let (alive, state, timer) = (self.alive.clone(), Arc::clone(&self.state), Arc::clone(&self.timer));
        tokio::spawn(async move {
            loop {
                let stream = tokio::select! {
                    () = alive.cancelled() => return,
                    accepted = listener.accept() => accepted.unwrap().0,
                };
                state.lock().unwrap().connections += 1;
                tokio::spawn(serve(stream, Arc::clone(&state), Arc::clone(&timer), alive.clone()));
            }
        });
    }

    /// Ends, with all its connections.
    pub(super) async fn die(&self) {
        self.alive.cancel();
        // Until nobody listens any more.
        while TcpStream::connect(&self.address).await.is_ok() {
            wall_sleep(Duration::from_millis(2)).await;
        }
    }

    pub(super) fn set(&self, manner: Manner) {
        self.state.lock().unwrap().manner = manner;
    }

    pub(super) fn position(&self) -> Position {
        let now = self.timer.now().utc;
        let mut state = self.state.lock().unwrap();
        state.turn(now);
        state.position
    }

    /// What was asked whose name begins so, and when.
    pub(super) fn asked(&self, name: &str) -> Vec<(UtcUs, String)> {
        let state = self.state.lock().unwrap();
        state.log.iter().filter(|(_, line)| line.starts_with(name)).cloned().collect()
    }

    /// The positions that were commanded, and when.
    pub(super) fn commanded(&self) -> Vec<(UtcUs, Position)> {
        self.asked("set_pos").into_iter().map(|(at, line)| (at, parse(&line).unwrap())).collect()
    }
}

fn parse(line: &str) -> Option<Position> {
    let mut words = line.split(' ').skip(1).map(str::parse);
    let position = Position { azimuth_deg: words.next()?.ok()?, elevation_deg: words.next()?.ok()? };
    Some(position)
}

impl State {
    #[expect(clippy::cast_precision_loss, reason = "seconds of a pass")]
    fn turn(&mut self, now: UtcUs) {
        let seconds = (now.0 - self.moved_at.0) as f64 / 1e6;
        if self.manner != Manner::Frozen {
            self.position = self.mount.after(self.position, self.target, seconds);
        }
        self.moved_at = now;
    }

    fn reply(&mut self, now: UtcUs, line: &str) -> String {
        self.turn(now);
        let Some(command) = line.strip_prefix("+\\") else {
            return if line == "\\chk_vfo" { "0\n".into() } else { String::new() };
        };
        self.log.push((now, command.to_owned()));
        let name = command.split(' ').next().unwrap_or_default();
        let echo = if name == command {
            format!("{name}:\n")
        } else {
            format!("{name}: {}\n", &command[name.len() + 1..])
        };
        let done = |values: String| format!("{echo}{values}RPRT 0\n");
        let refused = |code: i32| format!("{echo}RPRT {code}\n");
        match (&self.manner, name) {
            (Manner::Refusing(code), "set_pos" | "park" | "stop" | "set_freq") => return refused(*code),
            (Manner::Broken(code), name) if !matches!(name, "get_info" | "dump_state") => {
                return refused(*code);
            }
            (Manner::Old, "dump_state") => return String::new(),
            _ => {}
        }
        match name {
            "dump_state" => {
                let (a, b, c, d) = self.limits;
                done(format!(
                    "rotctld Protocol Ver: 1\nRotor Model: 1\nMinimum Azimuth: {a:.6}\nMaximum Azimuth: {b:.6}\n\
                     Minimum Elevation: {c:.6}\nMaximum Elevation: {d:.6}\nSouth Zero: 0\nrot_type=AzEl\ndone\n"
                ))
            }
            "get_info" => done("Info: our own\n".into()),
            "get_pos" if self.manner == Manner::Nan => done("Azimuth: nan\nElevation: nan\n".into()),
            "get_pos" => {
                self.asked += 1;
                let jump =
                    if self.manner == Manner::Jumping && self.asked.is_multiple_of(5) { 170.0 } else { 0.0 };
                let Position { azimuth_deg, elevation_deg } = self.position;
                done(format!("Azimuth: {:.2}\nElevation: {elevation_deg:.2}\n", azimuth_deg + jump))
            }
            "set_pos" => {
                let (a, b, c, d) = self.limits;
                match parse(command) {
                    Some(p) if (a..=b).contains(&p.azimuth_deg) && (c..=d).contains(&p.elevation_deg) => {
                        self.target = p;
                        done(String::new())
                    }
                    // As the real one does with what it cannot read.
                    None => done(String::new()),
                    Some(_) => refused(-1),
                }
            }
            "stop" => {
                self.target = self.position;
                done(String::new())
            }
            "park" => {
                self.target = Position { azimuth_deg: 0.0, elevation_deg: 0.0 };
                done(String::new())
            }
            "get_freq" => done(format!("Frequency: {}\n", self.stays_on_hz.unwrap_or(self.receive_hz))),
            "get_split_freq" => {
                done(format!("TX Frequency: {}\n", self.stays_on_hz.unwrap_or(self.transmit_hz)))
            }
            "set_freq" | "set_split_freq" => {
                let hz = command[name.len() + 1..].parse().unwrap();
                *(if name == "set_freq" { &mut self.receive_hz } else { &mut self.transmit_hz }) = hz;
                done(String::new())
            }
            _ => String::new(),
        }
    }
}

async fn serve(stream: TcpStream, state: Arc<Mutex<State>>, timer: Arc<dyn Timer>, alive: CancellationToken) {
    let (reader, mut writer) = stream.into_split();
    let mut lines = BufReader::new(reader).lines();
    loop {
        let line = tokio::select! {
            () = alive.cancelled() => return,
            line = lines.next_line() => match line {
                Ok(Some(line)) => line,
                _ => return,
            },
        };
        let (reply, manner) = {
            let mut state = state.lock().unwrap();
            (state.reply(timer.now().utc, &line), state.manner.clone())
        };
        if !speak(&mut writer, &reply, &manner).await {
            return;
        }
    }
}

/// False when that was the end of the connection.
async fn speak(writer: &mut OwnedWriteHalf, reply: &str, manner: &Manner) -> bool {
    let said = match manner {
        Manner::Silent => return true,
        Manner::Saying(text) => writer.write_all(text.as_bytes()).await,
        Manner::Dripping => {
            for piece in reply.as_bytes().chunks(11) {
                wall_sleep(Duration::from_millis(1)).await;
                if writer.write_all(piece).await.is_err() {
                    return false;
                }
            }
            Ok(())
        }
        Manner::Cutting => {
            let _ = writer.write_all(&reply.as_bytes()[..reply.len() / 2]).await;
            return false;
        }
        Manner::Repeating => writer.write_all(format!("{reply}{reply}").as_bytes()).await,
        _ => writer.write_all(reply.as_bytes()).await,
    };
    said.is_ok()
}
