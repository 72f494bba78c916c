//! A page of the documentation as a list of things to do: its commands in their order, and what it says is to be seen.
//!
//! Fenced blocks marked `sh` are commands, blocks marked `text` what they print; all other blocks are there to be read.
//! Remarks that readers do not see say the rest:
//!
//! | remark | meaning |
//! | --- | --- |
//! | `<!-- in each -->` | what each new terminal begins with |
//! | `<!-- window: NAME -->` | the next command stays, in a terminal of its own |
//! | `<!-- close: NAME -->` | Ctrl-C in that terminal |
//! | `<!-- repeat -->` | the next command is given again until what is to be seen is seen |
//! | `<!-- seen in: NAME -->` | the next text is seen in that terminal |
//! | `<!-- browser: WORDS -->` | what somebody does in a browser |

use std::fmt;

/// One thing to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// Line of the page, from 1.
    pub line: usize,
    /// What.
    pub what: What,
    /// The lines that the page says are to be seen; `…` stands for anything.
    pub seen: Vec<String>,
}

/// What is to be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum What {
    /// Commands that end, and succeed.
    Run(String),
    /// The same, again and again until what is to be seen is seen.
    Repeat(String),
    /// A command that stays: the terminal's name, the command.
    Window(String, String),
    /// Ctrl-C in a terminal.
    Close(String),
    /// Something in a browser.
    Browser(String),
    /// Nothing: only something is to be seen in a terminal.
    Look(String),
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {:?}", self.line, self.what)
    }
}

/// A page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Guide {
    /// What each terminal begins with.
    pub prelude: String,
    /// What is the reader's to replace.
    pub replaced: Vec<String>,
    /// In order.
    pub steps: Vec<Step>,
}

impl Guide {
    /// Reads a page.
    ///
    /// # Panics
    /// When it is not of the form that the module describes.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let mut guide = Self { prelude: String::new(), replaced: yours(text), steps: Vec::new() };
        let mut remark: Option<String> = None;
        let mut lines = text.lines().enumerate();
        while let Some((at, line)) = lines.next() {
            let line_no = at + 1;
            if let Some(told) = line.strip_prefix("<!-- ").and_then(|rest| rest.strip_suffix(" -->")) {
                assert_eq!(remark, None, "line {line_no}: nothing follows the remark before");
                match told.split_once(": ") {
                    Some(("close", name)) => guide.push(line_no, What::Close(name.to_owned())),
                    Some(("browser", words)) => guide.push(line_no, What::Browser(words.to_owned())),
                    _ => remark = Some(told.to_owned()),
                }
                continue;
            }
            let Some(language) = line.strip_prefix("```") else { continue };
            let block: Vec<&str> =
                lines.by_ref().map(|(_, line)| line).take_while(|line| *line != "```").collect();
            let remark = remark.take();
            match (language, remark.as_deref().map(|told| told.split_once(": ").unwrap_or((told, "")))) {
                ("sh", None) => guide.push(line_no, What::Run(block.join("\n"))),
                ("sh", Some(("repeat", ""))) => guide.push(line_no, What::Repeat(block.join("\n"))),
                ("sh", Some(("in each", ""))) => guide.prelude = block.join("\n"),
                ("sh", Some(("window", name))) => {
                    guide.push(line_no, What::Window(name.to_owned(), block.join("\n")));
                }
                ("text", place) => {
                    if let Some(("seen in", name)) = place {
                        guide.push(line_no, What::Look(name.to_owned()));
                    } else {
                        assert_eq!(place, None, "line {line_no}: this remark does not go with text");
                    }
                    let step = guide.steps.last_mut().expect("something was done before");
                    assert!(step.seen.is_empty(), "line {line_no}: {step} has its text already");
                    step.seen = block.into_iter().map(str::to_owned).collect();
                }
                (_, None) => {}
                (_, Some(remark)) => panic!("line {line_no}: {remark:?} does not go with ```{language}"),
            }
        }
        assert_eq!(remark, None, "nothing follows the last remark");
        guide
    }

    fn push(&mut self, line: usize, what: What) {
        self.steps.push(Step { line, what, seen: Vec::new() });
    }
}

/// The first column of the table with the heading `here`.
fn yours(text: &str) -> Vec<String> {
    let table = text.lines().skip_while(|line| !line.starts_with("| here |")).skip(2);
    table
        .take_while(|line| line.starts_with('|'))
        .filter_map(|line| Some(line.split('`').nth(1)?.to_owned()))
        .collect()
}

/// The first of these lines that does not stand in the text, in their order; `…` stands for anything within a line, and a
/// line of nothing else for any lines. Runs of blanks count as one.
#[must_use]
pub fn unseen<'a>(wanted: &'a [String], said: &str) -> Option<&'a str> {
    let mut said = said.lines().map(words);
    wanted
        .iter()
        .filter(|line| line.as_str() != "…")
        .find(|line| {
            let line = words(line);
            !said.any(|told| fits(&line, &told))
        })
        .map(String::as_str)
}

fn words(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Whether a line is as the pattern says.
fn fits(pattern: &str, line: &str) -> bool {
    let parts: Vec<&str> = pattern.split('…').collect();
    let [first, middle @ .., last] = &parts[..] else { return pattern == line };
    let Some(mut rest) = line.strip_prefix(first) else { return false };
    for part in middle {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "\
| here | with you |\n| --- | --- |\n| `PORT` | yours |\n\n<!-- in each -->\n```sh\ncd x\n```\n\
<!-- window: server -->\n```sh\nserve PORT\n```\n```text\nready …\n```\n```toml\na = 1\n```\n\
<!-- repeat -->\n```sh\nls\n```\n<!-- close: server -->\n<!-- seen in: mail -->\n```text\nhello\n```\n";

    #[test]
    fn a_page_is_a_list_of_things_to_do() {
        let guide = Guide::parse(PAGE);
        assert_eq!(guide.prelude, "cd x");
        assert_eq!(guide.replaced, ["PORT"]);
        let whats: Vec<What> = guide.steps.iter().map(|step| step.what.clone()).collect();
        let name = |text: &str| text.to_owned();
        assert_eq!(
            whats,
            [
                What::Window(name("server"), name("serve PORT")),
                What::Repeat(name("ls")),
                What::Close(name("server")),
                What::Look(name("mail")),
            ]
        );
        assert_eq!(guide.steps[0].seen, ["ready …"]);
    }

    #[test]
    fn what_is_to_be_seen_is_looked_for_in_order() {
        let wanted = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect::<Vec<_>>();
        let said = "first  line\nsecond 17 of 18\nthird\n";
        assert_eq!(unseen(&wanted(&["first line", "…", "second … of …", "third"]), said), None);
        assert_eq!(unseen(&wanted(&["third", "first line"]), said), Some("first line"));
        assert_eq!(unseen(&wanted(&["second … of 19"]), said), Some("second … of 19"));
        assert_eq!(unseen(&wanted(&["seco"]), said), Some("seco"));
        assert!(fits("a…", "ab") && fits("…b", "ab") && fits("…", "") && !fits("ab…b", "ab"));
    }
}
