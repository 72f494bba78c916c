//! TLS on both sides: our client against mosquitto's, mosquitto's client against our broker's.

use std::path::Path;

use super::bench::*;

/// A certificate of its own for `localhost`, and its key.
fn certificate(folder: &Path) {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    private(folder, "cert.pem", &made.cert.pem());
    private(folder, "cert.key", &made.signing_key.serialize_pem());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broker_is_believed_by_its_certificate_and_by_nothing_else() {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    certificate(folder.path());
    let file = |name: &str| folder.path().join(name).display().to_string();
    let (cert, key) = (file("cert.pem"), file("cert.key"));
    let config = format!("allow_anonymous true\nuser root\ncertfile {cert}\nkeyfile {key}\n");
    let _broker = mosquitto(folder.path(), port, &config).await;
    let ear = format!("[[ears]]\nname = \"club\"\nkind = \"mqtt\"\nurl = \"mqtts://localhost:{port}\"\n");
    // What this system trusts does not know it.
    let home = Home::new(&ear);
    let bench = home.serve(START).await;
    let way = bench.way("club", |way| way["state"] == "failing").await;
    assert!(way["error"].as_str().unwrap().contains("certificate"), "{way}");
    bench.stop().await;

    let home = Home::new(&format!("{ear}ca_file = \"{cert}\"\n"));
    let bench = home.serve(START).await;
    bench.way("club", |way| way["state"] == "working").await;
    let message = rx(&heartbeat(1_000), START.0);
    assert!(publish(port, "tinygs/team/roof/tele/rx", &message, &["--cafile", &cert, "--insecure"]).await);
    bench.until_heard((1, 0, 1)).await;
    bench.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn boards_may_come_over_tls() {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    certificate(folder.path());
    let cert = folder.path().join("cert.pem").display().to_string();
    let ear = format!(
        "[[ears]]\nname = \"own\"\nkind = \"broker\"\nlisten = \"127.0.0.1:{port}\"\n\
         tls = {{ certificate = \"cert.pem\", key = \"cert.key\" }}\n"
    );
    let home = Home::within(folder, &ear);
    let bench = home.serve(START).await;
    let message = rx(&heartbeat(1_000), START.0);
    assert!(!publish(port, "tinygs/team/roof/tele/rx", &message, &[]).await, "in the clear");
    let secure = ["-h", "localhost", "--cafile", &cert, "-q", "1"];
    assert!(publish(port, "tinygs/team/roof/tele/rx", &message, &secure).await);
    bench.until_heard((1, 0, 1)).await;
    bench.stop().await;
}
