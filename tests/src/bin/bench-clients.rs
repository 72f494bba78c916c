//! `scripts/bench-clients`: a thousand clients at the stream beside a hundred frames a second, in figures.

use std::process::ExitCode;

use end_to_end::crowd::{Load, run};

fn main() -> ExitCode {
    let mut numbers = std::env::args().skip(1).map(|text| text.parse::<u32>());
    let mut next = |usual: u32| numbers.next().unwrap_or(Ok(usual));
    let (Ok(clients), Ok(frames_per_s), Ok(seconds)) = (next(1000), next(100), next(120)) else {
        eprintln!("usage: bench-clients [CLIENTS [FRAMES_PER_S [SECONDS]]]");
        return ExitCode::from(2);
    };
    let (stalled, hostile) = (clients / 10, clients / 100);
    let load = Load {
        followers: (clients - stalled - hostile) as usize,
        stalled: stalled as usize,
        hostile: hostile as usize,
        frames_per_s,
        seconds,
    };
    println!("{load:?}");
    let figures = run(load);
    println!("{figures}");
    let whole = figures.archived == figures.frames && figures.holes + figures.doubles + figures.lost == 0;
    let within = figures.p99_ms <= 250.0 && figures.jitter_ms() <= 5.0 && figures.memory_mib <= 256.0;
    println!("whole: {whole}; within 250 ms, 5 ms, 256 MiB: {within}");
    if whole && within { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
