//! Bare iceoryx2 among the rivals: a topic with as many places as there are receivers, and an event that
//! wakes them.

use core::time::Duration;

use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;
use lager_ports::BusConfig;
use lager_sample::{Application, Qos};

use super::{Heard, Receiver, SIZES, Setup, Way, Write};
use crate::baseline::iceoryx::{Member, Sender};
use crate::error::{BenchError, Fault, broken};
use crate::sample::Block;

static RIVALS: Application = Application::new("rivals");

/// How long a receiver sleeps at most before it looks whether the measurement is over.
const LOOK: Duration = Duration::from_millis(50);

struct Bare {
    member: Member,
    setup: Setup,
}

pub(super) fn join(setup: &Setup) -> Result<Box<dyn super::Member>, BenchError> {
    let config = BusConfig {
        folder: Some(setup.folder.join("bus")),
        ..BusConfig::of(&RIVALS)
    };
    let limits = Qos {
        observers: setup.readers,
        slots: 0,
        ..Qos::stream(setup.depth)
    };
    Ok(Box::new(Bare {
        member: Member::join(&config, Some(limits))?,
        setup: setup.clone(),
    }))
}

impl Bare {
    fn sends<const WORDS: usize>(&self, way: Way) -> Result<Box<dyn super::Sender>, BenchError> {
        Ok(Box::new(Sends::<WORDS> {
            port: self.member.sender(way.name())?,
            bell: self.member.notifier(way.name(), self.setup.readers)?,
        }))
    }

    fn receives<const WORDS: usize>(&self, way: Way) -> Result<Box<dyn Receiver>, BenchError> {
        Ok(Box::new(Receives::<WORDS> {
            port: self.member.subscriber(way.name())?,
            bell: self.member.listener(way.name(), self.setup.readers)?,
        }))
    }
}

impl super::Member for Bare {
    fn sender(&self, way: Way) -> Result<Box<dyn super::Sender>, BenchError> {
        match self.setup.words == SIZES[0] {
            true => self.sends::<{ SIZES[0] }>(way),
            false => self.sends::<{ SIZES[1] }>(way),
        }
    }

    fn receiver(&self, way: Way) -> Result<Box<dyn Receiver>, BenchError> {
        match self.setup.words == SIZES[0] {
            true => self.receives::<{ SIZES[0] }>(way),
            false => self.receives::<{ SIZES[1] }>(way),
        }
    }
}

struct Sends<const WORDS: usize> {
    port: Sender<Block<WORDS>, ()>,
    bell: Notifier<ipc::Service>,
}

impl<const WORDS: usize> super::Sender for Sends<WORDS> {
    fn send(&mut self, write: Write<'_>) -> Result<(), Fault> {
        self.port
            .send_written(|place| write(place.as_mut_ptr().cast()))?;
        self.bell.notify().map_err(broken)?;
        Ok(())
    }
}

struct Receives<const WORDS: usize> {
    port: Subscriber<ipc::Service, Block<WORDS>, ()>,
    bell: Listener<ipc::Service>,
}

impl<const WORDS: usize> Receiver for Receives<WORDS> {
    fn run(&self, heard: Heard, is_over: &dyn Fn() -> bool) -> Result<(), Fault> {
        while !is_over() {
            match self.bell.timed_wait(|_| (), LOOK) {
                // A process that was frozen goes on.
                Ok(_) | Err(ListenerWaitError::InterruptSignal) => {}
                Err(error) => return Err(broken(error)),
            }
            while let Some(sample) = self.port.receive().map_err(broken)? {
                heard.call(lager_sample::bytes_of(sample.payload()));
            }
        }
        Ok(())
    }

    fn told(&self) -> Option<u64> {
        None
    }
}
