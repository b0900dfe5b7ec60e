//! The bridge at its boundaries: serial ports on pseudo terminals, and the whole service between
//! scripted boards and an isolated bus.

mod failures;
mod found;
mod harness;
mod lent;
mod original;
mod pressed;
mod serial;
mod steering;
