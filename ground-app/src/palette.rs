//! The palette: whatever can be done, found by typing. It opens and chooses; nothing in it sends anything to a satellite.

use egui::{Align2, Key, Modifiers, RichText};
use ui::Theme;

use crate::desk::Layout;
use crate::keys::{self, Deed};
use crate::panes::{self, Pane, Scene};

/// So many are shown at once.
const SHOWN: usize = 12;

/// What choosing does.
pub enum Act {
    /// What a key does, too.
    Deed(Deed),
    /// Opens a pane.
    Pane(Pane),
    /// Looks at this satellite.
    Satellite(String),
    /// Shows the arrangement that was saved under this name.
    Saved(String),
    /// What a pane knows how to do; it must not send anything by itself.
    Call(Box<dyn FnOnce(&mut Scene<'_>)>),
}

/// Something that can be chosen.
pub struct Entry {
    /// What it is called, and found by.
    pub name: String,
    /// What it is: a word or two, dim beside it; found by, too.
    pub says: String,
    /// What choosing does.
    pub act: Act,
}

impl Entry {
    /// Something that a pane knows how to do. It opens, chooses and fills in; it must not send anything by itself.
    pub fn call(
        name: impl Into<String>,
        says: impl Into<String>,
        act: impl FnOnce(&mut Scene<'_>) + 'static,
    ) -> Self {
        Self { name: name.into(), says: says.into(), act: Act::Call(Box::new(act)) }
    }

    fn new(name: impl Into<String>, says: impl Into<String>, act: Act) -> Self {
        Self { name: name.into(), says: says.into(), act }
    }
}

/// The palette, open or closed.
#[derive(Debug, Default)]
pub struct Palette {
    open: bool,
    typed: String,
    at: usize,
    fresh: bool,
}

impl Palette {
    /// Opens it, empty.
    pub fn open(&mut self) {
        *self = Self { open: true, fresh: true, ..Self::default() };
    }

    /// Draws it when it is open. What was chosen is for the window to do.
    pub fn show(&mut self, context: &egui::Context, scene: &Scene<'_>) -> Option<Act> {
        if !self.open {
            return None;
        }
        let (escaped, up, down, entered) = context.input_mut(|input| {
            let mut taken = |key| input.consume_key(Modifiers::NONE, key);
            (taken(Key::Escape), taken(Key::ArrowUp), taken(Key::ArrowDown), taken(Key::Enter))
        });
        if escaped {
            self.open = false;
            return None;
        }
        let mut found = find(entries(scene, &self.typed), &self.typed);
        let count = found.len().min(SHOWN);
        self.at = self.at.min(count.saturating_sub(1));
        if up {
            self.at = self.at.checked_sub(1).unwrap_or(count.saturating_sub(1));
        }
        if down {
            self.at = if self.at + 1 < count { self.at + 1 } else { 0 };
        }
        let mut chosen = (entered && count > 0).then_some(self.at);
        let mut away = false;
        let width = (context.content_rect().width() - 32.0).clamp(200.0, 560.0);
        let window = egui::Window::new("Palette")
            .title_bar(false)
            .resizable(false)
            .anchor(Align2::CENTER_TOP, [0.0, 72.0])
            .fixed_size([width, 0.0]);
        let shown = window.show(context, |ui| {
            let field = egui::TextEdit::singleline(&mut self.typed)
                .hint_text("Find a command, layout, pane or satellite")
                .desired_width(f32::INFINITY);
            let field = ui.add(field).accessible_name("Find");
            if std::mem::take(&mut self.fresh) {
                field.request_focus();
            }
            if field.changed() {
                self.at = 0;
            }
            for (index, entry) in found.iter().take(SHOWN).enumerate() {
                if row(ui, entry, index == self.at) {
                    chosen = Some(index);
                }
            }
            match found.len() {
                0 => ui.weak("Nothing of that name"),
                many if many > SHOWN => ui.weak(format!("and {} more: type on", many - SHOWN)),
                _ => ui.weak("Enter chooses, Esc closes. Nothing here sends by itself"),
            };
        });
        if let Some(shown) = shown {
            away = shown.response.clicked_elsewhere() && !self.fresh && !up && !down;
        }
        if let Some(index) = chosen {
            self.open = false;
            return Some(found.swap_remove(index).act);
        }
        self.open = !away;
        None
    }
}

fn row(ui: &mut egui::Ui, entry: &Entry, is_at: bool) -> bool {
    let theme = Theme::current(ui);
    let text = egui::Atoms::new((
        RichText::new(&entry.name).color(theme.text),
        egui::Atom::grow(),
        RichText::new(&entry.says).color(theme.dim).small(),
    ));
    let button = egui::Button::new(text).selected(is_at).frame_when_inactive(false);
    let response = ui.add_sized([ui.available_width(), 24.0], button);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &entry.name));
    response.clicked()
}

/// All that can be chosen now.
fn entries(scene: &Scene<'_>, typed: &str) -> Vec<Entry> {
    let mut all = panes::entries(scene, typed);
    for layout in Layout::ALL {
        let key = keys::ALL.iter().find(|binding| binding.deed == Deed::Layout(layout));
        let says = format!("layout, key {}", key.map_or("", |binding| binding.written));
        all.push(Entry::new(layout.name(), says, Act::Deed(Deed::Layout(layout))));
    }
    for name in scene.desk.saved.keys() {
        all.push(Entry::new(name, "your layout", Act::Saved(name.clone())));
    }
    all.extend(Pane::ALL.map(|pane| Entry::new(pane.name(), "pane", Act::Pane(pane))));
    if let Some((status, _)) = &scene.model.status {
        for satellite in &status.satellites {
            let name = &satellite.satellite;
            all.push(Entry::new(name, "satellite", Act::Satellite(name.clone())));
        }
    }
    for binding in &keys::ALL {
        let shown = all.iter().any(|entry| entry.name == binding.says);
        if !shown && !matches!(binding.deed, Deed::Layout(_) | Deed::Palette) {
            let says = format!("key {}", binding.written);
            all.push(Entry::new(binding.says, says, Act::Deed(binding.deed)));
        }
    }
    all
}

/// Those that have every word that was typed; names that begin with it come first.
fn find(all: Vec<Entry>, typed: &str) -> Vec<Entry> {
    let typed = typed.trim().to_lowercase();
    let has = |entry: &Entry| {
        let text = format!("{} {}", entry.name, entry.says).to_lowercase();
        typed.split_whitespace().all(|word| text.contains(word))
    };
    let mut found: Vec<Entry> = all.into_iter().filter(has).collect();
    found.sort_by_key(|entry| {
        let name = entry.name.to_lowercase();
        (!name.starts_with(&typed), !name.contains(&typed))
    });
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_must_be_there_and_names_that_begin_with_it_come_first() {
        let entry = |name: &str, says: &str| Entry::new(name, says, Act::Deed(Deed::Help));
        let all = || vec![entry("Frame", "pane"), entry("Set mode", "command"), entry("Mode chart", "pane")];
        let names = |typed: &str| find(all(), typed).into_iter().map(|e| e.name).collect::<Vec<_>>();
        assert_eq!(names("mode"), ["Mode chart", "Set mode"]);
        assert_eq!(names("PANE fr"), ["Frame"]);
        assert_eq!(names("nothing"), Vec::<String>::new());
        assert_eq!(names("").len(), 3);
    }
}
