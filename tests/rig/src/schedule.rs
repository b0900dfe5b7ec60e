//! How urgent a thread is to the kernel, and which cores it may run on.

use core::error::Error;
use core::marker::PhantomData;

use lager_ports::urgency;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use serde::{Deserialize, Serialize};

/// Gives the calling thread a scheduling class without priorities (`libc::SCHED_IDLE`, …).
///
/// # Errors
/// The user may not.
#[allow(unsafe_code)]
pub fn schedule(class: i32) -> std::io::Result<()> {
    let parameter = libc::sched_param { sched_priority: 0 };
    // SAFETY: the parameter outlives the call, which reads it and changes this thread only.
    match unsafe { libc::sched_setscheduler(0, class, &raw const parameter) } {
        0 => Ok(()),
        _ => Err(std::io::Error::last_os_error()),
    }
}

/// The user may not run processes in real time.
#[derive(Debug, thiserror::Error)]
#[error("no right to run in real time ({0}); run as root, or give this user rtprio (`ulimit -r`)")]
pub struct NoRealTime(std::io::Error);

/// The calling thread comes before all that is not real time, as long as this lives; so do the
/// threads and processes that it starts meanwhile. Stays in that thread.
#[derive(Debug)]
pub struct RealTime {
    _in_its_thread: PhantomData<*const ()>,
}

impl RealTime {
    /// From now on, with that priority under SCHED_FIFO.
    ///
    /// # Errors
    /// The user may not.
    pub fn begin(priority: u8) -> Result<Self, NoRealTime> {
        urgency::set_fifo(priority).map_err(NoRealTime)?;
        Ok(Self {
            _in_its_thread: PhantomData,
        })
    }
}

impl Drop for RealTime {
    fn drop(&mut self) {
        // Anybody may become less urgent.
        let _ = schedule(libc::SCHED_OTHER);
    }
}

/// Where a process of the path runs, and how urgently.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Place {
    /// The core it is bound to; `None` = any.
    pub core: Option<usize>,
    /// Its SCHED_FIFO priority; `None` = under the normal scheduler, with short slices.
    pub priority: Option<u8>,
}

impl Place {
    /// Takes the place for the rest of the thread's life, with all that it starts later.
    ///
    /// # Errors
    /// The kernel refuses, or the user may not.
    pub fn take(self) -> Result<(), Box<dyn Error>> {
        if let Some(core) = self.core {
            pin(core)?;
        }
        match self.priority {
            Some(priority) => core::mem::forget(RealTime::begin(priority)?),
            // Where a sandbox forbids it, none of those that are compared has them.
            None => drop(urgency::shorten_slices()),
        }
        Ok(())
    }
}

/// A thread could not be bound to that core.
#[derive(Debug, thiserror::Error)]
#[error(
    "a process could not be bound to core {core} ({detail}); check the container's cpuset, and that no other tool changes affinities meanwhile"
)]
pub struct Unbound {
    core: usize,
    detail: rustix::io::Errno,
}

/// The cores this thread may use, in ascending order.
#[must_use]
pub fn usable_cores() -> Vec<usize> {
    let Ok(set) = sched_getaffinity(None) else {
        return Vec::new();
    };
    (0..CpuSet::MAX_CPU)
        .filter(|core| set.is_set(*core))
        .collect()
}

/// Binds the calling thread to `core`, and what it starts from now on.
///
/// # Errors
/// The kernel refuses.
pub fn pin(core: usize) -> Result<(), Unbound> {
    let mut set = CpuSet::new();
    if core < CpuSet::MAX_CPU {
        set.set(core);
    }
    sched_setaffinity(None, &set).map_err(|detail| Unbound { core, detail })
}

/// The thread that made this is bound to a core as long as this lives; stays in that thread.
#[derive(Debug)]
pub struct Bound {
    before: CpuSet,
    _in_its_thread: PhantomData<*const ()>,
}

impl Bound {
    /// Binds the calling thread to `core`.
    ///
    /// # Errors
    /// The kernel refuses.
    pub fn to(core: usize) -> Result<Self, Unbound> {
        let before = sched_getaffinity(None).map_err(|detail| Unbound { core, detail })?;
        pin(core)?;
        Ok(Self {
            before,
            _in_its_thread: PhantomData,
        })
    }
}

impl Drop for Bound {
    fn drop(&mut self) {
        // Refused only if the cores have been taken away meanwhile, and then nothing is to be done.
        let _ = sched_setaffinity(None, &self.before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_thread_is_free_again_afterwards() {
        let cores = usable_cores();
        let last = *cores.last().unwrap();
        let seen = std::thread::spawn(move || {
            let bound = Bound::to(last).unwrap();
            let meanwhile = usable_cores();
            drop(bound);
            (meanwhile, usable_cores())
        });
        assert_eq!(seen.join().unwrap(), (vec![last], cores));
    }

    #[test]
    fn a_core_that_is_not_there_is_refused() {
        let refused = std::thread::spawn(|| pin(CpuSet::MAX_CPU + 1).is_err());
        assert!(refused.join().unwrap());
    }
}
