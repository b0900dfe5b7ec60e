//! Finds out how a robot is built, together with a person who looks at it: in which steps, what is
//! asked, and what follows from the answers.
//!
//! - [`Commissioning`]: the state machine. Time, samples and answers go in; [`Effect`]s come out.
//! - [`Answer`]: what a person may say.
//! - [`Said`]: a sentence of `sentences.txt`, in English and in Swedish. The table is apart from that
//!   of orders, because every page is told all of that one, and few show these.
//! - [`Results`]: what has been found out, as a page lists it.
//!
//! It opens no port, reads no clock and writes no file.
//!
//! **Invariant:** it moves the robot only after an answer that was given for this very movement, and
//! every order is renewed or ends by itself within the bridge's lease.

#![forbid(unsafe_code)]

mod answer;
mod arm;
mod line;
mod machine;
mod range;
mod recent;
mod step;
mod told;
mod wheels;
mod words;

pub use answer::{Answer, Way};
pub use arm::Joint;
pub use machine::{Built, Commissioning, Effect};
pub use step::{Question, Step, Takes};
pub use told::Results;
pub use words::{Said, sentences};
