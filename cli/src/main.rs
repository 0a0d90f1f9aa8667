//! The `resolvent` command.
fn main() {}
