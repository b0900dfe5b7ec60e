//! A process that watches the samples from sender to receiver, as `lager topic echo` would: ten times
//! a second it reads all that has come. Nobody wakes it.

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::error::Error;
use std::path::PathBuf;

use lager_ports::Bus;
use lager_rig::process::Main;
use lager_rig::{Parent, bus_at};
use lager_topics::Role;

use crate::error::no_bus;
use crate::sample::{Ping, drain, for_words};

pub(super) const NAME: &str = "observer of the samples";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(NAME, take_turns)];

/// The time between two looks.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// For each round: begins when it is told how many words a sample has, and ends at the next message.
fn take_turns(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let folder: PathBuf = parent.told()?;
    parent.say(&())?;
    while let Some(words) = parent.hear::<usize>()? {
        let bus = Bus::open(&bus_at(folder.clone()), Role::Observer).map_err(no_bus)?;
        for_words!(words, watch(&bus, parent))?;
    }
    Ok(())
}

fn watch<const WORDS: usize>(bus: &Bus, parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let mut samples = bus.subscriber::<Ping<WORDS>>().map_err(no_bus)?;
    parent.say(&())?;
    let is_over = AtomicBool::new(false);
    let looking = std::thread::current();
    std::thread::scope(|scope| {
        // The subscriber stays in its thread, so another one waits for the parent.
        let waiting = scope.spawn(|| {
            let told = parent.hear::<()>();
            is_over.store(true, Ordering::Release);
            looking.unpark();
            told
        });
        while !is_over.load(Ordering::Acquire) {
            drain(&mut samples)?;
            std::thread::park_timeout(LOOK_EVERY);
        }
        waiting.join().expect("it does not panic")?;
        Ok::<_, Box<dyn Error>>(())
    })?;
    drop(samples);
    Ok(parent.say(&())?)
}
