//! Command line of facemill.
fn main() {}
