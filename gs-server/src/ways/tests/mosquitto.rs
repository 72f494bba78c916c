//! The client against Debian's mosquitto: messages in the exact form of the firmware, and what goes wrong with a broker.

use serde_json::json;

use super::bench::*;

const TOPIC: &str = "tinygs/team/roof/tele/";

async fn say(port: u16, name: &str, message: &str) {
    assert!(publish(port, &format!("{TOPIC}{name}"), message, &[]).await);
}

fn ear(port: u16, more: &str) -> String {
    format!("[[ears]]\nname = \"club\"\nkind = \"mqtt\"\nurl = \"mqtt://127.0.0.1:{port}\"\n{more}")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn messages_of_a_board_become_receptions_and_health() {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let _broker = mosquitto(folder.path(), port, "allow_anonymous true").await;
    let home = Home::new(&ear(port, ""));
    let bench = home.serve(START).await;
    bench.way("club", |way| way["state"] == "working").await;

    say(port, "welcome", WELCOME).await;
    say(port, "ping", PING).await;
    // A board's clock of today, one of 1970, a packet with a wrong checksum, one of the network's tests, one of another
    // satellite with the same settings, one that was cut.
    say(port, "rx", &rx(&heartbeat(1_000), START.0 - 2_000_000)).await;
    say(port, "rx", &rx(&heartbeat(2_000), 31_000_000)).await;
    say(port, "rx", &rx(b"Error_CRC", START.0)).await;
    say(port, "rx", &rx(b"TinyGS-test 7", START.0)).await;
    say(port, "rx", &rx(b"what somebody else says", START.0)).await;
    let whole = rx(&heartbeat(3_000), START.0);
    say(port, "rx", &whole[..whole.len() - 60]).await;
    say(port, "rx", &format!("{{\"pad\":\"{}\",\"data\":\"\"}}", "x".repeat(17_000))).await;
    say(port, "get_weblogin", "1").await;
    let way =
        bench.way("club", |way| way["counts"]["receptions"] == 3 && way["counts"]["malformed"] == 1).await;
    for (reason, count) in [("test-packet", 1), ("foreign", 1), ("malformed", 1)] {
        assert_eq!(way["counts"][reason], count, "{way}");
    }
    bench.until_heard((2, 0, 1)).await;

    let kept = bench.get("receptions").await;
    let basis = |at: usize| (kept["items"][at]["kind"].clone(), kept["items"][at]["time_basis"].clone());
    assert_eq!(basis(0), (json!("detection"), json!("board-at-reception")), "{kept}");
    assert_eq!(basis(1), (json!("frame"), json!("arrival")), "a clock of 1970 counts for nothing");
    assert_eq!(kept["items"][1]["doubts"], json!(["time-too-early"]));
    assert_eq!(basis(2), (json!("frame"), json!("board-at-reception")), "firmware 2603242");
    assert_eq!(kept["items"][2]["frequency_hz"], 435_003_000.0);
    let receivers = bench.get("receivers").await;
    let roof = &receivers["items"][0];
    assert_eq!(
        (&roof["id"], &roof["frames"], &roof["without_frame"]),
        (&json!("team/roof"), &json!(2), &json!(1))
    );
    assert_eq!((&roof["median_snr_db"], &roof["board"]["online"]), (&json!(-11.75), &json!(true)));
    assert_eq!(
        (&roof["board"]["packets"], &roof["board"]["mac"]),
        (&json!(6), &json!("A0B1C2D3E4F5")),
        "{roof}"
    );

    say(port, "status", "0").await;
    let mut online = true;
    for _ in 0..500 {
        online = bench.get("receivers").await["items"][0]["board"]["online"] == true;
        if !online {
            break;
        }
        crate::clock::wall_sleep(std::time::Duration::from_millis(10)).await;
    }
    assert!(!online, "its last will was heard");
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broker_that_goes_and_comes_back_is_found_again() {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let home = Home::new(&ear(port, ""));
    let bench = home.serve(START).await;
    let failing = bench.way("club", |way| way["state"] == "failing").await;
    assert!(failing["error"].as_str().unwrap().contains("no connection"), "{failing}");
    let broker = mosquitto(folder.path(), port, "allow_anonymous true").await;
    bench.way("club", |way| way["state"] == "working").await;
    drop(broker);
    bench.way("club", |way| way["state"] == "failing").await;
    let _broker = mosquitto(folder.path(), port, "allow_anonymous true").await;
    bench.way("club", |way| way["counts"]["connections"] == 2).await;
    say(port, "rx", &rx(&heartbeat(1_000), START.0)).await;
    bench.until_heard((1, 0, 1)).await;
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broker_that_refuses_is_told_to_people_and_not_hammered() {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let passwords = folder.path().join("passwords");
    std::fs::write(&passwords, "").unwrap();
    let status = std::process::Command::new("mosquitto_passwd")
        .args(["-b", passwords.to_str().unwrap(), "team", "correct horse"])
        .status();
    assert!(status.unwrap().success());
    let config = format!("allow_anonymous false\npassword_file {}\nuser root", passwords.display());
    let _broker = mosquitto(folder.path(), port, &config).await;
    let home = Home::new(&ear(port, "user = \"team\"\npassword_file = \"pw\"\n"));
    home.write("pw", "hunter2\n");
    let bench = home.serve(START).await;
    let refused = bench.way("club", |way| way["state"] == "refused").await;
    let words = refused["error"].as_str().unwrap();
    assert!(words.contains("password_file") && !words.contains("hunter2"), "{refused}");
    let mut alerts = json!(null);
    for _ in 0..500 {
        alerts = bench.get("alerts").await;
        if alerts["items"][0]["kind"] == "ear" {
            break;
        }
        crate::clock::wall_sleep(std::time::Duration::from_millis(10)).await;
    }
    assert_eq!(alerts["items"][0]["kind"], "ear", "{alerts}");
    bench.stop().await;

    home.write("pw", "correct horse\n");
    let bench = home.serve(START.plus(60_000_000)).await;
    bench.way("club", |way| way["state"] == "working").await;
    bench.stop().await;
}
