//! A write that was asked for and whose answer is waited for, without waiting: it is asked again with the same key, so
//! that what got no answer is not done twice.

use api::FieldError;
use api::client::{ClientError, IdempotencyKey};

use crate::link::{Courier, Pending};

type Ask<T> = Box<dyn Fn(&Courier, IdempotencyKey) -> Pending<T>>;

/// A write under way, or one that failed and is not put away yet.
pub(super) struct Deed<T> {
    words: String,
    key: IdempotencyKey,
    ask: Ask<T>,
    pending: Option<Pending<T>>,
    failure: Option<Failure>,
}

/// Why it was not done, or nobody knows.
#[derive(Debug, Clone)]
pub(super) struct Failure {
    /// As a sentence.
    pub(super) words: String,
    /// The fields that are wrong.
    pub(super) errors: Vec<FieldError>,
    /// The same may succeed a little later.
    is_temporary: bool,
}

/// What the operator wants of a failure.
enum Wish {
    Again,
    Away,
}

impl<T> Deed<T> {
    /// Asks. `words` say what is done, as in "Arming night".
    pub(super) fn begin(
        courier: &Courier,
        words: impl Into<String>,
        ask: impl Fn(&Courier, IdempotencyKey) -> Pending<T> + 'static,
    ) -> Self {
        let key = IdempotencyKey::fresh();
        let pending = ask(courier, key.clone());
        Self { words: words.into(), key, ask: Box::new(ask), pending: Some(pending), failure: None }
    }

    /// The answer, once, when it has come and is a good one.
    pub(super) fn answer(&mut self) -> Option<T> {
        match self.pending.as_ref()?.take()? {
            Ok(answer) => {
                self.pending = None;
                Some(answer)
            }
            Err(error) => {
                self.pending = None;
                self.failure = Some(Failure::of(&error));
                None
            }
        }
    }

    pub(super) fn is_under_way(&self) -> bool {
        self.pending.is_some()
    }

    pub(super) fn failure(&self) -> Option<&Failure> {
        self.failure.as_ref()
    }

    /// Says how it stands; returns whether it is to be put away.
    pub(super) fn show(&mut self, ui: &mut egui::Ui, courier: &Courier) -> bool {
        let Some(failure) = &self.failure else {
            ui.weak(format!("{} …", self.words));
            return false;
        };
        match failure.show(ui, &self.words) {
            Some(Wish::Again) => {
                self.failure = None;
                self.pending = Some((self.ask)(courier, self.key.clone()));
                false
            }
            Some(Wish::Away) => true,
            None => false,
        }
    }
}

impl Failure {
    fn of(error: &ClientError) -> Self {
        let problem = error.problem();
        Self {
            words: problem.map_or_else(|| error.to_string(), |problem| problem.detail.clone()),
            errors: problem.map(|problem| problem.errors.clone()).unwrap_or_default(),
            is_temporary: error.is_temporary(),
        }
    }

    fn show(&self, ui: &mut egui::Ui, what: &str) -> Option<Wish> {
        let theme = ui::Theme::current(ui);
        let mut wish = None;
        ui.scope(|ui| {
            ui.colored_label(theme.critical, format!("{what}: {}", self.words));
            for error in &self.errors {
                ui.label(format!("{}: {}", error.field, error.message));
            }
            ui.horizontal(|ui| {
                if self.is_temporary && ui.button("Ask again").clicked() {
                    wish = Some(Wish::Again);
                }
                if ui.button("Close").clicked() {
                    wish = Some(Wish::Away);
                }
            });
        });
        wish
    }
}
