//! A robot driven by raw packets, as the bridge drives it, in virtual time.

mod arm;
mod driving;
mod faults;
mod pi;
mod repeat;
mod varied;
