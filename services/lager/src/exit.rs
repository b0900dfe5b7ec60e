//! The exit codes of `lager`; `lager --help` lists them. Wrong usage (2) comes from the parser of
//! the command line, or from later checks of an argument's meaning: [`Usage`].

use std::process::ExitCode;

use lager_bridge::BridgeError;
use lager_home::LockError;
use lager_monitor::ToolError;
use lager_ports::{OpenError, PortError};
use lager_recorder::RecordError;
use lager_supervisor::children::TRY_AGAIN;
use lager_supervisor::signals::INTERRUPTED;

/// The failure's reason is on standard error.
pub const FAILED: ExitCode = ExitCode::FAILURE;

/// The request makes no sense, whatever the robot does.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// Somebody ended the program before its work was done.
#[derive(Debug, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

/// Somebody else has the boards.
#[derive(Debug, thiserror::Error)]
#[error(
    "another `lager board` or `lager doctor` is at work on the boards of the robot `{name}`, or the \
     robot is just starting (process {pid}); do this again when that has ended"
)]
pub struct InUse {
    /// Its name.
    pub name: String,
    /// Whoever has the name.
    pub pid: String,
}

/// Somebody writes in the place of a robot, as `lager bag play` and `lager topic pub` do.
#[derive(Debug, thiserror::Error)]
#[error(
    "process {pid} ({command}) writes in the place of the robot `{name}`, so nobody starts that and \
     nobody works on its boards; end it, and do this again"
)]
pub struct InItsPlace {
    /// The robot's name.
    pub name: String,
    /// Whoever writes.
    pub pid: u32,
    /// Its command.
    pub command: String,
}

/// Whether another attempt may succeed: other processes were just making or removing a file that
/// this one needed. On a busy machine that may take longer than this one waits.
fn may_try_again(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        matches!(cause.downcast_ref(), Some(OpenError::Transport { .. }))
            || matches!(
                port_error(cause),
                Some(PortError::Busy { .. } | PortError::Transport { .. })
            )
    })
}

/// The error of a port, also where a service or a tool passes it on as its own.
pub fn port_error<'a>(cause: &'a (dyn std::error::Error + 'static)) -> Option<&'a PortError> {
    if let Some(BridgeError::Port(error)) = cause.downcast_ref() {
        return Some(error);
    }
    match (cause.downcast_ref(), cause.downcast_ref()) {
        (Some(ToolError::Open(error)), _) | (_, Some(RecordError::Open(error))) => Some(error),
        _ => cause.downcast_ref(),
    }
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
    } else if error.is::<InUse>()
        || error.is::<InItsPlace>()
        || matches!(
            error.downcast_ref(),
            Some(LockError::Up { .. } | LockError::Service { .. })
        )
    {
        ExitCode::from(4)
    } else if error.is::<crate::realtime::RealtimeError>() {
        ExitCode::from(5)
    } else if error.is::<Interrupted>() {
        ExitCode::from(INTERRUPTED as u8)
    } else {
        FAILED
    }
}

/// Whether the machine may have caused an error, and not the user's request.
pub fn may_have_a_cause(error: &anyhow::Error) -> bool {
    !error.is::<Usage>()
        && !error.is::<Interrupted>()
        && !error.is::<LockError>()
        && !error.is::<InUse>()
        && !error.is::<InItsPlace>()
}

/// The mission ended, but not every product was delivered.
pub fn not_delivered() -> ExitCode {
    ExitCode::from(3)
}
