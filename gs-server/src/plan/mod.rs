//! Plans as text: TOML or JSON in, a [`mission::plan::Plan`] or everything that is wrong with it out.
//!
//! | module | idea |
//! | --- | --- |
//! | [`read`] | text to the words of the API; the first mistake of shape, with line and column |
//! | `words` | words to what the engine takes; every mistake, with its place |
//! | `place` | where in the text a place of the plan stands |
//! | [`template`] | plans to begin with |
//!
//! ```
//! use gs_server::plan::{Form, check_text};
//! use mission::plan::CheckContext;
//!
//! let text = "name = \"hello\"\nsatellite = \"pixelsat-1\"\n[[steps]]\ndo = \"listn\"\nfor_s = 60\n";
//! let context = CheckContext { timing: Default::default(), profile: None, pass: None, now: None };
//! let checked = check_text(text, Form::Toml, &context);
//! assert!(checked.plan.is_none());
//! let found = &checked.findings[0];
//! assert_eq!((found.place.as_str(), found.line), ("steps[0].do", Some(4)));
//! assert!(found.remedy.contains("Did you mean 'listen'?"));
//! ```

mod condition;
mod place;
mod read;
pub mod template;
mod upload;
mod words;

use api::{PlanFinding, PlanText};
use mission::plan::{CheckContext, Finding, Plan, Severity, check};

pub use condition::{condition_of, condition_text};
pub use read::{Form, read};

/// A text that was looked at.
#[derive(Debug, Clone)]
pub struct CheckedText {
    /// The plan, if the text is one; it may be armed only without errors.
    pub plan: Option<Plan>,
    /// Everything that is wrong, in the order of the text.
    pub findings: Vec<PlanFinding>,
}

impl CheckedText {
    /// Whether the plan may be taken: there is one, and nothing about it is an error.
    pub fn is_good(&self) -> bool {
        self.plan.is_some() && self.errors() == 0
    }

    /// How many of the findings are errors.
    pub fn errors(&self) -> usize {
        self.findings.iter().filter(|finding| finding.severity == Severity::Error.name()).count()
    }
}

/// Reads a text and says everything that is wrong with it, with line and column.
pub fn check_text(text: &str, form: Form, context: &CheckContext) -> CheckedText {
    let words = match read(text, form) {
        Ok(words) => words,
        Err(finding) => return CheckedText { plan: None, findings: vec![*finding] },
    };
    let (plan, findings) = check_words(&words, context);
    let places = place::Places::new(text, form);
    let mut findings: Vec<PlanFinding> = findings.into_iter().map(|finding| places.put(finding)).collect();
    findings.sort_by_key(|finding| finding.line);
    CheckedText { plan, findings }
}

/// Findings of another look at a plan, with line and column in its text.
pub fn place_findings(
    text: &str,
    form: Form,
    findings: impl IntoIterator<Item = Finding>,
) -> Vec<PlanFinding> {
    let places = place::Places::new(text, form);
    findings.into_iter().map(|finding| places.put(finding)).collect()
}

/// The same for what came as words already.
pub fn check_words(words: &PlanText, context: &CheckContext) -> (Option<Plan>, Vec<Finding>) {
    match words::plan(words) {
        Ok(plan) => {
            let findings = check(&plan, context);
            (Some(plan), findings)
        }
        Err(findings) => (None, findings),
    }
}

#[cfg(test)]
mod tests;
