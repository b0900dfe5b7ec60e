//! The cores that a scenario uses, and the processes that keep cores from halting. It changes nothing
//! for other processes.

use std::error::Error;

use lager_rig::process::Main;
use lager_rig::schedule::{pin, schedule, usable_cores};
use lager_rig::{Parent, Process, Refused};

use crate::error::BenchError;
use crate::report::Regime;
use lager_machine::Cores;

const SPINNER: &str = "idle spinner";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(SPINNER, keep_from_halting)];

/// The cores of a scenario's two processes: the same one in [`Regime::SameCore`], otherwise one
/// each; those that are `chosen`, or the first of those that this process may use.
pub(crate) fn cores_for(regime: Regime, chosen: Option<Cores>) -> Result<Cores, BenchError> {
    let usable = usable_cores();
    let (first, second) = match (chosen, usable.as_slice()) {
        (Some(chosen), _) => chosen,
        (None, [one]) if regime == Regime::SameCore => (*one, *one),
        (None, [.., last]) if regime == Regime::SameCore => (*last, *last),
        (None, [first, second, ..]) => (*first, *second),
        (None, few) => return Err(BenchError::TooFewCores(few.len() + 1, few.len())),
    };
    if let Some(core) = [first, second]
        .into_iter()
        .find(|core| !usable.contains(core))
    {
        return Err(BenchError::NotUsable(core, usable));
    }
    Ok(match regime {
        Regime::SameCore => (second, second),
        Regime::Plain | Regime::NoHalt => (first, second),
    })
}

/// The processes that keep the cores from halting while they live; none if `regime` needs none.
pub(crate) fn kept_awake(regime: Regime) -> Result<Vec<Process>, BenchError> {
    let mut cores = usable_cores();
    if regime != Regime::NoHalt {
        cores.clear();
    }
    let started = cores.into_iter().map(|core| {
        let mut spinner = Process::start(SPINNER)?;
        let () = spinner.ask(&core)?;
        Ok(spinner)
    });
    started.collect()
}

/// Runs whenever nothing else needs the core, until it is killed.
///
/// It yields the core all the time. A process that only yields for a moment would otherwise get its
/// core back at the kernel's next tick, 4 ms later at 250 Hz. An adaptive receiver yields every 4
/// us (`lager_wake::Waiter`), and lost its core to this process that long.
fn keep_from_halting(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pin(parent.told()?)?;
    schedule(libc::SCHED_IDLE).map_err(Refused::to_make("a process of the lowest priority"))?;
    parent.say(&())?;
    loop {
        core::hint::spin_loop();
        rustix::thread::sched_yield();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_processes_share_a_core_only_where_that_is_asked_for() {
        let (first, second) = cores_for(Regime::SameCore, None).unwrap();
        assert_eq!(first, second);
        if let [one, .., other] = usable_cores()[..] {
            let (first, second) = cores_for(Regime::Plain, None).unwrap();
            assert_ne!(first, second);
            let chosen = cores_for(Regime::NoHalt, Some((other, one)));
            assert_eq!(chosen.unwrap(), (other, one));
        }
    }

    #[test]
    fn a_core_that_this_process_may_not_use_is_refused_and_those_that_it_may_are_named() {
        let usable = usable_cores();
        let refused = cores_for(Regime::Plain, Some((usable[0], 9_999))).unwrap_err();
        let said = refused.to_string();
        let named = usable.iter().all(|core| said.contains(&core.to_string()));
        assert!(said.contains("9999") && named, "{said}");
    }
}
