//! The codes of commands as text (AMB-4): the words after `styrcomm` and `armcomm`.
//!
//! | form | example | |
//! |---|---|---|
//! | binary | `11110011` | exactly eight digits of 0 and 1; this form is written |
//! | decimal | `243` | |
//! | hexadecimal | `0xF3` | `0x` or `0X`, digits of either case |
//! | bare hexadecimal | `F3` | two characters, the first `F` or `f`; the arm alone has them |
//!
//! The wheels have the codes 1 to 9, the arm F1 to FA in hexadecimal (K). These are an operator's
//! codes. [`OperatorCommand::firmware`] turns one into a board's command, because 7 means something
//! else there (AMB-2).
//!
//! ```
//! use lager_lines::command::{Code, read_arm, read_wheels};
//! use lager_wire::{ArmCommand, OperatorCommand, Speed};
//!
//! assert_eq!(read_wheels("7").map(OperatorCommand::from), Ok(OperatorCommand::Right(Speed::Full)));
//! for text in ["F3", "0xf3", "243", "11110011"] {
//!     assert_eq!(read_arm(text).unwrap().get(), ArmCommand::In);
//! }
//! assert_eq!(Code(OperatorCommand::Right(Speed::Full)).to_string(), "00000111");
//!
//! // A code of the arm is refused for the wheels, and so is a code that no list has.
//! assert_eq!(
//!     read_wheels("F3").unwrap_err().to_string(),
//!     "243 is no code of the wheels; they have 1 to 9"
//! );
//! assert_eq!(
//!     read_arm("0xFB").unwrap_err().to_string(),
//!     "251 is no code of the arm; it has 241 to 250, F1 to FA in hexadecimal"
//! );
//! ```

use core::fmt;

use lager_orders::Wheels;
use lager_wire::{Binary, CodeTextError, OperatorArm, OperatorCommand, parse_code};
use thiserror::Error;

/// Why a text is not a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum CommandError {
    /// It has none of the four forms.
    #[error("{0}")]
    Text(CodeTextError),
    /// The wheels have no such code (G8).
    #[error("{code} is no code of the wheels; they have 1 to 9")]
    NotOfWheels {
        /// The code.
        code: u8,
    },
    /// The arm has no such code (G7, AMB-27).
    #[error("{code} is no code of the arm; it has 241 to 250, F1 to FA in hexadecimal")]
    NotOfArm {
        /// The code.
        code: u8,
    },
}

/// A command's code as it is written: eight binary digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Code(pub OperatorCommand);

impl fmt::Display for Code {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        Binary(self.0.code()).fmt(formatter)
    }
}

/// Reads a code of the wheels, 1 to 9 (G8).
///
/// # Errors
///
/// The text is not a code, or the wheels do not have it.
pub fn read_wheels(text: &str) -> Result<Wheels, CommandError> {
    let code = code(text)?;
    OperatorCommand::from_code(code)
        .and_then(Wheels::new)
        .ok_or(CommandError::NotOfWheels { code })
}

/// Reads a code of the arm, F1 to FA in hexadecimal (G7).
///
/// # Errors
///
/// The text is not a code, or the arm does not have it, or an operator may not give it.
pub fn read_arm(text: &str) -> Result<OperatorArm, CommandError> {
    let code = code(text)?;
    match OperatorCommand::from_code(code) {
        Some(OperatorCommand::Arm(step)) => Ok(step),
        _ => Err(CommandError::NotOfArm { code }),
    }
}

fn code(text: &str) -> Result<u8, CommandError> {
    if let [b'F' | b'f', digit] = text.as_bytes()
        && digit.is_ascii_hexdigit()
    {
        // The same number, written with 0x.
        return parse_code(&format!("0x{text}")).map_err(CommandError::Text);
    }
    parse_code(text).map_err(CommandError::Text)
}
