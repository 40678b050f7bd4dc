//! Programs of two heads as two channel programs and back.
#![allow(dead_code, reason = "kits of the program's laws are used in part")]

#[path = "../../../nc-program/tests/laws/head_kit.rs"]
mod head_kit;
#[path = "../../../nc-program/tests/laws/kit.rs"]
mod kit;

mod pair;
