//! The orders of an operator to a robot, how long each holds, and the sentences about them.
//!
//! - [`Action`]: what an operator can ask.
//! - [`Buttons`]: how a robot's own buttons are connected.
//! - [`Commission`]: what a person says to a commissioning.
//! - [`EventKind`]: what happens on a mission.
//! - [`lease`]: how long an order holds, and how late one may come.
//! - [`Moment`]: a time on both clocks, robot time and real time.
//! - [`Late`]: finds out how late a page's line arrives.
//! - [`Reason`]: why an order is not carried out, as a code with values.
//! - [`Sentence`]: each sentence once, in English and in Swedish (`sentences.txt`).
//!
//! The command line, the page, the text lines and the bus write the same orders in their own ways.
//! The meaning of an order, and the sentences about it, are defined here once. This crate opens no
//! port, reads no clock and does not decide how a robot moves.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

extern crate alloc;

mod action;
mod button;
mod commission;
mod event;
mod late;
pub mod lease;
mod mode;
mod moment;
mod reason;
mod sentence;

pub use action::{Action, LeaseMs, Put, Wheels};
pub use button::{Buttons, Contact, Level, Levels, SwitchKind, lines};
pub use commission::{AnswerWord, Commission};
pub use event::EventKind;
pub use late::Late;
pub use mode::{Mode, Pick};
pub use moment::Moment;
pub use reason::{Code, Reason};
pub use sentence::{Language, Sentence};
