//! Where simavr departs from the ATmega1284P: each correction has a test that fails without it.
//!
//! The programs are a few lines of C or assembler in `tests/images`.

mod core;
mod peripherals;
mod serial;
mod support;
mod wires;
