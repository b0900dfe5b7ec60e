//! Real time for a service's process: priority, memory that stays in RAM, cores of its own. If
//! nobody asks for real time, the services on the path ask for short time slices.
//!
//! A process asks for all of this before it starts its first thread, so every thread inherits it.
//! Then each thread of the path lowers its own priority to its place ([`urgency::step_back`]). If
//! the machine refuses, the process ends with an error that says how to get real time (exit code
//! 5); it never runs slower than its user believes. The supervisor tries everything before it
//! starts any service, in a thread that ends at once ([`Wanted::rehearse`]); it never becomes
//! real-time itself. Services that spin at a real-time priority on all cores of the machine are
//! refused, because they can hang the machine.

mod cores;
mod error;
mod kernel;

use std::fs;
use std::io;
use std::path::Path;

use lager_wake::urgency;
use rustix::io::Errno;
use rustix::process::Resource;

pub use cores::{CoreSet, CoreSetError};
pub use error::RealtimeError;

/// The highest priority of `SCHED_FIFO`.
pub const HIGHEST_PRIORITY: u8 = 99;

/// How much memory one service may lock, in bytes. The kernel counts whole mappings, also the pages of
/// them that nobody has touched. Measured are 39 MiB for the bridge and 43 for logic, 18 of them the
/// program's file, and less than 1 MiB more with 64 observers. The rest is a reserve for programs and
/// topics that grow.
pub const LOCKED_AT_MOST: usize = 64 << 20;

/// What one process asks of the machine.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Priority under `SCHED_FIFO`, 1 to 99; 0 is the normal scheduler.
    pub priority: u8,
    /// Under the normal scheduler, run sooner than others. This needs no right, and the others get
    /// no less time.
    pub short_slices: bool,
    /// Keep all memory of the process in RAM.
    pub lock_memory: bool,
    /// The cores to run on; empty leaves the choice to the kernel.
    pub cores: CoreSet,
}

impl Wanted {
    /// Asks for it, for the calling thread and all threads that the process starts later.
    ///
    /// # Errors
    /// The machine or the user's rights do not allow it; the sentence says how to get it.
    pub fn apply(&self) -> Result<(), RealtimeError> {
        self.take_cores()?;
        self.try_memory()?;
        if self.lock_memory {
            kernel::lock_memory().map_err(RealtimeError::Lock)?;
        }
        self.take_slices();
        self.take_priority()
    }

    /// Tries whether [`Self::apply`] would succeed, and gives everything back.
    ///
    /// # Errors
    /// As [`Self::apply`].
    pub fn rehearse(&self) -> Result<(), RealtimeError> {
        in_passing(|| {
            self.take_cores()?;
            self.try_memory()?;
            self.take_priority()
        })
    }

    fn take_cores(&self) -> Result<(), RealtimeError> {
        if self.cores.is_empty() {
            return Ok(());
        }
        let existing = existing_cores();
        if let Some(core) = self.cores.iter().find(|core| !existing.contains(*core)) {
            return Err(RealtimeError::NoSuchCore { core, existing });
        }
        let refused = |core| RealtimeError::CoreNotAllowed {
            core,
            allowed: allowed_cores().unwrap_or_default(),
        };
        match kernel::pin(&self.cores) {
            Ok(granted) => match self.cores.iter().find(|core| !granted.contains(*core)) {
                Some(core) => Err(refused(core)),
                None => Ok(()),
            },
            // The kernel allows none of them.
            Err(error) if is(&error, Errno::INVAL) => {
                Err(refused(self.cores.iter().next().unwrap_or(0)))
            }
            Err(error) => Err(RealtimeError::Pin(error)),
        }
    }

    fn try_memory(&self) -> Result<(), RealtimeError> {
        if !self.lock_memory {
            return Ok(());
        }
        let allowed = kernel::whole_limit(Resource::Memlock);
        kernel::try_lock(LOCKED_AT_MOST).map_err(|error| {
            // Which error it is depends on the limit: zero, too small, or nearly used up.
            let limited = [Errno::PERM, Errno::NOMEM, Errno::AGAIN]
                .iter()
                .any(|errno| is(&error, *errno));
            match allowed {
                Some(allowed) if limited => RealtimeError::LockDenied { allowed },
                _ => RealtimeError::Lock(error),
            }
        })
    }

    fn take_slices(&self) {
        // A sandbox may forbid the call. The path then works with longer time slices.
        if self.short_slices
            && self.priority == 0
            && let Err(error) = urgency::shorten_slices()
        {
            tracing::debug!("no shorter time slices: {error}");
        }
    }

    fn take_priority(&self) -> Result<(), RealtimeError> {
        let priority = self.priority;
        if priority == 0 {
            return Ok(());
        }
        let allowed = kernel::whole_limit(Resource::Rtprio);
        urgency::set_fifo(priority).map_err(|error| {
            let within = allowed.is_none_or(|allowed| u64::from(priority) <= allowed);
            if !is(&error, Errno::PERM) {
                RealtimeError::Priority { priority, error }
            } else if within || kernel::may_exceed_priority_limit() {
                RealtimeError::NoTimeForGroup { priority }
            } else {
                let allowed = allowed.unwrap_or_default();
                RealtimeError::PriorityDenied { priority, allowed }
            }
        })
    }
}

