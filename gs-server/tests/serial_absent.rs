//! What a missing port costs: alone in its process, so that the figure is the server's.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed")]

#[expect(dead_code, reason = "shared with the tests in run")]
#[path = "run/support.rs"]
mod support;

use std::time::Duration;

use gs_server::run::RunOptions;
use support::{Folder, Server, pause, wall};

/// CPU time of this process: user and system, in clock ticks of 10 ms.
fn cpu() -> Duration {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("procfs");
    let after_name = stat.rsplit_once(')').expect("a name in brackets").1;
    let fields: Vec<u64> =
        after_name.split_whitespace().skip(11).take(2).map(|f| f.parse().expect("a number")).collect();
    Duration::from_millis(10 * fields.iter().sum::<u64>())
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_missing_port_costs_less_than_five_percent_of_a_processor() {
    let folder = Folder::new();
    let server = Server::start(RunOptions::new(folder.strapped())).await.unwrap();
    pause(Duration::from_millis(500)).await;
    let (began, before) = (wall(), cpu());
    pause(Duration::from_secs(3)).await;
    let share = (cpu() - before).as_secs_f64() / began.elapsed().as_secs_f64();
    assert!(share <= 0.05, "{:.1} %", share * 100.0);
    server.stop().await;
}
