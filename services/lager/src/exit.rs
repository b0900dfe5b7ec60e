//! The exit codes of `lager`, as `lager --help` documents them. Wrong usage (2) is the command
//! line parser's, and that of whatever reads an argument's meaning after it: [`Usage`].

use std::process::ExitCode;

use lager_ports::{LockError, OpenError, PortError};

/// The failure's reason is on standard error.
pub const FAILED: ExitCode = ExitCode::FAILURE;

/// What was asked for makes no sense, whatever the robot does.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// Somebody wished for the end before the work was done.
#[derive(Debug, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

/// The exit code after [`Interrupted`], as shells have it for Ctrl-C.
pub const INTERRUPTED: i32 = 130;

/// The exit code of a service that could not join the bus and may do better next time, as
/// `sysexits.h` has it. Only its supervisor sees it.
pub const TRY_AGAIN: i32 = 75;

/// Whether another attempt may succeed: others were just making or removing what it wanted, which
/// on a busy machine may take longer than it waits for.
fn may_try_again(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        matches!(cause.downcast_ref(), Some(OpenError::Transport { .. }))
            || matches!(
                cause.downcast_ref(),
                Some(PortError::Busy { .. } | PortError::Transport { .. })
            )
    })
}

/// The exit code of a service's error.
pub fn code_of_service(error: &anyhow::Error) -> ExitCode {
    match may_try_again(error) {
        true => ExitCode::from(TRY_AGAIN as u8),
        false => code(error),
    }
}

/// The exit code of an error that ends the program.
pub fn code(error: &anyhow::Error) -> ExitCode {
    if error.is::<Usage>() {
        ExitCode::from(2)
    } else if matches!(
        error.downcast_ref(),
        Some(LockError::Up { .. } | LockError::Service { .. })
    ) {
        ExitCode::from(4)
    } else if error.is::<crate::realtime::RealtimeError>() {
        ExitCode::from(5)
    } else if error.is::<Interrupted>() {
        ExitCode::from(INTERRUPTED as u8)
    } else {
        FAILED
    }
}

/// Whether the machine may be the cause of an error, rather than the user's request.
pub fn may_have_a_cause(error: &anyhow::Error) -> bool {
    !error.is::<Usage>() && !error.is::<Interrupted>() && !error.is::<LockError>()
}

/// The mission ended without every product delivered.
pub fn not_delivered() -> ExitCode {
    ExitCode::from(3)
}
