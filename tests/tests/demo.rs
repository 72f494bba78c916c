//! The demo as a stranger runs it, under every kind of sky: the image comes home byte for byte, and the one JSON object
//! says everything that it promises.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::time::Duration;

use end_to_end::process::{gs_server, run};
use end_to_end::wait::now;
use serde_json::Value;

/// Per byte: one damaged full frame in nine.
const FLIPS: &str = "0.0005";

fn home(seed: u64, loss: &str, flips: &str) {
    let seed_text = seed.to_string();
    let arguments =
        ["demo", "--until", "image", "--json", "--seed", &seed_text, "--loss", loss, "--flips", flips];
    let began = now();
    let (code, out, error) = run(gs_server(arguments));
    let took = began.elapsed();
    let replay = format!("gs-server {}", arguments.join(" "));
    assert_eq!(code, 0, "{replay}\n{out}\n{error}");
    let summary: Value = serde_json::from_str(&out).unwrap_or_else(|e| panic!("{replay}: {e}: {out}"));
    check(&summary, seed, loss, flips, &replay);
    eprintln!("{replay}: {took:.1?}, {out}");
    assert!(took < Duration::from_secs(180), "{replay} took {took:?}");
}

fn check(summary: &Value, seed: u64, loss: &str, flips: &str, replay: &str) {
    let number = |path: &str| {
        summary.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{replay}: no number {path}"))
    };
    let text = |path: &str| summary.pointer(path).and_then(Value::as_str).unwrap_or_default().to_owned();
    assert_eq!(summary["equal"], true, "{replay}");
    assert_eq!(summary["reason"], Value::Null, "{replay}");
    assert_eq!(summary["seed"].as_u64(), Some(seed), "{replay}");
    assert_eq!(text("/sha256/ground").len(), 64, "{replay}");
    assert_eq!(text("/sha256/ground"), text("/sha256/twin"), "{replay}");
    let (sent, heard) = (number("/frames/sent"), number("/frames/heard"));
    assert!(sent >= heard && heard > 0.0, "{replay}: {sent} sent, {heard} heard");
    // Under a clear sky too the horizon swallows a frame now and then.
    assert!(number("/frames/lost") > 0.0 || loss == "0", "{replay}: frames lost");
    assert_eq!(number("/frames/bad") > 0.0, flips != "0", "{replay}: frames bad");
    assert!(number("/requests") >= 1.0, "{replay}");
    let total = number("/chunks/total");
    assert!(total > 1.0 && number("/chunks/held") == total, "{replay}: chunks held");
    assert!(number("/chunks/sent") >= number("/chunks/received"), "{replay}: chunks received");
    assert!(number("/chunks/received") >= total && number("/chunks/bridged") >= 0.0, "{replay}: chunks");
    let loss: f64 = loss.parse().expect("a number");
    let bound = number("/airtime/bound_frames");
    assert!((bound - total / (1.0 - loss)).abs() < 1e-6 * bound, "{replay}: bound {bound}");
    let (up, down, used) = (number("/airtime/up_s"), number("/airtime/down_s"), number("/airtime/used_s"));
    assert!(up > 0.0 && down > 0.0 && (up + down - used).abs() < 1e-6 * used, "{replay}: airtime");
    assert!(
        number("/airtime/bound_s") > 0.0 && number("/simulated_s") > 0.0 && number("/wall_s") > 0.0,
        "{replay}"
    );
    let commands = summary["commands"].as_object().unwrap_or_else(|| panic!("{replay}: no commands"));
    assert!(commands.get("answered").and_then(Value::as_u64) >= Some(2), "{replay}: {commands:?}");
}

#[test]
fn clear_sky() {
    home(11, "0", "0");
}

#[test]
fn flipped_bits() {
    home(12, "0", FLIPS);
}

#[test]
fn a_fifth_is_lost() {
    home(13, "0.2", "0");
}

#[test]
fn a_fifth_is_lost_and_bits_are_flipped() {
    home(14, "0.2", FLIPS);
}

#[test]
fn half_is_lost() {
    home(15, "0.5", "0");
}

#[test]
fn half_is_lost_and_bits_are_flipped() {
    home(16, "0.5", FLIPS);
}
