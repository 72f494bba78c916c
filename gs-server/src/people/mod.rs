//! Who may do what: rights and the roles that bring them.

mod right;

pub use right::{NoSuchRight, NoSuchRole, Right, Rights, Role};
