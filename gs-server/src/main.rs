//! gs-server
fn main() {}
