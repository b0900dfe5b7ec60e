//! Tests of a simulated robot that gets raw packets, as from the bridge, in virtual time.

mod arm;
mod driving;
mod faults;
mod pi;
mod repeat;
mod varied;
