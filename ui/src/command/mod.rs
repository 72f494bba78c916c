//! Telecommands: how far each came, who wants it, what proves it, and what may be done about it.

mod card;
pub(crate) mod lights;

pub use card::{CardAction, Command, command_card_ui};
pub use lights::{End, Lights, Stage, stage_lights_ui};
