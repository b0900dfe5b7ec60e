//! Tries to open or create something again while other processes start, end or die.

use core::time::Duration;
use std::time::Instant;

use crate::bus::Bus;
use crate::error::PortError;
use crate::fault::TransportFault;
use lager_home::Shortage;

/// How an attempt to open or create something failed.
pub(crate) enum Fault {
    /// Another process is creating or removing it, or died while it did: sweep and try again.
    Passing(TransportFault),
    /// All places are taken: sweep in case dead processes hold some, try again, then give up.
    Full(PortError),
    /// Another attempt cannot help.
    Lasting(PortError),
}

/// How long such attempts are repeated, in real time; longer than any creation takes.
const PATIENCE: Duration = Duration::from_secs(2);

/// Tries until it works, an error is lasting, or `PATIENCE` is over. Sweeps between attempts, which
/// removes what a dead process left unfinished.
pub(crate) fn patiently<T>(
    bus: &Bus,
    topic: &str,
    mut attempt: impl FnMut() -> Result<T, Fault>,
) -> Result<T, PortError> {
    let start = Instant::now();
    let mut pause = Duration::from_millis(1);
    let mut swept_in_vain = false;
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
                    return Err(given_up(topic, fault));
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
