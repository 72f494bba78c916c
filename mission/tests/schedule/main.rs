//! The scheduler against brute force, its own rules, small changes of elements, and large questions.
#![expect(clippy::expect_used, reason = "a test that cannot be set up has failed")]

mod brute;
mod calm;
mod cases;
mod large;
mod rules;
mod small;
mod words;
