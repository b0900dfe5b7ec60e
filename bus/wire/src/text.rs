//! Reads and writes command codes as text: eight binary digits, decimal, or hexadecimal (AMB-4).
//!
//! Only eight digits of 0 and 1 are binary, so the three forms cannot be confused. Text is used
//! only where data enter or leave the robot; packets carry numbers.

use core::fmt;

/// Why a text is not a command code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CodeTextError {
    /// There is no digit.
    Empty,
    /// A character is not a digit of the form that the text has.
    NotADigit {
        /// The character.
        found: char,
        /// How many characters stand before it.
        position: usize,
    },
    /// The number does not fit one byte.
    TooLarge,
}

impl fmt::Display for CodeTextError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => formatter.write_str("the command code is empty")?,
            Self::NotADigit { found, position } => write!(
                formatter,
                "{found:?} at character {} is not a digit of a command code",
                position + 1
            )?,
            Self::TooLarge => formatter.write_str("the command code is larger than 255")?,
        }
        formatter.write_str("; write eight binary digits, a decimal number or 0x and hexadecimal")
    }
}

impl core::error::Error for CodeTextError {}

/// Reads a code written as eight binary digits, as decimal or as `0x` and hexadecimal.
///
/// ```
/// use lager_wire::parse_code;
///
/// assert_eq!(parse_code("11110011"), Ok(0xF3));
/// assert_eq!(parse_code("0xf3"), Ok(0xF3));
/// assert_eq!(parse_code("243"), Ok(0xF3));
/// ```
///
/// # Errors
///
/// The text has none of the three forms, or the number is larger than 255.
pub fn parse_code(text: &str) -> Result<u8, CodeTextError> {
    if let Some(code) = text.as_bytes().try_into().ok().and_then(binary_digits) {
        return Ok(code);
    }
    let (digits, radix, before) = match text.strip_prefix("0x").or(text.strip_prefix("0X")) {
        Some(digits) => (digits, 16, 2),
        None => (text, 10, 0),
    };
    if digits.is_empty() {
        return Err(CodeTextError::Empty);
    }
    let mut code: Option<u8> = Some(0);
    for (position, found) in (before..).zip(digits.chars()) {
        let digit = found
            .to_digit(radix)
            .ok_or(CodeTextError::NotADigit { found, position })?;
        // A wrong character further on is the more useful error, so too large a number waits.
        code = code
            .and_then(|code| u32::from(code).checked_mul(radix)?.checked_add(digit))
            .and_then(|code| u8::try_from(code).ok());
    }
    code.ok_or(CodeTextError::TooLarge)
}

/// The number that eight characters '0' and '1' write, most significant digit first.
pub(crate) fn binary_digits(characters: &[u8; 8]) -> Option<u8> {
    characters
        .iter()
        .try_fold(0, |code: u8, character| match character {
            b'0' => Some(code << 1),
            b'1' => Some(code << 1 | 1),
            _ => None,
        })
}

/// A code as the protocol writes it: eight binary digits.
///
/// ```
/// assert_eq!(lager_wire::Binary(7).to_string(), "00000111");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binary(pub u8);

impl fmt::Display for Binary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:08b}", self.0)
    }
}
