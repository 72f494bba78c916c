//! A report as Markdown (CommonMark with tables). Plots are left out; what they show stands in the tables as well.

use super::document::{Block, Cell, Document, Side, Table, is_printable, shape};

/// Writes a report as Markdown.
#[must_use]
pub fn markdown(document: &Document) -> String {
    let mut out = format!("# {}\n\n", escaped(&document.title));
    if document.simulated {
        out.push_str("**SIMULATED**\n\n");
    }
    out.push_str(&format!("{}\n", escaped(&document.subtitle)));
    for block in &document.blocks {
        match block {
            Block::Heading(text) => out.push_str(&format!("\n## {}\n", escaped(text))),
            Block::Paragraph(text) => out.push_str(&format!("\n{}\n", escaped(text))),
            Block::List(items) => {
                out.push('\n');
                items.iter().for_each(|item| out.push_str(&format!("- {}\n", escaped(item))));
            }
            Block::Facts(facts) => {
                out.push('\n');
                for (name, value) in facts {
                    out.push_str(&format!("- {}: {}\n", escaped(name), escaped(value)));
                }
            }
            Block::Table(table) => write_table(&mut out, table),
            Block::Plots(_) => {}
        }
    }
    out
}

fn write_table(out: &mut String, table: &Table) {
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    out.push('\n');
    out.push_str(&line(table.columns.iter().map(|(name, _)| escaped(name)).collect()));
    let rules = table.columns.iter().map(|(_, side)| match side {
        Side::Left => "---".to_owned(),
        Side::Right => "---:".to_owned(),
    });
    out.push_str(&line(rules.collect()));
    for row in &table.rows {
        let cells = row.iter().map(|cell| match cell {
            Cell::Text(text) => escaped(text),
            Cell::Level(level) => format!("{} {}", shape(level), escaped(level)).trim().to_owned(),
        });
        out.push_str(&line(cells.collect()));
    }
}

/// Text that means nothing but itself: no markup, no HTML, no line of its own.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '\\' | '`' | '*' | '_' | '[' | ']' | '|' | '#' | '~' | '!' => {
                out.push('\\');
                out.push(c);
            }
            c if c.is_whitespace() => out.push(' '),
            c if is_printable(c) => out.push(c),
            _ => out.push('\u{fffd}'),
        }
    }
    out
}
