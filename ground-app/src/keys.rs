//! The keys: one table that drives them, and that the list under `?` is made from.

use egui::{Context, Key, KeyboardShortcut, Modifiers};

use crate::desk::Layout;

/// What a key does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deed {
    /// Shows a layout.
    Layout(Layout),
    /// Opens the palette.
    Palette,
    /// Shows the keys, or hides them.
    Help,
    /// Shows alarms.
    Alarms,
    /// Goes to the search.
    Search,
    /// Holds what is live still, or lets it go on.
    Pause,
    /// Other theme.
    Theme,
    /// Everything larger.
    Larger,
    /// Everything smaller.
    Smaller,
    /// Everything as it was at first.
    AsItWas,
    /// The whole screen, or a window again.
    FullScreen,
}

/// A key.
#[derive(Debug, Clone, Copy)]
pub struct Binding {
    /// What is pressed.
    pub shortcut: KeyboardShortcut,
    /// How that is written.
    pub written: &'static str,
    /// What it does.
    pub deed: Deed,
    /// What it does, in words.
    pub says: &'static str,
    /// Whether it acts while a button has the keyboard: what buttons use themselves does not.
    pub over_buttons: bool,
}

const fn key(key: Key, written: &'static str, deed: Deed, says: &'static str) -> Binding {
    let shortcut = KeyboardShortcut::new(Modifiers::NONE, key);
    Binding { shortcut, written, deed, says, over_buttons: true }
}

const fn ctrl(key: Key, written: &'static str, deed: Deed, says: &'static str) -> Binding {
    let shortcut = KeyboardShortcut::new(Modifiers::COMMAND, key);
    Binding { shortcut, written, deed, says, over_buttons: true }
}

/// All keys of the frame. Panes say their own where they use them.
pub const ALL: [Binding; 19] = [
    key(Key::Num1, "1", Deed::Layout(Layout::Pass), "Layout Pass"),
    key(Key::Num2, "2", Deed::Layout(Layout::Plan), "Layout Plan"),
    key(Key::Num3, "3", Deed::Layout(Layout::Satellite), "Layout Satellite"),
    key(Key::Num4, "4", Deed::Layout(Layout::Images), "Layout Images"),
    key(Key::Num5, "5", Deed::Layout(Layout::Archive), "Layout Archive"),
    key(Key::Num6, "6", Deed::Layout(Layout::Health), "Layout Health"),
    ctrl(Key::K, "Ctrl+K", Deed::Palette, "Palette: find a command, a layout, a pane, a satellite"),
    key(Key::A, "A", Deed::Alarms, "Alarms"),
    key(Key::Slash, "/", Deed::Search, "Search"),
    Binding {
        over_buttons: false,
        ..key(Key::Space, "Space", Deed::Pause, "Hold what is live still, or let it go on")
    },
    ctrl(Key::T, "Ctrl+T", Deed::Theme, "Dark or light"),
    ctrl(Key::Plus, "Ctrl++", Deed::Larger, "Everything larger"),
    ctrl(Key::Equals, "Ctrl+=", Deed::Larger, "Everything larger"),
    ctrl(Key::Minus, "Ctrl+-", Deed::Smaller, "Everything smaller"),
    ctrl(Key::Num0, "Ctrl+0", Deed::AsItWas, "Everything in its own size"),
    key(Key::F11, "F11", Deed::FullScreen, "Whole screen"),
    key(Key::Questionmark, "?", Deed::Help, "This list"),
    key(Key::F1, "F1", Deed::Help, "This list"),
    ctrl(Key::P, "Ctrl+P", Deed::Palette, "Palette"),
];

/// What hands do that no deed of the frame is: for the list.
pub const ELSEWHERE: [(&str, &str); 5] = [
    ("Tab", "To the next field or button; Shift+Tab to the one before"),
    ("Enter", "Ends what is typed. It never sends anything to the satellite"),
    ("Esc", "Away from danger: closes, gives up, disarms. It never sends"),
    ("Space, held", "Fires what is armed, while its button has the keyboard"),
    ("Arrows", "From row to row, and from frame to frame"),
];

/// What was pressed in this frame, taken away from whoever draws later. While text is typed only keys together with Ctrl,
/// and those above the letters (F1, F11), act.
pub fn pressed(context: &Context) -> Vec<Deed> {
    let (typing, busy) = (context.text_edit_focused(), context.egui_wants_keyboard_input());
    let acts = |binding: &&Binding| {
        let bare = binding.shortcut.modifiers.is_none() && binding.written.chars().count() == 1;
        !(typing && (bare || binding.shortcut.logical_key == Key::Space)) && (binding.over_buttons || !busy)
    };
    context.input_mut(|input| {
        let taken = ALL.iter().filter(acts).filter(|binding| input.consume_shortcut(&binding.shortcut));
        taken.map(|binding| binding.deed).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things_and_each_layout_has_one() {
        for (index, one) in ALL.iter().enumerate() {
            assert!(ALL[index + 1..].iter().all(|other| other.shortcut != one.shortcut), "{}", one.written);
        }
        for layout in Layout::ALL {
            assert!(ALL.iter().any(|binding| binding.deed == Deed::Layout(layout)), "{layout:?}");
        }
    }
}
