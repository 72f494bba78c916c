//! A report as a page: no script, no request to anywhere, light on dark or dark on light as its reader has it, and dark
//! on white on paper.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

use super::document::{Block, Cell, Document, Side, Table, is_printable, shape};

const TOKENS: &str = include_str!("../http/page/tokens.css");
const STYLE: &str = include_str!("../http/page/report.css");

const LINKS: &str = r#"<link rel="stylesheet" href="/page/tokens.css">
<link rel="stylesheet" href="/page/report.css">
"#;

/// Where a page has its style from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// From the server that shows it: nothing inline.
    Linked,
    /// From itself, and nothing else is allowed in it: for a file that goes its own way.
    Embedded,
}

/// Writes a report as a page.
#[must_use]
pub fn html(document: &Document, style: Style) -> String {
    let mut out = String::with_capacity(16 * 1024);
    out.push_str("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    match style {
        Style::Linked => out.push_str(LINKS),
        Style::Embedded => {
            let css = format!("{TOKENS}{STYLE}");
            let hash = STANDARD.encode(Sha256::digest(&css));
            out.push_str(&format!(
                "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'sha256-{hash}'\">\n\
                 <style>{css}</style>\n"
            ));
        }
    }
    out.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    out.push_str("<meta name=\"color-scheme\" content=\"dark light\">\n");
    out.push_str(&format!("<title>{}</title>\n</head>\n<body>\n", escaped(&document.title)));
    if document.simulated {
        out.push_str("<p class=\"simulated\">SIMULATED</p>\n");
    }
    let (title, subtitle) = (escaped(&document.title), escaped(&document.subtitle));
    out.push_str(&format!(
        "<header>\n<h1>{title}</h1>\n<p class=\"dim\">{subtitle}</p>\n</header>\n<main>\n"
    ));
    let mut is_open = false;
    for block in &document.blocks {
        if let Block::Heading(text) = block {
            out.push_str(if is_open { "</section>\n" } else { "" });
            out.push_str(&format!("<section>\n<h2>{}</h2>\n", escaped(text)));
            is_open = true;
        } else {
            write(&mut out, block);
        }
    }
    out.push_str(if is_open { "</section>\n" } else { "" });
    out.push_str("</main>\n</body>\n</html>\n");
    out
}

fn write(out: &mut String, block: &Block) {
    match block {
        Block::Heading(_) => {}
        Block::Paragraph(text) => out.push_str(&format!("<p>{}</p>\n", escaped(text))),
        Block::List(items) => {
            out.push_str("<ul>\n");
            for item in items {
                out.push_str(&format!("<li>{}</li>\n", escaped(item)));
            }
            out.push_str("</ul>\n");
        }
        Block::Facts(facts) => {
            out.push_str("<dl>\n");
            for (name, value) in facts {
                out.push_str(&format!("<div><dt>{}</dt><dd>{}</dd></div>\n", escaped(name), escaped(value)));
            }
            out.push_str("</dl>\n");
        }
        Block::Table(table) => write_table(out, table),
        Block::Plots(plots) => {
            out.push_str("<div class=\"plots\">\n");
            // Drawn by us, with every text in them escaped.
            plots.iter().for_each(|plot| out.push_str(plot));
            out.push_str("</div>\n");
        }
    }
}

fn write_table(out: &mut String, table: &Table) {
    let class = |index: usize| match table.columns.get(index) {
        Some((_, Side::Right)) => " class=\"num\"",
        _ => "",
    };
    out.push_str("<div class=\"wide\"><table>\n<thead><tr>");
    for (index, (name, _)) in table.columns.iter().enumerate() {
        out.push_str(&format!("<th scope=\"col\"{}>{}</th>", class(index), escaped(name)));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        out.push_str("<tr>");
        for (index, cell) in row.iter().enumerate() {
            match cell {
                Cell::Text(text) => out.push_str(&format!("<td{}>{}</td>", class(index), escaped(text))),
                Cell::Level(level) => {
                    let shape = shape(level);
                    // A class of ours: what is none of the levels has no shape.
                    let colour = if shape.is_empty() { "normal" } else { level.as_str() };
                    out.push_str(&format!("<td class=\"level {colour}\">{shape} {}</td>", escaped(level)));
                }
            }
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table></div>\n");
}

/// Text as a page has it, in an element or an attribute.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_whitespace() => out.push(' '),
            c if is_printable(c) => out.push(c),
            _ => out.push('\u{fffd}'),
        }
    }
    out
}
