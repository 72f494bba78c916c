//! What is done with a plan: handed over, armed, disarmed, withdrawn. What takes effect later without anybody, or takes
//! something away, is asked for twice; a plan that somebody else has changed meanwhile is shown beside one's own.

use api::client::ClientError;
use api::{FieldError, Outcome, OutcomeWord, PlanText, PlanView};
use egui::Ui;

use crate::desk::PlanDraft;
use crate::link::Courier;
use crate::panes::deed::Deed;
use crate::panes::{Scene, plan_words};

/// What comes back.
enum Done {
    Outcome(Outcome),
    /// Nothing was done: the server has another plan by this name than the one that this began from.
    Changed(Box<PlanView>),
}

/// What is to be done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    HandOver,
    Arm,
    Disarm,
    Withdraw,
}

impl What {
    /// Asked before it happens.
    fn question(self) -> &'static str {
        match self {
            Self::HandOver => {
                "Hand it over? The plan in use by this name is replaced; its arming and chosen passes go."
            }
            Self::Arm => "Arm it? It then runs in its passes by itself, also when nobody is here.",
            Self::Disarm => "Disarm it? It runs in no further pass.",
            Self::Withdraw => "Withdraw it? It is taken out of use; its text stays here as a draft.",
        }
    }

    fn yes(self) -> &'static str {
        match self {
            Self::HandOver => "Yes, hand over",
            Self::Arm => "Yes, arm",
            Self::Disarm => "Yes, disarm",
            Self::Withdraw => "Yes, withdraw",
        }
    }

    fn words(self, name: &str) -> String {
        match self {
            Self::HandOver => format!("Handing over {name}"),
            Self::Arm => format!("Arming {name}"),
            Self::Disarm => format!("Disarming {name}"),
            Self::Withdraw => format!("Withdrawing {name}"),
        }
    }
}

/// The write under way, and what is asked twice.
#[derive(Default)]
pub(super) struct Deeds {
    asked: Option<(String, What)>,
    under_way: Option<(String, What, Deed<Done>)>,
    said: Option<(String, String)>,
    /// What the server found wrong with this plan when it was handed over.
    refused: Option<(PlanText, Vec<FieldError>)>,
    shown: Vec<FieldError>,
    /// The server's copy that was found when handing over, newer than the list that we hold.
    newer: Option<PlanView>,
}

