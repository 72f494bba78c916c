//! One frame by five doors, with a restart between them: it is one frame with five receptions.

use mission::{Clock as _, LinkId, Source as From};
use serde_json::{Value, json};

use super::bench::*;
use crate::elements::tests::source::{Source, say};
use crate::engine::EngineMessage;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_same_frame_by_radio_mqtt_api_satnogs_and_kiss_is_one_frame_with_five_receptions() {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let _broker = mosquitto(folder.path(), port, "allow_anonymous true").await;
    let (net, db) = (Source::saying(200, "{\"packets\":[]}").await, Source::saying(200, "[]").await);
    let home = Home::new(&format!(
        "[[ears]]\nname = \"club\"\nkind = \"mqtt\"\nurl = \"mqtt://127.0.0.1:{port}\"\n\
         [[ears]]\nname = \"net\"\nkind = \"tinygs-api\"\nurl = \"http://{}/v2/\"\ndetails = false\n\
         [[ears]]\nname = \"db\"\nkind = \"satnogs-db\"\nurl = \"http://{}/api/telemetry/\"\n",
        net.address, db.address
    ));
    let frame = heartbeat(77_000);
    let bench = home.serve(START).await;
    let (link, received) = (LinkId::new("radio").unwrap(), bench.clock.now());
    let heard = EngineMessage::Bytes { link, bytes: frame.clone(), source: From::Radio, received };
    bench.ready.inbox.send(heard).await;
    bench.until_heard((1, 1, 0)).await;
    bench.stop().await;

    let bench = home.serve(START.plus(5_000_000)).await;
    bench.way("club", |way| way["state"] == "working").await;
    let rx = rx(&frame, START.0 + 1_000_000);
    assert!(publish(port, "tinygs/team/roof/tele/rx", &rx, &["-q", "1"]).await);
    bench.until_heard((1, 1, 1)).await;
    bench.stop().await;

    let packet = json!({"packets": [{"id": "0192aa", "serverTime": START.0 / 1_000 + 4_000, "raw": base64(&frame), "satellite": "Norbi"}]});
    net.now_says(move |_| Some(say(200, &packet.to_string())));
    let row = json!([{"frame": hex::encode(&frame), "observer": "DL0XYZ-JO62qn", "timestamp": "2026-09-21T14:13:18Z", "norad_cat_id": 98_765}]);
    let mut bench = home.serve(START.plus(10_000_000)).await;
    bench.pass(3_600_000_000).await;
    bench.until_heard((1, 1, 2)).await;
    db.now_says(move |_| Some(say(200, &row.to_string())));
    bench.pass(2 * 3_600_000_000).await;
    bench.until_heard((1, 1, 3)).await;
    bench.stop().await;

    let bench = home.serve(START.plus(12 * 3_600_000_000)).await;
    let item = json!({"format": "kiss", "hex": hex::encode(&frame), "occurrence": 1});
    let body = json!({"receiver": "club-house", "at": "2026-09-21T14:13:22Z", "items": [item]});
    for (frames, merged, repeated) in [(0, 1, 0), (0, 0, 1)] {
        let report: Value = bench.post("receptions", &body).await;
        assert_eq!(
            (&report["frames"], &report["merged"], &report["repeated"]),
            (&json!(frames), &json!(merged), &json!(repeated)),
            "{report}"
        );
    }
    bench.until_heard((1, 1, 4)).await;
    let receivers = bench.get("receivers?start=2020-01-01T00:00:00Z").await;
    assert_eq!(
        receivers["items"].as_array().unwrap().len(),
        3,
        "one of the network was not named: {receivers}"
    );
    bench.stop().await;
}
