//! How long opening waits for processes that come, go or die meanwhile.

use core::time::Duration;
use std::ffi::OsStr;
use std::path::Path;
use std::time::{Instant, SystemTime};

use iceoryx2::config::Config;

use crate::bus::Bus;
use crate::error::PortError;
use crate::fault::TransportFault;
use crate::shortage::Shortage;

/// How an attempt to open or create something failed.
pub(crate) enum Fault {
    /// Another process is in the middle of something, or has died there: sweep and try again.
    Passing(TransportFault),
    /// A limit is met: sweep in case dead processes hold the places, then give up.
    Full(PortError),
    /// Trying again cannot help.
    Lasting(PortError),
}

/// How long passing faults are retried, in real time; longer than any creation takes.
const PATIENCE: Duration = Duration::from_secs(2);

/// Tries until it works, a fault lasts, or patience ends. Sweeps between attempts.
pub(crate) fn patiently<T>(
    bus: &Bus,
    topic: &str,
    mut attempt: impl FnMut() -> Result<T, Fault>,
) -> Result<T, PortError> {
    let mut start = Instant::now();
    let mut pause = Duration::from_millis(1);
    let mut swept_in_vain = false;
    let mut mended = false;
    loop {
        match attempt() {
            Ok(made) => return Ok(made),
            Err(Fault::Lasting(error)) => return Err(error),
            Err(Fault::Full(error)) => {
                let removed = bus.sweep();
                if (removed == 0 && swept_in_vain) || start.elapsed() > PATIENCE {
                    return Err(error);
                }
                swept_in_vain = removed == 0;
            }
            Err(Fault::Passing(fault)) => {
                bus.sweep();
                if start.elapsed() > PATIENCE {
                    if mended || remove_unfinished(bus.transport()) == 0 {
                        return Err(given_up(topic, fault));
                    }
                    mended = true;
                    start = Instant::now();
                }
            }
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(50));
    }
}

fn given_up(topic: &str, fault: TransportFault) -> PortError {
    let topic = topic.to_owned();
    if let Some(shortage) = Shortage::now() {
        PortError::Short { topic, shortage }
    } else if fault == TransportFault::Corrupted {
        PortError::Damaged { topic }
    } else {
        PortError::Busy { topic, fault }
    }
}

/// Removes the descriptions of services whose creator was killed before it had finished them;
/// returns how many there were.
///
/// The transport's own sweep ignores such a service and leaves the file, and every later process
/// would wait in vain for its completion. No process can have opened it: until it is finished it is
/// writable, which tells it from a finished one. Finishing takes microseconds, so if it is older
/// than our patience its creator is gone.
fn remove_unfinished(config: &Config) -> usize {
    use std::os::unix::fs::PermissionsExt;

    let folder = config.global.service_dir().to_string();
    let prefix = config.global.prefix.to_string();
    let suffix = config
        .global
        .service
        .static_config_storage_suffix
        .to_string();
    let is_description = |path: &Path| {
        path.file_name()
            .and_then(OsStr::to_str)
            .is_some_and(|name| name.starts_with(&prefix) && name.ends_with(&suffix))
    };
    let Ok(entries) = std::fs::read_dir(folder) else {
        return 0;
    };
    entries
        .filter_map(Result::ok)
        .filter(|entry| is_description(&entry.path()))
        .filter(|entry| {
            entry.metadata().is_ok_and(|file| {
                let writable = file.permissions().mode() & 0o200 != 0;
                let age = file
                    .modified()
                    .ok()
                    .and_then(|when| SystemTime::now().duration_since(when).ok());
                writable && age.is_some_and(|age| age >= PATIENCE)
            })
        })
        .filter(|entry| std::fs::remove_file(entry.path()).is_ok())
        .count()
}
