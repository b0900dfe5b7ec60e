//! [`Watcher`]: wakes a thread that only observes.

use core::fmt;
use core::time::Duration;
use std::time::Instant;

use lager_wake::{BoardFault, Pace, Wake, Watch};

use crate::bus::Bus;
use crate::untyped::Peek;

/// How long a watcher sleeps at least and at most before it looks without a ring. A program of plain
/// iceoryx2 does not ring, nor does a writer that gives a late reader the last sample of a state.
const SHORTEST: Duration = Duration::from_millis(5);
const LONGEST: Duration = Duration::from_millis(100);
/// How long [`Watcher::pause`] goes on after a ring. The actors that the same sample woke need the
/// cores now, and samples that follow each other closely are taken together.
const GATHER: Duration = Duration::from_micros(500);

/// Wakes a thread of an observer when one of its topics has a sample; stays in the thread that made
/// it.
///
/// An observer need not be woken: to look now and then costs nobody anything, and a recorder does
/// that. A watcher costs a writer one look at a word as long as no watcher sleeps. If one does, the
/// writer wakes a thread of its own process when all actors and observers have got the sample, and
/// that thread wakes all watchers of the topic. There may be any number of them.
///
/// ```no_run
/// # use std::time::Duration;
/// # use lager_ports::{Bus, BusConfig};
/// # use lager_topics::{LAGER, Role, SensorLine};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let bus = Bus::open(&BusConfig::of(&LAGER), Role::Observer)?;
/// let mut line = bus.subscriber::<SensorLine>()?;
/// let mut watcher = bus.watcher()?;
/// line.wakes(&mut watcher);
/// loop {
///     while let Some(sample) = line.receive()? {
///         println!("number {}: {:?}", sample.stamp().sequence, *sample);
///     }
///     watcher.wait(Duration::from_secs(1));
/// }
/// # }
/// ```
pub struct Watcher {
    watch: Watch,
    readers: Vec<Peek>,
    /// How long it now sleeps without a ring.
    patience: Duration,
    woken: u64,
}

impl Watcher {
    pub(crate) fn new(bus: &Bus) -> Result<Self, BoardFault> {
        Ok(Self {
            watch: Watch::on(bus.board())?,
            readers: Vec::new(),
            patience: SHORTEST,
            woken: 0,
        })
    }

    /// Also wakes for the samples of the topic with the number `id` that `reader` gets.
    pub(crate) fn add(&mut self, id: u32, reader: Peek) {
        self.readers.retain(|reader| !reader.is_over());
        self.readers.push(reader);
        self.watch.add(id);
    }

    /// Waits until a sample waits in one of its subscribers, at most `timeout` of real time.
    /// [`Wake::Rung`] means that there is one, [`Wake::TimedOut`] that there is none. Drain all
    /// subscribers before, because the wait ends at once if a sample is left.
    ///
    /// A sample that came without a ring is found after 5 to 100 ms: soon if that happened lately.
    pub fn wait(&mut self, timeout: Duration) -> Wake {
        let began = Instant::now();
        loop {
            self.watch.announce();
            if self.has_samples() {
                return Wake::Rung;
            }
            let left = timeout.saturating_sub(began.elapsed());
            if left.is_zero() {
                return Wake::TimedOut;
            }
            if self.watch.sleep(left.min(self.patience)) {
                if self.has_samples() {
                    self.woken += 1;
                    return Wake::Rung;
                }
            } else if self.has_samples() {
                self.patience = SHORTEST;
                return Wake::Rung;
            } else {
                self.patience = (2 * self.patience).min(LONGEST);
            }
        }
    }

    /// The wait between two looks of a thread that reads many topics: until a sample has come, and
    /// for half a millisecond more; at most as long as `pace` allows. Without a watcher the thread
    /// looks again when `pace` says so.
    pub fn pause(watcher: Option<&mut Self>, pace: &mut Pace) {
        let most = pace.wait();
        match watcher.map(|watcher| watcher.wait(most)) {
            Some(Wake::TimedOut) => {}
            Some(_) => std::thread::sleep(GATHER),
            None => std::thread::sleep(most),
        }
    }

    /// How often a ring has ended a wait.
    pub fn woken(&self) -> u64 {
        self.woken
    }

    fn has_samples(&self) -> bool {
        self.readers.iter().any(Peek::has_samples)
    }
}

impl fmt::Debug for Watcher {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Watcher")
            .field("readers", &self.readers.len())
            .field("woken", &self.woken)
            .finish_non_exhaustive()
    }
}
