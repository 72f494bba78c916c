//! The window on a real server with a simulated satellite, driven by accessible labels. One program, for it is linked
//! with the whole server: a topic is a module.

mod common;
mod frame;
mod lost;
