//! The communication unit's conversation from outside, as its peer and the bus see it.

mod asked_at_once;
mod by_hand;
mod by_itself;
mod extended;
mod robot;
