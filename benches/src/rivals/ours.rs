//! The typed ports among the rivals: receivers that act and are rung first, or observers that a watcher
//! wakes after that.

use core::cell::{Cell, RefCell};
use core::time::Duration;

use lager_ports::{Bus, BusConfig, Publisher, Subscriber, Watcher};
use lager_sample::{Application, LARGEST_COPY, Part, Qos, Topic};
use lager_wake::{Policy, Waiter};

use super::{Heard, Member, Receiver, SIZES, Sender, Setup, Way, Write};
use crate::error::{BenchError, Fault, broken, no_bus};
use crate::sample::Block;

const NEAR: Part = Part::new(0, "near");
const FAR: Part = Part::new(1, "far");
const ONLOOKER: Part = Part::new(2, "onlooker").observing();
static RIVALS: Application = Application::new("rivals");

/// How long a receiver sleeps at most before it looks whether the measurement is over.
const LOOK: Duration = Duration::from_millis(50);

/// A topic of samples of so many words, with so many places for receivers that act. An application's
/// topics have their limits at compile time; the usual number of places is 8.
struct Words<const WORDS: usize, const PLACES: usize, const BACK: bool>;

impl<const WORDS: usize, const PLACES: usize, const BACK: bool> Topic
    for Words<WORDS, PLACES, BACK>
{
    const NAME: &'static str = if BACK { "rivals/back" } else { "rivals/there" };
    type Payload = Block<WORDS>;
    const QOS: Qos = Qos {
        actors: if BACK { &[NEAR] } else { &[FAR] },
        slots: PLACES,
        copied: 8 * WORDS <= LARGEST_COPY,
        ..Qos::stream(if WORDS == SIZES[0] { 16 } else { 4 })
    };
    const SUMMARY: &'static str = "A measurement's samples.";
}

/// The membership. The receivers' part is known when the first port is made: only the process at
/// the sender's end receives what comes back.
struct Ours {
    setup: Setup,
    acts: bool,
    bus: RefCell<Option<&'static Bus>>,
}

pub(super) fn join(setup: &Setup, acts: bool) -> Result<Box<dyn Member>, BenchError> {
    Ok(Box::new(Ours {
        setup: setup.clone(),
        acts,
        bus: RefCell::new(None),
    }))
}

impl Ours {
    /// The bus, which this process opens once and keeps until it ends.
    fn bus(&self, part: Part) -> Result<&'static Bus, BenchError> {
        let mut bus = self.bus.borrow_mut();
        if bus.is_none() {
            let config = BusConfig {
                folder: Some(self.setup.folder.join("bus")),
                ..BusConfig::of(&RIVALS)
            };
            let part = if self.acts { part } else { ONLOOKER };
            *bus = Some(Box::leak(Box::new(
                Bus::open(&config, part).map_err(no_bus)?,
            )));
        }
        Ok(bus.expect("just opened"))
    }

    fn sends<T: Topic>(&self, part: Part) -> Result<Box<dyn Sender>, BenchError> {
        let port = self.bus(part)?.publisher::<T>().map_err(no_bus)?;
        Ok(Box::new(Sends(port)))
    }

    fn receives<T: Topic>(&self, part: Part) -> Result<Box<dyn Receiver>, BenchError> {
        let bus = self.bus(part)?;
        let port = bus.subscriber::<T>().map_err(no_bus)?;
        let lost = Cell::new(0);
        if self.acts {
            let waiter = bus.waiter(Policy::Block).map_err(no_bus)?;
            let port = RefCell::new(port);
            return Ok(Box::new(Acts { port, waiter, lost }));
        }
        let mut watcher = bus.watcher().map_err(no_bus)?;
        port.wakes(&mut watcher);
        let port = RefCell::new((port, watcher));
        Ok(Box::new(Watches { port, lost }))
    }
}

/// Calls a method for the topic of the setup's size and number of readers.
macro_rules! of_size {
    ($self:ident, $method:ident, $part:expr, $back:literal) => {
        match ($self.setup.words == SIZES[0], $self.setup.readers > 8) {
            (true, false) => $self.$method::<Words<{ SIZES[0] }, 8, $back>>($part),
            (true, true) => $self.$method::<Words<{ SIZES[0] }, 32, $back>>($part),
            (false, _) => $self.$method::<Words<{ SIZES[1] }, 8, $back>>($part),
        }
    };
}

impl Member for Ours {
    fn sender(&self, way: Way) -> Result<Box<dyn Sender>, BenchError> {
        match way {
            Way::There => of_size!(self, sends, NEAR, false),
            Way::Back => of_size!(self, sends, FAR, true),
        }
    }

    fn receiver(&self, way: Way) -> Result<Box<dyn Receiver>, BenchError> {
        match way {
            Way::There => of_size!(self, receives, FAR, false),
            Way::Back => of_size!(self, receives, NEAR, true),
        }
    }
}

struct Sends<T: Topic>(Publisher<T>);

impl<T: Topic> Sender for Sends<T> {
    fn send(&mut self, write: Write<'_>) -> Result<(), Fault> {
        let mut loan = self.0.loan_uninit().map_err(broken)?;
        write((&raw mut *loan).cast());
        loan.send().map_err(broken)
    }
}

struct Acts<T: Topic> {
    port: RefCell<Subscriber<T>>,
    waiter: Waiter,
    lost: Cell<u64>,
}

impl<T: Topic> Receiver for Acts<T> {
    fn run(&self, heard: Heard, is_over: &dyn Fn() -> bool) -> Result<(), Fault> {
        let mut port = self.port.borrow_mut();
        while !is_over() {
            self.waiter.wait(LOOK);
            if self.waiter.has::<T>() {
                drain(&mut port, &self.lost, heard)?;
            }
        }
        Ok(())
    }

    fn told(&self) -> Option<u64> {
        Some(self.lost.get())
    }
}

struct Watches<T: Topic> {
    port: RefCell<(Subscriber<T>, Watcher)>,
    lost: Cell<u64>,
}

impl<T: Topic> Receiver for Watches<T> {
    fn run(&self, heard: Heard, is_over: &dyn Fn() -> bool) -> Result<(), Fault> {
        let (port, watcher) = &mut *self.port.borrow_mut();
        while !is_over() {
            drain(port, &self.lost, heard)?;
            watcher.wait(LOOK);
        }
        Ok(())
    }

    fn told(&self) -> Option<u64> {
        Some(self.lost.get())
    }
}

fn drain<T: Topic>(port: &mut Subscriber<T>, lost: &Cell<u64>, heard: Heard) -> Result<(), Fault> {
    while let Some(sample) = port.receive().map_err(broken)? {
        lost.set(port.lost());
        heard.call(lager_sample::bytes_of(&*sample));
    }
    Ok(())
}
