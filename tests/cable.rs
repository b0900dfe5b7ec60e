//! A cable between the bridge and a board: a thread that passes bytes on between two ptys. Its half
//! towards the bridge can be cut, both can be made noisy, and it knows when the bridge last said
//! something.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use lager_ports::Clock;
use lager_pty::Port;
use rustix::fs::{Mode, OFlags, open};

/// How often the thread looks for bytes: many times between two reports.
const LOOK: Duration = Duration::from_micros(500);

/// The cable; unplugged when it is dropped.
#[derive(Debug)]
pub struct Cable {
    cut: Arc<AtomicBool>,
    noisy: Arc<AtomicBool>,
    unplugged: Arc<AtomicBool>,
    spoken_ns: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Cable {
    /// Plugs a cable into the board's port and makes the bridge's port at `bridge`.
    ///
    /// # Panics
    /// When a port cannot be had.
    #[must_use]
    pub fn plug(board: &Path, bridge: &Path) -> Self {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let board = open(board, flags, Mode::empty()).expect("the board's port");
        let mut port = Port::create(bridge).expect("a pty");
        let cut = Arc::new(AtomicBool::new(false));
        let unplugged = Arc::new(AtomicBool::new(false));
        let noisy = Arc::new(AtomicBool::new(false));
        let spoken_ns = Arc::new(AtomicU64::new(0));
        let is_noisy = Arc::clone(&noisy);
        let (is_cut, is_unplugged) = (Arc::clone(&cut), Arc::clone(&unplugged));
        let spoken = Arc::clone(&spoken_ns);
        let thread = std::thread::spawn(move || {
            let mut commands = Vec::new();
            let mut reports = [0; 4096];
            let mut noise = Noise(0x2545_f491_4f6c_dd1d);
            while !is_unplugged.load(Ordering::Relaxed) {
                port.look();
                commands.clear();
                port.read(&mut commands);
                if !commands.is_empty() {
                    spoken.store(Clock::monotonic_ns(), Ordering::Relaxed);
                }
                if is_noisy.load(Ordering::Relaxed) {
                    noise.spoil(&mut commands);
                }
                let mut rest = &commands[..];
                while let Ok(count @ 1..) = rustix::io::write(&board, rest) {
                    rest = &rest[count..];
                }
                while let Ok(count @ 1..) = rustix::io::read(&board, &mut reports) {
                    if is_noisy.load(Ordering::Relaxed) {
                        noise.spoil(&mut reports[..count]);
                    }
                    if !is_cut.load(Ordering::Relaxed) {
                        port.write(&reports[..count]);
                    }
                }
                std::thread::sleep(LOOK);
            }
        });
        Self {
            cut,
            noisy,
            unplugged,
            spoken_ns,
            thread: Some(thread),
        }
    }

    /// When the bridge last said something, in ns of CLOCK_MONOTONIC; 0 before its first word.
    #[must_use]
    pub fn spoken_ns(&self) -> u64 {
        self.spoken_ns.load(Ordering::Relaxed)
    }

    /// Cuts what the board says, or mends it; what the bridge says gets through all the time.
    pub fn cut_reports(&self, cut: bool) {
        self.cut.store(cut, Ordering::Relaxed);
    }

    /// Spoils a byte in eight of what both ends say, or none.
    pub fn make_noise(&self, noise: bool) {
        self.noisy.store(noise, Ordering::Relaxed);
    }
}

/// A generator of random numbers (xorshift), the same in each run.
struct Noise(u64);

impl Noise {
    fn spoil(&mut self, bytes: &mut [u8]) {
        for byte in bytes {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            if self.0.is_multiple_of(8) {
                *byte ^= (self.0 >> 32) as u8 | 1;
            }
        }
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
