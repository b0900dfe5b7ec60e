//! Tests for each correction of simavr; each fails without its correction.
//!
//! The programs are a few lines of C or assembler in `tests/images`.

mod core;
mod peripherals;
mod programming;
mod serial;
mod support;
mod wires;
