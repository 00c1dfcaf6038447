//! The twinlag program.
fn main() {}
