//! The `trajectory-selector` program.
fn main() {}