impl Deeds {
    /// What is wrong with the plan that was shown last.
    pub(super) fn errors(&self) -> &[FieldError] {
        &self.shown
    }

    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        scene: &mut Scene<'_>,
        name: &str,
        draft: &mut PlanDraft,
        theirs: Option<&PlanView>,
    ) {
        self.settle(scene, draft);
        self.shown = match &self.refused {
            Some((plan, errors)) if *plan == draft.plan => errors.clone(),
            _ => Vec::new(),
        };
        // The list may be a moment older than what was found when handing over.
        let newer = self.newer.take_if(|newer| newer.name == name);
        let newest = newer.as_ref().filter(|newer| theirs.is_none_or(|view| view.id < newer.id)).or(theirs);
        let changed = draft.unread.is_some() || newest.is_none_or(|view| view.plan != draft.plan);
        status(ui, newest, changed);
        if let Some(view) = changed.then(|| draft.overtaken(newest)).flatten() {
            both(ui, draft, view);
        } else {
            self.buttons(ui, scene, name, draft, newest, changed);
        }
        self.newer = newer;
        if let Some((_, _, deed)) = &mut self.under_way
            && deed.show(ui, scene.courier)
        {
            self.under_way = None;
        }
        if let Some((of, words)) = &self.said
            && of == name
        {
            ui.weak(words);
        }
    }

    /// Takes the answer when it has come.
    fn settle(&mut self, scene: &mut Scene<'_>, draft: &mut PlanDraft) {
        let Some((name, what, deed)) = &mut self.under_way else { return };
        let (name, what) = (name.clone(), *what);
        if let Some(failure) = deed.failure()
            && what == What::HandOver
            && draft.plan.name == name
            && !failure.errors.is_empty()
            && self.refused.as_ref().is_none_or(|(plan, _)| *plan != draft.plan)
        {
            self.refused = Some((draft.plan.clone(), failure.errors.clone()));
        }
        let Some(done) = deed.answer() else { return };
        self.under_way = None;
        let words = match done {
            Done::Changed(view) => {
                let words = format!("Not handed over: {} handed over another text meanwhile", view.added_by);
                self.newer = Some(*view);
                words
            }
            Done::Outcome(Outcome { outcome: OutcomeWord::AwaitingApproval, .. }) => {
                "A second person has to approve it".to_owned()
            }
            Done::Outcome(_) => {
                match what {
                    What::HandOver => {
                        self.newer = None;
                        scene.desk.plans.drafts.remove(&name);
                    }
                    What::Withdraw => {
                        // Nothing is lost by it: the text stays.
                        draft.base = None;
                        scene.desk.plans.drafts.insert(name.clone(), draft.clone());
                    }
                    What::Arm | What::Disarm => {}
                }
                match what {
                    What::HandOver => "Handed over; it is not armed".to_owned(),
                    What::Arm => "Armed".to_owned(),
                    What::Disarm => "Disarmed".to_owned(),
                    What::Withdraw => "Withdrawn; its text is kept here".to_owned(),
                }
            }
        };
        self.said = Some((name, words));
    }

    fn buttons(
        &mut self,
        ui: &mut Ui,
        scene: &mut Scene<'_>,
        name: &str,
        draft: &mut PlanDraft,
        theirs: Option<&PlanView>,
        changed: bool,
    ) {
        let busy = self.under_way.as_ref().is_some_and(|(_, _, deed)| deed.is_under_way());
        let why = match busy {
            true => Some("The last one is under way".to_owned()),
            false => plan_words::hindrance(scene),
        };
        if let Some((_, what)) = self.asked.as_ref().filter(|(of, _)| of == name) {
            let what = *what;
            ui.horizontal_wrapped(|ui| {
                ui.label(what.question());
                let yes = ui.add_enabled(why.is_none(), egui::Button::new(what.yes()));
                let back =
                    ui.button("Back").clicked() || ui.input(|input| input.key_pressed(egui::Key::Escape));
                if clicked_not_entered(ui, &yes) {
                    self.asked = None;
                    self.begin(scene.courier, name, what, draft, theirs);
                } else if back {
                    self.asked = None;
                }
            });
            return;
        }
        ui.horizontal_wrapped(|ui| {
            let mut button = |text: &str, what: What, fault: Option<&str>| {
                let why = fault.map(str::to_owned).or_else(|| why.clone());
                let button = ui.add_enabled(why.is_none(), egui::Button::new(text));
                let button = match why {
                    Some(why) => button.on_disabled_hover_text(why),
                    None => button,
                };
                if button.clicked() {
                    self.asked = Some((name.to_owned(), what));
                }
            };
            let unread = draft.unread.is_some().then_some("The text is no plan yet");
            if changed {
                button("Hand over", What::HandOver, unread);
            }
            let own = changed.then_some("Hand over what was changed first, or drop it");
            match theirs {
                Some(view) if view.armed => button("Disarm", What::Disarm, None),
                Some(_) => button("Arm", What::Arm, own),
                None => {}
            }
            if theirs.is_some() {
                button("Withdraw", What::Withdraw, None);
            }
            if changed && ui.button("Drop changes").clicked() {
                match theirs {
                    Some(view) => *draft = PlanDraft::of(view),
                    None => {
                        scene.desk.plans.drafts.remove(name);
                        scene.desk.plans.chosen = None;
                    }
                }
            }
        });
    }

    fn begin(
        &mut self,
        courier: &Courier,
        name: &str,
        what: What,
        draft: &PlanDraft,
        theirs: Option<&PlanView>,
    ) {
        let (plan, base) = (draft.plan.clone(), theirs.map(|view| view.id));
        let words = what.words(&plan.name);
        let of = name.to_owned();
        self.said = None;
        self.refused = None;
        let deed = Deed::begin(courier, words, move |courier, key| {
            let (name, plan) = (of.clone(), plan.clone());
            courier.ask(move |client| async move {
                let done = match what {
                    What::HandOver => {
                        // Looked at once more: nobody's newer text is overwritten unseen.
                        let others = client.plans().await?.items;
                        let there = others.into_iter().find(|view| view.name == plan.name);
                        if let Some(view) = there
                            && Some(view.id) != base
                            && view.plan != plan
                        {
                            return Ok(Done::Changed(Box::new(view)));
                        }
                        client.add_plan(&plan, &key).await?
                    }
                    What::Arm => client.arm_plan(&name, &key).await?,
                    What::Disarm => client.disarm_plan(&name, &key).await?,
                    What::Withdraw => client.withdraw_plan(&name, &key).await?,
                };
                Ok::<_, ClientError>(Done::Outcome(done))
            })
        });
        self.under_way = Some((name.to_owned(), what, deed));
    }
}

/// Clicked by the pointer, or by the space bar; Enter sends nothing.
fn clicked_not_entered(ui: &Ui, response: &egui::Response) -> bool {
    response.clicked() && !ui.input(|input| input.key_pressed(egui::Key::Enter))
}

fn status(ui: &mut Ui, theirs: Option<&PlanView>, changed: bool) {
    ui.horizontal_wrapped(|ui| match theirs {
        None => {
            ui.weak("A draft: the server does not know it yet");
        }
        Some(view) => {
            let theme = ui::Theme::current(ui);
            if view.armed {
                ui.colored_label(theme.armed, "ARMED");
            } else {
                ui.label("not armed");
            }
            let at = crate::orbit::timestamp(view.added_at.unix_us());
            ui.weak(format!("handed over by {} at {}", view.added_by, ui::format::utc(at)));
            if changed {
                ui.colored_label(theme.accent, "changed here, not handed over");
            }
        }
    });
}

/// Somebody else handed over another text under this name.
fn both(ui: &mut Ui, draft: &mut PlanDraft, view: &PlanView) {
    let theme = ui::Theme::current(ui);
    ui.colored_label(
        theme.distress,
        format!(
            "{} handed over another text of {} meanwhile. Nothing was overwritten.",
            view.added_by, view.name
        ),
    );
    ui.columns(2, |columns| {
        for (column, (title, plan)) in
            columns.iter_mut().zip([("Yours", &draft.plan), ("Theirs", &view.plan)])
        {
            column.strong(title);
            let other = if title == "Yours" { &view.plan } else { &draft.plan };
            for (index, step) in plan.steps.iter().enumerate() {
                let words = format!("{:>2}  {}", index + 1, plan_words::step(step));
                if other.steps.get(index) == Some(step) {
                    column.weak(words);
                } else {
                    column.label(words);
                }
            }
        }
    });
    ui.horizontal_wrapped(|ui| {
        if ui.button("Take theirs").on_hover_text("What was changed here is dropped").clicked() {
            *draft = PlanDraft::of(view);
        }
        if ui.button("Go on with mine").on_hover_text("Handing it over replaces theirs").clicked() {
            draft.base = Some(view.id);
        }
    });
}
