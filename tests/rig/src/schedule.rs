//! Sets how urgent a thread is to the kernel, and which cores it may run on.

use core::error::Error;
use core::marker::PhantomData;

pub use lager_machine::usable_cores;
use lager_wake::urgency;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use serde::{Deserialize, Serialize};

/// Gives the calling thread a scheduling class without priorities (`libc::SCHED_IDLE`, …).
///
/// # Errors
/// The user has no right to this class.
#[allow(unsafe_code)]
pub fn schedule(class: i32) -> std::io::Result<()> {
    let parameter = libc::sched_param { sched_priority: 0 };
    // SAFETY: the parameter outlives the call, which reads it and changes this thread only.
    match unsafe { libc::sched_setscheduler(0, class, &raw const parameter) } {
        0 => Ok(()),
        _ => Err(std::io::Error::last_os_error()),
    }
}

/// The user has no right to run processes in real time.
#[derive(Debug, thiserror::Error)]
#[error("no right to run in real time ({0}); run as root, or give this user rtprio (`ulimit -r`)")]
pub struct NoRealTime(std::io::Error);

/// As long as this lives, the calling thread runs before all threads that are not real time. So do
/// the threads and processes that it starts meanwhile. The value stays in its thread.
#[derive(Debug)]
pub struct RealTime {
    _in_its_thread: PhantomData<*const ()>,
}

impl RealTime {
    /// Makes the calling thread a SCHED_FIFO thread of that priority.
    ///
    /// # Errors
    /// The user has no right to that.
    pub fn begin(priority: u8) -> Result<Self, NoRealTime> {
        urgency::set_fifo(priority).map_err(NoRealTime)?;
        Ok(Self {
            _in_its_thread: PhantomData,
        })
    }
}

impl Drop for RealTime {
    fn drop(&mut self) {
        // Every user may make a thread less urgent.
        let _ = schedule(libc::SCHED_OTHER);
    }
}

/// The core and the urgency of one process of the path.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Placement {
    /// The core to which the process is bound; `None` = any core.
    pub core: Option<usize>,
    /// Its SCHED_FIFO priority; `None` = under the normal scheduler, with short slices.
    pub priority: Option<u8>,
}

impl Placement {
    /// Applies both to the calling thread, for the rest of its life, and to all that it starts.
    ///
    /// # Errors
    /// The kernel refuses, or the user has no right to it.
    pub fn take(self) -> Result<(), Box<dyn Error>> {
        if let Some(core) = self.core {
            pin(core)?;
        }
        match self.priority {
            Some(priority) => core::mem::forget(RealTime::begin(priority)?),
            // In a sandbox that forbids short slices, no compared process has them.
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

/// Binds the calling thread, and all that it starts from now on, to `core`.
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

/// Binds the thread that made it to a core until it is dropped; stays in that thread.
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
        // This fails only if the cores have been taken away meanwhile; then nothing can be done.
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
