//! A rig through a pass, and rigs that do not do as they say.

use mission::pointing::look_at;
use tle::{Propagator, doppler};

use super::daemon::{Daemon, Manner};
use super::*;
use crate::config::RigSection;

const DOWN_HZ: f64 = 437_800_000.0;
const UP_HZ: f64 = 145_990_000.0;

async fn bench(pass: &Pass) -> (Bench, Daemon) {
    let (clock, timer) = Bench::clock(UtcUs(pass.aos.at.unix_us()).plus(-120_000_000));
    let held = timer.busy("set-up");
    let daemon = Daemon::start(&timer, Manner::Good).await;
    let section = RigSection {
        address: daemon.address.clone(),
        downlink_hz: 437_800_000,
        uplink_hz: Some(145_990_000),
        resolution_hz: 10,
        step_hz: 50,
        reply_timeout_ms: 150,
    };
    let bench = Bench::start(clock, timer, None, Some(&section));
    drop(held);
    (bench, daemon)
}

fn range_rate(at: UtcUs) -> f64 {
    look_at(&Propagator::new(&elements()).unwrap(), &site(), at).unwrap().range_rate_km_s
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn through_a_whole_pass_both_frequencies_follow_the_shift_and_then_go_back() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon) = bench(&pass).await;
    bench.handle().track(tracking(&pass));
    bench.seconds(60).await;
    assert!(daemon.asked("set_").is_empty(), "not that early");
    let (aos, los) = (UtcUs(pass.aos.at.unix_us()), UtcUs(pass.los.at.unix_us()));
    bench.until(aos, |_, _| {}).await;
    let (mut worst, mut first, mut last) = (0.0_f64, None, 0.0);
    bench
        .until(los.plus(-2_000_000), |bench, now| {
            let state = daemon.state.lock().unwrap();
            let rate = range_rate(now);
            let receive = state.receive_hz - doppler::received_hz(DOWN_HZ, rate);
            let transmit = state.transmit_hz - doppler::uplink_hz(UP_HZ, rate);
            worst = worst.max(receive.abs()).max(transmit.abs());
            let shift = bench.rig().shift_hz.unwrap();
            first.get_or_insert(shift);
            last = shift;
        })
        .await;
    // Half a step of the synthesiser, a threshold, and a second and a half of drift.
    assert!(worst < 5.0 + 50.0 + 1.5 * 160.0, "{worst}");
    assert!(first.unwrap() > 8_000.0 && last < -8_000.0, "{first:?} to {last}");
    let status = bench.rig();
    assert!(status.trouble.is_none() && status.residual_hz.unwrap().abs() <= 60.0, "{status:?}");
    bench.seconds(15).await;
    assert_eq!(daemon.state.lock().unwrap().receive_hz, DOWN_HZ, "nominal again");
    assert_eq!(bench.rig().satellite, None);
    let sets = daemon.asked("set_freq");
    assert!((30..600).contains(&sets.len()), "{}", sets.len());
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rig_that_shows_another_frequency_than_it_accepted_is_told() {
    for shown in [144e6, f64::NAN, -9_223_372_036_854_775_808.0] {
        let pass = pass(35.0, 50.0);
        let (bench, daemon) = bench(&pass).await;
        daemon.state.lock().unwrap().stays_on_hz = Some(shown);
        bench.handle().track(tracking(&pass));
        bench.until(UtcUs(pass.aos.at.unix_us()), |_, _| {}).await;
        let status = bench.rig();
        let trouble = status.trouble.clone().unwrap();
        assert!(trouble.text.contains("accepted") || trouble.text.contains("no such value"), "{trouble:?}");
        assert_eq!(status.receive_hz, None, "what is not known is not told");
        daemon.state.lock().unwrap().stays_on_hz = None;
        bench.seconds(5).await;
        assert!(bench.rig().trouble.is_none() && bench.rig().receive_hz.is_some());
        bench.end().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rig_whose_daemon_dies_is_tuned_again_when_it_is_back_and_left_in_order() {
    let pass = pass(35.0, 50.0);
    let (bench, mut daemon) = bench(&pass).await;
    bench.handle().track(tracking(&pass));
    bench.until(UtcUs(pass.aos.at.unix_us()).plus(60_000_000), |_, _| {}).await;
    daemon.die().await;
    bench.seconds(10).await;
    assert!(bench.rig().trouble.is_some() && !bench.rig().is_connected);
    daemon.rise().await;
    bench.seconds(30).await;
    assert!(bench.rig().trouble.is_none(), "{:?}", bench.rig());
    let took = bench.end().await;
    assert!(took < std::time::Duration::from_secs(2), "{took:?}");
    assert_eq!(daemon.state.lock().unwrap().receive_hz, DOWN_HZ, "nominal at the end");
}
