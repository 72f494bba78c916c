//! Whole passes in stepped time, and everything that may go wrong in one.

use mission::pointing::{Mount, Position};

use super::daemon::{Daemon, Manner};
use super::*;
use crate::config::RotatorSection;

fn section(daemon: &Daemon) -> RotatorSection {
    RotatorSection {
        address: daemon.address.clone(),
        azimuth_range: (0.0, 450.0),
        park: Some((180.0, 0.0)),
        reply_timeout_ms: 150,
        ..RotatorSection::default()
    }
}

/// A station ten minutes before a pass, with its antenna at work.
async fn bench(pass: &Pass, change: impl FnOnce(&mut RotatorSection)) -> (Bench, Daemon, Mount) {
    let (clock, timer) = Bench::clock(UtcUs(pass.aos.at.unix_us()).plus(-600_000_000));
    let held = timer.busy("set-up");
    let daemon = Daemon::start(&timer, Manner::Good).await;
    let mut section = section(&daemon);
    change(&mut section);
    let bench = Bench::start(clock, timer, Some(&section), None);
    drop(held);
    (bench, daemon, section.mount().unwrap())
}

fn los(pass: &Pass) -> UtcUs {
    UtcUs(pass.los.at.unix_us())
}

fn aos(pass: &Pass) -> UtcUs {
    UtcUs(pass.aos.at.unix_us())
}

/// The largest angle between antenna and satellite while it looks, degrees.
async fn watch(bench: &Bench, daemon: &Daemon, mount: &Mount, until: UtcUs) -> f64 {
    let mut worst = 0.0_f64;
    bench
        .until(until, |_, now| {
            let wanted = mount.wanted(direction(now));
            worst = worst.max(daemon.position().direction().angle_deg(wanted));
        })
        .await;
    worst
}

