//! The communication unit's conversation from outside, as its peer and the bus see it.

mod by_hand;
mod by_itself;
mod extended;
mod pace;
mod robot;
