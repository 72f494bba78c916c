//! `gs-server elements check`.

use std::collections::BTreeSet;
use std::path::PathBuf;

use api::ElementsView;
use clap::Args;
use serde::Serialize;
use tle::formats::{Checksums, Found};

use super::super::shell::{print_json, print_line};
use super::super::{Exit, Failure};
use super::read;
use crate::elements::door::elements_view;
use crate::elements::{Refused, SetsOfText};

/// `gs-server elements check`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server elements check gp.json
  gs-server elements check --lenient typed-from-paper.tle --json | jq .broken

One line for each set: where it begins, the object, its number, its epoch, and what is odd. Broken
sets are named with their place and the remedy; they never stop the file.

Exit code 0 if every set can be used, 1 if one is broken or the file is no elements.")]
pub struct Check {
    /// A file of elements, or - for standard input
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Take a TLE whose checksum does not fit, with a warning
    #[arg(long)]
    lenient: bool,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Verdict {
    ok: bool,
    form: &'static str,
    sets: Vec<Set>,
    broken: Vec<Broken>,
    summary: Summary,
}

#[derive(Serialize)]
struct Set {
    line: usize,
    elements: ElementsView,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct Broken {
    line: usize,
    object: Option<String>,
    error: String,
}

#[derive(Serialize)]
struct Summary {
    sets: usize,
    objects: usize,
    with_warnings: usize,
    broken: usize,
}

impl Check {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let checksums = if self.lenient { Checksums::Lenient } else { Checksums::Strict };
        let text = SetsOfText::read(&read(&self.file)?, checksums)
            .map_err(|error| Failure::doing(format!("{} is no elements", self.file.display()), error))?;
        let objects: BTreeSet<_> = text
            .sets
            .iter()
            .map(|found| match found.elements.norad_cat_id {
                Some(number) => (Some(number), None),
                None => (None, found.elements.name.as_deref()),
            })
            .collect();
        let summary = Summary {
            sets: text.sets.len(),
            objects: objects.len(),
            with_warnings: text.sets.iter().filter(|found| !found.warnings.is_empty()).count(),
            broken: text.refused.len(),
        };
        let exit = if text.refused.is_empty() && !text.sets.is_empty() { Exit::Done } else { Exit::Failed };
        if self.json {
            print_json(&Verdict {
                ok: exit == Exit::Done,
                form: text.form.name(),
                sets: text.sets.iter().map(set).collect(),
                broken: text.refused.iter().map(broken).collect(),
                summary,
            })?;
        } else {
            print_text(&text, &summary)?;
        }
        Ok(exit)
    }
}

fn set(found: &Found) -> Set {
    Set {
        line: found.line,
        elements: elements_view(&found.elements),
        warnings: found.warnings.iter().map(ToString::to_string).collect(),
    }
}

fn broken(refused: &Refused) -> Broken {
    Broken { line: refused.line, object: refused.object.clone(), error: refused.error.clone() }
}

fn print_text(text: &SetsOfText, summary: &Summary) -> Result<(), Failure> {
    let sets = text.sets.iter().map(|found| {
        let number = found.elements.norad_cat_id.map_or_else(|| "-".to_owned(), |number| number.to_string());
        let mut line = format!(
            "line {}: {} {number}, epoch {}, {}",
            found.line,
            found.elements.label(),
            found.elements.epoch,
            text.form.name()
        );
        for warning in &found.warnings {
            line += &format!("\n  odd: {warning}");
        }
        (found.line, line)
    });
    let refused = text.refused.iter().map(|refused| (refused.line, format!("BROKEN {refused}")));
    let mut lines: Vec<(usize, String)> = sets.chain(refused).collect();
    lines.sort_by_key(|(line, _)| *line);
    for (_, line) in lines {
        print_line(line)?;
    }
    print_line(format_args!(
        "{} sets of {} objects ({}), {} with warnings, {} broken",
        summary.sets,
        summary.objects,
        text.form.name(),
        summary.with_warnings,
        summary.broken
    ))
}
