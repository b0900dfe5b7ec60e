//! The text languages of the robot's conversations: what robot, external computer and GaG say to
//! each other in lines, read and written.
//!
//! ```text
//!   robot ──── conversation, extension ──── external computer ──── gag ──── somebody's GaG
//!   (client)          TCP                   (Robert, server)   unix socket   (user interface)
//! ```
//!
//! - [`splitter`]: bytes in any pieces become lines.
//! - [`gag`]: the document's grammar, questions and answers (G1-G10, AMB-44).
//! - [`conversation`]: the same between robot and Robert, and which answer is awaited (C1-C9).
//! - [`extension`]: what a robot and a station of this project say besides, asynchronously.
//! - [`strings`]: map and goods as one string each (M1-M3).
//! - [`command`]: the codes of commands as text (AMB-4).
//! - [`LATEST_MOVE`]: how late something may come that moves a robot.
//! - [`secret`]: by what a robot and a station prove who they are.
//! - [`Called`]: a product by its number or its name, as people call it.
//! - [`nearest`](fn@nearest): what somebody may have meant who has mistyped a word.
//!
//! Every module specifies its language with examples, so that a peer can be written from it.
//!
//! # Lines
//!
//! A line is UTF-8 and ends with LF or with CR LF (AMB-45); written is LF. It has at most
//! [`MAX_LINE`] bytes without its end. Words are separated by one or more spaces or tabs, of which
//! some may stand before the first and after the last word; written is one space. Words are case
//! sensitive. A number is decimal, with `-` before it where it may be negative, without `+`.
//!
//! # Reading and writing
//!
//! A value is written by its `Display`, without the line's end; [`to_line`] adds the end and
//! refuses a line that is too long. A value is read by `read`, which never panics and allocates no
//! more than the line's length. For every value `x` that can be written, `read(to_line(x)) == x`.
//!
//! Nothing here does input or output, reads a clock or knows a topic; of the system only
//! [`secret::random`] asks anything. A service that uses both
//! converts between a `Direction` here and a heading on the bus.

#![forbid(unsafe_code)]

mod called;
pub mod command;
pub mod conversation;
pub mod extension;
pub mod gag;
mod late;
mod misread;
mod nearest;
mod reader;
pub mod secret;
pub mod splitter;
pub mod strings;
mod text;
mod warehouse;
mod writer;

pub use called::{Called, CalledError, NamesError, UnknownProduct, check_names};
pub use late::{LATEST, LATEST_MOVE, TooLate};
pub use misread::{Found, Misread};
pub use nearest::{hint, meant, nearest};
pub use text::{Name, NameError, Text, TextError};
pub use warehouse::{
    Coord, Direction, Map, MapError, Product, ProductId, Products, ProductsError, SideLength,
};
pub use writer::{MAX_LINE, TooLong, to_line};
