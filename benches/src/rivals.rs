//! What `benches/rivals` measures of the bus, bare iceoryx2 and Zenoh: the ends of a topic that other
//! middlewares have as files in C++. `benches/rivals/edge.rs` shows them to its harness, which plans,
//! times and counts. Nothing here reads a clock.

mod bare;
mod ours;
mod zenoh;

use core::ffi::c_void;
use std::path::PathBuf;

use crate::error::{BenchError, Fault};

/// The size of a small sample in words of 8 bytes, and that of a large one.
pub(crate) const SIZES: [usize; 2] = [8, 1 << 17];

/// What a process is told about the measurement.
#[derive(Clone, Debug)]
pub struct Setup {
    /// `actor`, `watcher`, `iceoryx2`, `zenoh` or `zenoh-shm`.
    pub kind: String,
    /// A folder that all processes of the measurement share.
    pub folder: PathBuf,
    /// The size of a sample in words of 8 bytes.
    pub words: usize,
    /// How many samples a receiver may fall behind.
    pub depth: usize,
    /// How many receivers there are.
    pub readers: usize,
}

/// Which of the two topics: from the sender to the receivers, or back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// To the receivers.
    There,
    /// Back from the receiver.
    Back,
}

impl Way {
    /// The name of its topic, for a middleware that gives none itself.
    const fn name(self) -> &'static str {
        match self {
            Self::There => "there",
            Self::Back => "back",
        }
    }
}

/// Writes all bytes of a sample into the place that it is given.
pub type Write<'a> = &'a mut dyn FnMut(*mut u8);

/// A process's membership. Its ends stay in the thread that makes them, except where the middleware
/// calls a receiver from a thread of its own.
pub trait Member {
    /// An end that publishes.
    ///
    /// # Errors
    /// The middleware gives none.
    fn sender(&self, way: Way) -> Result<Box<dyn Sender>, BenchError>;

    /// An end that receives.
    ///
    /// # Errors
    /// The middleware gives none.
    fn receiver(&self, way: Way) -> Result<Box<dyn Receiver>, BenchError>;
}

/// The end of a topic that publishes.
pub trait Sender {
    /// Publishes a sample that `write` writes in place.
    ///
    /// # Errors
    /// The middleware failed.
    fn send(&mut self, write: Write<'_>) -> Result<(), Fault>;
}

/// What is called with each sample's bytes, in whichever thread receives them.
#[derive(Clone, Copy, Debug)]
pub struct Heard {
    function: unsafe extern "C" fn(*mut c_void, *const u8, usize),
    context: *mut c_void,
}

// SAFETY: who makes one with `new` promises that any thread may call it.
#[allow(unsafe_code)]
unsafe impl Send for Heard {}
// SAFETY: as above.
#[allow(unsafe_code)]
unsafe impl Sync for Heard {}

impl Heard {
    /// Calls `function` with `context`, the bytes' place and their number.
    ///
    /// # Safety
    /// The function may be called with this context in any thread, by one at a time.
    #[allow(unsafe_code)]
    pub const unsafe fn new(
        function: unsafe extern "C" fn(*mut c_void, *const u8, usize),
        context: *mut c_void,
    ) -> Self {
        Self { function, context }
    }

    fn call(self, bytes: &[u8]) {
        // SAFETY: `new` was promised this.
        #[allow(unsafe_code)]
        unsafe {
            (self.function)(self.context, bytes.as_ptr(), bytes.len());
        }
    }
}

/// The end of a topic that receives.
pub trait Receiver {
    /// Calls `heard` for each sample until `is_over`, which it asks at least every 0.1 s. Afterwards
    /// nobody calls `heard`.
    ///
    /// # Errors
    /// The middleware failed.
    fn run(&self, heard: Heard, is_over: &dyn Fn() -> bool) -> Result<(), Fault>;

    /// How many samples it has said to be lost; `None` = it never tells.
    fn told(&self) -> Option<u64>;
}

/// Joins the middleware that `setup` names.
///
/// # Errors
/// There is no such middleware, or it does not let this process in.
pub fn join(setup: &Setup) -> Result<Box<dyn Member>, BenchError> {
    match setup.kind.as_str() {
        "actor" => ours::join(setup, true),
        "watcher" => ours::join(setup, false),
        "iceoryx2" => bare::join(setup),
        "zenoh" => zenoh::join(setup, false),
        "zenoh-shm" => zenoh::join(setup, true),
        other => Err(BenchError::Bus(format!("there is no rival {other}"))),
    }
}
