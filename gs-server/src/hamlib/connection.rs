//! One TCP connection to a daemon: a command, its whole answer, or no connection any more.

use std::sync::Arc;
use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

use super::error::HamlibError;
use crate::clock::{Timer, wall_sleep, within};

/// The longest line of an answer that is read.
const LINE: usize = 1_024;
/// The most lines of an answer; `dump_caps` has about a hundred.
const LINES: usize = 256;

/// What a daemon that hung up may take to compose itself.
const HUNG_UP: Duration = Duration::from_millis(100);

/// How long a daemon may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// To accept a connection.
    pub connect: Duration,
    /// To answer, the whole of it.
    pub reply: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self { connect: Duration::from_secs(2), reply: Duration::from_secs(2) }
    }
}

/// What an answer looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// The command's name, `Key: value` lines, `RPRT n`.
    Extended,
    /// One line: `chk_vfo` knows nothing else.
    OneLine,
}

/// A connection on which every answer fitted its command so far.
pub(super) struct Connection {
    address: String,
    stream: TcpStream,
    /// Bytes that were read and belong to no line yet.
    unread: Vec<u8>,
    patience: Patience,
    timer: Arc<dyn Timer>,
    /// A command is under way, or its answer did not fit: no other may follow.
    is_out_of_step: bool,
}

impl Connection {
    pub(super) async fn open(
        address: &str,
        patience: Patience,
        timer: &Arc<dyn Timer>,
    ) -> Result<Self, HamlibError> {
        let _held = timer.busy("connection to hamlib");
        let unreachable = |source| HamlibError::Unreachable { address: address.to_owned(), source };
        let stream = within(patience.connect, TcpStream::connect(address))
            .await
            .ok_or_else(|| HamlibError::NoConnection {
                address: address.to_owned(),
                after_ms: patience.connect.as_millis(),
            })?
            .map_err(unreachable)?;
        stream.set_nodelay(true).map_err(unreachable)?;
        Ok(Self {
            address: address.to_owned(),
            stream,
            unread: Vec::new(),
            patience,
            timer: Arc::clone(timer),
            is_out_of_step: false,
        })
    }

    /// Opens, and asks a first question by `ask`. A daemon that is just closing its device behind its last client (rigctld
    /// does) may hang up on the next one: it gets two more chances.
    pub(super) async fn open_asking<T>(
        address: &str,
        patience: Patience,
        timer: &Arc<dyn Timer>,
        ask: impl AsyncFn(&mut Self) -> Result<T, HamlibError>,
    ) -> Result<(Self, Result<T, HamlibError>), HamlibError> {
        let mut chances = 3;
        loop {
            let mut connection = Self::open(address, patience, timer).await?;
            let answer = ask(&mut connection).await;
            chances -= 1;
            if chances > 0 && matches!(answer, Err(HamlibError::Closed { .. })) {
                let _held = timer.busy("second connection to hamlib");
                wall_sleep(HUNG_UP).await;
                continue;
            }
            return Ok((connection, answer));
        }
    }

    pub(super) fn address(&self) -> &str {
        &self.address
    }

    /// Asks by the extended protocol: the long name, and arguments that hold no blank or line end. The lines of the answer,
    /// between the one that repeats the name and the one that ends it.
    pub(super) async fn ask(&mut self, name: &str, arguments: &str) -> Result<Vec<String>, HamlibError> {
        let command = if arguments.is_empty() { name.to_owned() } else { format!("{name} {arguments}") };
        self.exchange(&format!("+\\{command}\n"), name, &command, Form::Extended).await
    }

    /// Asks by the plain protocol for one line.
    pub(super) async fn ask_line(&mut self, name: &str) -> Result<String, HamlibError> {
        let lines = self.exchange(&format!("\\{name}\n"), name, name, Form::OneLine).await?;
        Ok(lines.into_iter().next().unwrap_or_default())
    }