/// Refuses services that never sleep at a real-time priority on too many cores: no core would be
/// left for the rest of the robot, or for the shell that could end it.
///
/// `spinners` has the cores that each of them wants; empty means all of `allowed`.
///
/// # Errors
/// No core would be left, or the services would keep each other from running.
pub fn refuse_starvation(spinners: &[CoreSet], allowed: &CoreSet) -> Result<(), RealtimeError> {
    if spinners.len() >= allowed.len() && !spinners.is_empty() {
        return Err(RealtimeError::NoCoreLeft {
            spinners: spinners.len(),
            cores: allowed.len(),
        });
    }
    // Each needs a core of its own, so no group of them may have fewer cores than members.
    for few in 1_usize..1 << spinners.len() {
        let chosen = || (0..spinners.len()).filter(|spinner| few >> spinner & 1 == 1);
        if chosen().any(|spinner| spinners[spinner].is_empty()) {
            continue;
        }
        let shared: CoreSet = chosen()
            .flat_map(|spinner| spinners[spinner].iter())
            .collect();
        if shared.len() < chosen().count() {
            return Err(RealtimeError::SpinnersShare { cores: shared });
        }
    }
    Ok(())
}

/// The cores that this process may choose: the machine's cores without those that its control group
/// forbids, whatever cores it is bound to now.
///
/// # Errors
/// The kernel does not say it.
pub fn allowed_cores() -> Result<CoreSet, RealtimeError> {
    in_passing(|| {
        kernel::pin(&(0..rustix::thread::CpuSet::MAX_CPU).collect())
            .or_else(|_| kernel::granted())
            .map_err(RealtimeError::Pin)
    })
}

/// The cores of the machine that are switched on.
pub fn existing_cores() -> CoreSet {
    let online = fs::read_to_string("/sys/devices/system/cpu/online").unwrap_or_default();
    // Without the file, take the cores that the kernel allows.
    online
        .parse()
        .unwrap_or_else(|_| allowed_cores().unwrap_or_default())
}

/// The time that real-time threads may take of each period, and the period, both in µs. A negative
/// time means no limit.
pub fn throttle() -> Option<(i64, i64)> {
    let read = |name: &str| {
        let text = fs::read_to_string(Path::new("/proc/sys/kernel").join(name)).ok()?;
        text.trim().parse().ok()
    };
    Some((read("sched_rt_runtime_us")?, read("sched_rt_period_us")?))
}

/// Runs `work` in a thread of its own, so that its priority and cores end with that thread.
fn in_passing<T: Send>(
    work: impl FnOnce() -> Result<T, RealtimeError> + Send,
) -> Result<T, RealtimeError> {
    std::thread::scope(|scope| {
        std::thread::Builder::new()
            .name("rehearsal".into())
            .spawn_scoped(scope, work)
            .map_err(RealtimeError::Rehearsal)?
            .join()
            .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn is(error: &io::Error, errno: Errno) -> bool {
    error.raw_os_error() == Some(errno.raw_os_error())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cores(text: &str) -> CoreSet {
        text.parse().expect("a set of cores")
    }

    #[test]
    fn spinners_leave_a_core_to_the_others_and_have_one_each() {
        let any = CoreSet::default();
        for (spinners, allowed, expected) in [
            (vec![], "0", "fine"),
            (vec![any.clone()], "0-1", "fine"),
            (vec![any.clone(), any.clone()], "0-2", "fine"),
            (vec![cores("1"), cores("2")], "0-3", "fine"),
            (vec![cores("1"), any.clone()], "0-3", "fine"),
            (vec![any.clone()], "0", "nothing else would run"),
            (
                vec![any.clone(), any.clone()],
                "0-1",
                "nothing else would run",
            ),
            (
                vec![cores("0"), cores("1")],
                "0-1",
                "nothing else would run",
            ),
            (vec![cores("1"), cores("1")], "0-3", "would never run"),
            (
                vec![cores("1-2"), cores("1"), cores("2")],
                "0-7",
                "would never run",
            ),
        ] {
            let said = match refuse_starvation(&spinners, &cores(allowed)) {
                Ok(()) => "fine".to_owned(),
                Err(error) => error.to_string(),
            };
            assert!(said.contains(expected), "{spinners:?} on {allowed}: {said}");
        }
    }

    #[test]
    fn a_rehearsal_leaves_the_caller_as_it_was() {
        let before = kernel::granted().expect("the kernel says");
        let one: CoreSet = allowed_cores()
            .expect("the kernel says")
            .iter()
            .take(1)
            .collect();
        Wanted {
            cores: one,
            ..Wanted::default()
        }
        .rehearse()
        .expect("a core that is allowed");
        assert_eq!(kernel::granted().expect("the kernel says"), before);
    }

    #[test]
    fn a_core_that_is_not_there_is_named_beside_those_that_are() {
        let existing = existing_cores();
        let wanted = Wanted {
            cores: [existing.iter().max().expect("a core") + 1]
                .into_iter()
                .collect(),
            ..Wanted::default()
        };
        let said = wanted.rehearse().expect_err("no such core").to_string();
        assert!(
            said.contains(&format!("has the cores {existing}")),
            "{said}"
        );
    }
}
