//! Pages and texts: what they may not contain, whatever the archive does.

use mission::UtcUs;

use super::super::{Document, Style, html, markdown, pass_document, pass_report};
use super::archive::{S, flown};

async fn document() -> Document {
    let archive = flown().await;
    let (_, _, los) = archive.times;
    let report =
        pass_report(&archive.store, &archive.identity, 1, UtcUs(los + 60 * S)).await.unwrap().unwrap();
    pass_document(&report)
}

/// Tags that stand in a page, by name.
fn tags(page: &str) -> Vec<&str> {
    let names = page.split('<').skip(1).map(|rest| {
        rest.trim_start_matches('/').split(|c: char| !c.is_ascii_alphanumeric() && c != '!').next().unwrap()
    });
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    names.dedup();
    names
}

#[tokio::test]
async fn what_came_from_outside_is_text_in_a_page() {
    let document = document().await;
    let page = html(&document, Style::Linked);
    assert!(
        page.contains("&lt;script&gt;alert(&quot;x&quot;)&lt;/script&gt;|`*\u{fffd}&amp;&#39; # h"),
        "{page}"
    );
    let known = [
        "!doctype", "body", "circle", "dd", "div", "dl", "dt", "h1", "h2", "head", "header", "html", "li",
        "link", "main", "meta", "p", "polyline", "rect", "section", "svg", "table", "tbody", "td", "text",
        "th", "thead", "title", "tr", "ul",
    ];
    for tag in tags(&page) {
        assert!(known.contains(&tag), "<{tag}> in {page}");
    }
    for inline in [" style=", "<style", " onload", " onerror", "javascript:", "http://", "https://"] {
        let found = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!found.contains(inline), "{inline}");
    }
    assert!(page.contains("SIMULATED"));
}

#[tokio::test]
async fn a_file_brings_its_style_and_allows_nothing_else() {
    use base64::Engine as _;
    use sha2::Digest as _;
    let page = html(&document().await, Style::Embedded);
    let css = page.split("<style>").nth(1).unwrap().split("</style>").next().unwrap();
    let hash = base64::engine::general_purpose::STANDARD.encode(sha2::Sha256::digest(css));
    assert!(page.contains(&format!("content=\"default-src 'none'; style-src 'sha256-{hash}'\"")));
    assert!(!page.contains("<link") && !css.contains("url(") && !css.contains("@import"));
    // Colours of plots follow the theme of the page.
    assert!(page.contains("fill=\"var(--accent, #4FB3FF)\""), "{page}");
}

#[tokio::test]
async fn what_came_from_outside_is_text_in_markdown() {
    let text = markdown(&document().await);
    assert!(
        text.contains("&lt;script&gt;alert(\"x\")&lt;/script&gt;\\|\\`\\*\u{fffd}&amp;' \\# h"),
        "{text}"
    );
    assert!(!text.contains("<script"));
    // A row of a table has as many cells as its head, whatever is in them.
    let cells = |line: &str| line.replace("\\|", "").matches('|').count();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line.starts_with('|')
            && let Some(next) = lines.peek()
            && next.starts_with('|')
        {
            assert_eq!(cells(line), cells(next), "{line}\n{next}");
        }
    }
}
