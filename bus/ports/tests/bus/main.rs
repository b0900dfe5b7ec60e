//! The bus as its users meet it: real shared memory, real processes, real `kill -9`.
//!
//! Every test has a bus of its own and checks at its end that nothing of it is left.

mod actors;
mod bells;
mod damage;
mod domain;
mod examples;
mod interop;
mod introspection;
mod killed;
mod limits;
mod process;
mod reasons;
mod requests;
mod samples;
mod stress;
mod swept;
mod waiting;
mod watching;