/// What holds of every command, whatever happened.
fn commands_were_proper(daemon: &Daemon, mount: &Mount) {
    let commanded = daemon.commanded();
    for (at, position) in &commanded {
        assert!(mount.allows(*position), "{position:?} at {at:?}");
    }
    for pair in commanded.windows(2) {
        assert!(pair[1].0.0 - pair[0].0.0 >= 999_999, "{pair:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn through_a_whole_pass_it_looks_at_the_satellite_and_then_rests() {
    for pass in [pass(10.0, 20.0), pass(35.0, 50.0)] {
        let (bench, daemon, mount) = bench(&pass, |_| {}).await;
        bench.handle().track(tracking(&pass));
        bench.seconds(30).await;
        let status = bench.rotator();
        assert!(status.is_connected && status.trouble.is_none(), "{status:?}");
        let route = status.route.clone().unwrap();
        assert_eq!(status.goal, Goal::Waiting { until: route.leaves });
        assert!(daemon.commanded().is_empty(), "it does not leave early");
        bench.until(aos(&pass), |_, _| {}).await;
        let status = bench.rotator();
        assert!(status.is_on_target, "in place at AOS: {status:?}");
        assert!(daemon.position().way_deg(route.start) < 2.5);
        let worst = watch(&bench, &daemon, &mount, los(&pass)).await;
        // The dead band on both axes and a second and a half of travel.
        assert!(worst < 5.0, "{worst}");
        let count = daemon.commanded().len();
        assert!((20..400).contains(&count), "{count} commands");
        bench.seconds(120).await;
        let status = bench.rotator();
        assert_eq!((status.goal, status.trouble.as_ref()), (Goal::Parked, None));
        assert!(daemon.position().way_deg(Position { azimuth_deg: 180.0, elevation_deg: 0.0 }) <= 2.0);
        commands_were_proper(&daemon, &mount);
        bench.end().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rotator_whose_daemon_dies_in_the_middle_is_found_again_and_goes_on() {
    let pass = pass(35.0, 50.0);
    let (bench, mut daemon, mount) = bench(&pass, |_| {}).await;
    bench.handle().track(tracking(&pass));
    bench.until(aos(&pass).plus(120_000_000), |_, _| {}).await;
    daemon.die().await;
    bench.seconds(20).await;
    let status = bench.rotator();
    let trouble = status.trouble.clone().unwrap();
    assert!(!status.is_connected && status.position.is_none(), "what is not known is not told: {status:?}");
    assert!(trouble.text.contains("cannot be reached") && trouble.text.contains("rotctld"), "{trouble:?}");
    let now = bench.clock.now().utc;
    assert!((18_000_000..=21_000_000).contains(&(now.0 - trouble.since.0)), "since the connection broke");
    daemon.rise().await;
    bench.seconds(40).await;
    assert!(bench.rotator().trouble.is_none() && bench.rotator().goal == Goal::Tracking);
    let worst = watch(&bench, &daemon, &mount, los(&pass)).await;
    assert!(worst < 5.0, "{worst}");
    bench.seconds(120).await;
    assert_eq!(bench.rotator().goal, Goal::Parked);
    commands_were_proper(&daemon, &mount);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn attempts_to_connect_become_rarer() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, _) = bench(&pass, |_| {}).await;
    bench.handle().track(tracking(&pass));
    bench.seconds(10).await;
    daemon.set(Manner::Silent);
    let before = daemon.state.lock().unwrap().connections;
    bench.seconds(300).await;
    let attempts = daemon.state.lock().unwrap().connections - before;
    // Each attempt takes two connections: one that learns that the limits are not told, and one without.
    assert!((8..=32).contains(&attempts), "{attempts} connections in five minutes");
    assert!(bench.rotator().trouble.as_ref().unwrap().text.contains("does not answer"));
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rotator_that_refuses_is_told_again_and_reported() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, mount) = bench(&pass, |_| {}).await;
    daemon.set(Manner::Refusing(-9));
    bench.handle().track(tracking(&pass));
    bench.until(aos(&pass).plus(60_000_000), |_, _| {}).await;
    let trouble = bench.rotator().trouble.clone().unwrap();
    assert!(trouble.text.contains("rejected by the device (RPRT -9)"), "{trouble:?}");
    assert_eq!(bench.rotator().commands, 0, "nothing was taken");
    daemon.set(Manner::Good);
    bench.seconds(90).await;
    assert!(bench.rotator().trouble.is_none(), "{:?}", bench.rotator());
    assert!(watch(&bench, &daemon, &mount, los(&pass)).await < 5.0);
    commands_were_proper(&daemon, &mount);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rotator_with_narrower_limits_than_configured_is_never_sent_beyond_them() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, _) = bench(&pass, |section| section.elevation_range = (0.0, 90.0)).await;
    daemon.state.lock().unwrap().limits = (0.0, 360.0, 5.0, 30.0);
    daemon.die().await;
    let mut daemon = daemon;
    daemon.rise().await;
    bench.handle().track(tracking(&pass));
    bench.until(los(&pass).plus(-2_000_000), |_, _| {}).await;
    let commanded = daemon.commanded();
    assert!(commanded.len() > 10);
    assert!(commanded.iter().all(|(_, p)| (0.0..=360.0).contains(&p.azimuth_deg)));
    assert!(commanded.iter().all(|(_, p)| (5.0..=30.0).contains(&p.elevation_deg)));
    let status = bench.rotator();
    assert!(status.route.as_ref().unwrap().keyholes.iter().any(|k| k.worst_deg > 5.0), "told beforehand");
    assert!(status.trouble.is_none(), "{status:?}");
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn rprt_0_without_motion_is_noticed() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, _) = bench(&pass, |_| {}).await;
    daemon.set(Manner::Frozen);
    bench.handle().track(tracking(&pass));
    bench.until(aos(&pass), |_, _| {}).await;
    let trouble = bench.rotator().trouble.clone().unwrap();
    assert!(trouble.text.contains("does not turn") && trouble.text.contains("end stops"), "{trouble:?}");
    assert!(!bench.rotator().is_on_target);
    assert!(daemon.commanded().len() >= 3, "told again");
    daemon.set(Manner::Good);
    bench.seconds(100).await;
    assert!(bench.rotator().trouble.is_none());
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn positions_that_jump_or_are_no_numbers_are_told_and_do_not_mislead_it() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, mount) = bench(&pass, |_| {}).await;
    bench.handle().track(tracking(&pass));
    bench.until(aos(&pass).plus(30_000_000), |_, _| {}).await;
    daemon.set(Manner::Jumping);
    let mut jumps = 0;
    bench
        .until(aos(&pass).plus(90_000_000), |bench, _| {
            jumps += usize::from(bench.rotator().trouble.as_ref().is_some_and(|t| t.text.contains("jumped")));
        })
        .await;
    assert!(jumps >= 10, "{jumps}");
    daemon.set(Manner::Good);
    bench.seconds(10).await;
    assert!(watch(&bench, &daemon, &mount, aos(&pass).plus(150_000_000)).await < 5.0);
    daemon.set(Manner::Nan);
    bench.seconds(3).await;
    let status = bench.rotator();
    assert!(status.trouble.as_ref().unwrap().text.contains("'nan', which is no such value"), "{status:?}");
    assert!(!status.is_on_target, "unknown");
    commands_were_proper(&daemon, &mount);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn newer_elements_in_the_middle_of_a_pass_are_followed_at_once() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, mount) = bench(&pass, |_| {}).await;
    let mut older = tracking(&pass);
    let mut elements = elements();
    elements.mean_anomaly_deg += 3.0;
    older.elements = Arc::new(elements);
    bench.handle().track(older);
    bench.until(aos(&pass).plus(200_000_000), |_, _| {}).await;
    let off = daemon.position().direction().angle_deg(direction(bench.clock.now().utc));
    assert!(off > 5.0, "{off}");
    bench.handle().track(tracking(&pass));
    bench.seconds(15).await;
    assert!(watch(&bench, &daemon, &mount, los(&pass)).await < 5.0);
    commands_were_proper(&daemon, &mount);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn stop_stops_and_park_parks_and_release_of_an_antenna_that_was_not_moved_moves_nothing() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, mount) = bench(&pass, |section| section.park = None).await;
    bench.handle().release();
    bench.seconds(10).await;
    assert!(daemon.asked("park").is_empty() && daemon.asked("stop").is_empty());
    assert_eq!(bench.rotator().goal, Goal::Idle);
    bench.handle().track(tracking(&pass));
    bench.until(aos(&pass).plus(100_000_000), |_, _| {}).await;
    bench.handle().stop();
    bench.seconds(3).await;
    assert_eq!((daemon.asked("stop").len(), bench.rotator().goal), (1, Goal::Stopped));
    let stopped = daemon.commanded().len();
    bench.until(los(&pass), |_, _| {}).await;
    assert_eq!(daemon.commanded().len(), stopped, "it stays");
    bench.handle().park();
    bench.seconds(120).await;
    assert_eq!((daemon.asked("park").len(), bench.rotator().goal), (1, Goal::Parked));
    assert!(daemon.position().way_deg(Position { azimuth_deg: 0.0, elevation_deg: 0.0 }) < 0.1);
    commands_were_proper(&daemon, &mount);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rotator_without_a_park_command_stays_and_says_so() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, _) = bench(&pass, |section| section.park = None).await;
    bench.handle().track(tracking(&pass));
    bench.until(aos(&pass).plus(100_000_000), |_, _| {}).await;
    daemon.set(Manner::Saying("park:\nRPRT -4\n".into()));
    bench.handle().release();
    bench.seconds(2).await;
    daemon.set(Manner::Good);
    bench.seconds(60).await;
    let status = bench.rotator();
    assert!(matches!(status.goal, Goal::Parked | Goal::Stopped), "{status:?}");
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn when_nobody_steers_it_any_more_it_parks() {
    let pass = pass(35.0, 50.0);
    let (mut bench, daemon, mount) = bench(&pass, |_| {}).await;
    bench.handle().track(tracking(&pass));
    bench.until(aos(&pass).plus(100_000_000), |_, _| {}).await;
    drop(bench.handle.take());
    bench.seconds(120).await;
    assert!(daemon.position().way_deg(Position { azimuth_deg: 180.0, elevation_deg: 0.0 }) <= 2.0);
    commands_were_proper(&daemon, &mount);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn at_the_end_it_is_stopped_and_parked_within_the_time_whatever_the_daemon_does() {
    for manner in [Manner::Good, Manner::Repeating, Manner::Cutting, Manner::Silent] {
        let pass = pass(35.0, 50.0);
        let (bench, daemon, _) = bench(&pass, |section| section.reply_timeout_ms = 5_000).await;
        bench.handle().track(tracking(&pass));
        bench.until(aos(&pass).plus(100_000_000), |_, _| {}).await;
        let is_good = manner == Manner::Good;
        daemon.set(manner.clone());
        let took = bench.end().await;
        assert!(took < std::time::Duration::from_millis(2_600), "{manner:?}: {took:?}");
        if is_good {
            assert_eq!(daemon.asked("stop").len(), 1);
            let last = daemon.commanded().pop().unwrap().1;
            assert_eq!(last, Position { azimuth_deg: 180.0, elevation_deg: 0.0 });
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_that_ends_while_the_daemon_hangs_reaches_it_by_another_connection() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, _) = bench(&pass, |section| section.reply_timeout_ms = 5_000).await;
    bench.handle().track(tracking(&pass));
    bench.until(aos(&pass).plus(100_000_000), |_, _| {}).await;
    daemon.set(Manner::Silent);
    // Woken at once, it is in the middle of an exchange when the end comes, and time stands still there.
    bench.handle().track(tracking(&pass));
    crate::clock::wall_sleep(std::time::Duration::from_millis(100)).await;
    daemon.set(Manner::Good);
    let took = bench.end().await;
    assert!(took < std::time::Duration::from_secs(2), "{took:?}");
    assert_eq!(daemon.asked("stop").len(), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn elements_that_say_nothing_of_the_pass_are_told() {
    let pass = pass(35.0, 50.0);
    let (bench, daemon, _) = bench(&pass, |_| {}).await;
    let mut dead = elements();
    dead.mean_motion_rev_day = 19.0;
    bench.handle().track(Tracking { elements: Arc::new(dead), ..tracking(&pass) });
    bench.seconds(20).await;
    let trouble = bench.rotator().trouble.clone().unwrap();
    assert!(
        trouble.text.contains("iss cannot be followed") && trouble.text.contains("newer elements"),
        "{trouble:?}"
    );
    assert!(daemon.commanded().is_empty());
    bench.end().await;
}
