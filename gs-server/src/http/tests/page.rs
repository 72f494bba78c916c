//! The page: whole, and with nothing in it that its own security policy or good sense forbids.

use std::time::Duration;

use super::super::page::FILES;
use super::{Bench, chunk, heartbeat, image_info};
use crate::clock::wall_sleep;

#[tokio::test]
async fn every_file_that_the_page_names_is_served_with_its_type() {
    let bench = Bench::new().await;
    let mut texts = Vec::new();
    for path in ["/", "/plan", "/login", "/welcome", "/api/docs"] {
        let page = bench.get(path).await;
        assert_eq!(page.header("content-type"), "text/html; charset=utf-8");
        assert!(page.header("content-security-policy").contains("default-src 'self'"), "{path}");
        texts.push(String::from_utf8(page.bytes).unwrap());
    }
    // From each page the other is a click away.
    assert!(texts.iter().take(2).all(|text| text.contains("href=\"/\"") && text.contains("href=\"/plan\"")));
    // What links the pages of reports have.
    texts.push(include_str!("../../report/html.rs").to_owned());
    texts.extend(FILES.iter().map(|(_, text)| (*text).to_owned()));
    for (name, _) in FILES {
        let file = bench.get(&format!("/page/{name}")).await;
        let expected = match name.rsplit_once('.').unwrap().1 {
            "js" => "text/javascript; charset=utf-8",
            "css" => "text/css; charset=utf-8",
            _ => "image/svg+xml",
        };
        assert_eq!((file.status().as_u16(), file.header("content-type")), (200, expected), "{name}");
        assert!(texts.iter().any(|text| text.contains(name)), "{name} is used by nobody");
    }
    let named = texts.iter().flat_map(|text| {
        let modules = text.split("from \"./").skip(1);
        let links = text.split("\"/page/").skip(1);
        modules.chain(links).filter_map(|rest| rest.split('"').next().map(str::to_owned))
    });
    for name in named.collect::<Vec<_>>() {
        assert!(FILES.iter().any(|(known, _)| *known == name), "{name} is missing");
    }
    assert_eq!(bench.get("/favicon.ico").await.header("content-type"), "image/svg+xml");
}

#[test]
fn data_reaches_the_page_as_text_only_and_nothing_is_fetched_from_elsewhere() {
    for (page, module) in [
        (include_str!("../page/index.html"), "main.js"),
        (include_str!("../page/plan.html"), "plan.js"),
        (include_str!("../page/docs.html"), "docs.js"),
    ] {
        assert!(!page.contains("<style") && !page.contains(" style=") && !page.contains(" onclick"));
        assert_eq!(page.matches("<script").count(), 1);
        assert!(page.contains(&format!("src=\"/page/{module}\"")));
    }
    for (name, text) in FILES {
        for forbidden in [
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            "document.write",
            "eval(",
            "localStorage",
            "sessionStorage",
            "document.cookie",
            "@import",
            "setAttribute(\"style",
        ] {
            assert!(!text.contains(forbidden), "{name} has {forbidden}");
        }
        let text = text.replace("http://www.w3.org/2000/svg", "");
        assert!(!text.contains("http://") && !text.contains("https://"), "{name} leads elsewhere");
    }
}

/// Every element that a page's module asks for by its id is in that page.
#[test]
fn what_a_module_looks_for_is_in_its_page() {
    let module = |name: &str| FILES.iter().find(|(known, _)| *known == name).map_or("", |(_, text)| text);
    for (page, first) in [
        (include_str!("../page/index.html"), "main.js"),
        (include_str!("../page/plan.html"), "plan.js"),
        (include_str!("../page/docs.html"), "docs.js"),
    ] {
        let mut names = vec![first.to_owned()];
        let mut at = 0;
        while at < names.len() {
            let text = module(&names[at]);
            assert!(!text.is_empty(), "{} is missing", names[at]);
            for name in text.split("from \"./").skip(1).filter_map(|rest| rest.split('"').next()) {
                if !names.iter().any(|known| known == name) {
                    names.push(name.to_owned());
                }
            }
            at += 1;
        }
        for id in names.iter().flat_map(|name| module(name).split("byId(\"").skip(1)) {
            let id = id.split('"').next().unwrap();
            // What another module of the same page paints only where it is called.
            let elsewhere =
                first == "plan.js" && include_str!("../page/index.html").contains(&format!("id=\"{id}\""));
            assert!(page.contains(&format!("id=\"{id}\"")) || elsewhere, "{first}: no element {id}");
        }
    }
}

#[tokio::test]
async fn the_browser_asks_each_time_and_gets_only_what_changed() {
    let bench = Bench::new().await;
    let first = bench.get("/page/main.js").await;
    assert_eq!(first.header("cache-control"), "no-cache");
    let again = super::request(axum::http::Method::GET, "/page/main.js")
        .header("if-none-match", first.header("etag"));
    let again = bench.send(again.body(axum::body::Body::empty()).unwrap()).await;
    assert_eq!((again.status().as_u16(), again.bytes.len()), (304, 0));
}

/// For eyes and screenshots: `cargo test -p gs-server --lib -- --ignored a_page_to_look_at --nocapture`.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "serves the page for two minutes, with a picture that grows"]
async fn a_page_to_look_at() {
    let (bench, address) = Bench::on_a_socket().await;
    println!("http://{address}/#token={}", super::TOKEN);
    let picture = image::RgbImage::from_fn(408, 304, |x, y| {
        let wave = ((f64::from(x) / 23.0).sin() + (f64::from(y) / 17.0).cos()) * 40.0;
        image::Rgb([(f64::from(x) / 1.7 + wave) as u8, (90.0 + wave) as u8, (f64::from(y) / 1.3) as u8])
    });
    let mut file = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut file, 85).encode_image(&picture).unwrap();
    bench.hear(&heartbeat(21.5)).await;
    let key = bench.post("/api/v1/commands", "p", &serde_json::json!({"command": "Ping"})).await;
    assert!(key.status().is_success());
    bench
        .post(
            "/api/v1/commands",
            "q",
            &serde_json::json!({"command": "GetImageChunk", "arguments": {"first": 0, "count": 64}}),
        )
        .await
        .ok();
    bench.hear(&image_info(u32::try_from(file.len()).unwrap())).await;
    let chunks = u16::try_from(file.len().div_ceil(222)).unwrap();
    for round in 0..240u16 {
        // Every fifth is lost, once; one is forged.
        for index in (round * 2..round * 2 + 2).filter(|index| *index < chunks && index % 5 != 3) {
            bench.hear(&chunk(&file, index)).await;
        }
        if round == 20 {
            bench.hear(&chunk(&[1; 9000], 12)).await;
        }
        if round % 60 == 59 {
            bench.hear(&heartbeat(22.0 + f32::from(round) / 100.0)).await;
        }
        wall_sleep(Duration::from_millis(500)).await;
    }
}
