//! The text languages from outside: lines in, values and exact errors out, and back.

mod corpus;
mod document;
mod extension;
mod laws;
mod malformed;
mod productions;
mod round_trip;
mod secret;
mod splitter;
mod values;
