//! The wire protocol from outside: bytes go in, packets and events come out.

mod arm;
mod commands;
mod errors;
mod golden;
mod line;
mod link;
mod noise;
mod original;
mod reset;
mod robot;
mod sample;
mod split;
