//! A cable between the bridge and a board: a thread that passes bytes between two ptys. A test can
//! cut its half towards the bridge, and can ask when the bridge last sent something.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use lager_home::Clock;
use lager_pty::Port;
use rustix::fs::{Mode, OFlags, open};

/// How often the thread looks for bytes: many times between two reports of a board.
const LOOK: Duration = Duration::from_micros(500);

/// The cable. Dropping it unplugs it.
#[derive(Debug)]
pub struct Cable {
    cut: Arc<AtomicBool>,
    unplugged: Arc<AtomicBool>,
    spoken_ns: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Cable {
    /// Plugs a cable into the board's port and makes the bridge's port at `bridge`.
    ///
    /// # Panics
    /// When the kernel refuses a port.
    #[must_use]
    pub fn plug(board: &Path, bridge: &Path) -> Self {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let board = open(board, flags, Mode::empty()).expect("the board's port");
        let mut port = Port::create(bridge).expect("a pty");
        let cut = Arc::new(AtomicBool::new(false));
        let unplugged = Arc::new(AtomicBool::new(false));
        let spoken_ns = Arc::new(AtomicU64::new(0));
        let (is_cut, is_unplugged) = (Arc::clone(&cut), Arc::clone(&unplugged));
        let spoken = Arc::clone(&spoken_ns);
        let thread = std::thread::spawn(move || {
            let mut commands = Vec::new();
            let mut reports = [0; 4096];
            while !is_unplugged.load(Ordering::Relaxed) {
                port.look();
                commands.clear();
                port.read(&mut commands);
                if !commands.is_empty() {
                    spoken.store(Clock::monotonic_ns(), Ordering::Relaxed);
                }
                let mut rest = &commands[..];
                while let Ok(count @ 1..) = rustix::io::write(&board, rest) {
                    rest = &rest[count..];
                }
                while let Ok(count @ 1..) = rustix::io::read(&board, &mut reports) {
                    if !is_cut.load(Ordering::Relaxed) {
                        port.write(&reports[..count]);
                    }
                }
                std::thread::sleep(LOOK);
            }
        });
        Self {
            cut,
            unplugged,
            spoken_ns,
            thread: Some(thread),
        }
    }

    /// When the bridge last sent something, in ns of `CLOCK_MONOTONIC`; 0 = not yet.
    #[must_use]
    pub fn spoken_ns(&self) -> u64 {
        self.spoken_ns.load(Ordering::Relaxed)
    }

    /// Cuts or mends the direction from the board to the bridge. The other direction always works.
    pub fn cut_reports(&self, cut: bool) {
        self.cut.store(cut, Ordering::Relaxed);
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        self.unplugged.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
