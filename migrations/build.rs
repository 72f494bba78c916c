//! A new migration file must lead to a new build, which cargo cannot know by itself.

fn main() {
    println!("cargo:rerun-if-changed=sqlite");
    println!("cargo:rerun-if-changed=postgres");
}
