//! Whether the kernel says that its clock is synchronised.
//!
//! The kernel's own answer is `adjtimex(2)`, which has no safe wrapper among our libraries and this workspace forbids
//! `unsafe`. So those are asked who ask the kernel: the mark that systemd-timesyncd leaves, then `timedatectl` (whose
//! `NTPSynchronized` *is* the kernel's flag, whoever set it), then `chronyc`. Where none of them is there, the answer is
//! no, and an operator vouches for the clock (`POST /clock/vouch`) or the configuration does (`clock = "trust"`).

use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use tokio::process::Command;

use super::within;

/// Longer than this nobody is waited for.
const PATIENCE: Duration = Duration::from_secs(1);

pub(crate) async fn kernel_says_synchronised() -> bool {
    if Path::new("/run/systemd/timesync/synchronized").exists() {
        return true;
    }
    let told = answer("timedatectl", &["show", "--property=NTPSynchronized", "--value"]).await;
    if told.is_some_and(|answer| answer.trim() == "yes") {
        return true;
    }
    answer("chronyc", &["-c", "tracking"]).await.is_some_and(|answer| chrony_is_synchronised(&answer))
}

/// How far the machine's clock is from the time of its sources, seconds, when chrony keeps it.
pub(crate) async fn clock_offset_s() -> Option<f64> {
    let line = answer("chronyc", &["-c", "tracking"]).await?;
    chrony_offset_s(&line)
}

/// The fifth field of `chronyc -c tracking`.
fn chrony_offset_s(line: &str) -> Option<f64> {
    chrony_is_synchronised(line).then(|| line.trim().split(',').nth(4)?.parse().ok()).flatten()
}

async fn answer(program: &str, arguments: &[&str]) -> Option<String> {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stderr(Stdio::null()).kill_on_drop(true);
    let output = within(PATIENCE, command.output()).await?.ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Fields of `chronyc -c tracking`: the third is the stratum (0 when there is no source), the last the leap status.
fn chrony_is_synchronised(line: &str) -> bool {
    let fields: Vec<&str> = line.trim().split(',').collect();
    fields.len() >= 14
        && fields[2].parse::<u8>().is_ok_and(|stratum| stratum > 0)
        && fields[13] != "Not synchronised"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chrony_answers_are_understood() {
        let good = "C0A80001,gate,3,1700000000.0,0.000001,0.0,0.0,1.0,0.0,0.0,0.001,0.0002,64.2,Normal";
        assert!(chrony_is_synchronised(good));
        assert_eq!(chrony_offset_s(good), Some(0.000_001));
        assert_eq!(chrony_offset_s("506 Cannot talk to daemon"), None);
        assert!(!chrony_is_synchronised(&good.replace(",3,", ",0,")));
        assert!(!chrony_is_synchronised(&good.replace("Normal", "Not synchronised")));
        assert!(!chrony_is_synchronised("506 Cannot talk to daemon"));
    }
}
