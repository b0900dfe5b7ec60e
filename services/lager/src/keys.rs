//! `lager keys`: makes certificates for a robot and its listeners.

use anyhow::Result;

use crate::cli::KeysArgs;

/// Makes the files, and says which.
///
/// # Errors
/// A file is there already or cannot be written, or there is no authority yet.
#[cfg(feature = "zenoh")]
pub fn run(args: &KeysArgs) -> Result<String> {
    use lager_remote::{Holder, make};

    use crate::cli::KeysCommand;

    let holder = match &args.command {
        KeysCommand::Authority => Holder::Authority,
        KeysCommand::Robot { robot, address } => Holder::Robot(robot, address),
        KeysCommand::Listener { listener } => Holder::Listener(listener),
        KeysCommand::Router { address } => Holder::Router(address),
    };
    let made = make(&args.folder, holder, args.days)?;
    let (certificate, key) = (made.certificate.display(), made.key.display());
    Ok(format!(
        "made {certificate} and its private key {key}, for {} days",
        args.days
    ))
}

/// This program cannot.
///
/// # Errors
/// Always, as it was built without the feature `zenoh`.
#[cfg(not(feature = "zenoh"))]
pub fn run(_args: &KeysArgs) -> Result<String> {
    Err(crate::afar::without())
}
