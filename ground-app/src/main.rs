//! The operator's desktop app.
fn main() {}
