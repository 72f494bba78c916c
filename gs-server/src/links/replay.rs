//! A recording, heard once from beginning to end as if it came in now. Never transmits.

use mission::{LinkState, MaybeRadiated, Source};
use tokio_util::sync::CancellationToken;

use super::LinkParts;
use crate::engine::{EngineMessage, LinkCommand};

/// Bytes heard at once, and the pause after them: about 400 frames a second, which the database keeps up with.
const PIECE: usize = 1024;
const PAUSE_US: u64 = 10_000;
/// Larger recordings are cut up by whoever made them.
const MOST_BYTES: u64 = 256 << 20;

pub(crate) async fn run(parts: LinkParts, stop: CancellationToken) {
    let LinkParts { id, section, engine, mut commands, timer, .. } = parts;
    let state = |state| EngineMessage::Link { link: id.clone(), state };
    let path = section.file.clone().unwrap_or_default();
    match read(&path).await {
        Err(reason) => engine.send(state(LinkState::Failed { reason })).await,
        Ok(bytes) => {
            engine.send(state(LinkState::Ok)).await;
            for piece in bytes.chunks(PIECE) {
                if stop.is_cancelled() {
                    return;
                }
                let received = timer.now();
                let bytes = piece.to_vec();
                engine
                    .send(EngineMessage::Bytes { link: id.clone(), bytes, source: Source::File, received })
                    .await;
                let _awake = timer.sleep_until(received.mono.plus(PAUSE_US)).await;
            }
            tracing::info!(link = %id, bytes = bytes.len(), "link {id}: {} was heard to its end", path.display());
            engine.send(state(LinkState::Disabled)).await;
        }
    }
    loop {
        tokio::select! {
            () = stop.cancelled() => return,
            command = commands.recv() => match command {
                Some((LinkCommand::Transmit(transmit), _busy)) => {
                    let reason = "a recording cannot transmit".to_owned();
                    engine.send(EngineMessage::TxFailed { tx: transmit.tx, radiated: MaybeRadiated::No, reason }).await;
                }
                None => return stop.cancelled().await,
            },
        }
    }
}

async fn read(path: &std::path::Path) -> Result<Vec<u8>, String> {
    let show = path.display();
    let size =
        tokio::fs::metadata(path).await.map_err(|error| format!("{show} cannot be read: {error}"))?.len();
    if size > MOST_BYTES {
        return Err(format!("{show} has {size} bytes; {MOST_BYTES} fit, cut it up"));
    }
    let bytes = tokio::fs::read(path).await.map_err(|error| format!("{show} cannot be read: {error}"))?;
    Ok(unhex(&bytes).unwrap_or(bytes))
}

/// The bytes that hex digits in lines stand for; `None` when it is something else. Lines that begin with `#` are
/// remarks, blanks between digits do not count.
fn unhex(text: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(text).ok()?;
    let mut bytes = Vec::with_capacity(text.len() / 2);
    for line in text.lines().filter(|line| !line.trim_start().starts_with('#')) {
        let digits: String = line.chars().filter(|c| !c.is_ascii_whitespace()).collect();
        bytes.extend(hex::decode(digits).ok()?);
    }
    Some(bytes).filter(|bytes| !bytes.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_lines_and_raw_bytes_are_told_apart() {
        assert_eq!(unhex(b"# heard at 12:00\n50 49 58\n454C\n"), Some(b"PIXEL".to_vec()));
        assert_eq!(unhex(b"PIXELSAT\x00\x01"), None);
        assert_eq!(unhex(b"505"), None, "half a byte");
        assert_eq!(unhex(b""), None);
        assert_eq!(unhex(&[0xff, 0x00]), None);
    }
}
