//! The `rtfmesh` program.

fn main() {}
