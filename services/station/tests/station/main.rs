//! The external computer from outside: a robot's lines in, what it is told out; a GaG that speaks
//! for it; a warehouse saved and read; and all of it through its sockets.

mod bad;
mod conversation;
mod extended;
mod file;
mod gag;
mod handle;
mod history;
mod late;
mod links;
mod sockets;
mod transcript;
