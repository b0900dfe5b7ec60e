//! The text languages in which robot, external computer and GaG talk to each other, one line at a
//! time: this crate reads and writes their lines.
//!
//! ```text
//!   robot ──── conversation, extension ──── external computer ──── gag ──── somebody's GaG
//!   (client)          TCP                   (Robert, server)   unix socket   (user interface)
//! ```
//!
//! - [`splitter`]: bytes in any pieces become lines.
//! - [`gag`]: the document's grammar, questions and answers (G1-G10, AMB-44).
//! - [`conversation`]: the same between robot and Robert, and which question is open (C1-C9).
//! - [`extension`]: more lines between a robot and a station of this project, at any time.
//! - [`strings`]: map and goods as one string each (M1-M3).
//! - [`command`]: the codes of commands as text (AMB-4).
//! - [`secret`]: how a robot and a station prove their names to each other.
//! - [`Called`]: a product by its number or its name, as people call it.
//! - [`nearest`](fn@nearest): finds the word that a mistyped one stands for.
//!
//! Every module specifies its language with examples, so that other people can write a peer from
//! it.
//!
//! # Lines
//!
//! A line is UTF-8 and ends with LF or with CR LF (AMB-45); this crate writes LF. It has at most
//! [`MAX_LINE`] bytes without its end. One or more spaces or tabs separate words, and some may
//! stand before the first and after the last word; this crate writes one space. Upper and lower
//! case differ. A number is decimal, with `-` before it if it is negative, and never with `+`.
//!
//! # Reading and writing
//!
//! `Display` writes a value without the line's end. [`to_line`] adds the end, and refuses a line
//! that is too long. `read` reads a value; it never panics, and allocates at most the line's
//! length. For every value `x` that can be written, `read(to_line(x)) == x`.
//!
//! Nothing here does input or output, reads a clock or knows a topic. Only
//! [`secret::random`] asks the system for something.

#![forbid(unsafe_code)]

mod called;
pub mod command;
pub mod conversation;
pub mod extension;
mod floor;
pub mod gag;
mod misread;
mod nearest;
mod reader;
pub mod secret;
pub mod splitter;
pub mod strings;
mod text;
mod writer;

pub use called::{Called, CalledError, UnknownProduct, check_names};
pub use floor::Products;
pub use misread::{Found, Misread};
pub use nearest::{hint, meant, nearest};
pub use text::{Name, NameError, Text, TextError};
pub use writer::{MAX_LINE, TooLong, to_line};