    /// Whoever drops this future in the middle leaves a connection that takes no further command.
    async fn exchange(
        &mut self,
        request: &str,
        name: &str,
        command: &str,
        form: Form,
    ) -> Result<Vec<String>, HamlibError> {
        // What happens in the real world takes no simulated time.
        let _held = self.timer.busy("exchange with hamlib");
        let was_out_of_step = std::mem::replace(&mut self.is_out_of_step, true);
        if was_out_of_step || self.has_unasked() {
            let found = String::from_utf8_lossy(&self.unread).into_owned();
            return Err(self.out_of_step(command, &found));
        }
        let limit = self.patience.reply;
        let result = match within(limit, self.converse(request, name, command, form)).await {
            Some(result) => result,
            None => Err(HamlibError::Silent {
                address: self.address.clone(),
                command: command.to_owned(),
                after_ms: limit.as_millis(),
            }),
        };
        self.is_out_of_step = result.as_ref().is_err_and(HamlibError::breaks_connection);
        result
    }

    /// Something came that nobody asked for: a late answer, or not a daemon of hamlib's.
    fn has_unasked(&mut self) -> bool {
        let mut byte = [0; 64];
        if self.unread.is_empty()
            && let Ok(count) = self.stream.try_read(&mut byte)
        {
            self.unread.extend_from_slice(&byte[..count]);
        }
        !self.unread.is_empty()
    }

    async fn converse(
        &mut self,
        request: &str,
        name: &str,
        command: &str,
        form: Form,
    ) -> Result<Vec<String>, HamlibError> {
        if let Err(error) = self.stream.write_all(request.as_bytes()).await {
            return Err(self.closed(command, Some(error)));
        }
        let mut lines = Vec::new();
        let mut has_begun = false;
        for _ in 0..LINES {
            let line = self.line(command).await?;
            if let Some(code) = line.strip_prefix("RPRT ") {
                let code = code.trim().parse::<i32>().ok().filter(|code| *code <= 0 && *code > -1000);
                return match code {
                    Some(0) if has_begun => Ok(lines),
                    Some(code) if code < 0 => Err(HamlibError::Refused {
                        address: self.address.clone(),
                        command: command.to_owned(),
                        code,
                    }),
                    _ => Err(self.out_of_step(command, &line)),
                };
            }
            if form == Form::OneLine {
                return Ok(vec![line]);
            }
            if has_begun {
                lines.push(line);
            } else if line.strip_prefix(name).is_some_and(|rest| rest.starts_with(':')) {
                has_begun = true;
            } else {
                return Err(self.out_of_step(command, &line));
            }
        }
        Err(self.endless(command))
    }

    /// The next line without its end.
    async fn line(&mut self, command: &str) -> Result<String, HamlibError> {
        loop {
            if let Some(end) = self.unread.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = self.unread.drain(..=end).collect();
                return Ok(String::from_utf8_lossy(&line).trim_end().to_owned());
            }
            if self.unread.len() > LINE {
                return Err(self.endless(command));
            }
            let mut piece = [0; LINE];
            match self.stream.read(&mut piece).await {
                Ok(0) => return Err(self.closed(command, None)),
                Ok(count) => self.unread.extend_from_slice(&piece[..count]),
                Err(error) => return Err(self.closed(command, Some(error))),
            }
        }
    }

    fn closed(&self, command: &str, source: Option<std::io::Error>) -> HamlibError {
        HamlibError::Closed { address: self.address.clone(), command: command.to_owned(), source }
    }

    fn endless(&self, command: &str) -> HamlibError {
        HamlibError::Endless { address: self.address.clone(), command: command.to_owned() }
    }

    fn out_of_step(&self, command: &str, found: &str) -> HamlibError {
        HamlibError::OutOfStep {
            address: self.address.clone(),
            command: command.to_owned(),
            found: cut(found),
        }
    }

    pub(super) fn malformed(&self, command: &'static str, what: &'static str, found: &str) -> HamlibError {
        HamlibError::Malformed {
            address: self.address.clone(),
            command: command.to_owned(),
            what,
            found: cut(found),
        }
    }

    /// The value behind `key: ` in an answer, as a finite number.
    pub(super) fn number(
        &self,
        command: &'static str,
        lines: &[String],
        key: &'static str,
    ) -> Result<f64, HamlibError> {
        let value = value(lines, key).unwrap_or_default();
        match value.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.malformed(command, key, value)),
        }
    }
}

/// The value behind `key: `.
pub(super) fn value<'a>(lines: &'a [String], key: &str) -> Option<&'a str> {
    lines.iter().find_map(|line| line.strip_prefix(key)?.strip_prefix(':')).map(str::trim)
}

/// Enough of it to recognise.
fn cut(found: &str) -> String {
    found.chars().filter(|c| !c.is_control()).take(60).collect()
}
