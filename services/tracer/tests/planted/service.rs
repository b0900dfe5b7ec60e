//! The service that answers frames, in a process of its own, and its file whose pages can be evicted.
#![allow(unsafe_code, reason = "it maps a file, to fault on its pages")]

use std::fs::File;
use std::io::Write as _;
use std::path::PathBuf;

use lager_home::Clock;
use lager_rig::schedule::{RealTime, pin};
use lager_rig::{Parent, Process};
use rustix::fs::{Advice, fadvise};
use rustix::mm::{self, MapFlags, ProtFlags};

/// Pages that a frame of the plant touches, each far from the next.
pub(crate) const PAGES: usize = 64;
const APART: usize = 64 * 4096;

/// The service, from outside.
pub(crate) struct Service {
    process: Process,
    file: PathBuf,
}

impl Service {
    pub(crate) fn start(core: usize) -> Self {
        let name = format!("planted-{}", std::process::id());
        let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
        let mut made = File::create(&file).expect("a file");
        for page in 0..PAGES {
            made.write_all(&vec![page as u8; APART])
                .expect("space for a file");
        }
        made.sync_all().expect("a disk");
        let mut process = Process::start_in_test("service", "child").expect("a process");
        let () = process.ask(&(core, file.clone())).expect("it starts");
        Self { process, file }
    }

    pub(crate) fn pid(&self) -> u32 {
        self.process.pid()
    }

    /// Lets it answer a frame, and touch so many pages. When it had read the frame, and when it was
    /// done, in ns.
    pub(crate) fn frame(&mut self, pages: usize) -> [u64; 2] {
        self.process.ask(&Some(pages)).expect("an answer")
    }

    /// Removes its pages from memory.
    pub(crate) fn evict(&mut self) {
        let [_, _] = self
            .process
            .ask::<[u64; 2]>(&None::<usize>)
            .expect("an answer");
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.file);
    }
}

/// The service's process.
pub(crate) fn serve(parent: &mut Parent) {
    let (core, path): (usize, PathBuf) = parent.told().expect("its core and file");
    pin(core).expect("a core");
    let _urgent = RealTime::begin(40).expect("the right to real time");
    let file = File::open(path).expect("the file");
    let length = PAGES * APART;
    // SAFETY: a new mapping, which nothing else uses, of a file that stays as long as it is.
    let mapped = unsafe {
        let none = std::ptr::null_mut();
        mm::mmap(none, length, ProtFlags::READ, MapFlags::SHARED, &file, 0).expect("a mapping")
    };
    // SAFETY: the whole of that mapping; it is only read.
    unsafe { mm::madvise(mapped, length, mm::Advice::Random).expect("advice") };
    parent.say(&()).expect("a parent");
    loop {
        let told: Option<usize> = parent.told().expect("a frame");
        let read_ns = Clock::monotonic_ns();
        match told {
            None => {
                // SAFETY: the mapping's pages are those of the file, so none is lost.
                unsafe { mm::madvise(mapped, length, mm::Advice::LinuxDontNeed).expect("advice") };
                fadvise(&file, 0, None, Advice::DontNeed).expect("advice");
            }
            Some(pages) => {
                for page in 0..pages.min(PAGES) {
                    // SAFETY: within the mapping, which nobody writes.
                    let byte = unsafe { mapped.cast::<u8>().add(page * APART).read_volatile() };
                    assert_eq!(usize::from(byte), page, "the file's byte");
                }
            }
        }
        parent
            .say(&[read_ns, Clock::monotonic_ns()])
            .expect("a parent");
    }
}
