//! Zenoh among the rivals: peers on a Unix socket, with a callback in Zenoh's receiving thread. Samples
//! are put as bytes, or, with `zenoh-shm`, loaned from shared memory of which the socket carries the
//! place.

use core::fmt::Display;
use std::time::Duration;

use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::sample::Sample;
use zenoh::shm::{
    BlockOn, GarbageCollect, PosixShmProviderBackend, ShmProvider, ShmProviderBuilder,
};
use zenoh::{Session, Wait};

use super::{Heard, Member, Receiver, Sender, Setup, Way, Write};
use crate::baseline::zenoh::config;
use crate::error::{BenchError, Fault, broken};

struct Zenoh {
    setup: Setup,
    shares: bool,
}

pub(super) fn join(setup: &Setup, shares: bool) -> Result<Box<dyn Member>, BenchError> {
    let setup = setup.clone();
    Ok(Box::new(Zenoh { setup, shares }))
}

impl Zenoh {
    /// The session of one way: its sender has the socket, and each receiver connects to it.
    fn open(&self, way: Way, sends: bool) -> Result<Session, BenchError> {
        let socket = self.setup.folder.join(way.name());
        let config = config(&socket, sends, self.shares)?;
        zenoh::open(config).wait().map_err(failed)
    }
}

impl Member for Zenoh {
    fn sender(&self, way: Way) -> Result<Box<dyn Sender>, BenchError> {
        let session = self.open(way, true)?;
        let port = session
            .declare_publisher(way.name())
            // Loses rather than waits, as all do, and batches nothing.
            .congestion_control(CongestionControl::Drop)
            .express(true)
            .wait()
            .map_err(failed)?;
        let bytes = 8 * self.setup.words;
        let memory = match self.shares {
            // Twice what the receivers' queues can hold, and room for the allocator's own.
            true => Some(
                ShmProviderBuilder::default_backend(2 * (self.setup.depth + 2) * bytes + (1 << 20))
                    .wait()
                    .map_err(failed)?,
            ),
            false => None,
        };
        Ok(Box::new(Sends {
            bytes,
            port,
            memory,
            _session: session,
        }))
    }

    fn receiver(&self, way: Way) -> Result<Box<dyn Receiver>, BenchError> {
        // Its sender in the other process makes the socket before, or soon.
        Ok(Box::new(Receives {
            session: self.open(way, false)?,
            way,
        }))
    }
}

struct Sends {
    port: Publisher<'static>,
    bytes: usize,
    memory: Option<ShmProvider<PosixShmProviderBackend>>,
    _session: Session,
}

impl Sender for Sends {
    fn send(&mut self, write: Write<'_>) -> Result<(), Fault> {
        let Some(memory) = &self.memory else {
            let mut bytes = vec![0; self.bytes];
            write(bytes.as_mut_ptr());
            return self.port.put(bytes).wait().map_err(broken);
        };
        let mut loan = memory
            .alloc(self.bytes)
            .with_policy::<BlockOn<GarbageCollect>>()
            .wait()
            .map_err(broken)?;
        write(loan.as_mut_ptr());
        self.port.put(loan).wait().map_err(broken)
    }
}

struct Receives {
    session: Session,
    way: Way,
}

impl Receiver for Receives {
    fn run(&self, heard: Heard, is_over: &dyn Fn() -> bool) -> Result<(), Fault> {
        let take = move |sample: Sample| heard.call(&sample.payload().to_bytes());
        let subscriber = self.session.declare_subscriber(self.way.name());
        let subscriber = subscriber.callback(take).wait().map_err(broken)?;
        while !is_over() {
            std::thread::sleep(Duration::from_millis(20));
        }
        subscriber.undeclare().wait().map_err(broken)
    }

    fn told(&self) -> Option<u64> {
        None
    }
}

fn failed(error: impl Display) -> BenchError {
    BenchError::Bus(format!("Zenoh: {error}"))
}
