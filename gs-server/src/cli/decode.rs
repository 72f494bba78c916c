//! `gs-server decode`.

use std::fs::File;
use std::io::{self, BufWriter, Read, Write as _};
use std::path::PathBuf;

use clap::Args;

use super::shell::quiet_pipe;
use super::{Exit, Failure};
use crate::decode::{Decoder, Format, Report, Unwrap};

/// `gs-server decode`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server decode capture.bin
  echo 504958454c534154... | gs-server decode -
  gs-server decode observation.b64 | jq 'select(.name == \"Heartbeat\") | .fields.temp'

Each line is one object, told apart by \"kind\": frame, sealed-uplink (a telecommand, seen from
outside), skipped (with a reason), text (characters that are no hex or base64), and one summary
at the end. Offsets count bytes after hex or base64 was undone. A value that is NaN or infinite
on the wire is null with \"invalid\": true.

Exit code 0 if there was at least one frame, 1 if there was none.")]
pub struct Decode {
    /// A capture, or - for standard input
    #[arg(value_name = "FILE", default_value = "-")]
    file: PathBuf,
    /// How the input is written
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// The byte after each frame is its level, as the radio module appends it
    #[arg(long)]
    rssi: bool,
    /// Add the whole frame in hex to each object
    #[arg(long)]
    hex: bool,
    /// Leave out what was skipped
    #[arg(long)]
    frames_only: bool,
}

impl Decode {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let name = self.file.display().to_string();
        let input: Box<dyn Read> = if name == "-" {
            Box::new(io::stdin().lock())
        } else {
            Box::new(
                File::open(&self.file).map_err(|e| Failure::doing(format!("{name} cannot be opened"), e))?,
            )
        };
        self.decode(input, io::stdout().lock(), &name)
    }

    fn decode(&self, mut input: Box<dyn Read>, output: impl io::Write, name: &str) -> Result<Exit, Failure> {
        let mut printer =
            Printer { out: BufWriter::new(output), frames_only: self.frames_only, written: Ok(()) };
        let mut unwrap = Unwrap::new(self.format);
        let mut decoder = Decoder::new(self.rssi).with_hex(self.hex);
        let mut piece = vec![0; 1 << 16];
        let mut bytes = Vec::new();
        loop {
            let len = match input.read(&mut piece) {
                Ok(0) => break,
                Ok(len) => len,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(Failure::doing(format!("{name} cannot be read"), error)),
            };
            unwrap.push(&piece[..len], &mut bytes, &mut |note| printer.tell(&Report::Text(note)));
            decoder.push(&bytes, &mut |report| printer.tell(&report));
            bytes.clear();
            if let Err(error) = printer.flush() {
                return end_of_output(error);
            }
        }
        unwrap.finish(&mut bytes, &mut |note| printer.tell(&Report::Text(note)));
        decoder.push(&bytes, &mut |report| printer.tell(&report));
        let summary = decoder.finish(&mut |report| printer.tell(&report));
        printer.tell(&Report::Summary(summary));
        match printer.flush() {
            Err(error) => end_of_output(error),
            Ok(()) if summary.frames + summary.sealed_uplinks > 0 => Ok(Exit::Done),
            Ok(()) => Err(Failure::failed(format!(
                "no frame in {} bytes of {name}: neither PIXELSAT nor DESTINY_ with what must follow",
                summary.bytes
            ))),
        }
    }
}

/// Writes reports; the first error stays until it is asked for.
struct Printer<W: io::Write> {
    out: BufWriter<W>,
    frames_only: bool,
    written: io::Result<()>,
}

impl<W: io::Write> Printer<W> {
    fn tell(&mut self, report: &Report) {
        let is_told = !self.frames_only
            || matches!(report, Report::Frame(_) | Report::SealedUplink(_) | Report::Summary(_));
        if self.written.is_ok() && is_told {
            self.written = serde_json::to_writer(&mut self.out, report)
                .map_err(io::Error::from)
                .and_then(|()| self.out.write_all(b"\n"));
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        std::mem::replace(&mut self.written, Ok(())).and_then(|()| self.out.flush())
    }
}

/// Whoever reads our output has gone (all is well then), or it cannot be written.
fn end_of_output(error: io::Error) -> Result<Exit, Failure> {
    quiet_pipe(error)
        .map(|()| Exit::Done)
        .map_err(|error| Failure::doing("standard output cannot be written", error))
}
