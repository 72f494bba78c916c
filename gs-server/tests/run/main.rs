//! The whole server over real pseudo-terminals.

mod disk;
mod serial;
mod start_and_end;
mod support;
mod tcp;
mod twin;
