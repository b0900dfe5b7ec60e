//! The exit codes of `lager`, as `lager --help` documents them. Wrong usage (2) is the command
//! line parser's.

use std::process::ExitCode;

/// The failure's reason is on standard error.
pub const FAILED: ExitCode = ExitCode::FAILURE;

/// The mission ended without every product delivered.
pub fn not_delivered() -> ExitCode {
    ExitCode::from(3)
}

/// A robot of this name is already up.
pub fn name_taken() -> ExitCode {
    ExitCode::from(4)
}

/// Real time, locked memory or cores are not granted as asked for.
pub fn not_granted() -> ExitCode {
    ExitCode::from(5)
}
